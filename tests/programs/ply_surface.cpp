#include "tests/programs/ply_surface.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>

namespace scree::test {
namespace {

using Point = std::array<double, 3>;

constexpr double kRounding = 1e-9;  // of barycentric weights: a point on a shared edge belongs to both triangles

// Twice the signed area of (a, b, p) in plan: positive where p lies to the left of a to b.
double side(const Point& a, const Point& b, double x, double y) {
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
}

std::size_t count_after(const std::string& header, const std::string& words) {
    const std::size_t at = header.find(words);
    if (at == std::string::npos) throw std::runtime_error("PLY: no '" + words + "'");
    return std::stoull(header.substr(at + words.size()));
}

const char kLayout[] = "property double x\nproperty double y\nproperty double z\n";
const char kFaces[] = "property list uchar int vertex_indices\n";
const char kEnd[] = "end_header\n";

}  // namespace

PlyMesh read_ply(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    const std::size_t end = bytes.find(kEnd);
    if (end == std::string::npos) throw std::runtime_error(path + ": not a PLY");
    const std::string header = bytes.substr(0, end);
    for (const char* needed : {"ply\nformat binary_little_endian 1.0\n", kLayout, kFaces})
        if (header.find(needed) == std::string::npos)
            throw std::runtime_error(path + ": another layout of PLY: no '" + needed + "'");
    const std::size_t vertices = count_after(header, "element vertex "), faces = count_after(header, "element face ");
    const char* at = bytes.data() + end + std::strlen(kEnd);
    const auto left = static_cast<std::size_t>(bytes.data() + bytes.size() - at);
    if (vertices > left / 24 || faces > left / 13 || left != vertices * 24 + faces * 13)
        throw std::runtime_error(path + ": " + std::to_string(left) + " bytes do not hold what the header says");
    PlyMesh mesh;
    mesh.vertices.resize(vertices);
    for (Point& v : mesh.vertices) {
        std::memcpy(v.data(), at, 24);
        at += 24;
        if (!std::isfinite(v[0]) || !std::isfinite(v[1]) || !std::isfinite(v[2]))
            throw std::runtime_error(path + ": a vertex that is not finite");
    }
    mesh.triangles.resize(faces);
    for (auto& t : mesh.triangles) {
        if (*at != 3) throw std::runtime_error(path + ": a face that is no triangle");
        std::memcpy(t.data(), at + 1, 12);
        at += 13;
        for (const std::int32_t v : t)
            if (v < 0 || static_cast<std::size_t>(v) >= vertices)
                throw std::runtime_error(path + ": a face with a vertex that does not exist");
    }
    return mesh;
}

void write_ply(const std::string& path, const PlyMesh& mesh) {
    std::ofstream out(path, std::ios::binary);
    out << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices.size() << '\n'
        << kLayout << "element face " << mesh.triangles.size() << '\n'
        << kFaces << kEnd;
    for (const Point& v : mesh.vertices) out.write(reinterpret_cast<const char*>(v.data()), 24);
    for (const auto& t : mesh.triangles) {
        out.put(3);
        out.write(reinterpret_cast<const char*>(t.data()), 12);
    }
}

PlySurface::PlySurface(PlyMesh mesh) : mesh_(std::move(mesh)) {
    if (mesh_.vertices.empty()) {
        first_.assign(2, 0);
        return;
    }
    double east = mesh_.vertices[0][0], north = mesh_.vertices[0][1];
    west_ = east;
    south_ = north;
    for (const Point& v : mesh_.vertices) {
        west_ = std::min(west_, v[0]);
        east = std::max(east, v[0]);
        south_ = std::min(south_, v[1]);
        north = std::max(north, v[1]);
    }
    // About one triangle a cell were they all alike; a large one among small ones lies in many cells.
    const double wide = std::max(east - west_, 1e-9), high = std::max(north - south_, 1e-9);
    cell_ = std::sqrt(wide * high / static_cast<double>(std::max<std::size_t>(mesh_.triangles.size(), 1)));
    cell_ = std::max({cell_, wide / 4096, high / 4096});
    columns_ = static_cast<std::int64_t>(wide / cell_) + 1;
    rows_ = static_cast<std::int64_t>(high / cell_) + 1;
    const auto each_cell = [&](auto&& visit) {
        for (std::size_t k = 0; k < mesh_.triangles.size(); ++k) {
            const auto& t = mesh_.triangles[k];
            const auto &a = mesh_.vertices[static_cast<std::size_t>(t[0])],
                       &b = mesh_.vertices[static_cast<std::size_t>(t[1])],
                       &c = mesh_.vertices[static_cast<std::size_t>(t[2])];
            const auto [x0, x1] = std::minmax({a[0], b[0], c[0]});
            const auto [y0, y1] = std::minmax({a[1], b[1], c[1]});
            for (std::int64_t row = row_of(y0); row <= row_of(y1); ++row)
                for (std::int64_t column = column_of(x0); column <= column_of(x1); ++column)
                    visit(static_cast<std::size_t>(row * columns_ + column), static_cast<std::int32_t>(k));
        }
    };
    first_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
    each_cell([&](std::size_t cell, std::int32_t) { ++first_[cell + 1]; });
    for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
    members_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    each_cell([&](std::size_t cell, std::int32_t triangle) { members_[next[cell]++] = triangle; });
}

std::int64_t PlySurface::column_of(double x) const {
    return std::clamp<std::int64_t>(static_cast<std::int64_t>((x - west_) / cell_), 0, columns_ - 1);
}
std::int64_t PlySurface::row_of(double y) const {
    return std::clamp<std::int64_t>(static_cast<std::int64_t>((y - south_) / cell_), 0, rows_ - 1);
}

PlySurface::Heights PlySurface::over(double x, double y) const {
    Heights found;
    const double margin = cell_;  // far outside: no triangle, and no cast of what does not fit
    if (!(x >= west_ - margin && x <= west_ + cell_ * static_cast<double>(columns_ + 1) && y >= south_ - margin &&
          y <= south_ + cell_ * static_cast<double>(rows_ + 1)))
        return found;
    const auto cell = static_cast<std::size_t>(row_of(y) * columns_ + column_of(x));
    for (std::size_t k = first_[cell]; k < first_[cell + 1]; ++k) {
        const auto& t = mesh_.triangles[static_cast<std::size_t>(members_[k])];
        const auto &a = mesh_.vertices[static_cast<std::size_t>(t[0])],
                   &b = mesh_.vertices[static_cast<std::size_t>(t[1])],
                   &c = mesh_.vertices[static_cast<std::size_t>(t[2])];
        const double area = side(a, b, c[0], c[1]);
        if (area == 0) continue;
        const double u = side(b, c, x, y) / area, v = side(c, a, x, y) / area, w = side(a, b, x, y) / area;
        if (u < -kRounding || v < -kRounding || w < -kRounding) continue;
        const double z = u * a[2] + v * b[2] + w * c[2];
        found.lowest = found.count == 0 ? z : std::min(found.lowest, z);
        found.highest = found.count == 0 ? z : std::max(found.highest, z);
        ++found.count;
    }
    return found;
}

std::optional<double> PlySurface::height(double x, double y) const {
    const Heights found = over(x, y);
    return found.count > 0 ? std::optional(found.highest) : std::nullopt;
}

double PlySurface::spread(double x, double y) const {
    const Heights found = over(x, y);
    return found.highest - found.lowest;
}

PlySurface::Seams PlySurface::seams() const {
    // By position, not by index: two vertices at one place are one, and one place at two heights is a crack.
    struct Uses {
        int forward = 0, backward = 0;
    };
    std::map<std::pair<Point, Point>, Uses> uses;
    Seams seams;
    for (const auto& t : mesh_.triangles) {
        std::array<Point, 3> p;
        for (std::size_t k = 0; k < 3; ++k) p[k] = mesh_.vertices[static_cast<std::size_t>(t[k])];
        if (!(side(p[0], p[1], p[2][0], p[2][1]) > 0)) ++seams.upside_down;
        for (std::size_t k = 0; k < 3; ++k) {
            const Point &a = p[k], &b = p[(k + 1) % 3];
            a < b ? ++uses[{a, b}].forward : ++uses[{b, a}].backward;
        }
    }
    seams.edges = static_cast<std::int64_t>(uses.size());
    std::vector<Point> open_ends;
    std::vector<std::pair<Point, Point>> open;
    for (const auto& [edge, use] : uses) {
        if (use.forward == 1 && use.backward == 1) continue;
        open.push_back(edge);
        open_ends.push_back(edge.first);
        open_ends.push_back(edge.second);
        // A thousandth of its length to either side of its middle lies terrain, or nothing.
        const auto& [a, b] = edge;
        const double x = (a[0] + b[0]) / 2, y = (a[1] + b[1]) / 2;
        const double dx = (b[1] - a[1]) / 1000, dy = -(b[0] - a[0]) / 1000;
        if (over(x + dx, y + dy).count > 0 && over(x - dx, y - dy).count > 0) ++seams.cracks;
    }
    // Sorted by x as points are: only ends between an edge's own can lie inside it.
    std::sort(open_ends.begin(), open_ends.end());
    open_ends.erase(std::unique(open_ends.begin(), open_ends.end()), open_ends.end());
    for (const auto& [a, b] : open) {
        const double length2 = (b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]);
        const double tolerance = kRounding * std::max(1.0, std::sqrt(length2));
        auto from = std::lower_bound(open_ends.begin(), open_ends.end(), Point{a[0] - tolerance, -INFINITY, 0});
        for (; from != open_ends.end() && (*from)[0] <= b[0] + tolerance; ++from) {
            const double along = ((*from)[0] - a[0]) * (b[0] - a[0]) + ((*from)[1] - a[1]) * (b[1] - a[1]);
            if (along <= tolerance || along >= length2 - tolerance) continue;
            if (std::abs(side(a, b, (*from)[0], (*from)[1])) > tolerance * std::sqrt(length2)) continue;
            ++seams.t_junctions;
            break;
        }
    }
    seams.open_edges = static_cast<std::int64_t>(open.size());
    return seams;
}

}  // namespace scree::test
