#include "common/geo_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

namespace scree {
namespace {

using Vector = std::array<double, 3>;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kPolarCurvature_m = 6399593.626;  // WGS 84: a^2 / b
constexpr int kMostTaps = 8;
constexpr double kSlack = 1e-9;  // of a cell: what lies on the box's side is within
constexpr int kMostStarts = 8;
constexpr int kMostSteps = 50;
constexpr double kDamping = 1e-12, kLeast = 1e-150;
constexpr double kSamePlace = 1e-11;  // between normals: 64 um

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector scaled(const Vector& a, double by) { return {a[0] * by, a[1] * by, a[2] * by}; }

// Lagrange's weights of the nodes around a place, and their derivatives: eight nodes, four on each side, or near a
// border those nearest to it.
struct Taps {
    int first = 0, count = 0;
    std::array<double, kMostTaps> weight{}, slope{};
};

Taps taps_at(double t, int nodes) {
    Taps taps;
    taps.count = std::min(kMostTaps, nodes);
    const int cell = static_cast<int>(std::floor(t));
    taps.first = std::clamp(cell - taps.count / 2 + 1, 0, nodes - taps.count);
    const double u = t - taps.first;
    for (int k = 0; k < taps.count; ++k) {
        // Product rule, factor by factor.
        double weight = 1, slope = 0;
        for (int m = 0; m < taps.count; ++m) {
            if (m == k) continue;
            slope = (slope * (u - m) + weight) / (k - m);
            weight = weight * (u - m) / (k - m);
        }
        taps.weight[static_cast<std::size_t>(k)] = weight;
        taps.slope[static_cast<std::size_t>(k)] = slope;
    }
    return taps;
}

// The interpolated vector, not normalised, and its derivatives by cell.
struct Surface {
    Vector value{}, by_column{}, by_row{};
};

Surface surface_at(const GeoGrid& grid, double column, double row) {
    const Taps x = taps_at(column, grid.columns), y = taps_at(row, grid.rows);
    Surface s;
    for (int j = 0; j < y.count; ++j) {
        Vector value{}, slope{};
        for (int i = 0; i < x.count; ++i) {
            const Vector& n = grid.normals[static_cast<std::size_t>((y.first + j) * grid.columns + x.first + i)];
            for (std::size_t k = 0; k < 3; ++k) {
                value[k] += x.weight[static_cast<std::size_t>(i)] * n[k];
                slope[k] += x.slope[static_cast<std::size_t>(i)] * n[k];
            }
        }
        const double weight = y.weight[static_cast<std::size_t>(j)];
        for (std::size_t k = 0; k < 3; ++k) {
            s.value[k] += weight * value[k];
            s.by_column[k] += weight * slope[k];
            s.by_row[k] += y.slope[static_cast<std::size_t>(j)] * value[k];
        }
    }
    return s;
}

// A place in nodes from the north-west one.
struct NodePlace {
    double column = 0, row = 0;
};

// Upright to the unit vector n what is along it already, for a vector of length 1 / by.
Vector tangent(const Vector& slope, const Vector& n, double by) {
    const double along = dot(slope, n);
    return {(slope[0] - n[0] * along) * by, (slope[1] - n[1] * along) * by, (slope[2] - n[2] * along) * by};
}

// Newton's method in least squares (two unknowns, three equations), kept within the box and from leaping.
std::optional<NodePlace> solve(const GeoGrid& grid, const Vector& target, NodePlace at) {
    for (int step = 0; step < kMostSteps; ++step) {
        const Surface s = surface_at(grid, at.column, at.row);
        const double length = std::sqrt(dot(s.value, s.value));
        if (!(length > 0.1)) return std::nullopt;
        const Vector n = scaled(s.value, 1 / length);
        const Vector off{target[0] - n[0], target[1] - n[1], target[2] - n[2]};
        const Vector a = tangent(s.by_column, n, 1 / length), b = tangent(s.by_row, n, 1 / length);
        // Damped, each by its own size: where the map is singular (a pole that is a side of it) neither divides by 0.
        const double aa = dot(a, a) * (1 + kDamping) + kLeast, bb = dot(b, b) * (1 + kDamping) + kLeast, ab = dot(a, b);
        const double determinant = aa * bb - ab * ab;
        if (!(determinant > 0)) return std::nullopt;
        const double column = std::clamp((bb * dot(a, off) - ab * dot(b, off)) / determinant, -1.0, 1.0);
        const double row = std::clamp((aa * dot(b, off) - ab * dot(a, off)) / determinant, -1.0, 1.0);
        const NodePlace next{std::clamp(at.column + column, 0.0, grid.columns - 1.0),
                             std::clamp(at.row + row, 0.0, grid.rows - 1.0)};
        const double moved = std::max(std::abs(next.column - at.column), std::abs(next.row - at.row));
        at = next;
        if (moved < 1e-13 * GeoGrid::kMostNodes) break;
    }
    const Surface s = surface_at(grid, at.column, at.row);
    const Vector n = scaled(s.value, 1 / std::sqrt(dot(s.value, s.value)));
    const Vector off{target[0] - n[0], target[1] - n[1], target[2] - n[2]};
    if (!(dot(off, off) <= kSamePlace * kSamePlace)) return std::nullopt;
    return at;
}

// Middles of the cells that are nearer to the target than the cells around them, the nearest first.
std::vector<NodePlace> starts_for(const GeoGrid& grid, const Vector& target) {
    const int columns = grid.columns - 1, rows = grid.rows - 1;
    std::vector<double> nearness(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    const auto node = [&](int i, int j) -> const Vector& {
        return grid.normals[static_cast<std::size_t>(j * grid.columns + i)];
    };
    const auto of = [&](int i, int j) -> double& { return nearness[static_cast<std::size_t>(j * columns + i)]; };
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            const Vector &a = node(i, j), &b = node(i + 1, j), &c = node(i, j + 1), &d = node(i + 1, j + 1);
            const Vector sum{a[0] + b[0] + c[0] + d[0], a[1] + b[1] + c[1] + d[1], a[2] + b[2] + c[2] + d[2]};
            const double length = std::sqrt(dot(sum, sum));
            of(i, j) = length > 0 ? dot(sum, target) / length : -1;
        }
    std::vector<std::pair<double, NodePlace>> found;
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            bool nearest = true;
            for (int y = std::max(j - 1, 0); y <= std::min(j + 1, rows - 1); ++y)
                for (int x = std::max(i - 1, 0); x <= std::min(i + 1, columns - 1); ++x)
                    nearest = nearest && of(x, y) <= of(i, j);
            if (nearest) found.push_back({of(i, j), {i + 0.5, j + 0.5}});
        }
    std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<NodePlace> starts;
    for (std::size_t k = 0; k < found.size() && k < kMostStarts; ++k) starts.push_back(found[k].second);
    return starts;
}

}  // namespace

std::array<double, 3> normal_of(const LonLat& at) {
    const double longitude = at.longitude_deg / kDegrees, latitude = at.latitude_deg / kDegrees;
    return {std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude), std::sin(latitude)};
}

double ground_distance_m(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return kPolarCurvature_m * std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

std::optional<LonLat> GeoGrid::lon_lat(double x_m, double y_m) const {
    const auto [west, south, east, north] = box_m;
    const double column = (x_m - west) / (east - west) * (columns - 1);
    const double row = (north - y_m) / (north - south) * (rows - 1);
    const bool within =
        column >= -kSlack && column <= columns - 1 + kSlack && row >= -kSlack && row <= rows - 1 + kSlack;
    if (!within) return std::nullopt;
    const Vector n = surface_at(*this, std::clamp(column, 0.0, columns - 1.0), std::clamp(row, 0.0, rows - 1.0)).value;
    if (!(dot(n, n) > 0.01)) return std::nullopt;  // no map has neighbours on opposite sides of the earth
    return LonLat{std::atan2(n[1], n[0]) * kDegrees, std::atan2(n[2], std::hypot(n[0], n[1])) * kDegrees};
}

std::optional<std::array<double, 2>> GeoGrid::place(const LonLat& at) const {
    if (!std::isfinite(at.longitude_deg) || !(std::abs(at.latitude_deg) <= 90)) return std::nullopt;
    if (columns < 2 || rows < 2) return std::nullopt;
    const Vector target = normal_of(at);
    std::optional<NodePlace> best;
    double best_distance = 0;
    for (const NodePlace& start : starts_for(*this, target)) {
        const auto found = solve(*this, target, start);
        if (!found) continue;
        const double distance = std::hypot(found->column / (columns - 1) - 0.5, found->row / (rows - 1) - 0.5);
        if (best && best_distance <= distance) continue;
        best = found;
        best_distance = distance;
    }
    if (!best) return std::nullopt;
    const auto [west, south, east, north] = box_m;
    return std::array{west + best->column / (columns - 1) * (east - west),
                      north - best->row / (rows - 1) * (north - south)};
}

Result<void> GeoGrid::check() const {
    const auto bad = [](std::string what) { return Error{ErrorCode::store, "geo_grid: " + std::move(what)}; };
    if (columns < 2 || columns > kMostNodes || rows < 2 || rows > kMostNodes)
        return bad(fmt::format("{} x {} nodes are not 2..{} a side", columns, rows, kMostNodes));
    if (normals.size() != static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows))
        return bad(fmt::format("{} normals for {} x {} nodes", normals.size(), columns, rows));
    const auto [west, south, east, north] = box_m;
    for (const double side : box_m)
        if (!(std::abs(side) <= 1e12)) return bad(fmt::format("a box with a side at {} m", side));
    if (!(east - west >= 1e-6 && north - south >= 1e-6))
        return bad(fmt::format("a box {} m wide and {} m high", east - west, north - south));
    if (!(error_m >= 0 && error_m <= 1e8)) return bad(fmt::format("an error of {} m", error_m));
    for (const Vector& n : normals)
        if (!(std::abs(dot(n, n) - 1) <= 1e-8)) return bad("a normal that is not of length 1");
    return {};
}

namespace {

constexpr double kOne = 4294967296.0;  // of the integers that stand for 1
constexpr std::int64_t kMostInteger = std::int64_t{1} << 33;
constexpr int kOrder = 3;

// (1 - x)^order, coefficient by coefficient.
constexpr std::array<std::array<std::int64_t, kOrder + 1>, kOrder + 1> kDifference{
    {{1, 0, 0, 0}, {1, -1, 0, 0}, {1, -2, 1, 0}, {1, -3, 3, -1}}};

constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

using Integers = std::vector<std::array<std::int64_t, 3>>;

// What is known of integer `k` of node (i, j) from those west and north of it: as if its differences of third order
// were 0, of lower order near the west and the north side.
std::int64_t foretold(const Integers& q, int columns, int i, int j, std::size_t k) {
    const auto &across = kDifference[static_cast<std::size_t>(std::min(i, kOrder))],
               &down = kDifference[static_cast<std::size_t>(std::min(j, kOrder))];
    std::int64_t sum = 0;
    for (int b = 0; b <= std::min(j, kOrder); ++b)
        for (int a = 0; a <= std::min(i, kOrder); ++a)
            if (a + b > 0)
                sum -= across[static_cast<std::size_t>(a)] * down[static_cast<std::size_t>(b)] *
                       q[static_cast<std::size_t>((j - b) * columns + i - a)][k];
    return sum;
}

void put_varint(std::vector<std::uint8_t>& out, std::int64_t value) {
    std::uint64_t zigzag = static_cast<std::uint64_t>(value) << 1 ^ static_cast<std::uint64_t>(value >> 63);
    for (; zigzag >= 128; zigzag >>= 7) out.push_back(static_cast<std::uint8_t>(zigzag | 128));
    out.push_back(static_cast<std::uint8_t>(zigzag));
}

// At most seven bytes; none where they end too early.
std::optional<std::int64_t> take_varint(const std::vector<std::uint8_t>& in, std::size_t& at) {
    std::uint64_t zigzag = 0;
    for (int shift = 0; shift < 49; shift += 7) {
        if (at == in.size()) return std::nullopt;
        const std::uint8_t byte = in[at++];
        zigzag |= static_cast<std::uint64_t>(byte & 127) << shift;
        if (byte >= 128) continue;
        return static_cast<std::int64_t>(zigzag >> 1) ^ -static_cast<std::int64_t>(zigzag & 1);
    }
    return std::nullopt;
}

// Three bytes are four characters; what is left over, two or three characters without padding.
std::string to_base64(const std::vector<std::uint8_t>& bytes) {
    std::string text;
    for (std::size_t at = 0; at < bytes.size(); at += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - at);
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < count ? bytes[at + k] : 0u);
        for (std::size_t k = 0; k <= count; ++k) text += kAlphabet[word >> (18 - 6 * k) & 63];
    }
    return text;
}

std::optional<std::vector<std::uint8_t>> from_base64(const std::string& text) {
    std::vector<std::uint8_t> bytes;
    std::uint32_t word = 0;
    int bits = 0;
    for (const char c : text) {
        const std::size_t digit = kAlphabet.find(c);
        if (digit == std::string_view::npos) return std::nullopt;
        word = (word << 6 | static_cast<std::uint32_t>(digit)) & 0xFFFFFF;
        bits += 6;
        if (bits < 8) continue;
        bits -= 8;
        bytes.push_back(static_cast<std::uint8_t>(word >> bits));
    }
    if (bits == 6 || (word & ((1u << bits) - 1)) != 0) return std::nullopt;
    return bytes;
}

}  // namespace

std::string normals_to_text(const GeoGrid& grid) {
    Integers q;
    for (const Vector& n : grid.normals)
        q.push_back({std::llround(n[0] * kOne), std::llround(n[1] * kOne), std::llround(n[2] * kOne)});
    std::vector<std::uint8_t> bytes;
    for (int j = 0; j < grid.rows; ++j)
        for (int i = 0; i < grid.columns; ++i)
            for (std::size_t k = 0; k < 3; ++k)
                put_varint(bytes,
                           q[static_cast<std::size_t>(j * grid.columns + i)][k] - foretold(q, grid.columns, i, j, k));
    return to_base64(bytes);
}

Result<std::vector<std::array<double, 3>>> normals_from_text(const std::string& text, int columns, int rows) {
    const auto bad = [](const char* what) {
        return Error{ErrorCode::store, fmt::format("geo_grid: normals {}", what)};
    };
    if (columns < 2 || columns > GeoGrid::kMostNodes || rows < 2 || rows > GeoGrid::kMostNodes)
        return bad("of a grid of another size than 2..65 nodes a side");
    const auto nodes = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    if (text.size() > nodes * 3 * 10) return bad("that are too long");
    const auto bytes = from_base64(text);
    if (!bytes) return bad("that are not base64");
    Integers q(nodes);
    std::vector<Vector> normals;
    std::size_t at = 0;
    for (std::size_t node = 0; node < nodes; ++node) {
        for (std::size_t k = 0; k < 3; ++k) {
            const auto residual = take_varint(*bytes, at);
            if (!residual) return bad("that end too early");
            const int i = static_cast<int>(node) % columns, j = static_cast<int>(node) / columns;
            // Of numbers below 2^33, 63 of them with signs, and one below 2^48: no overflow.
            q[node][k] = *residual + foretold(q, columns, i, j, k);
            if (std::abs(q[node][k]) > kMostInteger) return bad("that are not of length 1");
        }
        normals.push_back({static_cast<double>(q[node][0]) / kOne, static_cast<double>(q[node][1]) / kOne,
                           static_cast<double>(q[node][2]) / kOne});
    }
    if (at != bytes->size()) return bad("with something behind them");
    return normals;
}

}  // namespace scree
