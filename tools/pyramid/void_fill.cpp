#include "tools/pyramid/void_fill.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <vector>

#include "tools/pyramid/membrane.h"
#include "tools/pyramid/void_regions.h"

namespace scree {
namespace {

constexpr std::int64_t kMostCachedRows = 128;  // windows of more rows are read and written for themselves
constexpr std::int64_t kQuickVoid = std::int64_t{1}
                                    << 14;  // samples, filled within milliseconds: nobody waits to stop it

// Rows of the spool, row j in slot j modulo their number: most voids are small and many lie side by side, and a row is
// read and written once for all of them.
class RowCache {
public:
    RowCache(HeightSpool& spool, std::int64_t bytes)
        : spool_(spool),
          slots_(static_cast<std::size_t>(std::clamp<std::int64_t>(bytes / (8 * spool.width()), 3, kMostCachedRows))) {}

    std::int64_t rows() const { return static_cast<std::int64_t>(slots_.size()); }

    /// The row's samples, valid until rows() more rows are asked for.
    Result<std::span<double>> row(std::int64_t j) {
        Slot& slot = slots_[static_cast<std::size_t>(j % rows())];
        if (slot.row != j) {
            if (auto ok = write_back(slot); !ok) return ok.error();
            slot.row = -1;
            slot.values.resize(static_cast<std::size_t>(spool_.width()));
            if (auto ok = read(j, slot.values); !ok) return ok.error();
            slot.row = j;
        }
        return std::span<double>(slot.values);
    }
    void changed(std::int64_t j) { slots_[static_cast<std::size_t>(j % rows())].changed = true; }

    /// Writes what has changed and forgets every row.
    Result<void> flush() {
        for (Slot& slot : slots_) {
            if (auto ok = write_back(slot); !ok) return ok;
            slot.row = -1;
        }
        return {};
    }

private:
    struct Slot {
        std::int64_t row = -1;
        bool changed = false;
        std::vector<double> values;
    };
    // Of a sparse row what files may reach; the rest is never looked at.
    Result<void> read(std::int64_t j, std::vector<double>& values) const {
        if (!spool_.sparse()) return spool_.read_samples(0, j, values);
        for (const auto& [begin, end] : spool_.covered(j)) {
            const std::span part(values.data() + begin, static_cast<std::size_t>(end - begin));
            if (auto ok = spool_.read_samples(begin, j, part); !ok) return ok;
        }
        return {};
    }
    Result<void> write_back(Slot& slot) {
        if (!slot.changed) return {};
        slot.changed = false;
        return spool_.write_samples(0, slot.row, slot.values);
    }

    HeightSpool& spool_;
    std::vector<Slot> slots_;
};

class VoidFiller {
public:
    VoidFiller(HeightSpool& spool, const FillRule& rule, std::int64_t memory_bytes,
               const std::function<bool()>& keep_going)
        : spool_(spool), rule_(rule), keep_going_(keep_going), cache_(spool, memory_bytes) {}

    Result<FillReport> run();

private:
    bool stopped() const { return keep_going_ && !keep_going_(); }
    Result<void> add_sparse(VoidRegions& regions, std::int64_t j);
    Result<void> take(std::span<const VoidRegion> closed);
    Result<void> fill(const VoidRegion& region);
    bool is_cached(const VoidRegion& region) const { return region.window_height() <= cache_.rows(); }
    Result<void> read_window(const VoidRegion& region);
    void mark(const VoidRegion& region);
    Result<void> choose_values(const VoidRegion& region);
    Result<void> write_window(const VoidRegion& region);
    void leave(const VoidRegion& region);

    HeightSpool& spool_;
    const FillRule& rule_;
    const std::function<bool()>& keep_going_;
    RowCache cache_;
    Membrane membrane_;
    std::vector<double> values_;         // of the region's window
    std::vector<std::uint8_t> unknown_;  // 1: the region's
    double lowest_ = INFINITY, highest_ = -INFINITY;
    FillReport report_;
    bool last_was_empty_ = false;
};

Error interrupted() { return {ErrorCode::interrupted, "stopped while voids were filled"}; }

Result<FillReport> VoidFiller::run() {
    VoidRegions regions(spool_.width(), spool_.height());
    bool any_open = false;
    for (std::int64_t j = 0; j < spool_.height(); ++j) {
        if (j % 64 == 0 && stopped()) return interrupted();
        if (spool_.sparse()) {
            if (auto ok = add_sparse(regions, j); !ok) return ok.error();
            any_open = true;
        } else if (spool_.may_lack_samples(j)) {
            auto row = cache_.row(j);
            if (!row) return row.error();
            if (auto ok = take(regions.add_row(j, *row)); !ok) return ok.error();
            any_open = true;
        } else if (any_open) {
            if (auto ok = take(regions.add_valid_row()); !ok) return ok.error();
            any_open = false;
        }
    }
    if (auto ok = take(regions.add_valid_row()); !ok) return ok.error();
    if (auto ok = cache_.flush(); !ok) return ok.error();
    if (report_.filled_samples > 0) {
        report_.min_raw = lowest_;
        report_.max_raw = highest_;
    }
    return report_;
}

// Rows that no file reaches are alike: only the first after one that files do reach is told of.
Result<void> VoidFiller::add_sparse(VoidRegions& regions, std::int64_t j) {
    const Coverage::Runs covered = spool_.covered(j);
    const bool empty = covered.empty();
    if (empty && last_was_empty_) return {};
    last_was_empty_ = empty;
    if (empty) return take(regions.add_row(j, {}, covered));
    auto row = cache_.row(j);
    if (!row) return row.error();
    return take(regions.add_row(j, *row, covered));
}

Result<void> VoidFiller::take(std::span<const VoidRegion> closed) {
    for (const VoidRegion& region : closed) {
        if (region.outside) {
            report_.outside_regions += region.voids > 0;
            report_.outside_samples += region.voids;
        } else if (region.window_height() > kMaxFillWindowSamples / region.window_width()) {
            leave(region);
        } else if (auto ok = fill(region); !ok) {
            return ok;
        }
    }
    return {};
}

void VoidFiller::leave(const VoidRegion& region) {
    ++report_.too_large_regions;
    report_.too_large_samples += region.voids;
    const FillReport::Box box{region.west, region.north, region.east - region.west + 1,
                              region.south - region.north + 1};
    // Areas of boxes inside a raster whose samples were counted do not overflow.
    if (box.width * box.height > report_.largest_left.width * report_.largest_left.height) report_.largest_left = box;
}

Result<void> VoidFiller::fill(const VoidRegion& region) {
    if (region.voids > kQuickVoid && stopped()) return interrupted();
    if (auto ok = read_window(region); !ok) return ok;
    mark(region);
    if (auto ok = choose_values(region); !ok) return ok;
    if (auto ok = write_window(region); !ok) return ok;
    ++report_.filled_regions;
    report_.filled_samples += region.voids;
    return {};
}

Result<void> VoidFiller::read_window(const VoidRegion& region) {
    const auto width = static_cast<std::size_t>(region.window_width());
    values_.reserve(kMaxFillWindowSamples);  // once, lest growing holds two; pages that are not used cost nothing
    unknown_.reserve(kMaxFillWindowSamples);
    values_.resize(width * static_cast<std::size_t>(region.window_height()));
    if (!is_cached(region))
        if (auto ok = cache_.flush(); !ok) return ok;
    std::span<double> to = values_;
    for (std::int64_t j = region.north - 1; j <= region.south + 1; ++j, to = to.subspan(width)) {
        if (!is_cached(region)) {
            if (auto ok = spool_.read_samples(region.west - 1, j, to.first(width)); !ok) return ok;
            continue;
        }
        auto row = cache_.row(j);
        if (!row) return row.error();
        const auto from = row->subspan(static_cast<std::size_t>(region.west - 1), width);
        std::copy(from.begin(), from.end(), to.begin());
    }
    return {};
}

// Its box may hold parts of other regions: the region is what its first sample reaches. It never meets the window's
// edge, which lies outside its box.
void VoidFiller::mark(const VoidRegion& region) {
    const auto width = static_cast<std::int32_t>(region.window_width());
    unknown_.assign(values_.size(), 0);
    std::vector<std::int32_t> reached{width + static_cast<std::int32_t>(region.first - region.west + 1)};
    unknown_[static_cast<std::size_t>(reached.back())] = 1;
    while (!reached.empty()) {
        const std::int32_t k = reached.back();
        reached.pop_back();
        for (const std::int32_t beside :
             {k - width - 1, k - width, k - width + 1, k - 1, k + 1, k + width - 1, k + width, k + width + 1}) {
            const auto b = static_cast<std::size_t>(beside);
            if (unknown_[b] != 0 || !std::isnan(values_[b])) continue;
            unknown_[b] = 1;
            reached.push_back(beside);
        }
    }
}

Result<void> VoidFiller::choose_values(const VoidRegion& region) {
    double low = rule_.value, high = rule_.value;
    if (rule_.kind == FillRule::Kind::smooth) {
        const std::function<bool()> never_stop;
        if (!membrane_.solve({values_, unknown_, region.window_width(), region.window_height()},
                             region.voids > kQuickVoid ? keep_going_ : never_stop))
            return interrupted();
        low = membrane_.rim().low;
        high = membrane_.rim().high;
    }
    for (std::size_t k = 0; k < values_.size(); ++k) {
        if (unknown_[k] == 0) continue;
        double v = rule_.kind == FillRule::Kind::value ? rule_.value : values_[k];
        if (rule_.integer) v = std::round(v);
        if (rule_.kind == FillRule::Kind::smooth) v = std::clamp(v, low, high);
        if (!spool_.wide()) v = static_cast<double>(static_cast<float>(v));
        values_[k] = v;
        lowest_ = std::min(lowest_, v);
        highest_ = std::max(highest_, v);
    }
    return {};
}

Result<void> VoidFiller::write_window(const VoidRegion& region) {
    const auto width = static_cast<std::size_t>(region.window_width());
    std::size_t base = 0;
    for (std::int64_t j = region.north - 1; j <= region.south + 1; ++j, base += width) {
        for (std::size_t i = 0; i < width;) {
            std::size_t end = i;
            while (end < width && unknown_[base + end] != 0) ++end;
            if (end == i) {
                ++i;
                continue;
            }
            const std::span<const double> run(values_.data() + base + i, end - i);
            const std::int64_t column = region.west - 1 + static_cast<std::int64_t>(i);
            if (is_cached(region)) {
                auto row = cache_.row(j);
                if (!row) return row.error();
                std::copy(run.begin(), run.end(), row->begin() + column);
                cache_.changed(j);
            } else if (auto ok = spool_.write_samples(column, j, run); !ok) {
                return ok;
            }
            i = end;
        }
    }
    return {};
}

}  // namespace

Result<FillReport> fill_interior_voids(HeightSpool& spool, const FillRule& rule, std::int64_t memory_bytes,
                                       const std::function<bool()>& keep_going) {
    assert(rule.kind != FillRule::Kind::value || std::isfinite(rule.value));
    if (rule.kind == FillRule::Kind::none) return FillReport{};
    return VoidFiller(spool, rule, memory_bytes, keep_going).run();
}

}  // namespace scree
