#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tools/source/grid_file.h"
#include "tools/source/number_text.h"
#include "tools/source/state_plane.h"
#include "tools/source/text_reader.h"

namespace scree {
namespace {

constexpr std::size_t kRecordBytes = 1024;
constexpr std::size_t kFixedBytes = 864;  // of record A; what follows came with later editions
constexpr std::size_t kIntegerBytes = 6;
constexpr std::size_t kDoubleBytes = 24;
constexpr std::size_t kFloatBytes = 12;
constexpr std::size_t kHeadBytes = 3 * kIntegerBytes + 5 * kDoubleBytes;  // of a profile, after its row number
constexpr std::int64_t kFirstBlockValues = 146;                           // that fit a record after the head
constexpr std::int64_t kBlockValues = 170;
constexpr std::size_t kMaxRunBytes = TextReader::kBufferBytes / 4;
constexpr std::int64_t kMaxSamples = std::int64_t{1} << 26;  // 40 times those of a 10 m quad
constexpr std::int64_t kMaxColumnStep = 16;  // some missing profiles are a hole, more are a damaged coordinate
constexpr double kGridTolerance = 0.1;       // of a step that profiles may start beside the grid
constexpr double kMaxHeightStep = 1e6;       // so that 999999 of them fit a float
constexpr double kMaxLocalDatum = 1e9;
constexpr std::int32_t kVoid = -32767;
constexpr std::int32_t kOtherVoid = -32766;

Error broken(std::string reason) { return {ErrorCode::input, std::move(reason)}; }

// Fortran writes exponents of doubles with a D.
std::optional<double> fortran_number(std::string_view text) {
    std::string decimal(text);
    for (char& c : decimal)
        if (c == 'D' || c == 'd') c = 'e';
    const auto value = parse_number(decimal);
    return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<std::int64_t> integer_at(std::string_view text, std::size_t at, std::size_t bytes = kIntegerBytes) {
    if (text.size() < at + bytes) return std::nullopt;
    return whole_number(text.substr(at, bytes), -999999, 999999);
}

std::optional<double> number_at(std::string_view text, std::size_t at, std::size_t bytes) {
    if (text.size() < at + bytes) return std::nullopt;
    return fortran_number(text.substr(at, bytes));
}

// Fields of the file from some offset on. Errors hold the bare reason.
class FieldReader {
public:
    explicit FieldReader(const ByteFile& file) : text_(file, kMaxRunBytes) {}

    void seek(std::int64_t offset) {
        run_left_ = 0;
        text_.seek(offset);
    }
    std::int64_t offset() const { return text_.offset(); }

    /// As TextReader's.
    Result<std::string_view> take(std::size_t bytes) {
        run_left_ = 0;
        return text_.take(bytes);
    }
    Result<std::string_view> take_run() {
        run_left_ = 0;
        return text_.take_run();
    }

    /// A right-aligned field of six. Records and lines may be padded or not, but within them a field ends six bytes
    /// after the one before: a digit that is missing is found. `new_record`: this may be the first field of one.
    Result<std::int32_t> elevation(bool new_record) {
        const std::int64_t due = offset() + static_cast<std::int64_t>(kIntegerBytes);
        bool new_line = false;
        if (run_left_ == 0) {
            const Result<std::string_view> run = text_.find_run(&new_line);
            if (!run) return run.error();
            if (run->empty()) return broken("the file ends before it");
            run_left_ = run->size();
        }
        // Fields without space between them are full, but for the first.
        const std::size_t bytes = (run_left_ - 1) % kIntegerBytes + 1;
        const std::string_view text = text_.buffered().substr(0, bytes);
        text_.skip(bytes);
        run_left_ -= bytes;
        std::int32_t value = 0;
        const char* first = text.data() + (text[0] == '+' ? 1 : 0);
        const auto [stop, status] = std::from_chars(first, text.data() + bytes, value);
        if (status != std::errc() || stop != text.data() + bytes)
            return broken(fmt::format("'{}' is no integer", text));
        if (offset() != due && !new_record && !new_line)
            return broken(fmt::format("'{}' does not stand in its field of {} characters", text, kIntegerBytes));
        return value;
    }

private:
    TextReader text_;
    std::size_t run_left_ = 0;  ///< bytes of a run of fields, all of them buffered
};

enum class Unit { radians = 0, feet = 1, metres = 2, arc_seconds = 3 };
enum class Datum { nad27 = 1, wgs72 = 2, wgs84 = 3, nad83 = 4, other };

struct Header {
    bool geographic = false;
    bool state_plane = false;
    std::int64_t zone = 0;  ///< of UTM, negative in the south; of a state plane, by FIPS
    Unit ground = Unit::metres;
    Unit height = Unit::metres;
    double step_x = 0, step_y = 0, step_z = 0;
    std::int64_t profiles = 0;
    Datum datum = Datum::nad27;
    std::string vertical_datum;
    std::int64_t first_profile = 0;  ///< offset
};

Result<void> read_system(const std::string& path, std::string_view record, Header& header) {
    if (integer_at(record, 150) == 2)
        return unusable_grid(path, "its samples are scattered (pattern 2); only regular grids are read");
    const auto system = integer_at(record, 156);
    if (system != 0 && system != 1 && system != 2)
        return unusable_grid(path,
                             fmt::format("no USGS DEM that can be read: its ground reference system is '{}', but 0 "
                                         "(geographic), 1 (UTM) and 2 (state plane) are known",
                                         record.substr(156, kIntegerBytes)));
    header.geographic = system == 0;
    header.state_plane = system == 2;
    const auto zone = integer_at(record, 162);
    if (header.state_plane) {
        header.zone = zone.value_or(0);
    } else if (!header.geographic) {
        if (!zone || *zone == 0 || std::abs(*zone) > 60)
            return unusable_grid(
                path, fmt::format("its UTM zone is '{}', but zones are 1 to 60", record.substr(162, kIntegerBytes)));
        header.zone = *zone;
    }
    const auto ground = integer_at(record, 528);
    const bool known = header.geographic ? ground == 0 || ground == 3 : ground == 1 || ground == 2;
    if (!known)
        return unusable_grid(path, fmt::format("its ground unit is '{}', but {}", record.substr(528, kIntegerBytes),
                                               header.geographic ? "degrees come from 0 (radians) or 3 (arc-seconds)"
                                                                 : "planar coordinates are in 1 (feet) or 2 (metres)"));
    header.ground = static_cast<Unit>(*ground);
    const auto height = integer_at(record, 534);
    if (height != 1 && height != 2)
        return unusable_grid(path, fmt::format("its elevation unit is '{}', but 1 (feet) or 2 (metres) are known",
                                               record.substr(534, kIntegerBytes)));
    header.height = static_cast<Unit>(*height);
    return {};
}

Result<void> read_grid(const std::string& path, std::string_view record, Header& header) {
    if (number_at(record, 786, kDoubleBytes).value_or(0) != 0)
        return unusable_grid(path, fmt::format("its profiles are turned by '{}' against the ground system; only "
                                               "profiles from south to north are read",
                                               trimmed(record.substr(786, kDoubleBytes))));
    double* const steps[] = {&header.step_x, &header.step_y, &header.step_z};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::string_view text = record.substr(816 + i * kFloatBytes, kFloatBytes);
        const auto step = fortran_number(text);
        if (!step || !(*step > 0) || (i == 2 && *step > kMaxHeightStep))
            return unusable_grid(path, fmt::format("its resolution in {} is '{}', which cannot be", "xyz"[i], text));
        *steps[i] = *step;
    }
    const auto profiles = integer_at(record, 858);
    if (!profiles || *profiles < 1)
        return unusable_grid(path, fmt::format("it says that it has '{}' profiles", record.substr(858, kIntegerBytes)));
    header.profiles = *profiles;
    return {};
}

void read_datums(std::string_view record, Header& header) {
    const auto vertical = integer_at(record, 888, 2);
    if (vertical == 2) header.vertical_datum = "EPSG:7968";
    if (vertical == 3) header.vertical_datum = "EPSG:5703";
    // Files older than the element are of NAD 27.
    const std::int64_t horizontal = integer_at(record, 890, 2).value_or(0);
    if (horizontal >= 2) header.datum = horizontal <= 4 ? static_cast<Datum>(horizontal) : Datum::other;
}

struct ProfileHead {
    std::int64_t number = 0;  ///< from 1 on
    std::int64_t values = 0;
    double x = 0, y = 0;
    double local_datum = 0;
};

Result<ProfileHead> read_head(FieldReader& reader) {
    const Result<std::string_view> row = reader.take_run();
    if (!row) return row.error();
    if (row->empty()) return broken("the file ends before it");
    const bool begins = row->size() <= kIntegerBytes && whole_number(*row, 1, 999999).has_value();
    if (!begins) return broken(fmt::format("'{}' stands where it begins", row->substr(0, 40)));
    const Result<std::string_view> text = reader.take(kHeadBytes);
    if (!text) return text.error();
    if (text->size() < kHeadBytes) return broken("the file ends within its head");
    const auto number = integer_at(*text, 0);
    const auto values = integer_at(*text, kIntegerBytes);
    const auto columns = integer_at(*text, 2 * kIntegerBytes);
    const auto coordinate = [&](std::size_t i) {
        return number_at(*text, 3 * kIntegerBytes + i * kDoubleBytes, kDoubleBytes);
    };
    const auto x = coordinate(0), y = coordinate(1), datum = coordinate(2);
    if (!number || !values || !columns || *values < 1 || *columns != 1)
        return broken(fmt::format("its head says '{}' (number, values, columns), which cannot be",
                                  text->substr(0, 3 * kIntegerBytes)));
    if (!x || !y || !datum || std::abs(*datum) > kMaxLocalDatum)
        return broken(fmt::format("its start and datum are '{}', which cannot be",
                                  text->substr(3 * kIntegerBytes, 3 * kDoubleBytes)));
    return ProfileHead{*number, *values, *x, *y, *datum};
}

// Record A has a record of its own, or ends with its line, or where an older edition of it ended.
std::optional<std::size_t> find_first_profile(const ByteFile& file, std::string_view start) {
    FieldReader reader(file);
    const std::size_t line_end = std::min(start.find_first_of("\r\n", kFixedBytes), start.size());
    for (const std::size_t at : {kRecordBytes, line_end, kFixedBytes, std::size_t{892}}) {
        reader.seek(static_cast<std::int64_t>(at));
        const Result<ProfileHead> head = read_head(reader);
        if (head && head->number == 1) return at;
    }
    return std::nullopt;
}

/// 0: none, or in a unit that leaves it open.
int epsg_of_state_plane(const Header& header) {
    if (header.datum == Datum::nad27 && header.ground == Unit::feet) return epsg_of_state_plane_nad27(header.zone);
    if (header.datum == Datum::nad83 && header.ground == Unit::metres) return epsg_of_state_plane_nad83(header.zone);
    return 0;
}

Result<void> check_state_plane(const std::string& path, const Header& header) {
    if (!header.state_plane || epsg_of_state_plane(header) != 0) return {};
    return unusable_grid(path, fmt::format("it lies in state plane zone {} on datum {}, in {}; those on NAD27 (1) in "
                                           "US survey feet and on NAD83 (4) in metres are read where their zone is "
                                           "known",
                                           header.zone, static_cast<int>(header.datum),
                                           header.ground == Unit::feet ? "feet" : "metres"));
}

Result<Header> read_header(const ByteFile& file) {
    const Result<std::string> start = file.head(kRecordBytes);
    if (!start) return start.error();
    const std::string& path = file.path();
    if (start->size() < kFixedBytes)
        return unusable_grid(path, fmt::format("no USGS DEM: its header takes {} bytes, but the file has {}; it is cut "
                                               "off",
                                               kFixedBytes, start->size()));
    Header header;
    if (auto read = read_system(path, *start, header); !read) return read.error();
    if (auto read = read_grid(path, *start, header); !read) return read.error();
    const auto first = find_first_profile(file, *start);
    if (!first) return unusable_grid(path, "no profile follows its header; it is cut off or no USGS DEM");
    const std::size_t line_end = start->find_first_of("\r\n", kFixedBytes);
    read_datums(std::string_view(*start).substr(0, std::min(*first, line_end)), header);
    header.first_profile = static_cast<std::int64_t>(*first);
    if (auto known = check_state_plane(path, header); !known) return known.error();
    return header;
}

struct Profile {
    std::int64_t column = 0;
    std::int64_t row = 0;  ///< of its first value, the southmost; rows count to the north
    std::int64_t values = 0;
    double local_datum = 0;
    std::int64_t offset = 0;  ///< of its first value
};

// The grid over the box of all profiles, which stand at other heights one beside the other where a quad is slanted.
struct Grid {
    Header header;
    std::vector<Profile> profiles;
    double west = 0, south = 0;  ///< in units of the ground
    std::int64_t columns = 0;
    std::int64_t rows = 0;
    bool integers = true;
};

/// Whole steps from `from` to `to`.
Result<std::int64_t> steps(double from, double to, double step, const char* axis) {
    const double count = (to - from) / step;
    if (!(std::abs(count) < static_cast<double>(kMaxSamples)))
        return broken(fmt::format("it starts at {} = {}, too far from the first profile's {}", axis, to, from));
    const double whole = std::round(count);
    if (std::abs(count - whole) > kGridTolerance)
        return broken(
            fmt::format("it starts at {} = {}, beside the grid of steps of {} from {}", axis, to, step, from));
    return static_cast<std::int64_t>(whole);
}

Result<void> pass_values(FieldReader& reader, std::int64_t count, std::int32_t* out) {
    for (std::int64_t i = 0; i < count; ++i) {
        const bool new_record = i >= kFirstBlockValues && (i - kFirstBlockValues) % kBlockValues == 0;
        const Result<std::int32_t> value = reader.elevation(new_record);
        if (!value) return broken(fmt::format("value {} of {}: {}", i + 1, count, value.error().message));
        if (out != nullptr) out[i] = *value;
    }
    return {};
}

// Finds and checks all profiles in one pass over the file, for in files without padding a head is where the values of
// the profile before end.
class ProfileScan {
public:
    ProfileScan(const ByteFile& file, const Header& header) : reader_(file) {
        grid_.header = header;
        grid_.integers = header.step_z == 1;
    }

    Result<Grid> run() {
        reader_.seek(grid_.header.first_profile);
        for (std::int64_t i = 0; i < grid_.header.profiles; ++i)
            if (auto added = add(i); !added)
                return broken(fmt::format("profile {} of {}: {}", i + 1, grid_.header.profiles, added.error().message));
        const Result<ProfileHead> more = read_head(reader_);
        if (more && more->number == grid_.header.profiles + 1)
            return broken(
                fmt::format("its header says {} profiles, but another one follows them", grid_.header.profiles));
        for (Profile& profile : grid_.profiles) profile.row -= lowest_;
        grid_.south += static_cast<double>(lowest_) * grid_.header.step_y;
        return std::move(grid_);
    }

private:
    Result<void> add(std::int64_t index) {
        const Result<ProfileHead> head = read_head(reader_);
        if (!head) return head.error();
        if (head->number != index + 1) return broken(fmt::format("it says that it is profile {}", head->number));
        if (index == 0) {
            grid_.west = head->x;
            grid_.south = head->y;
        }
        const auto column = steps(grid_.west, head->x, grid_.header.step_x, "x");
        if (!column) return column.error();
        const auto row = steps(grid_.south, head->y, grid_.header.step_y, "y");
        if (!row) return row.error();
        if (index > 0 && (*column < grid_.columns || *column >= grid_.columns + kMaxColumnStep))
            return broken(fmt::format("it starts at x = {}, which is {} columns from the one before", head->x,
                                      *column - grid_.columns + 1));
        lowest_ = index == 0 ? *row : std::min(lowest_, *row);
        highest_ = std::max(highest_, *row + head->values);
        grid_.columns = *column + 1;
        grid_.rows = highest_ - lowest_;
        if (grid_.rows > kMaxSamples / grid_.columns)
            return broken(fmt::format("up to it the grid has {} x {} samples, but a DEM of this kind has at most {}",
                                      grid_.columns, grid_.rows, kMaxSamples));
        if (head->local_datum != 0) grid_.integers = false;
        grid_.profiles.push_back({*column, *row, head->values, head->local_datum, reader_.offset()});
        return pass_values(reader_, head->values, nullptr);
    }

    FieldReader reader_;
    Grid grid_;
    std::int64_t lowest_ = 0, highest_ = 0;  ///< rows, from the first profile's start; highest_ is one past
};

// Profiles are columns, so rows take all of them: four bytes a sample are held from the first row that is asked for
// until the last one is given.
class UsgsDemDecoder final : public PixelDecoder {
public:
    UsgsDemDecoder(ByteFile file, Grid grid) : file_(std::move(file)), grid_(std::move(grid)) {
        layout_ = {grid_.columns, grid_.rows, 1, -1, grid_.integers ? SampleType::i32 : SampleType::f32, 0};
    }

    const DecodedLayout& layout() const override { return layout_; }

    Result<void> decode(std::int64_t begin, std::int64_t end, std::byte* out) override {
        if (values_.empty())
            if (auto loaded = load(); !loaded) return loaded;
        if (grid_.integers)
            give<std::int32_t>(begin, end, out);
        else
            give<float>(begin, end, out);
        if (end == grid_.rows) values_ = {};
        return {};
    }

private:
    Result<void> load() {
        std::size_t count = 0;
        for (const Profile& profile : grid_.profiles) count += static_cast<std::size_t>(profile.values);
        std::vector<std::int32_t> values(count);
        FieldReader reader(file_);
        std::int32_t* to = values.data();
        for (const Profile& profile : grid_.profiles) {
            reader.seek(profile.offset);
            if (auto read = pass_values(reader, profile.values, to); !read) return read;
            to += profile.values;
        }
        values_ = std::move(values);
        return {};
    }

    template <class T>
    T height_of(std::int32_t stored, const Profile& profile) const {
        if (stored == kVoid || stored == kOtherVoid) return static_cast<T>(kVoid);
        if constexpr (std::is_same_v<T, std::int32_t>) return stored;
        return static_cast<T>(stored * grid_.header.step_z + profile.local_datum);
    }

    template <class T>
    void give(std::int64_t begin, std::int64_t end, std::byte* out) const {
        const auto put = [&](std::int64_t row, std::int64_t column, T value) {
            std::memcpy(out + static_cast<std::int64_t>(sizeof(T)) * ((row - begin) * grid_.columns + column), &value,
                        sizeof(T));
        };
        for (std::int64_t row = begin; row < end; ++row)
            for (std::int64_t column = 0; column < grid_.columns; ++column) put(row, column, static_cast<T>(kVoid));
        const std::int64_t south = grid_.rows - end, north = grid_.rows - begin;  // rows that count to the north
        const std::int32_t* stored = values_.data();
        for (const Profile& profile : grid_.profiles) {
            const std::int64_t first = std::max(south, profile.row);
            const std::int64_t last = std::min(north, profile.row + profile.values);
            for (std::int64_t row = first; row < last; ++row)
                put(grid_.rows - 1 - row, profile.column, height_of<T>(stored[row - profile.row], profile));
            stored += profile.values;
        }
    }

    ByteFile file_;
    Grid grid_;
    DecodedLayout layout_;
    std::vector<std::int32_t> values_;  ///< of all profiles one after the other; empty: not loaded
};

// Degrees or metres.
double in_units_of_crs(double coordinate, Unit unit) {
    switch (unit) {
        case Unit::radians:
            return coordinate * (180 / std::numbers::pi);
        case Unit::feet:
            return coordinate * 0.3048;
        case Unit::arc_seconds:
            return coordinate / 3600;
        default:
            return coordinate;
    }
}

// The extent is divided rather than the step, so that the far edge of a file is exactly its neighbour's near edge.
double step_in_units_of_crs(double step, std::int64_t count, Unit unit) {
    const std::int64_t gaps = std::max<std::int64_t>(1, count - 1);
    return in_units_of_crs(step * static_cast<double>(gaps), unit) / static_cast<double>(gaps);
}

/// 0: EPSG has none.
int epsg_of_utm(Datum datum, std::int64_t zone) {
    const int north = static_cast<int>(zone);
    switch (datum) {
        case Datum::wgs72:
            return zone > 0 ? 32200 + north : 32300 - north;
        case Datum::wgs84:
            return zone > 0 ? 32600 + north : 32700 - north;
        case Datum::nad27:
            if (zone >= 59) return 3370 + north - 59;
            return zone >= 1 && zone <= 22 ? 26700 + north : 0;
        case Datum::nad83:
            if (zone >= 59) return 3372 + north - 59;
            return zone >= 1 && zone <= 23 ? 26900 + north : 0;
        default:
            return 0;
    }
}

int epsg_of_geographic(Datum datum) {
    constexpr int kCodes[] = {4267, 4322, 4326, 4269, 0};
    return kCodes[static_cast<int>(datum) - 1];
}

int epsg_of(const Header& header) {
    if (header.state_plane) return epsg_of_state_plane(header);
    return header.geographic ? epsg_of_geographic(header.datum) : epsg_of_utm(header.datum, header.zone);
}

Georeference place_of(const Grid& grid) {
    const Header& header = grid.header;
    // A state plane's CRS counts in the unit of the file.
    const Unit unit = header.state_plane ? Unit::metres : header.ground;
    Georeference place;
    place.column_x = step_in_units_of_crs(header.step_x, grid.columns, unit);
    place.row_y = -step_in_units_of_crs(header.step_y, grid.rows, unit);
    place.first_x = in_units_of_crs(grid.west, unit);
    place.first_y = in_units_of_crs(grid.south + static_cast<double>(grid.rows - 1) * header.step_y, unit);
    place.raster_is_point = true;
    place.geographic = header.geographic;
    place.vertical_datum = header.vertical_datum;
    place.height_unit_m = header.height == Unit::feet ? 0.3048 : 1;
    const int epsg = epsg_of(header);
    if (epsg == 0) return place;
    constexpr const char* kDatums[] = {"NAD27", "WGS 72", "WGS 84", "NAD83"};
    place.crs = fmt::format("EPSG:{}", epsg);
    place.crs_name = kDatums[static_cast<int>(header.datum) - 1];
    if (header.state_plane)
        place.crs_name += fmt::format(" / state plane zone {}", header.zone);
    else if (!header.geographic)
        place.crs_name += fmt::format(" / UTM zone {}{}", std::abs(header.zone), header.zone > 0 ? 'N' : 'S');
    return place;
}

}  // namespace

bool looks_like_usgs_dem(std::string_view start) {
    if (start.size() < kFixedBytes) return false;
    const auto is_from = [&](std::size_t at, std::int64_t low, std::int64_t high) {
        const auto value = integer_at(start, at);
        return value && *value >= low && *value <= high;
    };
    return is_from(144, 1, 4) && is_from(150, 1, 2) && is_from(156, 0, 2) && is_from(528, 0, 3) && is_from(534, 1, 2) &&
           is_from(858, 1, 999999) && number_at(start, 816, kFloatBytes).value_or(0) > 0;
}

Result<GridFile> open_usgs_dem(ByteFile file) {
    const Result<Header> header = read_header(file);
    if (!header) return header.error();
    Result<Grid> profiles = ProfileScan(file, *header).run();
    if (!profiles)
        return unusable_grid(file.path(), fmt::format("{}; the file is damaged or cut off", profiles.error().message));
    GridFile grid;
    grid.nodata = fmt::format("{}", kVoid);
    grid.georeference = place_of(*profiles);
    if (auto checked = check_place(*grid.georeference, file.path(), "its header"); !checked) return checked.error();
    grid.decoder = std::make_unique<UsgsDemDecoder>(std::move(file), std::move(*profiles));
    return grid;
}

}  // namespace scree
