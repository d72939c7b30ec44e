// Heights along a straight line, as CSV on standard output:
//     height_profile STORE X1 Y1 X2 Y2 SAMPLES
// Coordinates are metres in the store's CRS. Where there is no terrain the height is left out.
#include <scree/common/query/ground.h>
#include <scree/common/store/sqlite_store.h>

#include <charconv>
#include <cstdio>
#include <cstring>
#include <optional>

namespace {

std::optional<double> number(const char* text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text, text + std::strlen(text), value);
    return error == std::errc{} && *end == '\0' ? std::optional(value) : std::nullopt;
}

int fail(const scree::Error& error) {
    std::fprintf(stderr, "height_profile: %s\n", error.message.c_str());
    return static_cast<int>(error.code);
}

struct Line {
    double x1, y1, x2, y2;
    int samples;
};

int print_profile(const char* path, const Line& line) {
    auto store = scree::SqliteStore::open(path);
    if (!store) return fail(store.error());
    auto ground = scree::Ground::open(**store);  // remembers the tiles it read last; for one thread
    if (!ground) return fail(ground.error());
    std::printf("x_m,y_m,height_m,error_bound_m\n");
    for (int k = 0; k < line.samples; ++k) {
        const double share = static_cast<double>(k) / (line.samples - 1);
        const double x_m = line.x1 + share * (line.x2 - line.x1), y_m = line.y1 + share * (line.y2 - line.y1);
        const auto height = (*ground)->height(x_m, y_m);
        if (!height) return fail(height.error());  // a damaged store
        if (*height)
            std::printf("%.3f,%.3f,%.3f,%.3g\n", x_m, y_m, (*height)->height_m, (*height)->error_bound_m);
        else
            std::printf("%.3f,%.3f,,\n", x_m, y_m);
    }
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    std::optional<double> numbers[5];
    for (int k = 0; k < 5 && argc == 7; ++k) numbers[k] = number(argv[k + 2]);
    for (const auto& n : numbers)
        if (!n) return std::fprintf(stderr, "usage: height_profile STORE X1 Y1 X2 Y2 SAMPLES\n"), 2;
    if (!(*numbers[4] >= 2 && *numbers[4] <= 1e9)) return std::fprintf(stderr, "SAMPLES: 2 or more\n"), 2;
    return print_profile(argv[1], {*numbers[0], *numbers[1], *numbers[2], *numbers[3], static_cast<int>(*numbers[4])});
}
