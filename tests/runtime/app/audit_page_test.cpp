// What is said of an audit: the page has the figures of the result, and says so where a promise is broken.
#include "runtime/app/audit_page.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/runtime/report/html_support.h"

namespace scree::test {
namespace {

AuditResult made_up_result() {
    AuditResult r;
    for (int k = 0; k < 3; ++k) {
        AuditFrame f;
        f.triangles = 1000 + k;
        f.samples = 10;
        f.promised_px = 1.001;
        f.max_px = 0.25 * (k + 1);
        f.p99_px = 0.125;
        f.mean_px = 0.0625;
        r.frames.push_back(f);
        for (int s = 0; s < 10; ++s) r.errors.add(s == 0 ? f.max_px : 0.003);
    }
    r.max_bound_px = 1;
    r.worst_share = 0.75;
    return r;
}

AuditFacts made_up_facts() {
    AuditFacts facts;
    facts.store = "<hills>.scree";
    facts.command = "scree-view audit 'a & b.scree'";
    facts.machine = "a machine";
    facts.lod = "--lod geomip";
    facts.width_px = 800;
    facts.height_px = 600;
    return facts;
}

TEST(AuditPages, SayInASentenceWhetherThePromiseHolds) {
    AuditResult r = made_up_result();
    AuditFacts facts = made_up_facts();
    EXPECT_EQ(audit_verdict(r, facts),
              "3 frames, 30 samples of the finest data: nothing drawn was further than 0.75 px from it; promised was 1 "
              "px; no open edge, no T-junction, no hole. The promise holds.");
    facts.guaranteed = false;
    EXPECT_NE(audit_verdict(r, facts).find("No error is promised."), std::string::npos);
    r.kept = false;
    r.errors.add(3);
    r.cracks.open_edges = 2;
    const std::string broken = audit_verdict(r, facts);
    EXPECT_NE(broken.find("further than 3 px from it, 96.8 % within 1 px"), std::string::npos) << broken;
    EXPECT_NE(broken.find("2 open edges"), std::string::npos) << broken;
    EXPECT_NE(broken.find("The promise is broken."), std::string::npos) << broken;
}

TEST(AuditPages, AreWholeAndHaveTheFiguresOfTheResult) {
    const AuditResult r = made_up_result();
    const PagePicture dot{1, 1, {1, 2, 3}};
    const auto page = audit_page(r, made_up_facts(), {{2, dot}}, "");
    ASSERT_TRUE(page) << page.error().message;
    expect_well_formed(*page);
    expect_self_contained(*page);
    EXPECT_EQ(page->find("<hills"), std::string::npos);
    for (const char* part :
         {"<title>An audit of &lt;hills&gt;.scree</title>", "scree-view audit 'a &amp; b.scree'", "a machine",
          "Frame 2: 1002 triangles, true error at most 0.75 px, promised 1 px", "note good",
          "<td>2</td><td>1002</td><td>10</td><td>1.001</td><td>0.75</td><td>0.125</td><td>0.0625</td><td>75 %</td>"})
        EXPECT_NE(page->find(part), std::string::npos) << part;
    EXPECT_EQ(page->find("BROKEN"), std::string::npos);
    EXPECT_EQ(page->find("Against the sources"), std::string::npos);
}

TEST(AuditPages, SayWhatIsBrokenAndWhyThereAreNoPictures) {
    AuditResult r = made_up_result();
    r.kept = false;
    r.frames[1].max_px = 4;
    r.errors.add(std::numeric_limits<double>::infinity());
    AuditFacts facts = made_up_facts();
    facts.sources = {"a<b.tif"};
    r.frames[0].source_max_px = 0.375;
    r.samples_not_drawn = 12;
    const auto page = audit_page(r, facts, {}, "no OpenGL & no EGL");
    ASSERT_TRUE(page) << page.error().message;
    expect_well_formed(*page);
    for (const char* part : {"note bad", "BROKEN", "No pictures: no OpenGL &amp; no EGL.", "a&lt;b.tif",
                             "12 samples lie over no terrain", "<td>0.375</td>"})
        EXPECT_NE(page->find(part), std::string::npos) << part;
}

TEST(AuditPages, OfNothingAreStillPages) {
    const auto page = audit_page({}, made_up_facts(), {}, "");
    ASSERT_TRUE(page);
    expect_well_formed(*page);
    EXPECT_EQ(page->find("nan"), std::string::npos);
}

TEST(ErrorHistograms, CountWhatIsWithin) {
    ErrorHistogram errors;
    for (const double px : {0.0, 0.1, 0.2, 0.4, 5.0}) errors.add(px);
    EXPECT_EQ(errors.count_within(0.01), 1);
    EXPECT_EQ(errors.count_within(0.15), 2);
    EXPECT_EQ(errors.count_within(1), 4);
    EXPECT_EQ(errors.count_within(5), 5);
    EXPECT_EQ(ErrorHistogram().count_within(1), 0);
}

}  // namespace
}  // namespace scree::test
