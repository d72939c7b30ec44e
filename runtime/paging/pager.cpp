#include "runtime/paging/pager.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "common/mesh/vertex_slot.h"

namespace scree {

Pager::Pager(const TileStore& store, const PagerOptions& options, TileSink& sink)
    : store_(store),
      options_(options),
      sink_(sink),
      heights_(options.memory.height_slots),
      textures_(options.memory.texture_slots) {}

Result<std::unique_ptr<Pager>> Pager::create(const TileStore& store, const PagerOptions& options, TileSink& sink) {
    std::unique_ptr<Pager> pager(new Pager(store, options, sink));
    if (auto ok = pager->load_roots(); !ok) return ok.error();
    auto loader = Loader::start(store, options.loader_threads, options.latency_ms);
    if (!loader) return loader.error();
    pager->loader_ = std::move(*loader);
    return pager;
}

Result<void> Pager::load_roots() {
    const Dataset& d = store_.dataset();
    auto reader = store_.open_reader();
    if (!reader) return reader.error();
    std::vector<SlotVertex> vertices(slot_vertex_count(d.lattice.tile_cells_log2));
    TileRow row;
    for (std::int64_t y = 0; y < d.lattice.root_rows; ++y)
        for (std::int64_t x = 0; x < d.lattice.root_columns; ++x) {
            const TileId id{0, x, y};
            auto found = (*reader)->read(TileKind::height, id, row);
            if (!found) return found.error();
            if (!*found) continue;  // no heights there at all
            auto tile = read_height_tile(**reader, d, id);
            if (!tile) return tile.error();
            fill_vertex_slot(tile->samples, d.lattice.tile_cells_log2, vertices);
            const auto slot = heights_.reserve(id, frame_);
            if (!slot) return Error{ErrorCode::usage, "more roots than height slots"};
            heights_.complete(id, &tile->header);
            heights_.pin(id);
            sink_.put_height(*slot, vertices);
            if (!options_.textures) continue;
            auto texture = read_texture_tile(**reader, d, id);
            if (!texture) return texture.error();
            const auto texture_slot = textures_.reserve(id, frame_);
            if (!texture_slot) return Error{ErrorCode::usage, "more roots than texture slots"};
            HeightTileHeader children;
            children.child_mask = texture->child_mask;
            textures_.complete(id, &children);
            textures_.pin(id);
            sink_.put_texture(*texture_slot, texture->blocks);
        }
    return {};
}

ResidentHeight Pager::height(TileId id) const {
    const TileCache::Entry* entry = heights_.find(id);
    if (entry == nullptr || entry->state != TileCache::State::resident) return {};
    return {&entry->header, entry->slot};
}

std::int32_t Pager::texture(TileId id) const {
    const TileCache::Entry* entry = textures_.find(id);
    return entry != nullptr && entry->state == TileCache::State::resident ? entry->slot : -1;
}

std::uint8_t Pager::texture_children(TileId id) const {
    const TileCache::Entry* entry = textures_.find(id);
    return entry != nullptr && entry->state == TileCache::State::resident ? entry->header.child_mask : std::uint8_t{0};
}

bool Pager::unavailable_height(TileId id) const {
    const TileCache::Entry* entry = heights_.find(id);
    return entry != nullptr && entry->state == TileCache::State::unavailable;
}

bool Pager::unavailable_texture(TileId id) const {
    const TileCache::Entry* entry = textures_.find(id);
    return !options_.textures || (entry != nullptr && entry->state == TileCache::State::unavailable);
}

void Pager::accept(LoadedTile&& tile) {
    const LoadJob job = tile.job;
    --loading_[static_cast<int>(job.kind)];
    counters_.bytes_read += tile.bytes_read;
    if (!tile.error.empty()) {
        cache(job.kind).fail(job.id);
        ++counters_.damaged_tiles;
        if (on_damage)
            on_damage(fmt::format("{} tile {}/{}/{}: {}; its parent stands in",
                                  job.kind == TileKind::height ? "height" : "texture", job.id.level, job.id.x, job.id.y,
                                  tile.error));
    } else if (job.kind == TileKind::height) {
        sink_.put_height(job.slot, tile.vertices);
        heights_.complete(job.id, &tile.header);
        ++counters_.tiles_paged_in;
    } else {
        sink_.put_texture(job.slot, tile.blocks);
        textures_.complete(job.id, &tile.header);
        ++counters_.tiles_paged_in;
    }
    loader_->recycle(std::move(tile));
}

int Pager::take_arrivals(std::int64_t upload_bytes, bool wait) {
    int taken = 0;
    LoadedTile tile;
    while (upload_bytes > 0 && loader_->take(tile, wait && taken == 0)) {
        upload_bytes -= static_cast<std::int64_t>(
            tile.job.kind == TileKind::height ? tile.vertices.size() * sizeof(SlotVertex) : tile.blocks.size());
        accept(std::move(tile));
        ++taken;
    }
    return taken;
}

void Pager::request(const Wishes& wishes) {
    ++frame_;
    heights_.touch(wishes.standing_heights);
    textures_.touch(wishes.standing_textures);
    heights_.touch_planned(wishes.planned_heights, frame_);
    textures_.touch_planned(wishes.planned_textures, frame_);

    const std::int64_t evicted_before = heights_.evictions() + textures_.evictions();
    loader_->edit_queue([&](std::vector<LoadJob>& queue) { update_queue(wishes.requests, queue); });
    counters_.tiles_paged_out += heights_.evictions() + textures_.evictions() - evicted_before;
}

void Pager::update_queue(std::span<const TileRequest> requests, std::vector<LoadJob>& queue) {
    // Jobs not begun keep their slots while they are wished for; the others are forgotten.
    std::erase_if(queue, [&](LoadJob& job) {
        const auto wish = std::find_if(requests.begin(), requests.end(),
                                       [&](const TileRequest& r) { return r.kind == job.kind && r.id == job.id; });
        if (wish != requests.end()) {
            job.priority = wish->priority;
            return false;
        }
        cache(job.kind).cancel(job.id);
        --loading_[static_cast<int>(job.kind)];
        return true;
    });
    bool full[2] = {false, false};
    for (const TileRequest& wish : requests) {
        const int kind = static_cast<int>(wish.kind);
        if (full[kind] || loading_[kind] >= options_.memory.staging_slots) continue;
        TileCache& tiles = cache(wish.kind);
        if (tiles.find(wish.id) != nullptr) continue;
        const auto slot = tiles.reserve(wish.id, frame_);
        if (!slot) {
            full[kind] = true;
            continue;
        }
        ++loading_[kind];
        queue.push_back({wish.kind, wish.id, *slot, wish.priority});
    }
}

}  // namespace scree
