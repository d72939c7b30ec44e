#include "tools/mosaic/open_images.h"

#include <algorithm>
#include <utility>

namespace scree {

Result<ImageSource*> OpenImages::open(std::size_t file) {
    const auto found = std::find_if(open_.begin(), open_.end(), [&](const Open& o) { return o.file == file; });
    if (found != open_.end()) {
        open_.splice(open_.begin(), open_, found);
        return open_.front().source.get();
    }
    while (open_.size() >= kMost) open_.pop_back();
    auto source = ImageSource::open(files_[file].path, options_);
    if (!source) return source.error();
    if (auto same = check_unchanged(files_[file], (*source)->info()); !same) return same.error();
    open_.push_front({file, std::move(*source)});
    return open_.front().source.get();
}

bool OpenImages::is_open(std::size_t file) const {
    return std::any_of(open_.begin(), open_.end(), [&](const Open& o) { return o.file == file; });
}

void OpenImages::close(std::size_t file) {
    open_.remove_if([&](const Open& o) { return o.file == file; });
}

}  // namespace scree
