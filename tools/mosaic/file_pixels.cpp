#include "tools/mosaic/file_pixels.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <span>
#include <utility>

namespace scree {
namespace {

constexpr std::size_t kBlockPixels = SpooledPixels::kBlock * SpooledPixels::kBlock;
constexpr std::int64_t kBlockBytes = static_cast<std::int64_t>(kBlockPixels) * 4;
constexpr std::size_t kMostSpare = 8;

std::int64_t parts(std::int64_t whole, std::int64_t part) { return (whole + part - 1) / part; }

void copy_pixels(const std::uint32_t* from, std::int64_t count, std::uint32_t* to) {
    std::memcpy(to, from, static_cast<std::size_t>(count) * 4);
}

Error not_prepared() { return {ErrorCode::io, "pixels were asked for that were not prepared, or are released"}; }

}  // namespace

FilePixels::FilePixels(const PlacedFile& file, std::size_t index, std::int64_t band_rows)
    : width_(file.info.width),
      height_(file.info.height),
      band_rows_(band_rows),
      file_(index),
      bands_(static_cast<std::size_t>(parts(file.info.height, band_rows))),
      live_end_(band_count()),
      absent_(band_count()) {}

std::int64_t FilePixels::rows_of(std::int64_t band) const { return std::min(band_rows_, height_ - band * band_rows_); }

bool FilePixels::want_rows(std::int64_t row_begin, std::int64_t row_end, std::int64_t until, bool again) {
    assert(0 <= row_begin && row_begin < row_end && row_end <= height_);
    bool any = false;
    for (std::int64_t b = row_begin / band_rows_; b * band_rows_ < row_end; ++b) {
        Band& band = bands_[static_cast<std::size_t>(b)];
        if (band.state == State::released && !again) continue;
        band.until = std::max(band.until, until);
        if (band.state == State::held) continue;
        any = true;
        if (band.wanted) continue;
        band.wanted = true;
        wanted_begin_ = wants_decoding() ? std::min(wanted_begin_, b) : b;
        wanted_end_ = std::max(wanted_end_, b + 1);
    }
    return any;
}

Result<void> FilePixels::fetch(OpenImages& images, const ReadProgress& progress) {
    for (; wanted_begin_ < wanted_end_; ++wanted_begin_) {
        Band& band = bands_[static_cast<std::size_t>(wanted_begin_)];
        if (!band.wanted) continue;
        auto source = images.open(file_);
        if (!source) return source.error();
        opaque_ = (*source)->info().opaque;
        if (auto ok = decode(wanted_begin_, **source); !ok) return ok;
        band.wanted = false;
        leave(band, State::held);
        live_begin_ = std::min(live_begin_, wanted_begin_);
        live_end_ = std::max(live_end_, wanted_begin_ + 1);
        if (progress && !progress(rows_of(wanted_begin_) * width_))
            return Error{ErrorCode::interrupted, "stopped; nothing was written"};
    }
    wanted_begin_ = wanted_end_ = 0;
    if (absent_ == 0) images.close(file_);
    return load_wanted();
}

Result<void> FilePixels::decode(std::int64_t band, ImageSource& source) {
    const std::int64_t row = band * band_rows_, pixels = rows_of(band) * width_;
    auto* room = reinterpret_cast<std::uint8_t*>(room_for(band));
    if (auto ok = source.read_rgba8(row, row + rows_of(band), {room, static_cast<std::size_t>(pixels) * 4}); !ok)
        return ok;
    return keep(band);
}

void FilePixels::leave(Band& band, State state) {
    if (band.state == State::absent) --absent_;
    band.state = state;
}

void FilePixels::release(std::int64_t j, const LastReading& last, OpenImages& images) {
    while (live_begin_ < live_end_ && try_release(live_begin_, j, last)) ++live_begin_;
    while (live_begin_ < live_end_ && try_release(live_end_ - 1, j, last)) --live_end_;
    if (absent_ == 0) images.close(file_);
    drop_copies(j);
}

bool FilePixels::try_release(std::int64_t b, std::int64_t j, const LastReading& last) {
    Band& band = bands_[static_cast<std::size_t>(b)];
    if (band.until > j || band.wanted) return false;
    if (!band.last) band.last = last({0, b * band_rows_, width_, rows_of(b)});
    if (*band.last >= j) return false;
    if (band.state == State::held) drop(b);
    leave(band, State::released);
    return true;
}

// --- in memory ---

RowPixels::RowPixels(const PlacedFile& file, std::size_t index)
    : FilePixels(file, index, kBandRows), rows_(static_cast<std::size_t>(band_count())) {}

// The rows that points read are known exactly, so what was wanted for which of them need not be kept.
void RowPixels::want(const SampleRectangle& part, std::int64_t) {
    (void)want_rows(part.row, part.row + part.rows, std::numeric_limits<std::int64_t>::min(), true);
}

std::uint32_t* RowPixels::room_for(std::int64_t band) {
    Rows& rows = rows_[static_cast<std::size_t>(band)];
    if (rows) return rows.get();
    if (spare_.empty()) {
        rows = std::make_unique_for_overwrite<std::uint32_t[]>(static_cast<std::size_t>(kBandRows * width()));
    } else {
        rows = std::move(spare_.back());
        spare_.pop_back();
    }
    return rows.get();
}

void RowPixels::drop(std::int64_t band) {
    Rows rows = std::move(rows_[static_cast<std::size_t>(band)]);
    if (spare_.size() < kMostSpare) spare_.push_back(std::move(rows));
}

Result<void> RowPixels::read(const SampleRectangle& part, std::uint32_t* out, std::int64_t pitch) const {
    for (std::int64_t r = 0; r < part.rows; ++r, out += pitch) {
        const std::int64_t row = part.row + r, band = row / kBandRows;
        if (!holds(band)) return not_prepared();
        copy_pixels(rows_[static_cast<std::size_t>(band)].get() + (row - band * kBandRows) * width() + part.column,
                    part.columns, out);
    }
    return {};
}

// --- on disk ---

SpooledPixels::SpooledPixels(const PlacedFile& file, std::size_t index, const TemporaryFile& spool, std::int64_t at,
                             std::int64_t& room_bytes)
    : FilePixels(file, index, kBlock),
      spool_(spool),
      at_(at),
      blocks_across_(parts(file.info.width, kBlock)),
      unit_rows_(file.info.unit_rows),
      room_bytes_(room_bytes) {}

SpooledPixels::~SpooledPixels() = default;

std::int64_t SpooledPixels::file_bytes(const ImageInfo& info) {
    return parts(info.width, kBlock) * parts(info.height, kBlock) * kBlockBytes;  // sides are below 2^31
}

std::int64_t SpooledPixels::place_of(std::int64_t block) const { return at_ + block * kBlockBytes; }

void SpooledPixels::want(const SampleRectangle& part, std::int64_t until) {
    const bool decodes = want_rows(part.row, part.row + part.rows, until, true);
    // The file may be closed before its next rows are wanted: the rest of what is decoded together is kept as well.
    if (decodes && unit_rows_ > kBlock) {
        const std::int64_t begin = part.row / unit_rows_ * unit_rows_,
                           end = parts(part.row + part.rows, unit_rows_) * unit_rows_;
        (void)want_rows(begin, std::min(end, height()), std::numeric_limits<std::int64_t>::min(), false);
    }
    for (std::int64_t by = part.row / kBlock; by * kBlock < part.row + part.rows; ++by)
        for (std::int64_t bx = part.column / kBlock; bx * kBlock < part.column + part.columns; ++bx) {
            const std::int64_t block = by * blocks_across_ + bx;
            const auto found = copies_.find(block);
            if (found != copies_.end()) {
                found->second.until = std::max(found->second.until, until);
            } else if (room_bytes_ >= kBlockBytes) {
                room_bytes_ -= kBlockBytes;
                copies_.emplace(block, Copy{until, nullptr});
                to_load_.push_back(block);
            }
        }
}

std::uint32_t* SpooledPixels::room_for(std::int64_t) {
    decoded_.resize(static_cast<std::size_t>(kBlock * width()));
    return decoded_.data();
}

// Blocks side by side go out in one piece.
Result<void> SpooledPixels::keep(std::int64_t band) {
    arranged_.assign(static_cast<std::size_t>(blocks_across_) * kBlockPixels, 0);
    std::int64_t begin = 0;
    const auto write_to = [&](std::int64_t end) -> Result<void> {
        if (begin == end) return {};
        const std::span<const std::uint32_t> pixels(arranged_.data() + static_cast<std::size_t>(begin) * kBlockPixels,
                                                    static_cast<std::size_t>(end - begin) * kBlockPixels);
        return spool_.write(place_of(band * blocks_across_ + begin), std::as_bytes(pixels));
    };
    for (std::int64_t bx = 0; bx < blocks_across_; ++bx) {
        std::uint32_t* block = arranged_.data() + static_cast<std::size_t>(bx) * kBlockPixels;
        const std::int64_t columns = std::min(kBlock, width() - bx * kBlock);
        for (std::int64_t r = 0; r < rows_of(band); ++r)
            copy_pixels(decoded_.data() + r * width() + bx * kBlock, columns, block + r * kBlock);
        const auto found = copies_.find(band * blocks_across_ + bx);
        if (found != copies_.end()) {
            if (!found->second.pixels)
                found->second.pixels = std::make_unique_for_overwrite<std::uint32_t[]>(kBlockPixels);
            copy_pixels(block, kBlockPixels, found->second.pixels.get());
        }
        if (std::any_of(block, block + kBlockPixels, [](std::uint32_t v) { return v != 0; })) continue;
        if (auto ok = write_to(bx); !ok) return ok;
        begin = bx + 1;
    }
    return write_to(blocks_across_);
}

void SpooledPixels::drop(std::int64_t band) {
    spool_.forget(place_of(band * blocks_across_), blocks_across_ * kBlockBytes);
}

void SpooledPixels::drop_copies(std::int64_t j) {
    const std::size_t dropped = std::erase_if(copies_, [&](const auto& copy) { return copy.second.until <= j; });
    room_bytes_ += static_cast<std::int64_t>(dropped) * kBlockBytes;
}

Result<void> SpooledPixels::load_wanted() {
    for (; !to_load_.empty(); to_load_.pop_back()) {
        const auto found = copies_.find(to_load_.back());
        if (found == copies_.end() || found->second.pixels) continue;
        auto pixels = std::make_unique_for_overwrite<std::uint32_t[]>(kBlockPixels);
        if (auto ok = load(to_load_.back(), pixels.get()); !ok) return ok;
        found->second.pixels = std::move(pixels);
    }
    return {};
}

Result<void> SpooledPixels::load(std::int64_t block, std::uint32_t* pixels) const {
    return spool_.read(place_of(block), std::as_writable_bytes(std::span(pixels, kBlockPixels)));
}

Result<void> SpooledPixels::read(const SampleRectangle& part, std::uint32_t* out, std::int64_t pitch) const {
    std::array<std::uint32_t, kBlockPixels> loaded;
    const std::int64_t row_end = part.row + part.rows, column_end = part.column + part.columns;
    for (std::int64_t by = part.row / kBlock; by * kBlock < row_end; ++by) {
        if (!holds(by)) return not_prepared();
        const std::int64_t top = std::max(part.row, by * kBlock), bottom = std::min(row_end, (by + 1) * kBlock);
        for (std::int64_t bx = part.column / kBlock; bx * kBlock < column_end; ++bx) {
            const std::int64_t left = std::max(part.column, bx * kBlock),
                               right = std::min(column_end, (bx + 1) * kBlock);
            const auto copy = copies_.find(by * blocks_across_ + bx);
            const std::uint32_t* block = copy == copies_.end() ? nullptr : copy->second.pixels.get();
            if (block == nullptr) {
                if (auto ok = load(by * blocks_across_ + bx, loaded.data()); !ok) return ok;
                block = loaded.data();
            }
            for (std::int64_t y = top; y < bottom; ++y)
                copy_pixels(block + (y - by * kBlock) * kBlock + (left - bx * kBlock), right - left,
                            out + (y - part.row) * pitch + (left - part.column));
        }
    }
    return {};
}

}  // namespace scree
