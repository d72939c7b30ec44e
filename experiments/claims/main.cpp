// scree_claims: makes the figures of all claims, or of some, into a folder. Exit code 1 where a verdict is not as
// theory has it.
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "common/report.h"
#include "experiments/claims/claims.h"
#include "experiments/program.h"

namespace {

struct Options {
    std::string store, out = "claims";
    std::uint64_t seed = 1;
    bool quick = false;
    std::vector<std::string> only;
};

scree::Result<scree::Terrain> terrain_of(const Options& o) {
    if (!o.store.empty()) return scree::terrain_of_store(o.store, scree::kLeastTerrainSide);
    return scree::ridged_terrain(660, o.seed);
}

void say(const scree::Figure& figure) {
    fmt::print("{:4} {}  {}\n", figure.id, figure.confirmed() ? "confirmed" : "NOT SO   ", figure.title);
    for (const scree::FigureCheck& check : figure.checks)
        fmt::print("     {} {}: {:.6g} ({} {:g})\n", check.holds() ? ' ' : '!', check.what, check.measured,
                   check.is == scree::FigureCheck::Is::at_least ? "at least" : "at most", check.limit);
}

int run(const Options& o) {
    for (const std::string& id : o.only) {
        const auto& all = scree::all_claims();
        if (std::none_of(all.begin(), all.end(), [&](const auto& claim) { return claim.id == id; }))
            return scree::report_error("scree_claims", {scree::ErrorCode::usage, fmt::format("{} is no claim", id)});
    }
    const auto terrain = terrain_of(o);
    if (!terrain) return scree::report_error("scree_claims", terrain.error());
    const scree::ClaimBench bench{*terrain, o.seed, o.quick};
    std::vector<scree::Figure> figures;
    for (const scree::NamedClaim& claim : scree::all_claims()) {
        if (!o.only.empty() && std::find(o.only.begin(), o.only.end(), claim.id) == o.only.end()) continue;
        figures.push_back(claim.make(bench));
        say(figures.back());
    }
    if (auto ok = scree::write_figures(figures, o.out); !ok) return scree::report_error("scree_claims", ok.error());
    const bool all = std::all_of(figures.begin(), figures.end(), [](const scree::Figure& f) { return f.confirmed(); });
    return all ? 0 : static_cast<int>(scree::ErrorCode::check_failed);
}

int main_of(int argc, char** argv) {
    Options o;
    CLI::App app{"The claims of the papers that fail, as figures: CSV and SVG a claim, and claims.json.",
                 "scree_claims"};
    app.add_option("--store", o.store, "Heights: a Scree store (default: made up, ridged)");
    app.add_option("--out", o.out, "Folder for the figures")->capture_default_str();
    app.add_option("--seed", o.seed, "Of all that is drawn at random")->capture_default_str();
    app.add_flag("--quick", o.quick, "A twentieth of the samples");
    app.add_option("--claim", o.only, "Only these: C2, C3, ...");
    if (const int code = scree::parse_words(app, argc, argv); code >= 0) return code;
    return run(o);
}

}  // namespace

int main(int argc, char** argv) { return scree::run_program("scree_claims", argc, argv, main_of); }
