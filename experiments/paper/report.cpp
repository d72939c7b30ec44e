#include "experiments/paper/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/report.h"
#include "experiments/paper/references.h"
#include "runtime/report/plot.h"

namespace scree::paper {
namespace {

struct Column {
    const char* name;
    std::string (*value)(const Row&);
};

std::string number(double value) { return fmt::format("{:.6g}", value); }
double share(std::int64_t part, std::int64_t whole) {
    return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

// A vertex that a cache left out though its own test fails, over those selected without a cache.
double missing_share(const SelectionTruth& s) { return share(s.failing_missing, s.wanted); }

const std::vector<Column>& columns() {
    static const std::vector<Column> kColumns{
        {"flight", [](const Row& r) { return r.flight; }},
        {"step_m", [](const Row& r) { return number(r.step_m); }},
        {"metric", [](const Row& r) { return name_of(r.rules.metric); }},
        {"dikes", [](const Row& r) { return std::string(r.dike_aware ? "aware" : "blind"); }},
        {"floor", [](const Row& r) { return number(r.rules.floor); }},
        {"reuse", [](const Row& r) { return name_of(r.rules); }},
        {"tau_px", [](const Row& r) { return number(r.rules.tau_px); }},
        {"s_px", [](const Row& r) { return number(r.rules.s_px); }},
        {"triangles", [](const Row& r) { return number(std::round(r.figures.triangles)); }},
        {"dike_triangles", [](const Row& r) { return number(std::round(r.figures.dike_triangles)); }},
        {"blocks_in_view", [](const Row& r) { return number(r.figures.blocks_in_view); }},
        {"lod_ms", [](const Row& r) { return fmt::format("{:.4f}", r.figures.lod_ms); }},
        {"reused_share", [](const Row& r) { return number(r.figures.reused_share); }},
        {"regenerated", [](const Row& r) { return number(r.figures.regenerated); }},
        {"meshes_made", [](const Row& r) { return number(r.figures.meshes_made); }},
        {"strips_made", [](const Row& r) { return number(r.figures.strips_made); }},
        {"missing_share", [](const Row& r) { return number(missing_share(r.figures.selection)); }},
        {"missing_with_parents_share", [](const Row& r) { return number(r.figures.selection.missing_share()); }},
        {"worst_local_over_tau", [](const Row& r) { return number(r.figures.selection.worst_px / r.rules.tau_px); }},
        {"reused_lacking_share",
         [](const Row& r) { return number(share(r.figures.selection.blocks_lacking, r.figures.judged_reused)); }},
        {"reused_above_share",
         [](const Row& r) { return number(share(r.figures.selection.blocks_above, r.figures.judged_reused)); }},
        {"max_px", [](const Row& r) { return number(r.figures.truth.blocks.max_px()); }},
        {"p99_px", [](const Row& r) { return number(r.figures.truth.blocks.quantile_px(0.99)); }},
        {"mean_px", [](const Row& r) { return number(r.figures.truth.blocks.mean_px()); }},
        {"dike_max_px", [](const Row& r) { return number(r.figures.truth.dikes.max_px()); }},
        {"strips_above_share",
         [](const Row& r) { return number(share(r.figures.truth.strips_above, r.figures.truth.strips)); }},
        {"promise_px", [](const Row& r) { return r.is_guaranteed() ? number(r.promise_px()) : std::string(); }},
    };
    return kColumns;
}

std::vector<const Row*> of_table(const std::vector<Row>& rows, const std::string& table) {
    std::vector<const Row*> found;
    for (const Row& row : rows)
        if (row.table == table) found.push_back(&row);
    return found;
}

std::string csv(const std::vector<const Row*>& rows) {
    std::string text;
    for (const Column& c : columns()) text += fmt::format("{}{}", text.empty() ? "" : ",", c.name);
    text += '\n';
    for (const Row* row : rows) {
        bool first = true;
        for (const Column& c : columns()) {
            text += fmt::format("{}{}", first ? "" : ",", c.value(*row));
            first = false;
        }
        text += '\n';
    }
    return text;
}

// The CSV's columns, numbers as numbers.
nlohmann::ordered_json json_of(const Row& row) {
    nlohmann::ordered_json object{{"table", row.table}};
    for (const Column& c : columns()) {
        const std::string value = c.value(row);
        const bool is_number = !value.empty() && (std::isdigit(static_cast<unsigned char>(value[0])) != 0);
        if (is_number)
            object[c.name] = nlohmann::ordered_json::parse(value);
        else
            object[c.name] = value;
    }
    object["keeps_promise"] = row.keeps_promise();
    return object;
}

std::string json_text(const Subject& s, const std::vector<Row>& rows) {
    nlohmann::ordered_json report{{"name", s.name},
                                  {"columns", s.columns},
                                  {"rows", s.rows},
                                  {"dropped_columns", s.dropped_columns},
                                  {"dropped_rows", s.dropped_rows},
                                  {"spacing_m", s.spacing_m},
                                  {"complete_triangles", s.complete_triangles},
                                  {"frames", s.frames},
                                  {"runs", nlohmann::ordered_json::array()}};
    for (const Row& row : rows) report["runs"].push_back(json_of(row));
    return report.dump(2) + "\n";
}

// ---- the page ----

std::string grouped(double value) {
    const std::string digits = fmt::format("{:.0f}", value);
    std::string text;
    for (std::size_t k = 0; k < digits.size(); ++k) {
        if (k > 0 && (digits.size() - k) % 3 == 0) text += ',';
        text += digits[k];
    }
    return text;
}
std::string percent(double part) { return fmt::format("{:.1f}", 100 * part); }
std::string percent2(double part) { return fmt::format("{:.2f}", 100 * part); }
std::string or_dash(bool present, const std::string& text) { return present ? text : "-"; }

const CachingReference* reference_for(double tau_px, double s_px) {
    for (const CachingReference& r : kCachingReferences)
        if (r.tau_px == tau_px && r.s_px == s_px) return &r;
    return nullptr;
}

std::string promise_of(const Row& row) {
    if (!row.is_guaranteed()) return "none";
    return fmt::format("{} px, {}", number(row.promise_px()), row.keeps_promise() ? "kept" : "BROKEN");
}

// What a row of the caching tables has to stand beside.
struct Beside {
    explicit Beside(const Row& row)
        : cached(row.rules.reuse != ReuseTest::off),
          p1(row.rules.reuse == ReuseTest::paper),
          uc(row.rules.metric == BlockMetric::uc),
          reference(uc && (!cached || row.rules.s_px > 0) ? reference_for(row.rules.tau_px, row.rules.s_px) : nullptr) {
    }
    /// The prototype's figure for this row's test.
    std::string prototype(double CachingReference::*of_p1, double CachingReference::*of_exact) const {
        return cached && reference != nullptr ? number(reference->*(p1 ? of_p1 : of_exact)) : "-";
    }
    /// The paper has one test, and the prototype's triangles and times are those of that test.
    std::string same_test(double CachingReference::*value, std::string (*text)(double) = number) const {
        return reference != nullptr && (!cached || p1) ? text(reference->*value) : "-";
    }

    bool cached, p1, uc;
    const CachingReference* reference;
};

std::string caching_start(const Row& row) {
    return fmt::format("| {} | {} | {} | {} |", name_of(row.rules.metric), number(row.rules.tau_px),
                       row.rules.reuse != ReuseTest::off ? number(row.rules.s_px) : "-", name_of(row.rules));
}

// Tables 1 and 2.
std::string cost_lines(const std::vector<const Row*>& rows) {
    std::string text =
        "| metric | tau | s | cache | triangles | paper | prototype | LOD ms | paper | prototype | reused % | "
        "prototype "
        "|\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
    for (const Row* row : rows) {
        const Figures& f = row->figures;
        const Beside beside(*row);
        text += caching_start(*row);
        text += fmt::format(" {} | {} | {} | {:.3f} | {} | {} | {} | {} |\n", grouped(f.triangles),
                            beside.same_test(&CachingReference::paper_triangles, grouped),
                            beside.same_test(&CachingReference::triangles, grouped), f.lod_ms,
                            beside.same_test(&CachingReference::paper_ms), beside.same_test(&CachingReference::ms),
                            or_dash(beside.cached, percent(f.reused_share)),
                            beside.prototype(&CachingReference::reused_p1, &CachingReference::reused_t1));
    }
    return text;
}

// Table 3, and what it does not say.
std::string missing_lines(const std::vector<const Row*>& rows) {
    std::string text =
        "| metric | tau | s | cache | missing % | paper | prototype | worst vertex / tau | prototype | greatest error "
        "px: "
        "blocks | dikes | promise |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
    for (const Row* row : rows) {
        const Figures& f = row->figures;
        const Beside beside(*row);
        text += caching_start(*row);
        text += fmt::format(" {} | {} | {} | {} | {} | {:.2f} | {:.2f} | {} |\n",
                            or_dash(beside.cached && beside.uc, percent2(missing_share(f.selection))),
                            beside.cached ? beside.same_test(&CachingReference::paper_missing) : "-",
                            beside.prototype(&CachingReference::missing_p1, &CachingReference::missing_t1),
                            or_dash(beside.uc, fmt::format("{:.3f}", f.selection.worst_px / row->rules.tau_px)),
                            beside.prototype(&CachingReference::worst_p1, &CachingReference::worst_t1),
                            f.truth.blocks.max_px(), f.truth.dikes.max_px(), promise_of(*row));
    }
    return text;
}

std::string truth_lines(const std::vector<const Row*>& rows) {
    std::string text =
        "| metric | tau | triangles | prototype | blocks: max px | p99 | mean | prototype | dikes: max px | strips "
        "above "
        "tau % | promise |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
    for (const Row* row : rows) {
        const Figures& f = row->figures;
        const std::string metric = name_of(row->rules.metric);
        const auto reference =
            std::find_if(kTruthReferences.begin(), kTruthReferences.end(), [&](const TruthReference& t) {
                return !row->dike_aware && metric == t.metric && row->rules.tau_px == t.tau_px;
            });
        const bool known = reference != kTruthReferences.end();
        text +=
            fmt::format("| {}{} | {} | {} | {} | {:.2f} | {:.2f} | {:.3f} | {} | {:.2f} | {} | {} |\n", metric,
                        row->dike_aware ? ", dikes counted" : "", number(row->rules.tau_px), grouped(f.triangles),
                        or_dash(known, known ? grouped(reference->triangles) : ""), f.truth.blocks.max_px(),
                        f.truth.blocks.quantile_px(0.99), f.truth.blocks.mean_px(),
                        or_dash(known, known ? fmt::format("{:.2f} / {:.2f} / {:.3f}", reference->max_px,
                                                           reference->p99_px, reference->mean_px)
                                             : ""),
                        f.truth.dikes.max_px(), percent(share(f.truth.strips_above, f.truth.strips)), promise_of(*row));
    }
    return text;
}

std::string views_lines(const std::vector<const Row*>& rows) {
    std::string text =
        "| flight | metric | cache | reused % | worst vertex / tau | reused blocks with a failing vertex % | above tau "
        "+ s "
        "% | greatest error px: blocks | dikes |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
    for (const Row* row : rows) {
        const Figures& f = row->figures;
        const bool uc = row->rules.metric == BlockMetric::uc;
        text +=
            fmt::format("| {}, {} m a frame | {} | {} | {} | {} | {} | {} | {:.2f} | {:.2f} |\n", row->flight,
                        number(row->step_m), name_of(row->rules.metric), name_of(row->rules), percent(f.reused_share),
                        or_dash(uc, fmt::format("{:.2f}", f.selection.worst_px / row->rules.tau_px)),
                        or_dash(uc, percent(share(f.selection.blocks_lacking, f.judged_reused))),
                        or_dash(uc, percent(share(f.selection.blocks_above, f.judged_reused))), f.truth.blocks.max_px(),
                        f.truth.dikes.max_px());
    }
    return text;
}

std::string speed_lines(const std::vector<const Row*>& rows) {
    std::string text =
        "| m a frame | metric | cache | reused % | prototype | missing % | LOD ms |\n| --- | --- | --- | --- | --- | "
        "--- | "
        "--- |\n";
    for (const Row* row : rows) {
        const bool uc = row->rules.metric == BlockMetric::uc, p1 = row->rules.reuse == ReuseTest::paper;
        const auto reference = std::find_if(kSpeedReferences.begin(), kSpeedReferences.end(),
                                            [&](const SpeedReference& s) { return uc && s.step_m == row->step_m; });
        const bool known = reference != kSpeedReferences.end();
        text += fmt::format("| {} | {} | {} | {} | {} | {} | {:.3f} |\n", number(row->step_m),
                            name_of(row->rules.metric), name_of(row->rules), percent(row->figures.reused_share),
                            or_dash(known, known ? number(p1 ? reference->reused_p1 : reference->reused_t1) : ""),
                            or_dash(uc, percent2(missing_share(row->figures.selection))), row->figures.lod_ms);
    }
    return text;
}

std::string rigour_lines(const std::vector<const Row*>& rows) {
    std::string text =
        "| flight | floor c | triangles | reused % | regenerated a frame | LOD ms | greatest error px: blocks | dikes "
        "|\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- |\n";
    for (const Row* row : rows)
        text += fmt::format("| {} | {} | {} | {} | {:.2f} | {:.3f} | {:.2f} | {:.2f} |\n", row->flight,
                            number(row->rules.floor), grouped(row->figures.triangles),
                            percent(row->figures.reused_share), row->figures.regenerated, row->figures.lod_ms,
                            row->figures.truth.blocks.max_px(), row->figures.truth.dikes.max_px());
    return text;
}

std::string page(const Subject& s, const std::vector<Row>& rows) {
    const std::string file = "paper_" + s.name;
    std::string text = fmt::format(
        "## {}\n\n{} x {} samples at {} m, {} to {} m high; {} triangles complete. {} frames of 800 x 800 px, 40 "
        "degrees.\n",
        s.title, s.columns, s.rows, number(s.spacing_m), number(s.lowest_m), number(s.highest_m),
        grouped(static_cast<double>(s.complete_triangles)), s.frames);
    if (s.dropped_columns + s.dropped_rows > 0)
        text += fmt::format("Cropped to whole blocks: {} columns in the east and {} rows in the south are left out.\n",
                            s.dropped_columns, s.dropped_rows);
    text += "\n### Tables 1 to 3 of Ueng & Chuang: with and without a cache\n\n" +
            cost_lines(of_table(rows, "caching")) + "\n" + missing_lines(of_table(rows, "caching")) +
            fmt::format("\n![Triangles missing]({0}_missing.svg)\n![LOD time]({0}_time.svg)\n", file);
    text += "\n### The error of every method, no cache\n\n" + truth_lines(of_table(rows, "truth")) +
            fmt::format("\n![Error against triangles]({0}_truth.svg)\n![Error of dikes]({0}_dikes.svg)\n", file);
    text += "\n### Where a reuse test by corners breaks (tau 1, s 0.1)\n\n" + views_lines(of_table(rows, "views"));
    text += "\n### Reuse against speed (tau 1, s 0.1)\n\n" + speed_lines(of_table(rows, "speed")) +
            fmt::format("\n![Blocks selected anew against speed]({0}_speed.svg)\n", file);
    text += "\n### The cost of rigour: N*K, exact cache, by the floor of the metric (tau 1, s 0.1)\n\n" +
            rigour_lines(of_table(rows, "rigour")) + "\n";
    return text;
}

// ---- charts ----

PlotSeries series_of(const std::string& name, const std::vector<const Row*>& rows,
                     const std::function<bool(const Row&)>& wanted,
                     const std::function<std::pair<double, double>(const Row&)>& point, bool dashed = false) {
    PlotSeries series{name, {}, true, true, dashed};
    for (const Row* row : rows)
        if (wanted(*row)) series.points.push_back(point(*row));
    std::sort(series.points.begin(), series.points.end());
    return series;
}

std::string subtitle(const Subject& s) {
    return fmt::format("{}: {} x {} samples at {} m, 800 x 800 px, 40 degrees", s.title, s.columns, s.rows,
                       number(s.spacing_m));
}

std::string missing_chart(const Subject& s, const std::vector<Row>& rows) {
    const auto caching = of_table(rows, "caching");
    const auto point = [](const Row& r) {
        return std::pair{r.rules.s_px / r.rules.tau_px, 100 * missing_share(r.figures.selection)};
    };
    LineChart chart{"Vertices that a cache leaves out", subtitle(s), {"s / tau", false, {}},
                    {"missing (%)", false, {}},         {},          {}};
    for (const ReuseTest reuse : {ReuseTest::paper, ReuseTest::exact})
        chart.series.push_back(series_of(
            reuse == ReuseTest::paper ? "UC, P1" : "UC, exact", caching,
            [&](const Row& r) {
                return r.rules.metric == BlockMetric::uc && r.rules.reuse == reuse && r.rules.s_px > 0;
            },
            point));
    PlotSeries paper{"the paper, Table 3", {}, true, true, true};
    for (const CachingReference& r : kCachingReferences)
        if (r.s_px > 0) paper.points.emplace_back(r.s_px / r.tau_px, r.paper_missing);
    std::sort(paper.points.begin(), paper.points.end());
    chart.series.push_back(std::move(paper));
    return to_svg(chart);
}

std::string time_chart(const Subject& s, const std::vector<Row>& rows) {
    BarChart chart{"LOD time of a frame", subtitle(s), "tau (px), s (px)", {}, {"CPU ms", true, {}}, {}, {}};
    struct Kind {
        const char* name;
        BlockMetric metric;
        ReuseTest reuse;
    };
    const std::vector<Kind> kinds{{"UC", BlockMetric::uc, ReuseTest::off},
                                  {"UC, P1", BlockMetric::uc, ReuseTest::paper},
                                  {"UC, exact", BlockMetric::uc, ReuseTest::exact},
                                  {"N*K", BlockMetric::guaranteed, ReuseTest::off},
                                  {"N*K, exact", BlockMetric::guaranteed, ReuseTest::exact}};
    const auto caching = of_table(rows, "caching");
    for (const Kind& kind : kinds) chart.series.push_back({kind.name, {}});
    for (const Row* row : caching) {
        // A group for each tau and s that some row has a cache for.
        if (row->rules.metric != BlockMetric::uc || row->rules.reuse != ReuseTest::paper) continue;
        chart.groups.push_back(fmt::format("{}, {}", number(row->rules.tau_px), number(row->rules.s_px)));
        for (std::size_t k = 0; k < kinds.size(); ++k) {
            const auto found = std::find_if(caching.begin(), caching.end(), [&](const Row* r) {
                return r->rules.metric == kinds[k].metric && r->rules.reuse == kinds[k].reuse &&
                       r->rules.tau_px == row->rules.tau_px &&
                       (kinds[k].reuse == ReuseTest::off || r->rules.s_px == row->rules.s_px);
            });
            chart.series[k].values.push_back(found == caching.end() ? 0 : (*found)->figures.lod_ms);
        }
    }
    return to_svg(chart);
}

std::string truth_chart(const Subject& s, const std::vector<Row>& rows) {
    LineChart chart{"What an error costs in triangles",
                    subtitle(s) + "; no cache",
                    {"triangles a frame", true, {}},
                    {"greatest error in blocks (px)", true, {}},
                    {},
                    {}};
    for (const BlockMetric metric :
         {BlockMetric::uc, BlockMetric::nested, BlockMetric::guaranteed, BlockMetric::by_block})
        chart.series.push_back(series_of(
            name_of(metric), of_table(rows, "truth"),
            [&](const Row& r) { return r.rules.metric == metric && !r.dike_aware; },
            [](const Row& r) {
                return std::pair{r.figures.triangles, r.figures.truth.blocks.max_px()};
            }));
    return to_svg(chart);
}

std::string dike_chart(const Subject& s, const std::vector<Row>& rows) {
    LineChart chart{"What the strips between blocks err",
                    subtitle(s) + "; no cache",
                    {"tau (px)", true, {}},
                    {"greatest error in strips (px)", true, {}},
                    {},
                    {}};
    const auto point = [](const Row& r) { return std::pair{r.rules.tau_px, r.figures.truth.dikes.max_px()}; };
    for (const BlockMetric metric : {BlockMetric::uc, BlockMetric::guaranteed})
        chart.series.push_back(series_of(
            name_of(metric) + ", as in the paper", of_table(rows, "truth"),
            [&](const Row& r) { return r.rules.metric == metric && !r.dike_aware; }, point));
    chart.series.push_back(series_of(
        "N*K, dikes counted", of_table(rows, "truth"),
        [&](const Row& r) { return r.rules.metric == BlockMetric::guaranteed && r.dike_aware; }, point));
    chart.series.push_back(series_of(
        "tau", of_table(rows, "truth"), [](const Row& r) { return r.is_guaranteed(); },
        [](const Row& r) {
            return std::pair{r.rules.tau_px, r.rules.tau_px};
        },
        true));
    return to_svg(chart);
}

std::string speed_chart(const Subject& s, const std::vector<Row>& rows) {
    LineChart chart{"Blocks that a cache cannot spare",
                    subtitle(s) + "; tau 1 px, s 0.1 px",
                    {"metres a frame", true, {}},
                    {"selected anew (% of those in view)", true, {}},
                    {},
                    {}};
    const auto point = [](const Row& r) { return std::pair{r.step_m, 100 * (1 - r.figures.reused_share)}; };
    for (const auto& [name, metric, reuse] : {std::tuple{"UC, P1", BlockMetric::uc, ReuseTest::paper},
                                              std::tuple{"UC, exact", BlockMetric::uc, ReuseTest::exact},
                                              std::tuple{"N*K, exact", BlockMetric::guaranteed, ReuseTest::exact}})
        chart.series.push_back(series_of(
            name, of_table(rows, "speed"),
            [m = metric, u = reuse](const Row& r) { return r.rules.metric == m && r.rules.reuse == u; }, point));
    return to_svg(chart);
}

}  // namespace

Result<void> write_report(const std::string& folder, const Subject& subject, const std::vector<Row>& rows) {
    const std::string base = folder + "/paper_" + subject.name;
    std::vector<std::pair<std::string, std::string>> files{{base + ".json", json_text(subject, rows)},
                                                           {base + ".md", page(subject, rows)},
                                                           {base + "_missing.svg", missing_chart(subject, rows)},
                                                           {base + "_time.svg", time_chart(subject, rows)},
                                                           {base + "_truth.svg", truth_chart(subject, rows)},
                                                           {base + "_dikes.svg", dike_chart(subject, rows)},
                                                           {base + "_speed.svg", speed_chart(subject, rows)}};
    for (const char* table : {"caching", "truth", "views", "speed", "rigour"})
        files.emplace_back(fmt::format("{}_{}.csv", base, table), csv(of_table(rows, table)));
    for (const auto& [file, text] : files)
        if (auto ok = write_text(file, text); !ok) return ok;
    return {};
}

}  // namespace scree::paper
