#include "tools/source/tiff_file.h"

#include <array>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <mutex>

#include <tiffio.h>

#include <geotiff/xtiffio.h>

namespace scree {
namespace {

int keep_message(TIFF*, void* user_data, const char*, const char* format, va_list arguments) {
    auto* kept = static_cast<std::string*>(user_data);
    if (kept->empty()) {
        std::array<char, 512> text{};
        std::vsnprintf(text.data(), text.size(), format, arguments);
        *kept = text.data();
    }
    return 1;  // handled: the process-wide handler is not asked
}

int drop_message(TIFF*, void*, const char*, const char*, va_list) { return 1; }

}  // namespace

TiffFile::TiffFile(const std::string& path, const char* mode) : messages_(std::make_unique<std::string>()) {
    // libgeotiff's tags are added to a process-wide chain; doing so twice at once would be a race.
    static std::once_flag once;
    std::call_once(once, [] { XTIFFInitialize(); });
    TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
    if (options == nullptr) return;
    TIFFOpenOptionsSetErrorHandlerExtR(options, keep_message, messages_.get());
    TIFFOpenOptionsSetWarningHandlerExtR(options, drop_message, nullptr);
    handle_ = TIFFOpenExt(path.c_str(), mode, options);
    TIFFOpenOptionsFree(options);
}

TiffFile::~TiffFile() {
    if (handle_ != nullptr) TIFFClose(handle_);
}

bool TiffFile::flush_and_close() {
    if (handle_ == nullptr) return false;
    const bool flushed = TIFFFlush(handle_) == 1;
    TIFFClose(handle_);
    handle_ = nullptr;
    return flushed && messages_->empty();
}

std::string text_tag(TIFF* file, std::uint32_t tag) {
    const TIFFField* field = TIFFFindField(file, tag, TIFF_ASCII);
    const char* text = nullptr;
    if (field == nullptr) return {};
    if (TIFFFieldPassCount(field) == 0)
        return TIFFGetField(file, tag, &text) == 1 && text != nullptr ? text : std::string();
    std::uint32_t count = 0;
    return TIFFGetField(file, tag, &count, &text) == 1 && text != nullptr ? std::string(text, count) : std::string();
}

bool begins_as_tiff(std::string_view start) {
    using namespace std::string_view_literals;
    return start.starts_with("II*\0"sv) || start.starts_with("MM\0*"sv) || start.starts_with("II+\0"sv) ||
           start.starts_with("MM\0+"sv);
}

bool looks_like_tiff(const std::string& path) {
    std::array<char, 4> magic{};
    std::ifstream file(path, std::ios::binary);
    return file.read(magic.data(), magic.size()) && begins_as_tiff({magic.data(), magic.size()});
}

}  // namespace scree
