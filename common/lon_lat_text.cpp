#include "common/lon_lat_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

constexpr double kDegree_m = 111319.49;  // WGS 84, along the equator
constexpr int kMostDigits = 7;           // a centimetre

int digits_for(double certain_m) {
    if (!(certain_m > 0)) return kMostDigits;
    const double digits = std::ceil(std::log10(kDegree_m / certain_m));
    return static_cast<int>(std::clamp(digits, 0.0, static_cast<double>(kMostDigits)));
}

std::string side_text(double degrees, int digits, const char* letters) {
    const std::string number = fmt::format("{:.{}f}", std::abs(degrees), digits);
    const bool neither = number.find_first_of("123456789") == std::string::npos || number.rfind("180", 0) == 0;
    return neither ? number : fmt::format("{} {}", number, letters[degrees < 0 ? 1 : 0]);
}

}  // namespace

std::string lon_lat_text(const LonLat& at, double certain_m) {
    const int digits = digits_for(certain_m);
    return side_text(at.longitude_deg, digits, "EW") + " " + side_text(at.latitude_deg, digits, "NS");
}

}  // namespace scree
