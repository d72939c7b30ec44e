#include "tools/cli/height_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/cli/arguments.h"
#include "common/query/ground.h"
#include "common/report.h"
#include "common/store/sqlite_store.h"

namespace scree {
namespace {

struct Point {
    double x_m = 0, y_m = 0;
};

// What was asked for: coordinates of either kind, and where they are.
struct Question {
    std::array<double, 2> asked{};
    std::optional<Point> at;  // none: beyond what the store knows
};

struct Questions {
    std::vector<Question> points;
    bool lon_lat = false;  // asked for by longitude and latitude
    bool has_ray = false;
    Vector3 ray_origin, ray_direction;
};

struct Answers {
    std::vector<std::optional<HeightAt>> heights;  // of the points
    std::optional<RayHit> hit;
};

// A finite number that begins at `from` (a plus sign and blanks may stand before it); the rest of the text, or nullopt.
std::optional<std::string_view> take_number(std::string_view from, double& value) {
    from.remove_prefix(std::min(from.find_first_not_of(" \t"), from.size()));
    if (from.size() > 1 && from[0] == '+' && from[1] != '-') from.remove_prefix(1);
    const auto [end, error] = std::from_chars(from.data(), from.data() + from.size(), value);
    if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
    return from.substr(static_cast<std::size_t>(end - from.data()));
}

bool only_blanks(std::string_view text) { return text.find_first_not_of(" \t\r") == std::string_view::npos; }

Result<std::vector<double>> parse_numbers(const std::vector<std::string>& words) {
    std::vector<double> numbers;
    for (const std::string& word : words) {
        double value = 0;
        const auto rest = take_number(word, value);
        if (!rest || !rest->empty()) return Error{ErrorCode::usage, fmt::format("'{}' is not a finite number", word)};
        numbers.push_back(value);
    }
    return numbers;
}

std::optional<std::array<double, 2>> parse_line(std::string_view line) {
    std::array<double, 2> point{};
    const auto after_x = take_number(line, point[0]);
    if (!after_x) return std::nullopt;
    const std::size_t comma = after_x->find_first_not_of(" \t");
    if (comma == std::string_view::npos || (*after_x)[comma] != ',') return std::nullopt;
    const auto after_y = take_number(after_x->substr(comma + 1), point[1]);
    if (!after_y || !only_blanks(*after_y)) return std::nullopt;
    return point;
}

// x,y a line (or lon,lat); a first line that says so, and empty ones, are passed over.
Result<void> read_points(std::istream& in, const std::string& name, Questions& out) {
    const std::string head = out.lon_lat ? "lon,lat" : "x,y";
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        if (only_blanks(line) || (number == 1 && line.substr(0, line.find('\r')) == head)) continue;
        const auto point = parse_line(line);
        if (!point)
            return Error{ErrorCode::input,
                         fmt::format("{}: line {}: '{}' is not two finite numbers {}", name, number, line, head)};
        out.points.push_back({*point, {}});
    }
    if (in.bad()) return Error{ErrorCode::input, fmt::format("{}: cannot be read", name)};
    return {};
}

Result<void> read_file(const std::string& file, Questions& out) {
    if (file == "-") return read_points(std::cin, "standard input", out);
    std::ifstream in(file);
    if (!in) return Error{ErrorCode::input, fmt::format("{}: cannot be read", file)};
    return read_points(in, file, out);
}

Result<Questions> questions_of(const std::vector<std::string>& coordinates, const std::string& file,
                               const std::vector<std::string>& ray, bool lon_lat) {
    Questions out;
    out.lon_lat = lon_lat;
    const auto numbers = parse_numbers(coordinates);
    if (!numbers) return numbers.error();
    if (numbers->size() % 2 != 0)
        return Error{ErrorCode::usage,
                     fmt::format("{} numbers are no pairs {}", numbers->size(), lon_lat ? "LON LAT" : "X Y")};
    for (std::size_t k = 0; k < numbers->size(); k += 2) out.points.push_back({{(*numbers)[k], (*numbers)[k + 1]}, {}});
    const auto six = parse_numbers(ray);
    if (!six) return six.error();
    out.has_ray = !six->empty();
    if (out.has_ray) {
        out.ray_origin = {(*six)[0], (*six)[1], (*six)[2]};
        out.ray_direction = {(*six)[3], (*six)[4], (*six)[5]};
    }
    if (out.points.empty() && file.empty() && !out.has_ray)
        return Error{ErrorCode::usage, "no point: X Y, --file or --ray is needed"};
    if (!file.empty())
        if (auto ok = read_file(file, out); !ok) return ok.error();
    return out;
}

// Where the questions are. Errors: ErrorCode::input where the store cannot say, ErrorCode::usage for no latitude.
Result<void> find_places(const Dataset& d, const std::string& store, Questions& questions) {
    for (Question& q : questions.points) {
        const auto [first, second] = q.asked;
        if (!questions.lon_lat) {
            q.at = Point{first, second};
            continue;
        }
        if (!d.geo_grid)
            return Error{ErrorCode::input,
                         fmt::format("{}: knows no longitudes and latitudes: {}", store,
                                     d.crs.empty() ? "its coordinate system is unknown"
                                                   : "it was made before stores had them; its next update adds them")};
        if (!(std::abs(second) <= 90))
            return Error{ErrorCode::usage, fmt::format("{} is no latitude: LON LAT are degrees", second)};
        if (const auto place = d.geo_grid->place({first, second})) q.at = Point{(*place)[0], (*place)[1]};
    }
    return {};
}

Result<Answers> answer(Ground& ground, const Questions& questions) {
    Answers out;
    if (questions.has_ray) {
        const auto hit =
            ground.cast_ray(questions.ray_origin, questions.ray_direction, std::numeric_limits<double>::infinity());
        if (!hit) return hit.error();
        out.hit = *hit;
    }
    for (const Question& q : questions.points) {
        if (!q.at) {
            out.heights.emplace_back();
            continue;
        }
        const auto height = ground.height(q.at->x_m, q.at->y_m);
        if (!height) return height.error();
        out.heights.push_back(*height);
    }
    return out;
}

void print(const Questions& questions, const Answers& answers) {
    for (std::size_t k = 0; k < questions.points.size(); ++k) {
        const auto& [first, second] = questions.points[k].asked;
        if (const auto& height = answers.heights[k])
            fmt::print("{} {} {} {}\n", first, second, height->height_m, height->error_bound_m);
        else
            fmt::print("{} {} absent\n", first, second);
    }
    if (!questions.has_ray) return;
    if (const auto& hit = answers.hit)
        fmt::print("ray {} {} {} {} {}\n", hit->position.x, hit->position.y, hit->position.z, hit->error_bound_m,
                   hit->distance_m);
    else
        fmt::print("ray absent\n");
}

std::string to_json(const Dataset& d, const Questions& questions, const Answers& answers) {
    using Json = nlohmann::ordered_json;
    Json points = Json::array();
    for (std::size_t k = 0; k < questions.points.size(); ++k) {
        const auto& height = answers.heights[k];
        const Question& q = questions.points[k];
        Json point = Json::object();
        if (questions.lon_lat) point.update({{"longitude_deg", q.asked[0]}, {"latitude_deg", q.asked[1]}});
        if (q.at) point.update({{"x_m", q.at->x_m}, {"y_m", q.at->y_m}});
        point["present"] = height.has_value();
        if (height) point.update({{"height_m", height->height_m}, {"error_bound_m", height->error_bound_m}});
        points.push_back(std::move(point));
    }
    Json out = {
        {"points", points}, {"height_quantum_error_m", d.height_quantum_error_m}, {"warp_error_m", d.warp_error_m}};
    if (questions.has_ray) {
        Json& ray = out["ray"];
        ray["hit"] = answers.hit.has_value();
        if (const auto& hit = answers.hit)
            ray.update({{"position_m", {hit->position.x, hit->position.y, hit->position.z}},
                        {"error_bound_m", hit->error_bound_m},
                        {"distance_m", hit->distance_m}});
    }
    return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

// CLI11 takes "-5" for a value and "-.5" for an option: written out, both are values.
void write_out_leading_zeros(int argc, char** argv, std::vector<std::string>& texts, std::vector<char*>& arguments) {
    texts.assign(argv, argv + argc);
    for (std::string& text : texts)
        if (text.size() > 2 && text[0] == '-' && text[1] == '.' && text[2] >= '0' && text[2] <= '9')
            text.insert(1, "0");
    for (std::string& text : texts) arguments.push_back(text.data());
}

}  // namespace

int run_height(int argc, char** argv) {
    CLI::App app{
        "Says how high the terrain is at points, and where a ray meets it: the finest stored surface, with the bound "
        "of its error.\nA line a point: X Y HEIGHT BOUND, or X Y absent (with --lonlat LON LAT in their place); then "
        "of a ray: ray X Y Z BOUND DISTANCE, "
        "or ray absent.",
        "scree height"};
    std::string path, file, json;
    std::vector<std::string> coordinates, ray;
    bool lon_lat = false;
    app.add_option("STORE", path, "A .scree file")->required();
    app.add_option("X Y", coordinates, "Points in metres in the store's CRS")->expected(-1);
    app.add_flag("--lonlat", lon_lat,
                 "Points are longitude and latitude, WGS 84 degrees: LON LAT, lon,lat in the file");
    app.add_option("--file", file, "More points, x,y a line; - is standard input")->type_name("CSV|-");
    app.add_option("--ray", ray, "Also the first point of the terrain on the ray from X Y Z along DX DY DZ")
        ->expected(6)
        ->allow_extra_args(false)
        ->type_name("NUMBER");
    add_json_option(app, json);
    std::vector<std::string> texts;
    std::vector<char*> arguments;
    write_out_leading_zeros(argc, argv, texts, arguments);
    if (const int code = parse_arguments(app, argc, arguments.data()); code >= 0) return code;
    auto questions = questions_of(coordinates, file, ray, lon_lat);
    if (!questions) return report_error("scree height", questions.error());
    auto store = SqliteStore::open(path);
    if (!store) return report_error("scree height", store.error());
    if (auto ok = find_places((*store)->dataset(), path, *questions); !ok)
        return report_error("scree height", ok.error());
    auto ground = Ground::open(**store);
    if (!ground) return report_error("scree height", ground.error());
    const auto answers = answer(**ground, *questions);
    if (!answers) return report_error("scree height", answers.error());
    if (json != "-") print(*questions, *answers);
    if (json.empty()) return 0;
    if (auto ok = write_text(json, to_json((*store)->dataset(), *questions, *answers)); !ok)
        return report_error("scree height", ok.error());
    return 0;
}

}  // namespace scree
