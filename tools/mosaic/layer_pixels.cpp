#include "tools/mosaic/layer_pixels.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace scree {
namespace {

constexpr std::uint32_t kSolid = 128;

std::optional<SampleRectangle> common_part(const SampleRectangle& a, const SampleRectangle& b) {
    const std::int64_t west = std::max(a.column, b.column), north = std::max(a.row, b.row);
    const std::int64_t east = std::min(a.column + a.columns, b.column + b.columns),
                       south = std::min(a.row + a.rows, b.row + b.rows);
    if (west >= east || north >= south) return std::nullopt;
    return SampleRectangle{west, north, east - west, south - north};
}

bool covers(const SampleRectangle& whole, const SampleRectangle& part) {
    return whole.column <= part.column && whole.row <= part.row &&
           part.column + part.columns <= whole.column + whole.columns && part.row + part.rows <= whole.row + whole.rows;
}

SampleRectangle moved(SampleRectangle part, const SampleRectangle& origin) {
    part.column -= origin.column;
    part.row -= origin.row;
    return part;
}

void clear(const SampleRectangle& window, std::uint32_t* out, std::int64_t pitch) {
    for (std::int64_t r = 0; r < window.rows; ++r) std::fill_n(out + r * pitch, window.columns, 0U);
}

// Over pixels of the files below.
Result<void> lay(const FilePixels& file, const SampleRectangle& part, std::uint32_t* to, std::int64_t pitch) {
    std::vector<std::uint32_t> pixels(static_cast<std::size_t>(part.count()));
    if (auto ok = file.read(part, pixels.data(), part.columns); !ok) return ok;
    const std::uint32_t* from = pixels.data();
    for (std::int64_t r = 0; r < part.rows; ++r, from += part.columns, to += pitch)
        for (std::int64_t c = 0; c < part.columns; ++c) to[c] = lies_on_top(from[c], to[c]) ? from[c] : to[c];
    return {};
}

}  // namespace

bool lies_on_top(std::uint32_t later, std::uint32_t earlier) {
    return later >> 24 >= kSolid || later >> 24 > earlier >> 24;
}

Result<std::unique_ptr<LayerPixels>> LayerPixels::create(const Layer& layer, const std::vector<PlacedFile>& files,
                                                         PixelPlace place, const std::string& temporary,
                                                         std::int64_t& room_bytes) {
    auto pixels = std::make_unique<LayerPixels>();
    if (place == PixelPlace::disk) {
        auto spool = TemporaryFile::create(temporary + ".layer");
        if (!spool) return spool.error();
        pixels->spool_ = std::move(*spool);
    }
    std::int64_t at = 0;
    for (const LayerMember& member : layer.members) {
        const PlacedFile& file = files[member.file];
        Member fresh{nullptr, {member.column, member.row, file.info.width, file.info.height}};
        if (place == PixelPlace::memory) {
            fresh.pixels = std::make_unique<RowPixels>(file, member.file);
        } else {
            fresh.pixels = std::make_unique<SpooledPixels>(file, member.file, *pixels->spool_, at, room_bytes);
            if (__builtin_add_overflow(at, SpooledPixels::file_bytes(file.info), &at))
                return Error{ErrorCode::input, fmt::format("{}: no temporary file is large enough for all pixels of "
                                                           "the files up to this one",
                                                           file.path)};
        }
        pixels->members_.push_back(std::move(fresh));
    }
    return pixels;
}

void LayerPixels::want(const SampleRectangle& window, std::int64_t until) {
    for (Member& member : members_)
        if (const auto part = common_part(window, member.place)) member.pixels->want(moved(*part, member.place), until);
}

void LayerPixels::want_all(std::int64_t until) {
    for (Member& member : members_) member.pixels->want({0, 0, member.place.columns, member.place.rows}, until);
}

// Files that are open come first: opening others may close them.
Result<void> LayerPixels::fetch(OpenImages& images, const ReadProgress& progress) {
    for (const bool open : {true, false})
        for (Member& member : members_) {
            if (open && !(member.pixels->wants_decoding() && images.is_open(member.pixels->file()))) continue;
            if (auto ok = member.pixels->fetch(images, progress); !ok) return ok;
        }
    return {};
}

void LayerPixels::release(std::int64_t j, const LastReading& last, OpenImages& images) {
    for (Member& member : members_) {
        const auto last_of_file = [&](SampleRectangle part) {
            part.column += member.place.column;
            part.row += member.place.row;
            return last(part);
        };
        member.pixels->release(j, last_of_file, images);
    }
}

Result<bool> LayerPixels::read(const SampleRectangle& window, std::uint32_t* out, std::int64_t pitch) const {
    // What lies under an opaque cover of the window is not looked at.
    auto bottom = members_.begin();
    bool opaque = false;
    for (auto member = members_.begin(); member != members_.end(); ++member)
        if (member->pixels->opaque() && covers(member->place, window)) {
            bottom = member;
            opaque = true;
        }
    bool empty = true;
    for (auto member = bottom; member != members_.end(); ++member) {
        const auto part = common_part(window, member->place);
        if (!part) continue;
        if (empty && !covers(member->place, window)) clear(window, out, pitch);
        std::uint32_t* to = out + (part->row - window.row) * pitch + (part->column - window.column);
        const FilePixels& pixels = *member->pixels;
        const SampleRectangle in_file = moved(*part, member->place);
        if (auto ok = empty ? pixels.read(in_file, to, pitch) : lay(pixels, in_file, to, pitch); !ok) return ok.error();
        opaque = opaque && pixels.opaque();
        empty = false;
    }
    if (empty) clear(window, out, pitch);
    return opaque;
}

}  // namespace scree
