#include <limits>
#include <mutex>
#include <optional>
#include <utility>

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
        if (read && !input_->has_error()) return {};
        const std::string reason = input_->geterror();
        return Error{ErrorCode::input, reason.empty() ? "no reason given" : reason};
    }

private:
    std::unique_ptr<OIIO::ImageInput> input_;
    OIIO::ImageSpec spec_;
    OIIO::TypeDesc format_;
    DecodedLayout layout_;
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

void load_openimageio() {
    configure_openimageio();
    (void)OIIO::ImageInput::create("tiff");  // makes the list of readers
}

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
