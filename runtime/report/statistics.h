// Order statistics of a measured series.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <vector>

namespace scree {

struct Series {
    std::vector<double> values;

    void add(double v) { values.push_back(v); }
    double max() const { return values.empty() ? 0 : *std::max_element(values.begin(), values.end()); }
    double mean() const {
        double sum = 0;
        for (const double v : values) sum += v;
        return values.empty() ? 0 : sum / static_cast<double>(values.size());
    }
    double quantile(double q) const {
        if (values.empty()) return 0;
        std::vector<double> sorted = values;
        std::sort(sorted.begin(), sorted.end());
        const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size())));
        return sorted[std::clamp<std::size_t>(rank, 1, sorted.size()) - 1];
    }
    nlohmann::ordered_json spread() const {
        return {{"median", quantile(0.5)}, {"p99", quantile(0.99)}, {"max", max()}};
    }
    nlohmann::ordered_json mean_max() const { return {{"mean", mean()}, {"max", max()}}; }
};

}  // namespace scree
