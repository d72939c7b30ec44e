// Coordinate reference systems by PROJ, in one convention: x is east or longitude, y is north or latitude, degrees or
// metres-per-unit as the CRS has them, whatever axis order its authority names. PROJ is linked here and nowhere else;
// it never asks the network.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "common/result.h"

namespace scree {

class Crs {
public:
    /// "EPSG:n", WKT 1 or 2, PROJJSON or a PROJ string. Of a compound CRS the horizontal part is taken and the vertical
    /// part kept apart. From any thread; what was parsed once is remembered. Errors: ErrorCode::input, quoting the text
    /// (cut to 80 characters).
    static Result<Crs> parse(const std::string& text);

    /// That of files which name none: metres of their own, the same as itself and nothing else.
    static Crs unnamed_metres();

    const std::string& text() const;  ///< "EPSG:n" where the registry knows it (exactly), else one-line WKT2
    const std::string& name() const;  ///< for people
    const std::string& vertical()
        const;                ///< "EPSG:n" of a compound CRS's vertical part, of a 3D one's ellipsoid; else empty
    bool geographic() const;  ///< units are degrees, in a few old CRS others (turn())
    double turn() const;      ///< of a geographic CRS: once around in its units, 360 for degrees; else 0
    double metres_per_unit() const;  ///< of a projected CRS (1 for degrees)
    bool east_north() const;         ///< its axes count to the east and north (or are polar), not to the west
    /// WKT 1 as ESRI writes it into .prj files and most programs read; empty where that cannot say the same.
    std::string esri_wkt() const;
    /// The same horizontal CRS, axis order and names aside.
    bool same_as(const Crs& other) const;

    Crs(const Crs&);
    Crs(Crs&&) noexcept;
    Crs& operator=(const Crs&);
    Crs& operator=(Crs&&) noexcept;
    ~Crs();

    struct Impl;

private:
    friend class CrsTransform;
    explicit Crs(std::shared_ptr<const Impl> impl);
    std::shared_ptr<const Impl> impl_;
};

/// Longitudes and latitudes (degrees, WGS 84) that sources cover; west may be greater than east: across the
/// antimeridian.
struct LonLatBox {
    double west = 0, south = 0, east = 0, north = 0;
};

/// From one CRS to another. Owned by one thread at a time; copies are made with make(), which chooses alike for alike
/// arguments. One operation serves all points: PROJ's first of those that need no missing grid, for the area given or
/// else the smaller one of the two CRS. A choice by point would be more accurate where datum shifts are regional, and
/// would tear rasters where the regions meet.
class CrsTransform {
public:
    /// Errors: ErrorCode::input where PROJ knows no way.
    static Result<CrsTransform> make(const Crs& from, const Crs& to, const LonLatBox* area = nullptr);
    /// In place. Points without an image become NaN, both coordinates. Longitudes may be beyond +-180 on input; those
    /// of the result are within it.
    void apply(std::span<double> x, std::span<double> y) const;
    /// The same CRS on both sides: apply() changes nothing.
    bool identity() const;
    /// Metres, as the registry states the accuracy of the datum shift; 0 for none, negative: unknown.
    double accuracy_m() const;

    CrsTransform(CrsTransform&&) noexcept;
    CrsTransform& operator=(CrsTransform&&) noexcept;
    ~CrsTransform();

private:
    struct Impl;
    explicit CrsTransform(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// How far lengths in a projected CRS are from lengths on the ground: point scale along both axes of Tissot's ellipse
/// over the box (Snyder 1987, sec. 4), least and greatest, whatever the CRS's unit. 1 for both is perfect. Errors:
/// ErrorCode::input for a CRS that is not projected, and where part of the box has no image.
struct ScaleRange {
    double least = 1, greatest = 1;
    double worst() const { return greatest > 1 / least ? greatest : 1 / least; }  ///< >= 1
};
Result<ScaleRange> measure_scale(const Crs& crs, const LonLatBox& box);

/// What a build projects to when nobody says.
struct ChosenCrs {
    Crs crs;
    std::string reason;  ///< one line for people: "UTM zone 10 N: the sources span 3.0 x 2.0 degrees"
    ScaleRange scale;
};
/// `own` (the first DEM's CRS) where it is projected, in metres and within 1.001 of true scale over the box; else the
/// UTM zone of the box's middle where that keeps within 1.001; else polar stereographic above 60 degrees (true at the
/// box's middle latitude), else a Lambert conformal conic (parallels 1/6 inside the box), or an equatorial Mercator
/// where the box straddles the equator too evenly for a cone; the best of what is possible, with its scale stated, when
/// none keeps within 1.001. Where nothing conformal reaches the whole box (the world), an equidistant cylindrical, its
/// scale stated between latitudes +-89.
/// Errors: ErrorCode::input for a box that is none.
Result<ChosenCrs> choose_crs(const Crs* own, const LonLatBox& box);

}  // namespace scree
