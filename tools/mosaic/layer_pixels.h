// The pixels of a layer: its files laid over one another, whichever of them were decoded first.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/mosaic/file_pixels.h"
#include "tools/mosaic/layer.h"
#include "tools/mosaic/sample_rectangle.h"

namespace scree {

/// Of two pixels the later one lies on top where its alpha is 128 or more, or more than the earlier one's.
bool lies_on_top(std::uint32_t later, std::uint32_t earlier);

/// Where pixels wait until they are read.
enum class PixelPlace { memory, disk };

class LayerPixels {
public:
    /// On disk: `temporary` is what the spool's name begins with; `room_bytes` as SpooledPixels has it. Errors:
    /// ErrorCode::io.
    static Result<std::unique_ptr<LayerPixels>> create(const Layer& layer, const std::vector<PlacedFile>& files,
                                                       PixelPlace place, const std::string& temporary,
                                                       std::int64_t& room_bytes);

    /// As FilePixels has them, in the layer's samples; what lies outside of it is no matter.
    void want(const SampleRectangle& window, std::int64_t until);
    void want_all(std::int64_t until);
    Result<void> fetch(OpenImages& images, const ReadProgress& progress);
    void release(std::int64_t j, const LastReading& last, OpenImages& images);
    std::int64_t temporary_bytes_taken() const { return spool_ ? spool_->bytes_taken() : 0; }
    /// The window in rows `pitch` pixels apart; 0 where no file is. True: every pixel has alpha 255.
    Result<bool> read(const SampleRectangle& window, std::uint32_t* out, std::int64_t pitch) const;

private:
    struct Member {
        std::unique_ptr<FilePixels> pixels;
        SampleRectangle place;
    };
    std::unique_ptr<TemporaryFile> spool_;
    std::vector<Member> members_;  ///< bottom to top
};

}  // namespace scree
