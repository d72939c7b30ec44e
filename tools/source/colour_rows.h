// Rows of decoded samples as 8-bit RGBA: what ColourReading, the file's colour model, mask and nodata make of them.
// One thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/source/image_header.h"
#include "tools/source/image_source.h"

namespace scree {

/// A row of a mask, `channels` samples a pixel: one for all channels of the image or one for each. Sample 0: nothing.
struct MaskRow {
    const std::uint8_t* samples = nullptr;  ///< null: no mask
    int channels = 1;
    bool hides(std::int64_t column, int channel) const {
        return samples[column * channels + (channels == 1 ? 0 : channel)] == 0;
    }
};

class ColourRows {
public:
    /// Uses width, channels, alpha, type and nodata of info. Errors (ErrorCode::usage): bands that the file does not
    /// have, a stretch that is none.
    static Result<ColourRows> make(const std::string& path, const ImageInfo& info, const ImageHeader& header,
                                   const ColourReading& reading);

    int shown_bands() const { return grey_ ? 1 : 3; }
    /// The shown samples have at most 8 bits as they are stored.
    bool eight_bit() const { return eight_bit_; }
    /// Without a mask every pixel comes out with alpha 255.
    bool opaque() const;

    /// `samples`: a row, all channels, as decoded. `out`: 4 bytes a pixel.
    void to_rgba8(const std::byte* samples, const MaskRow& mask, std::uint8_t* out) const;
    /// Shown bands as they are, unassociated, before any stretch; NaN in all of a transparent pixel. shown_bands() a
    /// pixel.
    void to_values(const std::byte* samples, const MaskRow& mask, float* out) const;

private:
    template <bool kGrey, class T>
    void convert_colours(const T* from, std::uint8_t* out) const;
    template <class T>
    void convert_associated(const T* from, std::uint8_t* out) const;
    template <class T>
    void convert(const T* from, const MaskRow& mask, std::uint8_t* out) const;
    template <class T>
    void convert_indexed(const T* from, const MaskRow& mask, std::uint8_t* out) const;
    template <class T>
    void convert_cmyk(const T* from, const MaskRow& mask, std::uint8_t* out) const;
    template <class T>
    bool hidden(const T* pixel) const;
    template <class T>
    std::uint8_t alpha_of(const T* pixel) const;
    bool masked(const MaskRow& mask, std::int64_t column) const;
    void finish_colour(std::array<std::uint8_t, 3> rgb, bool hidden, std::uint8_t* pixel) const;
    void fill_tables();

    std::int64_t width_ = 0;
    int channels_ = 1;
    int alpha_channel_ = -1;
    SampleType type_ = SampleType::u8;
    ColourModel model_ = ColourModel::grey_or_rgb;
    std::vector<std::array<std::uint8_t, 4>> palette_;
    bool associated_ = false;
    bool grey_ = true;
    bool eight_bit_ = true;
    bool identity_ = true;                ///< bytes are shown as they are
    std::array<int, 3> shown_{};          ///< 0-based; of a palette or CMYK: 0 red, 1 green, 2 blue
    double low_ = 0, high_ = 255;         ///< shown black and white
    double alpha_max_ = 255;              ///< opaque
    std::vector<double> nodata_;          ///< of shown samples, as the type holds it
    std::optional<double> index_nodata_;  ///< the tag of a palette image, or of all four inks
    std::vector<std::uint8_t> levels_;    ///< level of every value of an 8 or 16-bit type, by its bits; else empty
};

}  // namespace scree
