// What is said of a flight: lines, CSV, JSON and page have the figures of the log.
#include "runtime/app/flight_page.h"

#include <gtest/gtest.h>

#include <sstream>

#include "tests/runtime/report/html_support.h"

namespace scree::test {
namespace {

/// 100 frames of 10 ms, the last 200 ms; frame k has 1000 + k triangles.
FlightLog made_up_log() {
    FlightLog log;
    for (int k = 0; k < 100; ++k) {
        FlightFrame f;
        f.frame_ms = k == 99 ? 200 : 10;
        f.select_ms = 0.5;
        f.triangles = 1000 + k;
        f.tiles_drawn = 20;
        f.uploads = 2;
        f.upload_bytes = 5000 + k;
        f.requests = 3;
        f.queue = 7;
        f.max_bound_px = 1;
        f.mean_bound_px = 0.25;
        f.tau_effective_px = 1;
        f.resident_heights_bytes = 40'000'000;
        f.resident_textures_bytes = k == 50 ? 21'000'000 : 20'000'000;
        f.rss_bytes = 123'000'000;
        f.bytes_read = 1000 * k;
        log.frames.push_back(f);
    }
    log.frames[7].incomplete = true;
    log.frames[7].stand_ins = 13;
    log.frames[7].max_bound_px = 2.5;
    log.frames[8].growing = true;
    log.frames[8].max_bound_px = 1.5;
    return log;
}

FlightFacts made_up_facts() {
    FlightFacts facts;
    facts.store = "<hills>.scree";
    facts.command = "scree-view fly 'a & b.scree' --tau 1";
    facts.renderer = "a renderer";
    facts.machine = "a machine, 2 cores";
    facts.lod = "--lod geomip";
    facts.width_px = 800;
    facts.height_px = 600;
    facts.budget_bytes = 268'000'000;
    facts.paging.bytes_read = 99'000;
    return facts;
}

std::vector<std::string> split(const std::string& text, char at) {
    std::istringstream in(text);
    std::vector<std::string> parts;
    for (std::string part; std::getline(in, part, at);) parts.push_back(part);
    return parts;
}

TEST(FlightLogs, CsvHasTheNamedColumnsAndALineAFrame) {
    const FlightLog log = made_up_log();
    const auto lines = split(flight_csv(log), '\n');
    ASSERT_EQ(lines.size(), 101u);
    const auto columns = split(lines[0], ',');
    const auto at = [&](const std::string& name, std::size_t frame) {
        const auto column = std::find(columns.begin(), columns.end(), name);
        EXPECT_NE(column, columns.end()) << name;
        const auto values = split(lines[frame + 1], ',');
        EXPECT_EQ(values.size(), columns.size());
        return column == columns.end() ? std::string() : values[static_cast<std::size_t>(column - columns.begin())];
    };
    EXPECT_EQ(at("frame", 7), "7");
    EXPECT_EQ(at("triangles", 7), "1007");
    EXPECT_EQ(at("tiles_drawn", 7), "20");
    EXPECT_EQ(at("uploads", 7), "2");
    EXPECT_EQ(at("upload_bytes", 7), "5007");
    EXPECT_EQ(at("requests", 7), "3");
    EXPECT_EQ(at("queue", 7), "7");
    EXPECT_EQ(at("stand_ins", 7), "13");
    EXPECT_EQ(at("stand_ins", 8), "0");
    EXPECT_EQ(at("max_bound_px", 7), "2.5000");
    EXPECT_EQ(at("tau_effective", 7), "1.0000");
    EXPECT_EQ(at("resident_heights_bytes", 50), "40000000");
    EXPECT_EQ(at("resident_textures_bytes", 50), "21000000");
    EXPECT_EQ(at("rss_bytes", 50), "123000000");
    EXPECT_EQ(at("bytes_read", 50), "50000");
}

TEST(FlightLogs, JsonSumsThemUp) {
    const auto report = flight_json(made_up_log(), made_up_facts());
    EXPECT_EQ(report["frames"], 100);
    EXPECT_EQ(report["frame_ms"]["median"], 10);
    EXPECT_EQ(report["frame_ms"]["max"], 200);
    EXPECT_EQ(report["triangles"]["max"], 1099);
    EXPECT_EQ(report["frames_with_stand_ins"], 1);
    EXPECT_EQ(report["max_bound_px"], 2.5);
    EXPECT_EQ(report["most_tile_bytes"], 61'000'000);
    EXPECT_EQ(report.count("settled"), 0u);
}

TEST(FlightPages, SayInASentenceHowTheFlightWas) {
    FlightLog log = made_up_log();
    FlightFacts facts = made_up_facts();
    EXPECT_EQ(flight_verdict(log, facts),
              "100 frames, median 10 ms, 99 % within 10 ms; nothing drawn was further than 2.5 px from the finest data "
              "(2 of 100 frames went beyond the tolerance of 1 px; in 1 tiles were still missing; in 1 tiles that came "
              "late were still growing); memory for tiles stayed at 61 of 268 MB; no hole.");
    log.frames[7].max_bound_px = log.frames[8].max_bound_px = 1;
    EXPECT_NE(flight_verdict(log, facts).find("further than 1 px from the finest data; memory"), std::string::npos);
    log.frames[3].holes = 4;
    log.frames[4].max_bound_px = 9;
    log.frames[4].limited = true;
    log.frames[5].max_bound_px = log.frames[5].tau_effective_px = 3;
    facts.fps = 60;
    const std::string text = flight_verdict(log, facts);
    EXPECT_NE(text.find("4 cells in holes"), std::string::npos) << text;
    EXPECT_NE(text.find("in 1 the budget bound; in 1 it was raised for the sake of 60 frames"), std::string::npos)
        << text;
}

TEST(FlightPages, AreWholeAndHaveTheFiguresOfTheLog) {
    const FlightLog log = made_up_log();
    const PagePicture dot{2, 1, {1, 2, 3, 4, 5, 6}};
    const auto page = flight_page(log, made_up_facts(), {{0, dot}, {50, dot}});
    ASSERT_TRUE(page) << page.error().message;
    expect_well_formed(*page);
    expect_self_contained(*page);
    EXPECT_EQ(page->find("<hills"), std::string::npos);
    for (const char* part :
         {"<title>A flight over &lt;hills&gt;.scree</title>", "scree-view fly 'a &amp; b.scree' --tau 1", "a renderer",
          "a machine, 2 cores", "100 frames, median 10 ms", "Frame 50: 1050 triangles, at most 1 px", "budget 268.0 MB",
          "<td class=\"l\">triangles</td><td>1049</td><td>1098</td><td>1099</td><td>1050</td>",
          "<td class=\"l\">tiles in memory at most, MB</td><td>61.0</td>", "note good"})
        EXPECT_NE(page->find(part), std::string::npos) << part;
    std::size_t charts = 0;
    for (std::size_t at = page->find("<svg"); at != std::string::npos; at = page->find("<svg", at + 1)) ++charts;
    EXPECT_EQ(charts, 8u);
    FlightLog broken = log;
    broken.frames[3].holes = 4;
    EXPECT_NE(flight_page(broken, made_up_facts(), {})->find("note bad"), std::string::npos);
}

TEST(FlightPages, OfNothingAndOfManyFramesAreStillPages) {
    const auto none = flight_page({}, made_up_facts(), {});
    ASSERT_TRUE(none);
    expect_well_formed(*none);
    FlightLog many = made_up_log();
    while (many.frames.size() < 200000)
        many.frames.insert(many.frames.end(), many.frames.begin(), many.frames.begin() + 100);
    const auto page = flight_page(many, made_up_facts(), {});
    ASSERT_TRUE(page);
    EXPECT_LT(page->size(), 500000u);
    EXPECT_EQ(page->find("nan"), std::string::npos);
}

TEST(PagePictures, AreEvenlySpacedFromTheFirstToTheLast) {
    EXPECT_EQ(pictured_frames(0), std::vector<std::size_t>{});
    EXPECT_EQ(pictured_frames(1), std::vector<std::size_t>{0});
    EXPECT_EQ(pictured_frames(3), (std::vector<std::size_t>{0, 1, 2}));
    EXPECT_EQ(pictured_frames(71), (std::vector<std::size_t>{0, 10, 20, 30, 40, 50, 60, 70}));
}

TEST(PageCommands, AreQuotedForAShell) {
    const char* const words[] = {"fly", "a b.scree", "--tau", "1"};
    EXPECT_EQ(typed_command("fly", 4, words), "scree-view fly 'a b.scree' --tau 1");
}

}  // namespace
}  // namespace scree::test
