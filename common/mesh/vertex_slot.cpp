#include "common/mesh/vertex_slot.h"

#include <cassert>

namespace scree {
namespace {

float mean(std::int32_t a, std::int32_t b) { return 0.5f * static_cast<float>(a + b); }  // |a + b| < 2^24: exact

// A row that a coarser level draws too: its vertices of odd multiples of the stride lie on edges along x.
void fill_edges_along_x(const std::int32_t* row, int cells, int stride, SlotVertex* out) {
    for (int i = stride; i < cells; i += 2 * stride) out[i].next_n = mean(row[i - stride], row[i + stride]);
}

// A row between two that a coarser level draws, `north` and `south`: vertices on edges along y and, between those, the
// middles of the coarser level's cells. The first cell of the row is split from its north-west corner iff `even`.
void fill_row_between(const std::int32_t* north, const std::int32_t* south, int cells, int stride, bool even,
                      SlotVertex* out) {
    for (int i = 0; i <= cells; i += 2 * stride) out[i].next_n = mean(north[i], south[i]);
    for (int i = stride; i < cells; i += 2 * stride, even = !even)
        out[i].next_n = even ? mean(north[i - stride], south[i + stride]) : mean(north[i + stride], south[i - stride]);
}

}  // namespace

void fill_vertex_slot(std::span<const std::int32_t> samples, int tile_cells_log2, std::span<SlotVertex> out) {
    const int cells = 1 << tile_cells_log2;
    const std::ptrdiff_t pitch = cells + 1;
    assert(samples.size() == slot_vertex_count(tile_cells_log2) && out.size() == samples.size());
    for (std::size_t k = 0; k < out.size(); ++k) {
        const float own = static_cast<float>(samples[k]);
        out[k] = {own, own, 0};
    }
    // The vertices born at a stride are those of its grid that twice the stride leaves out; every level writes its own.
    for (int stride = 1; stride < cells; stride *= 2) {
        for (int j = 0; j <= cells; j += 2 * stride)
            fill_edges_along_x(&samples[static_cast<std::size_t>(j * pitch)], cells, stride,
                               &out[static_cast<std::size_t>(j * pitch)]);
        for (int j = stride; j < cells; j += 2 * stride) {
            const std::int32_t* row = &samples[static_cast<std::size_t>(j * pitch)];
            fill_row_between(row - stride * pitch, row + stride * pitch, cells, stride, (j / (2 * stride)) % 2 == 0,
                             &out[static_cast<std::size_t>(j * pitch)]);
        }
    }
    // The whole tile is no cell of a coarser level of its own: its centre stays.
    SlotVertex& centre = out[static_cast<std::size_t>(cells / 2 * pitch + cells / 2)];
    centre.next_n = centre.height_n;
    for (std::ptrdiff_t stride = 1; 4 * stride <= cells; stride *= 2)
        for (std::ptrdiff_t along = 2 * stride; along < cells; along += 4 * stride) {
            const auto rim = [&](std::ptrdiff_t border, std::ptrdiff_t inner) {
                const SlotVertex& moves = out[static_cast<std::size_t>(border)];
                out[static_cast<std::size_t>(inner)].rim_n = 0.5f * (moves.next_n - moves.height_n);
            };
            rim(along, stride * pitch + along);
            rim(along * pitch + cells, along * pitch + cells - stride);
            rim(cells * pitch + along, (cells - stride) * pitch + along);
            rim(along * pitch, along * pitch + stride);
        }
}

}  // namespace scree
