// The first look at an image file, before any decoder sees it.
#include <filesystem>

#include "tests/fuzz/file_input.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/tools/source/test_tiff.h"
#include "tools/source/image_header.h"

namespace scree::fuzz {
namespace {

// A literal that holds zeros.
template <std::size_t N>
std::string bytes(const char (&text)[N]) {
    return std::string(text, N - 1);
}

std::string tiff_bytes(std::uint32_t tile, const char* mode) {
    test::TestTiff tiff;
    tiff.tile = tile;
    tiff.mode = mode;
    tiff.nodata = "-9999";
    tiff.extra_sample = EXTRASAMPLE_ASSOCALPHA;
    tiff.channels = 4;
    const std::vector<std::uint8_t> pixels(4 * 12, 7);
    const std::string path = folder().path("seed.tif");
    require(test::write_tiff(path, tiff, pixels.data()), "a seed can be written");
    return test::read_bytes(path);
}

}  // namespace

std::vector<std::string> seeds() {
    return {
        tiff_bytes(0, "w"),
        tiff_bytes(16, "wb"),
        tiff_bytes(0, "w8"),
        bytes("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x04\0\0\0\x03\x08\x02\0\0\0????"),
        bytes("\xFF\xD8\xFF\xE0\0\x10JFIF\0\1\1\0\0\1\0\1\0\0\xFF\xC0\0\x0B\x08\0\3\0\4\1\1\x11\0\xFF\xDA\0\x08\1\1\0\0"
              "\x3F\0\x12\x34\xFF\xD9"),
        bytes("\0\0\0\x0CjP  \r\n\x87\n\xFF\x4F\xFF\x51\0\x29\0\0\0\0\0\x04\0\0\0\x03\0\0\0\0\0\0\0\0\0\0\0\x04"),
        "BM" + std::string(60, '\1'),
        "RIFF\1\0\0\0WEBPVP8 ",
        "P5\n4 3\n255\nabcdefghijkl",
        "#?RADIANCE\n\n-Y 3 +X 4\n"};
}

}  // namespace scree::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace scree;
    using namespace scree::fuzz;
    const auto header = read_image_header(folder().write("image", text_of(data, size)));
    if (!header) {
        require(header.error().code == ErrorCode::input, "what cannot be read is an input error");
        return 0;
    }
    require(header->width >= 0 && header->height >= 0 && header->rows_per_strip > 0, "sides are counts");
    if (header->nodata) {
        for (const SampleType type :
             {SampleType::u8, SampleType::i16, SampleType::u64, SampleType::f16, SampleType::f32})
            static_cast<void>(nodata_as(type, *header->nodata));
    }
    return 0;
}
