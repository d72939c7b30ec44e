// What follows from figures that were measured: cases made up, answers known.
#include "runtime/app/comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>

#include <nlohmann/json.hpp>

#include "runtime/app/comparison_page.h"
#include "runtime/app/comparison_table.h"
#include "tests/runtime/report/html_support.h"

namespace scree::test {
namespace {

ComparedCase made_up(const std::string& method, double tau_px, double true_max_px, double triangles, double frame_ms,
                     double p99_ms) {
    ComparedCase c;
    c.what.method = method;
    c.what.tau_px = tau_px;
    c.what.budget_bytes = std::int64_t{256} << 20;
    c.figures.bound_px = 0.9 * tau_px;
    c.figures.true_max_px = true_max_px;
    c.figures.triangles_mean = triangles;
    c.figures.frame_ms = frame_ms;
    c.figures.frame_p99_ms = p99_ms;
    c.figures.lod_ms = frame_ms / 10;
    return c;
}

ComparedCase without_promise(ComparedCase c) {
    c.what.lod = {LodMethod::rsg, ErrorMetric::uc};
    return c;
}

// geomip and rsg, and the cheaper one that promises nothing.
std::vector<ComparedCase> measured() {
    return {made_up("geomip", 1, 0.8, 1000, 12, 15), made_up("geomip", 2, 1.7, 500, 8, 9),
            made_up("geomip", 4, 3.1, 250, 5, 6),    made_up("rsg", 1, 0.95, 300, 14, 30),
            made_up("rsg", 2, 1.9, 150, 9, 11),      without_promise(made_up("rsg, metric uc", 1, 1.8, 90, 2, 3))};
}

TEST(Recommending, TheCheapestThatKeepsBothWishes) {
    const auto r = recommend(measured(), {100, 2});
    ASSERT_TRUE(r.best);
    EXPECT_TRUE(r.fits);
    EXPECT_EQ(*r.best, 1u) << r.reason;
    EXPECT_FALSE(r.cheaper_here) << "tau 4 was 3.1 px off";
}

TEST(Recommending, AFrameRateThatHundredthFramesMissDoesNotCount) {
    // rsg at tau 1 has the p99 of 30 ms; geomip 15.
    EXPECT_EQ(*recommend(measured(), {60, 1}).best, 0u);
    EXPECT_TRUE(recommend(measured(), {60, 1}).fits);
    const auto r = recommend(measured(), {70, 1});
    EXPECT_FALSE(r.fits);
    EXPECT_EQ(*r.best, 0u);
    EXPECT_NE(r.reason.find("closest"), std::string::npos) << r.reason;
    EXPECT_NE(r.reason.find("geomip at tau 1 px"), std::string::npos) << r.reason;
}

TEST(Recommending, APromiseIsNotWhatHappenedToBeMeasured) {
    const auto r = recommend(measured(), {60, 1.75});
    EXPECT_EQ(*r.best, 0u) << "tau 2 promises 2, though it erred by 1.7";
    ASSERT_TRUE(r.cheaper_here);
    EXPECT_EQ(*r.cheaper_here, 1u);
}

TEST(Recommending, WhatPromisesNothingOrBrokeItsPromiseIsNeverRecommended) {
    auto cases = measured();
    EXPECT_NE(*recommend(cases, {60, 8}).best, 5u);
    EXPECT_EQ(*recommend(cases, {60, 8}).best, 2u);
    cases[2].figures.kept = false;
    EXPECT_EQ(*recommend(cases, {60, 8}).best, 1u);
    const auto nothing = recommend({cases[5]}, {60, 8});
    EXPECT_FALSE(nothing.best);
    EXPECT_FALSE(nothing.fits);
    EXPECT_NE(nothing.reason, "");
}

TEST(Recommending, ReuseAndATightBudgetArePartOfThePromise) {
    auto cached = made_up("rsg, cache exact", 1, 0.9, 100, 1, 2);
    cached.what.lod = {LodMethod::rsg};
    cached.what.lod.reuse = ReuseTest::exact;
    cached.what.lod.s_px = 0.25;
    EXPECT_DOUBLE_EQ(cached.promised_px(), 1.25);
    EXPECT_FALSE(recommend({cached}, {60, 1.2}).fits);
    EXPECT_TRUE(recommend({cached}, {60, 1.25}).fits);
    auto tight = made_up("geomip", 1, 0.9, 100, 1, 2);
    tight.figures.bound_px = 3;
    EXPECT_FALSE(recommend({tight}, {60, 2}).fits);
    EXPECT_TRUE(recommend({tight}, {60, 3}).fits);
}

TEST(Recommending, WhereNothingIsTrueEnoughTheTruestIsNamed) {
    const auto r = recommend(measured(), {60, 0.5});
    ASSERT_TRUE(r.best);
    EXPECT_FALSE(r.fits);
    EXPECT_EQ(cost_of(measured()[*r.best], Cost::frame_ms) <= 14, true);
    EXPECT_DOUBLE_EQ(measured()[*r.best].promised_px(), 1);
    EXPECT_NE(r.reason.find("0.5"), std::string::npos) << r.reason;
}

TEST(Recommending, OtherSweepsAreNoChoices) {
    auto cases = measured();
    auto blurred = made_up("geomip", 1, 0.8, 10, 1, 1);
    blurred.what.sweep = Sweep::texture;
    cases.push_back(blurred);
    blurred.what.sweep = Sweep::budget;
    cases.push_back(blurred);
    EXPECT_EQ(*recommend(cases, {60, 1}).best, 0u);
    EXPECT_EQ(*cheapest_within(cases, 1, Cost::triangles, true), 3u);
    EXPECT_EQ(pareto_front(cases, Cost::triangles), (std::vector<std::size_t>{0, 3, 4}));
}

TEST(ParetoFronts, HaveNothingThatIsBeatenInBoth) {
    const auto cases = measured();
    EXPECT_EQ(pareto_front(cases, Cost::triangles), (std::vector<std::size_t>{0, 3, 4}));
    EXPECT_EQ(pareto_front(cases, Cost::frame_ms), (std::vector<std::size_t>{0, 1, 2}));
    EXPECT_TRUE(pareto_front({}, Cost::lod_ms).empty());
    auto twice = cases;
    twice.push_back(cases[0]);
    EXPECT_EQ(pareto_front(twice, Cost::frame_ms).size(), 3u) << "the same point once";
}

TEST(CheapestMethods, AreThoseWithinTheTrueError) {
    const auto cases = measured();
    EXPECT_FALSE(cheapest_within(cases, 0.5, Cost::frame_ms, true));
    EXPECT_EQ(*cheapest_within(cases, 1, Cost::frame_ms, true), 0u);
    EXPECT_EQ(*cheapest_within(cases, 1, Cost::triangles, true), 3u);
    EXPECT_EQ(*cheapest_within(cases, 2, Cost::frame_ms, true), 1u);
    EXPECT_EQ(*cheapest_within(cases, 2, Cost::frame_ms, false), 5u);
    EXPECT_FALSE(cheapest_within(cases, 1, Cost::frame_ms, false));
}

TEST(ComparisonCases, HaveEveryMethodAtEveryToleranceAndTheSweeps) {
    CaseList list;
    list.base.method = "geomip";
    list.base.budget_bytes = std::int64_t{256} << 20;
    const auto cases = comparison_cases(list);
    std::set<std::string> methods;
    std::set<LodMethod> kinds;
    int textures = 0, budgets = 0;
    for (const ComparisonCase& c : cases) {
        textures += c.sweep == Sweep::texture ? 1 : 0;
        budgets += c.sweep == Sweep::budget ? 1 : 0;
        if (c.sweep != Sweep::tolerance) {
            EXPECT_EQ(c.tau_px, 1);
            continue;
        }
        methods.insert(c.method);
        kinds.insert(c.lod.method);
        // What is compared can be typed.
        const LodOptions typed{std::string(to_string(c.lod.method)), std::string(to_string(c.lod.metric)),
                               std::string(to_string(c.lod.reuse)),  std::string(to_string(c.lod.culling)),
                               std::string(to_string(c.lod.cracks)), c.lod.s_px};
        const auto settings = lod_settings_from(typed);
        ASSERT_TRUE(settings) << c.method << ": " << settings.error().message;
        EXPECT_EQ(*settings, c.lod);
    }
    EXPECT_EQ(kinds.size(), 3u);
    EXPECT_EQ(cases.size() - static_cast<std::size_t>(textures + budgets), methods.size() * list.tau_px.size());
    EXPECT_EQ(textures, 7);
    EXPECT_EQ(budgets, 5);
    for (const double share : {0.1, 0.25, 0.5})
        EXPECT_TRUE(std::any_of(cases.begin(), cases.end(), [&](const ComparisonCase& c) {
            return c.lod.reuse == ReuseTest::exact && c.tau_px == 4 && c.lod.s_px == 4 * share;
        })) << share;
    for (const auto& has : {+[](const LodSettings& l) { return l.metric == ErrorMetric::uc; },
                            +[](const LodSettings& l) { return l.metric == ErrorMetric::deboer; },
                            +[](const LodSettings& l) { return l.culling == Culling::corners; },
                            +[](const LodSettings& l) { return l.cracks == CrackFix::dike; },
                            +[](const LodSettings& l) { return l.reuse == ReuseTest::paper; }})
        EXPECT_TRUE(std::any_of(cases.begin(), cases.end(), [&](const ComparisonCase& c) { return has(c.lod); }));
}

TEST(ComparisonCases, ForARecommendationEachMethodPromisesJustTheError) {
    CaseList list;
    list.tau_px = {4};
    list.just_px = 1.1;
    list.promises_only = true;
    std::set<std::string> just;
    for (const ComparisonCase& c : comparison_cases(list)) {
        EXPECT_TRUE(c.lod.is_guaranteed()) << c.method;
        EXPECT_EQ(c.sweep, Sweep::tolerance);
        if (c.tau_px == 4) continue;
        EXPECT_LE(c.lod.promise_px(c.tau_px), 1.1 + 1e-12) << c.method;
        EXPECT_GT(c.lod.promise_px(c.tau_px), 1.099) << c.method;
        just.insert(c.method);
    }
    EXPECT_GE(just.size(), 7u);
}

TEST(ComparisonCases, BudgetsEndWithTheFirstThatHoldsAll) {
    CaseList list;
    const auto count = [&](std::int64_t all_bytes) {
        const auto cases = without_idle_budgets(comparison_cases(list), all_bytes);
        return std::count_if(cases.begin(), cases.end(),
                             [](const ComparisonCase& c) { return c.sweep == Sweep::budget; });
    };
    EXPECT_EQ(count(1), 1);
    EXPECT_EQ(count(std::int64_t{100} << 20), 3);
    EXPECT_EQ(count(std::int64_t{1} << 40), 5);
}

TEST(ComparisonCases, OptionsAreThoseOfACommandLine) {
    ComparisonCase c;
    c.budget_bytes = std::int64_t{256} << 20;
    EXPECT_EQ(options_of(c), "--lod geomip --tau 1");
    c.morph = false;
    c.tau_px = 0.25;
    c.texture_tau_px = 1.41;
    c.budget_bytes = std::int64_t{32} << 20;
    EXPECT_EQ(options_of(c), "--lod geomip --tau 0.25 --no-morph --texture-tau 1.41 --budget 32M");
    c.budget_bytes = 123456789;
    EXPECT_NE(options_of(c).find("--budget 123456789"), std::string::npos);
}

Comparison made_up_comparison() {
    Comparison c;
    c.store = "<hills & dales>.scree";
    c.renderer = "a \"renderer\"";
    c.frames = 3;
    c.rounds = 1;
    c.width_px = c.height_px = 100;
    c.cases = measured();
    c.cases[1].figures.true_max_px = std::numeric_limits<double>::infinity();
    c.cases[2].what.method = "geomip, no morph";
    auto other = c.cases[0];
    other.what.sweep = Sweep::texture;
    other.what.texture_tau_px = 4;
    c.cases.push_back(other);
    c.skipped.push_back({other.what, "--lod roam is not built in"});
    c.picture_width_px = 3;
    c.picture_height_px = 2;
    c.reference_picture.assign(18, 100);
    c.pictures.push_back({0, std::vector<std::uint8_t>(18, 90), std::vector<std::uint8_t>(18, 80), 40, 0.99});
    return c;
}

void expect_finite(const nlohmann::ordered_json& json, const std::string& where) {
    if (json.is_structured()) {
        for (const auto& [key, value] : json.items()) expect_finite(value, where + "/" + key);
    }
    if (json.is_number_float()) {
        EXPECT_TRUE(std::isfinite(json.get<double>())) << where;
    }
}

TEST(ComparisonTables, JsonIsFiniteAndNamesItsFigures) {
    const Comparison made = made_up_comparison();
    // Through text: infinity would come back as null.
    const auto report = nlohmann::ordered_json::parse(comparison_json(made, Wish{60, 2}).dump());
    expect_finite(report, "");
    EXPECT_EQ(report["cases"].size(), made.cases.size());
    EXPECT_EQ(report["cases"][1]["true_max_px"], kBeyondMeasure);
    EXPECT_EQ(report["cases"][5]["guaranteed"], false);
    EXPECT_EQ(report["cheapest"].size(), 7u);
    EXPECT_FALSE(report["cheapest"][0].contains("by_frame_ms")) << "nothing erred by so little";
    EXPECT_EQ(report["cheapest"][2]["by_triangles"]["method"], "rsg");
    EXPECT_EQ(report["skipped"][0]["reason"], "--lod roam is not built in");
    EXPECT_EQ(report["recommendation"]["best"]["method"], "geomip");
    EXPECT_EQ(report["kept"], true);
    EXPECT_FALSE(comparison_json(made, {}).contains("recommendation"));
}

TEST(ComparisonTables, CsvHasTheFiguresOfTheJson) {
    const Comparison made = made_up_comparison();
    const auto report = comparison_json(made, {});
    std::istringstream csv(comparison_csv(made));
    const auto fields = [](const std::string& line) {
        std::vector<std::string> all(1);
        bool inside = false;
        for (const char c : line) {
            if (c == '"')
                inside = !inside;
            else if (c == ',' && !inside)
                all.emplace_back();
            else
                all.back() += c;
        }
        return all;
    };
    std::string line;
    ASSERT_TRUE(std::getline(csv, line));
    const auto keys = fields(line);
    EXPECT_EQ(keys.size(), report["cases"][0].size());
    for (const auto& row : report["cases"]) {
        ASSERT_TRUE(std::getline(csv, line));
        const auto values = fields(line);
        ASSERT_EQ(values.size(), keys.size()) << line;
        for (std::size_t k = 0; k < keys.size(); ++k) {
            const auto& value = row.at(keys[k]);
            if (value.is_string()) {
                EXPECT_EQ(values[k], value.get<std::string>());
            } else if (value.is_boolean()) {
                EXPECT_EQ(values[k], value.get<bool>() ? "1" : "0");
            } else
                EXPECT_NEAR(std::stod(values[k]), value.get<double>(), 1e-5 * std::abs(value.get<double>())) << keys[k];
        }
    }
    EXPECT_FALSE(std::getline(csv, line));
}

TEST(ComparisonPages, AreWholeAndNeedNothingElse) {
    const Comparison made = made_up_comparison();
    const auto page = comparison_page(made, Wish{60, 2}, "scree-view view 'a b' --tau 1");
    ASSERT_TRUE(page) << page.error().message;
    expect_well_formed(*page);
    for (const char* outside : {"http:", "https:", "src=\"/", "@import", "<link"})
        EXPECT_EQ(page->find(outside), std::string::npos) << outside;
    for (const ComparedCase& c : made.cases) EXPECT_NE(page->find(c.what.method), std::string::npos) << c.what.method;
    EXPECT_NE(page->find("&lt;hills &amp; dales&gt;.scree"), std::string::npos);
    EXPECT_EQ(page->find("<hills"), std::string::npos);
    EXPECT_NE(page->find("scree-view view 'a b' --tau 1"), std::string::npos);
    EXPECT_NE(page->find("data:image/png;base64,iVBORw0KGgo"), std::string::npos);
    EXPECT_NE(page->find("--lod roam is not built in"), std::string::npos);
    EXPECT_NE(page->find("prefers-color-scheme: dark"), std::string::npos);
    EXPECT_EQ(page->find("BROKEN"), std::string::npos);
    for (const char* text : {">nan", ">inf", "\"nan", "nan,", "inf,"})
        EXPECT_EQ(page->find(text), std::string::npos) << text;
}

TEST(ComparisonPages, SayWhereAPromiseWasBroken) {
    Comparison made = made_up_comparison();
    made.cases[0].figures.kept = false;
    EXPECT_FALSE(made.kept());
    const auto page = comparison_page(made, {}, "");
    ASSERT_TRUE(page) << page.error().message;
    EXPECT_NE(page->find("BROKEN"), std::string::npos);
    EXPECT_NE(page->find("A promise was broken"), std::string::npos);
    EXPECT_NE(comparison_text(made).find("THE PROMISE IS BROKEN"), std::string::npos);
}

TEST(ComparisonPages, OfNothingAreStillPages) {
    Comparison made = made_up_comparison();
    made.cases.clear();
    made.pictures.clear();
    made.reference_picture.clear();
    const auto page = comparison_page(made, Wish{}, "");
    ASSERT_TRUE(page) << page.error().message;
    expect_well_formed(*page);
}

}  // namespace
}  // namespace scree::test
