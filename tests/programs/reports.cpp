#include "tests/programs/reports.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

namespace scree::test {
namespace {

void expect_finite(const nlohmann::json& value, const std::string& where) {
    EXPECT_FALSE(value.is_null()) << where << " is null: a number that is not finite";
    EXPECT_TRUE(!value.is_number_float() || std::isfinite(value.get<double>())) << where;
    if (value.is_structured())
        for (const auto& [key, inner] : value.items()) expect_finite(inner, where + "/" + key);
}

}  // namespace

nlohmann::json report_of(const ProgramRun& run) {
    EXPECT_EQ(run.exit_code, 0) << describe(run);
    nlohmann::json report = nlohmann::json::parse(run.out, nullptr, false);
    EXPECT_FALSE(report.is_discarded()) << "not only JSON on stdout\n" << describe(run);
    if (report.is_discarded()) return nlohmann::json::object();
    expect_finite(report, "");
    return report;
}

void expect_keys(const nlohmann::json& report, const std::vector<std::string>& keys) {
    for (const std::string& key : keys)
        EXPECT_TRUE(report.contains(key)) << key << " is missing from " << report.dump();
}

nlohmann::json build_store_from(const std::vector<std::string>& inputs, const std::string& store) {
    std::vector<std::string> arguments{"build"};
    arguments.insert(arguments.end(), inputs.begin(), inputs.end());
    arguments.insert(arguments.end(), {"-o", store, "--quiet", "--json", "-"});
    const nlohmann::json report = report_of(scree(arguments));
    expect_keys(report, {"seconds", "cpu_seconds", "peak_rss_bytes", "source_megapixels", "height_tiles",
                         "texture_tiles", "store_bytes"});
    return report;
}

nlohmann::json expect_sound_store(const std::string& store, const std::vector<double>& taus,
                                  const std::vector<std::string>& budgets) {
    const nlohmann::json info = report_of(scree({"info", store, "--digest", "--json", "-"}));
    expect_keys(info, {"format_version", "crs", "vertical_datum", "origin_m", "spacing_m", "levels", "texture_levels",
                       "roots", "tile_size", "texture_size", "height_quantum_m", "height_quantum_error_m",
                       "height_range_m", "height_tiles", "texture_tiles", "bytes", "digest"});
    EXPECT_EQ(info.value("digest", "").size(), 64u);

    const nlohmann::json verified = report_of(scree({"verify", store, "--quiet", "--json", "-"}));
    expect_keys(verified, {"tiles_checked", "shared_samples_compared", "shared_samples_differing", "bounds_checked",
                           "bound_violations", "lon_lat_note", "problems"});
    EXPECT_EQ(verified.value("tiles_checked", -1), info.value("height_tiles", 0) + info.value("texture_tiles", 0));
    EXPECT_EQ(verified.value("shared_samples_differing", -1), 0);
    EXPECT_EQ(verified.value("bound_violations", -1), 0);

    for (const double tau : taus) {
        SCOPED_TRACE("tau " + std::to_string(tau));
        const nlohmann::json audit = report_of(scree_view(
            {"audit", store, "--tau", std::to_string(tau), "--frames", "6", "--size", "640x480", "--json", "-"}));
        expect_keys(audit, {"frames", "tau_px", "max_error_px", "p99_error_px", "mean_error_px", "max_bound_px",
                            "open_edges", "t_junctions", "samples"});
        EXPECT_EQ(audit.value("frames", 0), 6);
        EXPECT_EQ(audit.value("tau_px", -1.0), tau);
        EXPECT_LE(audit.value("max_error_px", 1e9), tau + 1e-3);
        EXPECT_EQ(audit.value("open_edges", -1), 0);
        EXPECT_EQ(audit.value("t_junctions", -1), 0);
        EXPECT_GT(audit.value("samples", 0), 0);
    }
    for (const std::string& budget : budgets) {
        SCOPED_TRACE("budget " + budget);
        const nlohmann::json flight = report_of(scree_view(
            {"fly", store, "--headless", "--frames", "8", "--size", "160x120", "--budget", budget, "--json", "-"}));
        expect_keys(flight, {"frames", "frame_ms", "select_ms", "triangles", "tiles_drawn", "budget_bytes",
                             "peak_resident_bytes", "peak_rss_bytes", "tiles_paged_in", "tiles_paged_out", "bytes_read",
                             "frames_with_stand_ins", "holes", "max_bound_px"});
        for (const char* spread : {"frame_ms", "select_ms"})
            if (flight.contains(spread)) expect_keys(flight[spread], {"median", "p99", "max"});
        for (const char* spread : {"triangles", "tiles_drawn"})
            if (flight.contains(spread)) expect_keys(flight[spread], {"mean", "max"});
        EXPECT_EQ(flight.value("frames", 0), 8);
        EXPECT_EQ(flight.value("holes", -1), 0);
        EXPECT_GT(flight.value("peak_resident_bytes", std::int64_t{0}), 0);
        EXPECT_LE(flight.value("peak_resident_bytes", std::int64_t{1} << 60),
                  flight.value("budget_bytes", std::int64_t{0}));
    }
    return info;
}

std::string digest_of(const std::string& store) {
    return report_of(scree({"info", store, "--digest", "--json", "-"})).value("digest", "none");
}

void expect_only(const std::string& folder, const std::vector<std::string>& names) {
    std::set<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        found.insert(entry.path().filename().string());
    EXPECT_EQ(found, std::set<std::string>(names.begin(), names.end()));
}

void expect_at_most_partial(const std::string& store, const std::vector<std::string>& others) {
    const std::filesystem::path path = store;
    const std::string partial = path.filename().string() + ".partial";
    std::set<std::string> allowed(others.begin(), others.end());
    allowed.insert({partial, partial + "-journal"});
    for (const auto& entry : std::filesystem::directory_iterator(path.parent_path()))
        EXPECT_EQ(allowed.count(entry.path().filename().string()), 1u) << entry.path() << " was left";
}

}  // namespace scree::test
