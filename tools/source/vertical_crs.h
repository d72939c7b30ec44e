// Vertical references and the way from one to another, by PROJ. A vertical reference is a vertical CRS, or a
// geographic one of three dimensions, whose heights stand on its ellipsoid. Heights are metres along the reference's
// axis: downwards for depths, and whatever the unit of the CRS.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "common/result.h"
#include "tools/source/crs.h"

namespace scree {

struct VerticalCrs {
    std::string text;  ///< "EPSG:n"
    std::string name;  ///< for people
    double metres_per_unit = 1;
    bool up = true;  ///< false: depths
    bool ellipsoidal = false;

    /// Errors: ErrorCode::input, quoting the text, where the registry has no such vertical reference.
    static Result<VerticalCrs> parse(const std::string& text);
};

/// From one vertical reference to another at places of a horizontal CRS. One operation serves all places: PROJ's first
/// for the area whose grids are installed. Never one that merely neglects the difference ("ballpark"). Owned by one
/// thread at a time.
class VerticalShift {
public:
    /// Errors: ErrorCode::input where PROJ knows no way, or lacks a grid for it: which one is said.
    static Result<VerticalShift> make(const Crs& horizontal, const VerticalCrs& from, const VerticalCrs& to,
                                      const LonLatBox& area);

    /// Heights z at (x, y), in place; NaN where the operation says nothing.
    void apply(std::span<const double> x, std::span<const double> y, std::span<double> z) const;
    /// Metres stay what they are: the references differ by their unit at most.
    bool identity() const;
    const std::string& operation() const;  ///< its name in the registry
    double accuracy_m() const;             ///< as the registry states it; negative: unknown

    VerticalShift(VerticalShift&&) noexcept;
    VerticalShift& operator=(VerticalShift&&) noexcept;
    ~VerticalShift();

private:
    struct Impl;
    explicit VerticalShift(std::unique_ptr<Impl> impl);
    bool keeps_metres(const Crs& horizontal, const LonLatBox& area) const;
    std::unique_ptr<Impl> impl_;
};

}  // namespace scree
