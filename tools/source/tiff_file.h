// An open TIFF handle whose messages go to itself instead of to standard error or to the handlers another library in
// the process has installed. Owned by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

struct tiff;

namespace scree {

class TiffFile {
public:
    /// mode as TIFFOpen's ("rm", "w", "w8"). GeoTIFF tags are known. valid() is false when the file cannot be opened;
    /// messages() then says why.
    TiffFile(const std::string& path, const char* mode);
    ~TiffFile();
    TiffFile(const TiffFile&) = delete;
    TiffFile& operator=(const TiffFile&) = delete;

    bool valid() const { return handle_ != nullptr; }
    tiff* get() const { return handle_; }
    /// The first complaint of libtiff since opening or clearing, empty when there was none.
    const std::string& messages() const { return *messages_; }
    void clear_messages() { messages_->clear(); }
    /// Writes what is pending and closes; false when that failed.
    bool flush_and_close();

private:
    std::unique_ptr<std::string> messages_;
    tiff* handle_ = nullptr;
};

/// Text of a tag of GDAL's (42112, 42113), empty where there is none.
std::string text_tag(tiff* file, std::uint32_t tag);

/// True when the first bytes of the file are those of a classic or big TIFF.
bool begins_as_tiff(std::string_view start);
bool looks_like_tiff(const std::string& path);

}  // namespace scree
