#include "tools/mosaic/file_pixels.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <iterator>
#include <span>
#include <utility>

namespace scree {
namespace {

constexpr std::size_t kBlockPixels = SpooledPixels::kBlock * SpooledPixels::kBlock;
constexpr std::size_t kMostSpare = 8;          // bands
constexpr std::size_t kMostSpareBlocks = 512;  // 8 MiB

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
    if (auto ok = make_room(); !ok) return ok;
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
    if (live_begin_ == live_end_) finish();
    forget_north_of(j);
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

// --- in memory or on disk ---

SpooledPixels::SpooledPixels(const PlacedFile& file, std::size_t index, const TemporaryFile& spool, std::int64_t at,
                             SpoolMemory& memory)
    : FilePixels(file, index, kBlock),
      spool_(spool),
      at_(at),
      blocks_across_(parts(file.info.width, kBlock)),
      unit_rows_(file.info.unit_rows),
      memory_(memory),
      spooled_(static_cast<std::size_t>(band_count())) {}

std::int64_t SpooledPixels::file_bytes(const ImageInfo& info) {
    return parts(info.width, kBlock) * parts(info.height, kBlock) * kBlockBytes;  // sides are below 2^31
}

std::int64_t SpooledPixels::place_of(std::int64_t block) const { return at_ + block * kBlockBytes; }

bool SpooledPixels::has_memory() const { return memory_.taken + kBlockBytes <= memory_.bytes; }

SpooledPixels::Pixels SpooledPixels::take_memory() {
    if (memory_.spare.empty()) return std::make_unique_for_overwrite<std::uint32_t[]>(kBlockPixels);
    Pixels pixels = std::move(memory_.spare.back());
    memory_.spare.pop_back();
    return pixels;
}

void SpooledPixels::give_back(Block& block) {
    memory_.taken -= kBlockBytes;
    if (block.pixels && memory_.spare.size() < kMostSpareBlocks) memory_.spare.push_back(std::move(block.pixels));
}

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
            const auto found = blocks_.find(block);
            if (found != blocks_.end()) {
                found->second.until = std::max(found->second.until, until);
            } else if (has_memory()) {
                memory_.taken += kBlockBytes;
                blocks_[block].until = until;
                to_load_.push_back(block);
            }
        }
}

std::uint32_t* SpooledPixels::room_for(std::int64_t) {
    memory_.decoded.resize(std::max(memory_.decoded.size(), static_cast<std::size_t>(kBlock * width())));
    return memory_.decoded.data();
}

void SpooledPixels::arrange(std::int64_t band) {
    memory_.arranged.assign(static_cast<std::size_t>(blocks_across_) * kBlockPixels, 0);
    for (std::int64_t bx = 0; bx < blocks_across_; ++bx) {
        const std::uint32_t* from = memory_.decoded.data() + bx * kBlock;
        std::uint32_t* to = memory_.arranged.data() + static_cast<std::size_t>(bx) * kBlockPixels;
        const std::int64_t columns = std::min(kBlock, width() - bx * kBlock);
        for (std::int64_t r = 0; r < rows_of(band); ++r) copy_pixels(from + r * width(), columns, to + r * kBlock);
    }
}

// Blocks side by side that go out go in one piece.
Result<void> SpooledPixels::keep(std::int64_t band) {
    arrange(band);
    const std::int64_t first = band * blocks_across_;
    std::int64_t begin = 0;
    for (std::int64_t bx = 0; bx <= blocks_across_; ++bx) {
        const std::uint32_t* pixels = memory_.arranged.data() + static_cast<std::size_t>(bx) * kBlockPixels;
        if (bx < blocks_across_ && !keep_in_memory(first + bx, pixels)) continue;
        if (begin < bx)
            if (auto ok = spool(first + begin, bx - begin,
                                memory_.arranged.data() + static_cast<std::size_t>(begin) * kBlockPixels);
                !ok)
                return ok;
        begin = bx + 1;
    }
    return {};
}

// Or nowhere: what is not in the spool is nothing.
bool SpooledPixels::keep_in_memory(std::int64_t block, const std::uint32_t* pixels) {
    const bool nothing = std::all_of(pixels, pixels + kBlockPixels, [](std::uint32_t v) { return v == 0; });
    const auto found = blocks_.find(block);
    if (found == blocks_.end() && nothing) return true;
    if (found == blocks_.end() && !has_memory()) return false;
    if (found == blocks_.end()) memory_.taken += kBlockBytes;
    Block& kept = blocks_[block];
    if (!kept.pixels) kept.pixels = take_memory();
    copy_pixels(pixels, kBlockPixels, kept.pixels.get());
    kept.spooled = nothing;
    return true;
}

Result<void> SpooledPixels::spool(std::int64_t first_block, std::int64_t count, const std::uint32_t* pixels) {
    spooled_[static_cast<std::size_t>(first_block / blocks_across_)] = true;
    return spool_.write(place_of(first_block),
                        std::as_bytes(std::span(pixels, static_cast<std::size_t>(count) * kBlockPixels)));
}

void SpooledPixels::drop(std::int64_t band) {
    const std::int64_t first = band * blocks_across_;
    for (std::int64_t block = first; block < first + blocks_across_; ++block) {
        const auto found = blocks_.find(block);
        if (found == blocks_.end()) continue;
        give_back(found->second);
        blocks_.erase(found);
    }
    if (!spooled_[static_cast<std::size_t>(band)]) return;
    spool_.forget(place_of(first), blocks_across_ * kBlockBytes);
    spooled_[static_cast<std::size_t>(band)] = false;
}

void SpooledPixels::forget_north_of(std::int64_t j) {
    unwanted_north_of_ = std::max(unwanted_north_of_, j);
    for (auto entry = blocks_.begin(); entry != blocks_.end();) {
        Block& block = entry->second;
        const bool goes = block.until <= j && block.spooled;
        if (goes) give_back(block);
        entry = goes ? blocks_.erase(entry) : std::next(entry);
    }
}

// Where memory is short, what nobody waits for goes to the spool.
Result<void> SpooledPixels::make_room() {
    if (!wants_decoding() || memory_.taken <= memory_.bytes / 2) return {};
    for (auto& [index, block] : blocks_) {
        if (block.until > unwanted_north_of_ || block.spooled || !block.pixels) continue;
        if (auto ok = spool(index, 1, block.pixels.get()); !ok) return ok;
        block.spooled = true;
    }
    forget_north_of(unwanted_north_of_);
    return {};
}

Result<void> SpooledPixels::load_wanted() {
    for (; !to_load_.empty(); to_load_.pop_back()) {
        const auto found = blocks_.find(to_load_.back());
        if (found == blocks_.end() || found->second.pixels) continue;
        Pixels pixels = take_memory();
        if (auto ok = load(to_load_.back(), pixels.get()); !ok) return ok;
        found->second.pixels = std::move(pixels);
        found->second.spooled = true;
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
            const auto found = blocks_.find(by * blocks_across_ + bx);
            const std::uint32_t* block = found == blocks_.end() ? nullptr : found->second.pixels.get();
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
