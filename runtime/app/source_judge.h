// Which samples of a source layer a store is judged by, and whether the store has terrain under all of them.
//
// Where a layer's samples are lattice points, they were copied: judged is what belongs to a cell of four samples that
// have terrain. Elsewhere lattice points took values from between the samples: judged is a sample all of whose
// neighbours have terrain, as far as the corners of the coarsest leaf's cell over it may lie from it, and half a sample
// on, because a point has the validity of its nearest sample (tools/source/resample.h). A hole in the store within the
// data is therefore always under judged samples; only a rim along the data's own end is not judged. Hidden samples have
// terrain: seams of layers are no ends.
#pragma once

#include <cstdint>
#include <vector>

#include "common/store/tile_store.h"
#include "runtime/app/source_index.h"
#include "runtime/app/source_samples.h"

namespace scree {

class SourceJudge {
public:
    /// Reads all leaves of the store once. The layer must outlive it. Memory: a bit a sample, two while it is made.
    /// Errors: those of the store.
    static Result<SourceJudge> make(const Dataset& dataset, TileReader& reader, const SourceLayer& layer);

    const SourceLayer& layer() const { return *layer_; }
    const SourceIndex& index() const { return index_; }
    /// The sample is to be judged by, and lies over a present cell.
    bool judged(std::int64_t column, std::int64_t row) const { return test(judged_, column, row); }
    /// Samples that should have terrain (hidden ones, too) and lie over no present cell of the store: 0 in a sound one.
    std::int64_t not_drawn() const { return not_drawn_; }
    /// Metres that rounding may put a sample beside a line of the lattice.
    double slack_m() const { return slack_m_; }

private:
    using Bits = std::vector<std::uint64_t>;

    SourceJudge(const Dataset& dataset, const SourceLayer& layer);
    bool test(const Bits& bits, std::int64_t column, std::int64_t row) const {
        const auto k = static_cast<std::uint64_t>(row * layer_->columns + column);
        return (bits[k / 64] >> (k % 64) & 1) != 0;
    }
    void set(Bits& bits, std::int64_t column, std::int64_t row) {
        const auto k = static_cast<std::uint64_t>(row * layer_->columns + column);
        bits[k / 64] |= std::uint64_t{1} << (k % 64);
    }
    bool on_lattice(const Dataset& dataset) const;
    void choose_copied();
    void choose_resampled(double cell_m);
    Result<void> look_under(const Dataset& dataset, TileReader& reader);
    void look_under(const Lattice& lattice, TileId id, const std::vector<std::uint8_t>& presence, Bits& drawn);

    const SourceLayer* layer_;
    SourceIndex index_;
    double slack_m_;
    Bits judged_;
    std::int64_t not_drawn_ = 0;
};

}  // namespace scree
