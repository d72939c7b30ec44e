// The words of --lod and its companions: what they mean, what does not go together, what is promised.
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <vector>

#include "runtime/lod/lod_method.h"

namespace scree::test {
namespace {

LodOptions options(const std::string& lod, const std::string& metric = "guaranteed", const std::string& cache = "off",
                   double s_px = 0, const std::string& cull = "box", const std::string& cracks = "stitch") {
    return {lod, metric, cache, cull, cracks, s_px};
}

// What the documentation says of command_line_of, in other words.
std::string words_of(const LodOptions& o) {
    std::string line = "--lod " + o.lod;
    if (o.metric != "guaranteed") line += " --metric " + o.metric;
    if (o.cache != "off") line += " --cache " + o.cache;
    if (o.s_px > 0) line += " --s 0.1";
    if (o.cull != "box") line += " --cull " + o.cull;
    if (o.cracks != "stitch") line += " --cracks " + o.cracks;
    return line;
}

void expect_refused(const LodOptions& o, const std::vector<std::string>& words) {
    const auto settings = lod_settings_from(o);
    ASSERT_FALSE(settings) << command_line_of(*settings) << " was taken";
    EXPECT_EQ(settings.error().code, ErrorCode::usage);
    for (const std::string& word : words)
        EXPECT_NE(settings.error().message.find(word), std::string::npos)
            << "'" << word << "' is missing in: " << settings.error().message;
}

TEST(LodMethods, DefaultsAreTheDefaultSettings) {
    const auto settings = lod_settings_from({});
    ASSERT_TRUE(settings) << settings.error().message;
    EXPECT_EQ(*settings, LodSettings{});
    EXPECT_TRUE(settings->is_guaranteed());
    EXPECT_EQ(command_line_of(*settings), "--lod geomip");
}

TEST(LodMethods, EveryWordMeansItself) {
    auto s = lod_settings_from(options("rsg", "uc", "paper", 0.5, "corners", "dike"));
    ASSERT_TRUE(s) << s.error().message;
    EXPECT_EQ(*s,
              (LodSettings{LodMethod::rsg, ErrorMetric::uc, ReuseTest::paper, 0.5, Culling::corners, CrackFix::dike}));
    s = lod_settings_from(options("geomip", "deboer"));
    ASSERT_TRUE(s) << s.error().message;
    EXPECT_EQ(s->method, LodMethod::geomip);
    EXPECT_EQ(s->metric, ErrorMetric::deboer);
    s = lod_settings_from(options("block-rsg"));
    ASSERT_TRUE(s) << s.error().message;
    EXPECT_EQ(s->method, LodMethod::block_rsg);
    s = lod_settings_from(options("rsg", "guaranteed", "exact", 0.1));
    ASSERT_TRUE(s) << s.error().message;
    EXPECT_EQ(s->reuse, ReuseTest::exact);
}

TEST(LodMethods, UnknownWordsAreRefusedWithTheOptionAndWhatItTakes) {
    expect_refused(options("roam"), {"--lod roam", "geomip", "rsg", "block-rsg"});
    expect_refused(options("block_rsg"), {"--lod block_rsg"});
    expect_refused(options("rsg", "best"), {"--metric best", "guaranteed", "uc", "deboer"});
    expect_refused(options("rsg", "guaranteed", "on"), {"--cache on", "off", "paper", "exact"});
    expect_refused(options("rsg", "guaranteed", "off", 0, "sphere"), {"--cull sphere", "box", "corners"});
    expect_refused(options("rsg", "guaranteed", "off", 0, "box", "skirt"), {"--cracks skirt", "stitch", "dike"});
    expect_refused(options(""), {"--lod"});
}

TEST(LodMethods, WhatDoesNotGoTogetherIsRefusedWithTheReason) {
    expect_refused(options("rsg", "deboer"), {"--metric deboer", "--lod rsg", "geomip"});
    expect_refused(options("block-rsg", "deboer"), {"--metric deboer", "--lod block-rsg", "geomip"});
    expect_refused(options("geomip", "uc"), {"--metric uc", "--lod geomip", "rsg"});
    expect_refused(options("block-rsg", "uc"), {"--metric uc", "--lod block-rsg"});
    for (const char* cache : {"paper", "exact"})
        for (const char* lod : {"geomip", "block-rsg"})
            expect_refused(options(lod, "guaranteed", cache), {std::string("--cache ") + cache, lod, "--lod rsg"});
    for (const char* lod : {"geomip", "block-rsg"})
        expect_refused(options(lod, "guaranteed", "off", 0, "box", "dike"), {"--cracks dike", lod, "--lod rsg"});
}

TEST(LodMethods, TheAllowanceIsALengthAndNeedsACache) {
    for (const char* lod : {"geomip", "rsg", "block-rsg"})
        expect_refused(options(lod, "guaranteed", "off", 0.1), {"--s 0.1", "--cache"});
    for (const double s : {-0.1, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
        expect_refused(options("rsg", "guaranteed", "exact", s), {"--s", "pixels"});
    EXPECT_TRUE(lod_settings_from(options("rsg", "guaranteed", "exact", 0)));
}

TEST(LodMethods, CornersGoWithEveryMethod) {
    for (const char* lod : {"geomip", "rsg", "block-rsg"})
        EXPECT_TRUE(lod_settings_from(options(lod, "guaranteed", "off", 0, "corners"))) << lod;
}

TEST(LodMethods, WhatThePapersHaveIsNoPromise) {
    EXPECT_FALSE(lod_settings_from(options("rsg", "uc"))->is_guaranteed());
    EXPECT_FALSE(lod_settings_from(options("geomip", "deboer"))->is_guaranteed());
    EXPECT_FALSE(lod_settings_from(options("rsg", "guaranteed", "paper", 0.1))->is_guaranteed());
    EXPECT_FALSE(lod_settings_from(options("rsg", "guaranteed", "off", 0, "corners"))->is_guaranteed());
    EXPECT_TRUE(lod_settings_from(options("rsg", "guaranteed", "exact", 0.1))->is_guaranteed());
    EXPECT_TRUE(lod_settings_from(options("rsg", "guaranteed", "off", 0, "box", "dike"))->is_guaranteed());
    EXPECT_DOUBLE_EQ(lod_settings_from(options("rsg", "guaranteed", "exact", 0.25))->promise_px(2), 2.25);
    EXPECT_DOUBLE_EQ(lod_settings_from(options("rsg"))->promise_px(2), 2);
}

// A command line that is printed is one that can be typed.
TEST(LodMethods, CommandLinesSayTheSettingsAgain) {
    std::set<std::string> lines;
    std::size_t taken = 0;
    for (const char* lod : {"geomip", "rsg", "block-rsg"})
        for (const char* metric : {"guaranteed", "uc", "deboer"})
            for (const char* cache : {"off", "paper", "exact"})
                for (const double s : {0.0, 0.1})
                    for (const char* cull : {"box", "corners"})
                        for (const char* cracks : {"stitch", "dike"}) {
                            const LodOptions asked = options(lod, metric, cache, s, cull, cracks);
                            const auto settings = lod_settings_from(asked);
                            if (!settings) continue;
                            ++taken;
                            const std::string line = words_of(asked);
                            EXPECT_EQ(command_line_of(*settings), line);
                            lines.insert(line);
                        }
    EXPECT_EQ(lines.size(), taken) << "two settings have the same command line";
    EXPECT_EQ(taken, 4u + 40u + 2u);
}

TEST(LodMethods, WhatIsNotBuiltInIsRefusedByItsCommandLine) {
    EXPECT_TRUE(expect_built_in({}));
    EXPECT_TRUE(expect_built_in(*lod_settings_from(options("rsg", "uc", "paper", 0.1, "box", "dike"))));
    LodSettings nonsense;
    nonsense.metric = ErrorMetric::uc;  // with geomip: no command line makes it
    const auto refused = expect_built_in(nonsense);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
    EXPECT_NE(refused.error().message.find("--metric uc is not built in"), std::string::npos)
        << refused.error().message;
}

}  // namespace
}  // namespace scree::test
