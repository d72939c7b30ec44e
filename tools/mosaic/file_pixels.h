// The pixels of one image of a layer, decoded by bands of rows when they are wanted and kept until they are released:
// as whole rows in memory (RowPixels), or in a temporary file, with what is wanted now in memory too (SpooledPixels).
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/result.h"
#include "tools/mosaic/open_images.h"
#include "tools/mosaic/sample_rectangle.h"
#include "tools/mosaic/stack.h"
#include "tools/mosaic/temporary_file.h"

namespace scree {

/// The last grid row with points that read a part, as far as that is known; the greatest number where it is not.
using LastReading = std::function<std::int64_t(const SampleRectangle& part)>;

/// want() and fetch() make pixels ready, read() hands them out. read(): any thread, but not beside the others.
class FilePixels {
public:
    virtual ~FilePixels() = default;
    FilePixels(const FilePixels&) = delete;
    FilePixels& operator=(const FilePixels&) = delete;

    /// The rectangle, within the file, will be read for points north of grid row `until`.
    virtual void want(const SampleRectangle& part, std::int64_t until) = 0;
    bool wants_decoding() const { return wanted_begin_ < wanted_end_; }
    /// Decodes what is wanted and not there, from north to south. Errors: the file's, ErrorCode::io,
    /// ErrorCode::interrupted.
    Result<void> fetch(OpenImages& images, const ReadProgress& progress);
    /// Lets go of the outermost bands that were not wanted for points from grid row j on, nor by `last`, of a part of
    /// the file, will be. What is wanted after all is decoded again.
    void release(std::int64_t j, const LastReading& last, OpenImages& images);
    /// The rectangle, within the file and fetched, into rows `pitch` pixels apart.
    virtual Result<void> read(const SampleRectangle& part, std::uint32_t* out, std::int64_t pitch) const = 0;

    /// Every pixel has alpha 255. Known once something was fetched.
    bool opaque() const { return opaque_; }
    std::int64_t width() const { return width_; }
    std::int64_t height() const { return height_; }
    std::size_t file() const { return file_; }

protected:
    FilePixels(const PlacedFile& file, std::size_t index, std::int64_t band_rows);

    /// Room for the band's rows; good until keep().
    virtual std::uint32_t* room_for(std::int64_t band) = 0;
    /// The rows are in the room.
    virtual Result<void> keep(std::int64_t band) = 0;
    virtual void drop(std::int64_t band) = 0;
    /// Nothing is wanted for points north of grid row j any more.
    virtual void forget_north_of(std::int64_t) {}
    /// Nothing is held any more.
    virtual void finish() {}
    /// Before decoding.
    virtual Result<void> make_room() { return {}; }
    /// After decoding.
    virtual Result<void> load_wanted() { return {}; }

    /// True where some of the bands are to be decoded. `again`: those that were released, too.
    bool want_rows(std::int64_t row_begin, std::int64_t row_end, std::int64_t until, bool again);
    std::int64_t rows_of(std::int64_t band) const;
    std::int64_t band_count() const { return static_cast<std::int64_t>(bands_.size()); }
    bool holds(std::int64_t band) const { return bands_[static_cast<std::size_t>(band)].state == State::held; }

private:
    enum class State : std::uint8_t { absent, held, released };
    struct Band {
        State state = State::absent;
        bool wanted = false;
        std::int64_t until = std::numeric_limits<std::int64_t>::min();
        std::optional<std::int64_t> last;  ///< grid row, when it was asked for
    };
    Result<void> decode(std::int64_t band, ImageSource& source);
    void leave(Band& band, State state);
    bool try_release(std::int64_t band, std::int64_t j, const LastReading& last);

    std::int64_t width_, height_, band_rows_;
    std::size_t file_;
    bool opaque_ = false;
    std::vector<Band> bands_;
    std::int64_t wanted_begin_ = 0, wanted_end_ = 0;  ///< all wanted bands are among these
    std::int64_t live_begin_ = 0, live_end_;          ///< all others are released
    std::int64_t absent_;
};

/// Bands of 8 rows in memory.
class RowPixels final : public FilePixels {
public:
    static constexpr std::int64_t kBandRows = 8;

    RowPixels(const PlacedFile& file, std::size_t index);
    void want(const SampleRectangle& part, std::int64_t until) override;
    Result<void> read(const SampleRectangle& part, std::uint32_t* out, std::int64_t pitch) const override;

private:
    using Rows = std::unique_ptr<std::uint32_t[]>;
    std::uint32_t* room_for(std::int64_t band) override;
    Result<void> keep(std::int64_t) override { return {}; }
    void drop(std::int64_t band) override;
    void finish() override { spare_.clear(); }

    std::vector<Rows> rows_;   ///< of each band; null: not held
    std::vector<Rows> spare_;  ///< fresh memory costs more than what is written into it
};

/// Memory that all spooled files of a stack share.
struct SpoolMemory {
    std::int64_t bytes = 0;  ///< that blocks may take
    std::int64_t taken = 0;
    std::vector<std::unique_ptr<std::uint32_t[]>> spare;  ///< blocks
    std::vector<std::uint32_t> decoded, arranged;         ///< a band, by rows and by blocks
};

/// Blocks of 64 x 64 pixels, in memory as long as that has room and else in a temporary file, a band of 64 rows after
/// the other; each has its place there, and those that hold nothing are not written. Those that are wanted are in
/// memory before others are.
class SpooledPixels final : public FilePixels {
public:
    static constexpr std::int64_t kBlock = 64;
    static constexpr std::int64_t kBlockBytes = kBlock * kBlock * 4;

    /// `at`: where its part of the spool begins.
    SpooledPixels(const PlacedFile& file, std::size_t index, const TemporaryFile& spool, std::int64_t at,
                  SpoolMemory& memory);
    /// Of the spool at most.
    static std::int64_t file_bytes(const ImageInfo& info);

    void want(const SampleRectangle& part, std::int64_t until) override;
    Result<void> read(const SampleRectangle& part, std::uint32_t* out, std::int64_t pitch) const override;

private:
    using Pixels = std::unique_ptr<std::uint32_t[]>;
    struct Block {
        std::int64_t until = std::numeric_limits<std::int64_t>::min();  ///< wanted for points north of this grid row
        Pixels pixels;                                                  ///< null: to be loaded
        bool spooled = false;                                           ///< it stands in the spool, too
    };
    std::uint32_t* room_for(std::int64_t band) override;
    Result<void> keep(std::int64_t band) override;
    void drop(std::int64_t band) override;
    void forget_north_of(std::int64_t j) override;
    Result<void> make_room() override;
    Result<void> load_wanted() override;
    void arrange(std::int64_t band);
    bool keep_in_memory(std::int64_t block, const std::uint32_t* pixels);
    Result<void> load(std::int64_t block, std::uint32_t* pixels) const;
    Result<void> spool(std::int64_t first_block, std::int64_t count, const std::uint32_t* pixels);
    bool has_memory() const;
    Pixels take_memory();
    void give_back(Block& block);
    std::int64_t place_of(std::int64_t block) const;

    const TemporaryFile& spool_;
    std::int64_t at_, blocks_across_, unit_rows_;
    SpoolMemory& memory_;
    std::unordered_map<std::int64_t, Block> blocks_;  ///< in memory, or about to be
    std::vector<std::int64_t> to_load_;
    std::vector<bool> spooled_;  ///< bands of which something was
    std::int64_t unwanted_north_of_ = std::numeric_limits<std::int64_t>::min();
};

}  // namespace scree
