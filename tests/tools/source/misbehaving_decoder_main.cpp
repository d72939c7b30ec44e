// A decoder program whose decoders do what the names of their files say: on opening for "open-...", at row 8 otherwise.
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include "tools/source/decoder_server.h"

namespace scree {
namespace {

// Not a tail call, and nothing that a compiler may know to be endless.
int recurse(volatile int* depth) {
    volatile char frame[4096] = {};
    if (*depth < 0) return 0;
    *depth = *depth + 1;
    return recurse(depth) + frame[*depth % 4096];
}

Result<void> misbehave(const std::string& name) {
    if (name.ends_with("abort.tif")) std::abort();
    if (name.ends_with("leave.tif")) ::_exit(0);
    if (name.ends_with("overflow.tif")) {
        volatile int depth = 0;
        ::_exit(recurse(&depth));
    }
    if (name.ends_with("spin.tif")) {
        volatile bool going = true;
        while (going) {
        }
    }
    if (name.ends_with("sleep.tif")) ::pause();
    if (name.ends_with("grow.tif"))
        for (std::vector<std::vector<char>> all;;) all.emplace_back(std::size_t{1} << 20, 'x');
    if (name.ends_with("refuse.tif")) return Error{ErrorCode::input, "strip 8 is\nodd \x1b[31m"};
    return {};
}

class MisbehavingDecoder final : public PixelDecoder {
public:
    MisbehavingDecoder(std::string name, const ImageHeader& header) : name_(std::move(name)) {
        layout_.width = header.width;
        layout_.height = header.height;
        layout_.channels = 1;
    }
    const DecodedLayout& layout() const override { return layout_; }
    Result<void> decode(std::int64_t begin, std::int64_t end, std::byte* out) override {
        if (begin >= 8)
            if (Result<void> done = misbehave(name_); !done) return done;
        for (std::int64_t row = begin; row < end; ++row)
            std::memset(out + (row - begin) * layout_.width, static_cast<int>(row + 1),
                        static_cast<std::size_t>(layout_.width));
        return {};
    }

private:
    std::string name_;
    DecodedLayout layout_;
};

Result<std::unique_ptr<PixelDecoder>> open(const std::string& path, const ImageHeader& header) {
    const std::string name = std::filesystem::path(path).filename();
    if (name.starts_with("open-"))
        if (Result<void> done = misbehave(name); !done) return done.error();
    return std::unique_ptr<PixelDecoder>(std::make_unique<MisbehavingDecoder>(name, header));
}

}  // namespace
}  // namespace scree

int main() {
    return scree::serve_decoders({[] {}, scree::open});
}
