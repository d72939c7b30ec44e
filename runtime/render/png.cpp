#include "runtime/render/png.h"

#include <fmt/format.h>
#include <png.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace scree {
namespace {

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};

png_image described(int width_px, int height_px) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(width_px);
    image.height = static_cast<png_uint_32>(height_px);
    image.format = PNG_FORMAT_RGB;
    return image;
}

Result<void> write_whole(const std::filesystem::path& path, int width_px, int height_px,
                         std::span<const std::uint8_t> rgb) {
    std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "wb"));
    if (!file) return Error{ErrorCode::io, std::strerror(errno)};
    png_image image = described(width_px, height_px);
    if (png_image_write_to_stdio(&image, file.get(), 0, rgb.data(), 3 * width_px, nullptr) == 0)
        return Error{ErrorCode::io, image.message};
    if (std::fflush(file.get()) != 0 || fsync(fileno(file.get())) != 0 || std::fclose(file.release()) != 0)
        return Error{ErrorCode::io, std::strerror(errno)};
    return {};
}

}  // namespace

Result<std::vector<std::uint8_t>> encode_png(int width_px, int height_px, std::span<const std::uint8_t> rgb) {
    assert(width_px >= 1 && height_px >= 1);
    assert(rgb.size() == 3 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
    png_image image = described(width_px, height_px);
    png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::vector<std::uint8_t> file(bytes);
    if (png_image_write_to_memory(&image, file.data(), &bytes, 0, rgb.data(), 3 * width_px, nullptr) == 0)
        return Error{ErrorCode::io, image.message};
    file.resize(bytes);
    return file;
}

Result<void> write_png(const std::filesystem::path& path, int width_px, int height_px,
                       std::span<const std::uint8_t> rgb) {
    assert(width_px >= 1 && height_px >= 1);
    assert(rgb.size() == 3 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
    std::filesystem::path partial = path;
    partial += fmt::format(".{}.partial", getpid());
    Result<void> written = write_whole(partial, width_px, height_px, rgb);
    std::error_code moved;
    if (written) std::filesystem::rename(partial, path, moved);
    if (moved) written = Error{ErrorCode::io, moved.message()};
    if (written) return {};
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    return Error{ErrorCode::io, fmt::format("cannot write {}: {}", path.string(), written.error().message)};
}

}  // namespace scree
