// Pages and their parts.
#include "runtime/report/html.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/runtime/report/html_support.h"

namespace scree::test {
namespace {

TEST(HtmlPages, AreWellFormedAndNeedNothingElse) {
    HtmlPage page("<hills> & \"dales\"", "lead");
    page.style(".own { color: red; }");
    page.script("let a = 1;");
    page.section("Heading", "words");
    page.add(html_table({"name", "figure"}, {{"a", "1"}, {"b", "2"}}, 1, {"", "bad"}));
    const std::string html = std::move(page).finish();
    expect_well_formed(html);
    expect_self_contained(html);
    EXPECT_NE(html.find("<title>&lt;hills&gt; &amp; &quot;dales&quot;</title>"), std::string::npos);
    EXPECT_NE(html.find("<h1>&lt;hills&gt;"), std::string::npos);
    EXPECT_NE(html.find(".own { color: red; }"), std::string::npos);
    EXPECT_NE(html.find("<tr class=\"bad\"><td class=\"l\">b</td><td>2</td></tr>"), std::string::npos);
    EXPECT_NE(html.find("prefers-color-scheme: dark"), std::string::npos);
}

TEST(HtmlNumbers, AreShort) {
    EXPECT_EQ(short_number(0), "0");
    EXPECT_EQ(short_number(0.012345), "0.0123");
    EXPECT_EQ(short_number(12.345), "12.3");
    EXPECT_EQ(short_number(1234.4), "1234");
    EXPECT_EQ(short_number(12345), "12.3 k");
    EXPECT_EQ(short_number(4560000), "4.56 M");
    EXPECT_EQ(short_number(std::numeric_limits<double>::infinity()), "&infin;");
    EXPECT_EQ(tick_number(5000), "5k");
    EXPECT_EQ(tick_number(1500000), "1.5M");
    EXPECT_EQ(tick_number(0.5), "0.5");
    EXPECT_EQ(tick_number(-0.0), "0");
    EXPECT_EQ(page_megabytes(268435456), "268.4");
}

TEST(ShellWords, AreQuotedWhereTheyMustBe) {
    EXPECT_EQ(shell_quoted("a/b-c.scree"), "a/b-c.scree");
    EXPECT_EQ(shell_quoted("a b"), "'a b'");
    EXPECT_EQ(shell_quoted("it's"), "'it'\\''s'");
    EXPECT_EQ(shell_quoted(""), "''");
}

TEST(PagePictures, AreReducedByTheMeanOfLight) {
    // Black and white columns: half of the light is sRGB 188, not 128.
    PagePicture stripes{8, 4, {}};
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 8; ++x)
            for (int c = 0; c < 3; ++c) stripes.rgb.push_back(x % 2 == 0 ? 0 : 255);
    const PagePicture half = reduced(stripes, 4);
    ASSERT_EQ(half.width_px, 4);
    ASSERT_EQ(half.height_px, 2);
    ASSERT_EQ(half.rgb.size(), 24u);
    for (const auto v : half.rgb) EXPECT_EQ(v, 188);
    EXPECT_EQ(reduced(stripes, 8).rgb, stripes.rgb) << "narrow enough";
    const PagePicture odd = reduced(stripes, 3);
    EXPECT_EQ(odd.rgb.size(), 3u * 3u * static_cast<std::size_t>(odd.height_px));
}

TEST(PagePictures, KeepAFlatColourToTheByte) {
    PagePicture flat{100, 60, {}};
    for (int k = 0; k < 6000; ++k) flat.rgb.insert(flat.rgb.end(), {17, 130, 251});
    const PagePicture small = reduced(flat, 33);
    ASSERT_EQ(small.height_px, 20);
    for (std::size_t k = 0; k < small.rgb.size(); k += 3) {
        ASSERT_EQ(small.rgb[k], 17);
        ASSERT_EQ(small.rgb[k + 1], 130);
        ASSERT_EQ(small.rgb[k + 2], 251);
    }
}

TEST(PagePictures, StandInsideThePage) {
    const auto image = image_html({1, 1, {1, 2, 3}}, "a \"dot\"");
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->rfind(
                  "<img alt=\"a &quot;dot&quot;\" width=\"1\" height=\"1\" src=\"data:image/png;base64,iVBORw0KGgo", 0),
              0u)
        << *image;
}

}  // namespace
}  // namespace scree::test
