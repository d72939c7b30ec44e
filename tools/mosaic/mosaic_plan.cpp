#include "tools/mosaic/mosaic_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "tools/source/source_list.h"
#include "tools/source/vertical_crs.h"

namespace scree {
namespace {

constexpr double kOneSample = 1e-3;  // what may be lost by taking a grid for square or for the lattice's own, samples
constexpr double kFinerBy = 1.1;     // a layer this much finer than the lattice asks for no finer one
constexpr double kBranchCost = 2;    // of a point made tile by tile, against one of the dense part
constexpr double kWarnedScale = 1.001;  // of the CRS against the ground

Error input_error(std::string message) { return {ErrorCode::input, std::move(message)}; }
Error usage_error(std::string message) { return {ErrorCode::usage, std::move(message)}; }

struct OpenedFile {
    std::string path;
    ImageInfo info;
    std::optional<Georeference> where;
};

// `heights`: how they are read; null: images.
Result<std::vector<OpenedFile>> open_headers(const std::vector<std::string>& paths, const OpenOptions& options,
                                             const HeightReading* heights) {
    auto list = list_sources(paths);
    if (!list) return list.error();
    std::vector<OpenedFile> files;
    for (const std::string& path : *list) {
        auto source = heights != nullptr ? open_heights(path, options, heights->height_encoding)
                                         : ImageSource::open(path, options);
        if (!source) return source.error();
        files.push_back({path, (*source)->info(), (*source)->georeference()});
    }
    return files;
}

class Planner {
public:
    explicit Planner(const MosaicRequest& request, MosaicPlan& plan) : request_(request), plan_(plan) {}

    Result<void> run() {
        if (auto ok = open_files(); !ok) return ok;
        if (auto ok = place_files(); !ok) return ok;
        if (auto ok = check_datums(); !ok) return ok;
        if (auto ok = choose_crs_of_all(); !ok) return ok;
        if (auto ok = convert_datums(); !ok) return ok;
        auto layers = group_layers(plan_.heights);
        if (!layers) return layers.error();
        plan_.height_layers = std::move(*layers);
        if (auto ok = choose_lattice(); !ok) return ok;
        plan_.heights_copied = std::all_of(plan_.height_layers.begin(), plan_.height_layers.end(),
                                           [&](const Layer& l) { return on_grid(l, plan_.finest_grid(), plan_.crs); });
        plan_.same_units = one_unit();
        if (auto ok = keep_imagery_that_meets(); !ok) return ok;
        return place_imagery();
    }

private:
    Result<void> open_files() {
        auto heights = open_headers(request_.heights, request_.open, &request_.reading);
        if (!heights) return heights.error();
        heights_ = std::move(*heights);
        for (const OpenedFile& f : heights_)
            if (f.info.width < 2 || f.info.height < 2)
                return input_error(fmt::format("{}: {} x {} samples; a terrain needs at least 2 x 2", f.path,
                                               f.info.width, f.info.height));
        if (request_.imagery.empty()) return {};
        auto imagery = open_headers(request_.imagery, request_.open, nullptr);
        if (!imagery) return imagery.error();
        imagery_ = std::move(*imagery);
        return {};
    }

    // A file without any place: alone it lies at (0, 0), its imagery edge to edge over it.
    Result<void> place_unplaced() {
        if (heights_.size() > 1)
            return input_error(fmt::format("{}: the file carries no georeference, so it cannot be placed beside {}",
                                           unplaced(heights_)->path, other_than(*unplaced(heights_)).path));
        OpenedFile& dem = heights_.front();
        const auto& spacing = request_.reading.spacing_m;
        if (!spacing)
            return input_error(
                fmt::format("{}: the file carries no georeference; give the distance of its samples in "
                            "metres with --spacing",
                            dem.path));
        dem.where.emplace();
        dem.where->column_x = *spacing;
        dem.where->row_y = -*spacing;
        dem.where->raster_is_point = true;
        if (imagery_.empty()) return {};
        if (imagery_.size() > 1 || imagery_.front().where)
            return input_error(
                fmt::format("{} carries no georeference and {} does: either both or neither", dem.path,
                            imagery_.size() > 1 ? "several images need one each;" : imagery_.front().path));
        OpenedFile& image = imagery_.front();
        Georeference covering;
        covering.column_x = static_cast<double>(dem.info.width - 1) * *spacing / static_cast<double>(image.info.width);
        covering.row_y = -static_cast<double>(dem.info.height - 1) * *spacing / static_cast<double>(image.info.height);
        covering.first_x = covering.column_x / 2;
        covering.first_y = covering.row_y / 2;
        image.where = covering;
        return {};
    }

    static const OpenedFile* unplaced(const std::vector<OpenedFile>& files) {
        const auto found = std::find_if(files.begin(), files.end(), [](const OpenedFile& f) { return !f.where; });
        return found == files.end() ? nullptr : &*found;
    }
    const OpenedFile& other_than(const OpenedFile& file) const {
        return &heights_.front() == &file ? heights_.back() : heights_.front();
    }

    Result<void> place_files() {
        if (unplaced(heights_) != nullptr) {
            if (auto ok = place_unplaced(); !ok) return ok;
            spacing_used_ = true;
        }
        if (const OpenedFile* image = unplaced(imagery_); image != nullptr)
            return input_error(fmt::format("{} carries a georeference and {} does not: either both or neither",
                                           heights_.front().path, image->path));
        auto fallback = crs_of_the_unnamed();
        if (!fallback) return fallback.error();
        for (auto* files : {&heights_, &imagery_})
            for (const OpenedFile& f : *files) {
                auto crs = f.where->crs.empty() ? Result<Crs>(*fallback) : Crs::parse(f.where->crs);
                if (!crs) return Error{crs.error().code, fmt::format("{}: {}", f.path, crs.error().message)};
                PlacedFile placed{f.path, f.info, *f.where, std::move(*crs)};
                if (files == &heights_ && plan_.heights.empty()) reference_longitude_ = middle_x(placed);
                turn_towards(reference_longitude_, placed);
                (files == &heights_ ? plan_.heights : plan_.imagery).push_back(std::move(placed));
            }
        return {};
    }

    static double middle_x(const PlacedFile& f) {
        return f.crs.geographic()
                   ? f.where.x(static_cast<double>(f.info.width - 1) / 2, static_cast<double>(f.info.height - 1) / 2)
                   : 0;
    }

    Result<Crs> crs_of_the_unnamed() {
        std::string named, unnamed;
        for (const auto* files : {&heights_, &imagery_})
            for (const OpenedFile& f : *files) {
                std::string& first = f.where->crs.empty() ? unnamed : named;
                if (first.empty()) first = f.path;
            }
        plan_.crs_known = !named.empty() || request_.assume_crs || unnamed.empty();
        if (request_.assume_crs) return Crs::parse(*request_.assume_crs);
        if (named.empty()) {
            if (request_.crs)
                return usage_error(fmt::format("--crs {}: {} names no CRS to transform from; say it with --assume-crs",
                                               *request_.crs, unnamed));
            return Crs::unnamed_metres();
        }
        if (!unnamed.empty()) {
            if (heights_.front().where->crs.empty())
                return input_error(
                    fmt::format("{} names no CRS and {} does; say what it is in with --assume-crs", unnamed, named));
            plan_.warnings.push_back(fmt::format("{} names no CRS; taken to be in {}, as {} is", unnamed,
                                                 heights_.front().where->crs, heights_.front().path));
        }
        return Crs::parse(heights_.front().where->crs);
    }

    // What the user says of single files.
    Result<void> name_datums() {
        for (const std::string& word : request_.reading.source_vertical_crs) {
            const auto said = parse_source_vertical_crs(word);
            if (!said) return usage_error(fmt::format("--source-vertical-crs {} is not NAME=EPSG:n", word));
            if (auto known = VerticalCrs::parse(said->crs); !known)
                return usage_error(fmt::format("--source-vertical-crs {}: {}", word, known.error().message));
            bool found = false;
            for (PlacedFile& f : plan_.heights) {
                if (std::filesystem::path(f.path).filename() != said->name) continue;
                found = true;
                f.where.vertical_datum = said->crs;
            }
            if (!found)
                return usage_error(
                    fmt::format("--source-vertical-crs {}: no file with heights is called {}", word, said->name));
        }
        return {};
    }

    Result<void> check_datums() {
        if (auto ok = name_datums(); !ok) return ok;
        if (request_.reading.vertical_crs) return adopt_datum(*request_.reading.vertical_crs);
        std::string first;
        for (const PlacedFile& f : plan_.heights) {
            const std::string datum = datum_of(f);
            if (datum.empty()) continue;
            if (plan_.vertical_datum.empty()) {
                plan_.vertical_datum = datum;
                first = f.path;
            } else if (datum != plan_.vertical_datum && !request_.assume_same_datum) {
                return input_error(
                    fmt::format("{} has heights above {}, {} above {}: metres apart in places; "
                                "--vertical-crs converts them, --assume-same-datum takes them as they are",
                                f.path, datum, first, plan_.vertical_datum));
            }
        }
        return {};
    }

    // The one that was asked for. It has to be on record unless files name it and none names another: then nothing is
    // converted, and a store that was built so can be judged so.
    Result<void> adopt_datum(const std::string& asked) {
        if (request_.assume_same_datum)
            return usage_error("--vertical-crs converts heights, --assume-same-datum takes them as they are");
        plan_.vertical_datum = asked;
        std::string unnamed;
        bool named = false, another = false;
        for (const PlacedFile& f : plan_.heights) {
            const std::string datum = datum_of(f);
            if (datum.empty() && unnamed.empty()) unnamed = f.path;
            named = named || datum == asked;
            another = another || (!datum.empty() && datum != asked);
        }
        if (!unnamed.empty())
            plan_.warnings.push_back(
                fmt::format("{} names no vertical datum; its heights are taken to be above {}", unnamed, asked));
        if (named && !another) return {};
        auto target = VerticalCrs::parse(asked);
        if (!target) return usage_error(fmt::format("--vertical-crs {}", target.error().message));
        if (!target->up || std::abs(target->metres_per_unit - 1) > 1e-9)
            return usage_error(fmt::format("--vertical-crs {}: {} does not count metres upwards, and terrain does",
                                           asked, target->name));
        return {};
    }

    // Which files' heights are changed, and by what: everything that can be refused is refused before a pixel is read.
    Result<void> convert_datums() {
        if (!request_.reading.vertical_crs) return {};
        std::set<std::string> said;
        for (PlacedFile& f : plan_.heights) {
            const std::string datum = datum_of(f);
            if (datum.empty() || datum == plan_.vertical_datum) continue;
            if (!plan_.crs_known)
                return input_error(
                    fmt::format("{}: names no CRS, so its heights above {} cannot be converted to {}: "
                                "the difference depends on the place",
                                f.path, datum, plan_.vertical_datum));
            auto from = VerticalCrs::parse(datum);
            auto to = VerticalCrs::parse(plan_.vertical_datum);
            if (!from) return input_error(fmt::format("{}: {}", f.path, from.error().message));
            if (!to) return input_error(fmt::format("{}: {}", f.path, to.error().message));
            // A file that names no unit counts in that of its CRS.
            if (f.where.height_unit_m == 0) f.where.height_unit_m = from->metres_per_unit;
            auto shift = VerticalShift::make(f.crs, *from, *to, plan_.box);
            if (!shift) return input_error(fmt::format("{}: {}", f.path, shift.error().message));
            if (shift->identity()) continue;
            f.datum_change = DatumChange{datum, plan_.vertical_datum, plan_.box};
            if (!said.insert(datum + shift->operation()).second) continue;
            plan_.conversions.push_back(fmt::format(
                "heights above {} become heights above {} by \"{}\"{}", datum, plan_.vertical_datum, shift->operation(),
                shift->accuracy_m() > 0 ? fmt::format(", good for {} m", shift->accuracy_m()) : ""));
        }
        return {};
    }

    static std::string datum_of(const PlacedFile& f) {
        return f.where.vertical_datum.empty() ? f.crs.vertical() : f.where.vertical_datum;
    }

    Result<void> measure_box() {
        auto degrees = Crs::parse("EPSG:4326");
        if (!degrees) return degrees.error();
        bool first = true;
        for (const PlacedFile& f : plan_.heights) {
            auto box = box_of(f, *degrees);
            if (!box) return box.error();
            if (first) {
                plan_.box = {box->west, box->south, box->east, box->north};
                first = false;
                continue;
            }
            const double middle = (plan_.box.west + plan_.box.east) / 2;
            const double turn = 360 * std::nearbyint(((box->west + box->east) / 2 - middle) / 360);
            plan_.box.west = std::min(plan_.box.west, box->west - turn);
            plan_.box.east = std::max(plan_.box.east, box->east - turn);
            plan_.box.south = std::min(plan_.box.south, box->south);
            plan_.box.north = std::max(plan_.box.north, box->north);
        }
        return {};
    }

    Result<void> choose_crs_of_all() {
        plan_.crs = plan_.heights.front().crs;
        if (!plan_.crs_known) return {};
        if (auto ok = measure_box(); !ok) return ok;
        if (request_.crs) {
            auto asked = Crs::parse(*request_.crs);
            if (!asked) return usage_error(fmt::format("--crs {}: {}", *request_.crs, asked.error().message));
            if (asked->geographic() || std::abs(asked->metres_per_unit() - 1) > 1e-9)
                return usage_error(fmt::format("--crs {}: {} does not count in metres, and terrain does", *request_.crs,
                                               asked->name()));
            plan_.crs = std::move(*asked);
            auto scale = measure_scale(plan_.crs, plan_.box);
            if (!scale) return usage_error(fmt::format("--crs {}: {}", *request_.crs, scale.error().message));
            plan_.scale = *scale;
        } else {
            auto chosen = choose_crs(&plan_.heights.front().crs, plan_.box);
            if (!chosen)
                return Error{chosen.error().code,
                             fmt::format("{}: {}", plan_.heights.front().path, chosen.error().message)};
            plan_.crs = std::move(chosen->crs);
            plan_.crs_reason = std::move(chosen->reason);
            plan_.scale = chosen->scale;
        }
        if (plan_.scale.worst() > kWarnedScale)
            plan_.warnings.push_back(fmt::format(
                "{} is not metric here: a metre of it is {:.4f} to {:.4f} m on the ground; distances, slopes and "
                "errors are off by as much",
                plan_.crs.name(), 1 / plan_.scale.greatest, 1 / plan_.scale.least));
        return {};
    }

    // Metres of the dataset's CRS from one sample to the next around the layer's middle.
    struct CellSize {
        double along_columns = 0, along_rows = 0;
        double smaller() const { return std::min(along_columns, along_rows); }
    };
    Result<CellSize> cell_size(const Layer& layer, const std::string& path) const {
        auto transform = CrsTransform::make(layer.crs, plan_.crs);
        if (!transform) return transform.error();
        const double c = std::floor(static_cast<double>(layer.columns - 1) / 2),
                     r = std::floor(static_cast<double>(layer.rows - 1) / 2);
        std::vector<double> x{layer.where.x(c, r), layer.where.x(c + 1, r), layer.where.x(c, r + 1)};
        std::vector<double> y{layer.where.y(c, r), layer.where.y(c + 1, r), layer.where.y(c, r + 1)};
        transform->apply(x, y);
        const CellSize size{std::hypot(x[1] - x[0], y[1] - y[0]), std::hypot(x[2] - x[0], y[2] - y[0])};
        if (!(size.smaller() > 0) || !std::isfinite(size.along_columns + size.along_rows))
            return input_error(fmt::format("{}: the middle of {} x {} samples of its grid has no place in {}", path,
                                           layer.columns, layer.rows, plan_.crs.name()));
        return size;
    }

    // The first DEM's own samples, where they are a square north-up or south-up metric grid.
    std::optional<TargetGrid> own_grid() const {
        const Layer& first = plan_.height_layers.front();
        const Georeference& w = first.where;
        if (!first.crs.same_as(plan_.crs) || !w.axis_aligned()) return std::nullopt;
        const double step = std::abs(w.column_x);
        const TargetGrid grid{w.first_x, w.first_y, step};
        return on_grid(first, grid, plan_.crs) ? std::optional(grid) : std::nullopt;
    }

    // To eight bits, so that every multiple is exact and prints short; at most 0.8 % finer than asked.
    static double rounded_down(double spacing) {
        int exponent = 0;
        const double mantissa = std::frexp(spacing, &exponent);
        return std::ldexp(std::floor(mantissa * 256 * (1 + 1e-9)), exponent - 8);
    }

    Result<TargetGrid> choose_grid() {
        double finest = std::numeric_limits<double>::infinity();
        for (const Layer& layer : plan_.height_layers) {
            auto size = cell_size(layer, plan_.heights[layer.members.front().file].path);
            if (!size) return size.error();
            cell_sizes_.push_back(size->smaller());
            finest = std::min(finest, size->smaller());
        }
        const auto& asked = spacing_used_ ? std::nullopt : request_.reading.spacing_m;
        auto own = own_grid();
        if (own && (!asked || std::abs(*asked / own->step_m - 1) < 1e-9)) {
            // A finer layer on top halves the steps until it loses nothing.
            while (!asked && own->step_m > finest * kFinerBy) own->step_m /= 2;
            return *own;
        }
        TargetGrid grid;
        grid.step_m = asked ? *asked : rounded_down(finest);
        return grid;
    }

    Result<void> choose_lattice() {
        auto grid = choose_grid();
        if (!grid) return grid.error();
        const double step = grid->step_m;
        double west = std::numeric_limits<double>::infinity(), north = west, east = -west, south = -west;
        for (const PlacedFile& f : plan_.heights) {
            auto box = box_of(f, plan_.crs);
            if (!box) return box.error();
            west = std::min(west, std::floor((box->west - grid->x_m) / step + kOneSample));
            east = std::max(east, std::ceil((box->east - grid->x_m) / step - kOneSample));
            north = std::min(north, std::floor((grid->y_m - box->north) / step + kOneSample));
            south = std::max(south, std::ceil((grid->y_m - box->south) / step - kOneSample));
        }
        constexpr auto kMost = static_cast<double>(kMaxCellsPerSide);
        if (!(east - west <= kMost && south - north <= kMost))
            return input_error(fmt::format("the heights span {} x {} cells of {} m; a store has at most {} a side",
                                           east - west, south - north, step, kMaxCellsPerSide));
        const int shift = base_shift((east - west) * (south - north), step);
        const double unit = std::ldexp(1.0, shift);
        const auto [i, j] = point_of_coarse_sample(*grid, shift);
        west = i + std::floor((west - i) / unit) * unit;
        north = j + std::floor((north - j) / unit) * unit;
        east = i + std::ceil((east - i) / unit) * unit;
        south = j + std::ceil((south - j) / unit) * unit;
        auto lattice = make_lattice(grid->x_m + west * step, grid->y_m - north * step, step,
                                    static_cast<std::int64_t>(east - west), static_cast<std::int64_t>(south - north),
                                    request_.tile_cells_log2);
        if (!lattice) return lattice.error();
        plan_.lattice = *lattice;
        plan_.base_shift = std::min(shift, lattice->deepest_level);
        for (const double cell : cell_sizes_)
            plan_.layer_level.push_back(std::max(lattice->deepest_level - coarser_by(cell, step), 0));
        return {};
    }

    // Where the dense part may begin: on a sample of the first layer that is as coarse, if that is a grid point. Listed
    // after a finer file, it would else fall between the dense part's points and lose its sharpest samples.
    std::pair<double, double> point_of_coarse_sample(const TargetGrid& grid, int shift) const {
        for (std::size_t k = 0; k < plan_.height_layers.size(); ++k) {
            const Layer& layer = plan_.height_layers[k];
            if (coarser_by(cell_sizes_[k], grid.step_m) < shift || !layer.crs.same_as(plan_.crs)) continue;
            const double i = (layer.where.first_x - grid.x_m) / grid.step_m,
                         j = (grid.y_m - layer.where.first_y) / grid.step_m;
            if (std::abs(i - std::nearbyint(i)) <= kOneSample && std::abs(j - std::nearbyint(j)) <= kOneSample)
                return {std::nearbyint(i), std::nearbyint(j)};
        }
        return {0, 0};
    }

    // Halvings that are left to single branches: those that make the fewest points in all. `points`: of the finest
    // lattice, if it were dense. None beyond the coarsest layer: tint and interior voids are made by cells of the dense
    // part.
    int base_shift(double points, double step) const {
        int best = 0, most = 0;
        for (const double cell : cell_sizes_) most = std::max(most, coarser_by(cell, step));
        double least = std::numeric_limits<double>::infinity();
        for (int shift = 0; shift <= most && std::ldexp(points, -2 * shift) >= 1; ++shift) {
            double cost = std::ldexp(points, -2 * shift);
            for (std::size_t k = 0; k < plan_.height_layers.size(); ++k)
                if (coarser_by(cell_sizes_[k], step) < shift) cost += kBranchCost * points_of(plan_.height_layers[k]);
            if (cost < least) best = shift;
            least = std::min(least, cost);
        }
        return best;
    }

    static int coarser_by(double cell, double step) {
        return static_cast<int>(std::floor(std::log2(std::max(1.0, cell * kFinerBy / step))));
    }

    double points_of(const Layer& layer) const {
        double points = 0;
        for (const LayerMember& member : layer.members) {
            const ImageInfo& info = plan_.heights[member.file].info;
            points += static_cast<double>(info.width) * static_cast<double>(info.height);
        }
        return points;
    }

    bool one_unit() const {
        const HeightUnits first = units_of(plan_.heights.front().info, plan_.heights.front().where, request_.reading);
        return std::all_of(plan_.heights.begin(), plan_.heights.end(), [&](const PlacedFile& f) {
            return !f.datum_change && units_of(f.info, f.where, request_.reading) == first;
        });
    }

    Result<void> keep_imagery_that_meets() {
        const Lattice& l = plan_.lattice;
        const double west = l.x_m(0), east = l.x_m(static_cast<double>(l.cells_x)), north = l.y_m(0),
                     south = l.y_m(static_cast<double>(l.cells_y));
        std::vector<PlacedFile> kept;
        std::string why;
        for (PlacedFile& f : plan_.imagery) {
            const auto box = box_of(f, plan_.crs);
            if (box && box->east > west && box->west < east && box->north > south && box->south < north) {
                kept.push_back(std::move(f));
                continue;
            }
            why = box ? fmt::format("{} (x {}..{}, y {}..{}) does not meet the heights (x {}..{}, y {}..{})", f.path,
                                    box->west, box->east, box->south, box->north, west, east, south, north)
                      : box.error().message;
            plan_.warnings.push_back(why + "; it is not used");
        }
        if (kept.empty() && !plan_.imagery.empty()) return input_error(why);
        plan_.imagery = std::move(kept);
        return {};
    }

    Result<void> place_imagery() {
        auto layers = group_layers(plan_.imagery);
        if (!layers) return layers.error();
        plan_.image_layers = std::move(*layers);
        for (const PlacedFile& file : plan_.imagery) {
            const Layer alone{file.where, file.crs, file.info.width, file.info.height, false, {}};
            auto size = cell_size(alone, file.path);
            if (!size) return size.error();
            plan_.pixel_m.push_back(size->smaller());
        }
        return {};
    }

    const MosaicRequest& request_;
    MosaicPlan& plan_;
    std::vector<OpenedFile> heights_, imagery_;
    std::vector<double> cell_sizes_;  // of the height layers, metres
    double reference_longitude_ = 0;
    bool spacing_used_ = false;
};

}  // namespace

Lattice MosaicPlan::base_lattice() const {
    Lattice base = lattice;
    base.spacing_m = std::ldexp(lattice.spacing_m, base_shift);
    base.cells_x >>= base_shift;
    base.cells_y >>= base_shift;
    base.deepest_level -= base_shift;
    return base;
}

Result<MosaicPlan> plan_mosaic(const MosaicRequest& request) {
    MosaicPlan plan(Crs::unnamed_metres());
    if (auto ok = Planner(request, plan).run(); !ok) return ok.error();
    return plan;
}

}  // namespace scree
