#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include "tools/source/pixel_decoder.h"

namespace scree {
namespace {

constexpr int kMaxSide = 1 << 30;

Error unusable(const std::string& path, const std::string& what) {
    return {ErrorCode::input, fmt::format("{}: {}", path, what)};
}

std::optional<SampleType> sample_type_of(OIIO::TypeDesc type) {
    switch (type.basetype) {
        case OIIO::TypeDesc::UINT8:
            return SampleType::u8;
        case OIIO::TypeDesc::INT8:
            return SampleType::i8;
        case OIIO::TypeDesc::UINT16:
            return SampleType::u16;
        case OIIO::TypeDesc::INT16:
            return SampleType::i16;
        case OIIO::TypeDesc::UINT32:
            return SampleType::u32;
        case OIIO::TypeDesc::INT32:
            return SampleType::i32;
        case OIIO::TypeDesc::UINT64:
            return SampleType::u64;
        case OIIO::TypeDesc::INT64:
            return SampleType::i64;
        case OIIO::TypeDesc::HALF:
            return SampleType::f16;
        case OIIO::TypeDesc::FLOAT:
            return SampleType::f32;
        case OIIO::TypeDesc::DOUBLE:
            return SampleType::f64;
        default:
            return std::nullopt;
    }
}

// A grey pixel of value 0x0102.
constexpr unsigned char kInterlacedPng[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00, 0x00,
    0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x10, 0x00, 0x00, 0x00, 0x01, 0x1d, 0xe9, 0x77, 0x80, 0x00, 0x00, 0x00,
    0x0e, 0x49, 0x44, 0x41, 0x54, 0x78, 0x01, 0x01, 0x03, 0x00, 0xfc, 0xff, 0x00, 0x01, 0x02, 0x00, 0x07, 0x00,
    0x04, 0x6c, 0xf8, 0x39, 0x68, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

// OpenImageIO 2.4 leaves the samples of interlaced 16-bit PNGs in the file's byte order. Asked of the library itself,
// so that one which does not is not corrected.
bool interlaced_png_is_swapped() {
    static const bool swapped = [] {
        OIIO::Filesystem::IOMemReader memory(kInterlacedPng, sizeof kInterlacedPng);
        const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create("png");
        OIIO::ImageSpec spec;
        std::uint16_t sample = 0;
        return input && input->set_ioproxy(&memory) && input->open("probe.png", spec) &&
               input->read_image(0, 0, 0, 1, OIIO::TypeDesc::UINT16, &sample) && sample == 0x0201;
    }();
    return swapped;
}

class OpenImageIoDecoder final : public PixelDecoder {
public:
    explicit OpenImageIoDecoder(std::unique_ptr<OIIO::ImageInput> input)
        : input_(std::move(input)), spec_(input_->spec()) {}

    Result<void> check(const std::string& path, const ImageHeader& header) {
        const std::optional<SampleType> type = sample_type_of(spec_.format);
        if (!type)
            return unusable(path,
                            fmt::format("its samples are of type {}, which cannot be read", spec_.format.c_str()));
        if (spec_.deep) return unusable(path, "its pixels are deep (many samples each); only flat images are read");
        if (spec_.depth > 1)
            return unusable(path, fmt::format("it is a volume of {} slices; only flat images are read", spec_.depth));
        if (spec_.width <= 0 || spec_.height <= 0 || spec_.width > kMaxSide || spec_.height > kMaxSide)
            return unusable(
                path, fmt::format("its header says {} x {} samples, which cannot be read", spec_.width, spec_.height));
        if (header.width != 0 && (header.width != spec_.width || header.height != spec_.height))
            return unusable(
                path,
                fmt::format("its header says {} x {} samples but its decoder {} x {}; the file is not what it seems",
                            header.width, header.height, spec_.width, spec_.height));
        layout_ = {spec_.width,         spec_.height, spec_.nchannels,
                   spec_.alpha_channel, *type,        spec_.tile_width > 0 ? spec_.tile_height : 0};
        // Half to float is the one conversion that OpenImageIO does without rescaling; integers are taken as they are.
        format_ = *type == SampleType::f16 ? OIIO::TypeDesc(OIIO::TypeDesc::FLOAT) : spec_.format;
        swapped_ = header.kind == ImageKind::png && header.interlaced && *type == SampleType::u16 &&
                   interlaced_png_is_swapped();
        return {};
    }

    const DecodedLayout& layout() const override { return layout_; }

    Result<void> decode(std::int64_t begin, std::int64_t end, std::byte* out) override {
        const int y_begin = spec_.y + static_cast<int>(begin);
        const int y_end = spec_.y + static_cast<int>(end);
        const bool read = layout_.tile_rows > 0
                              ? input_->read_tiles(0, 0, spec_.x, spec_.x + spec_.width, y_begin, y_end, 0, 1, 0,
                                                   spec_.nchannels, format_, out)
                              : input_->read_scanlines(0, 0, y_begin, y_end, 0, 0, spec_.nchannels, format_, out);
        // Some readers report a damaged strip but claim success.
        if (read && !input_->has_error()) {
            if (swapped_) swap_bytes(end - begin, out);
            return {};
        }
        const std::string reason = input_->geterror();
        return Error{ErrorCode::input, reason.empty() ? "no reason given" : reason};
    }

private:
    void swap_bytes(std::int64_t rows, std::byte* out) const {
        const std::byte* end = out + rows * layout_.width * layout_.channels * 2;
        for (; out != end; out += 2) std::swap(out[0], out[1]);
    }

    std::unique_ptr<OIIO::ImageInput> input_;
    OIIO::ImageSpec spec_;
    OIIO::TypeDesc format_;
    DecodedLayout layout_;
    bool swapped_ = false;
};

void configure_openimageio() {
    static std::once_flag once;
    std::call_once(once, [] {
        // The pipeline above decides on threads; sides and units are checked here, so large files are no suspects.
        OIIO::attribute("threads", 1);
        OIIO::attribute("exr_threads", 1);
        OIIO::attribute("limits:imagesize_MB", std::numeric_limits<int>::max());
    });
}

}  // namespace

Result<std::unique_ptr<PixelDecoder>> make_openimageio_decoder(const std::string& path, const ImageHeader& header) {
    configure_openimageio();
    std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(reader_name(header.kind));
    if (!input)
        return unusable(path, fmt::format("no decoder for {} here ({})", reader_name(header.kind), OIIO::geterror()));
    OIIO::ImageSpec hints;
    hints.attribute("oiio:UnassociatedAlpha", 1);
    OIIO::ImageSpec spec;
    if (!input->open(path, spec, hints))
        return unusable(path, fmt::format("cannot be decoded ({})", input->geterror()));
    auto decoder = std::make_unique<OpenImageIoDecoder>(std::move(input));
    if (Result<void> checked = decoder->check(path, header); !checked) return checked.error();
    return std::unique_ptr<PixelDecoder>(std::move(decoder));
}

}  // namespace scree
