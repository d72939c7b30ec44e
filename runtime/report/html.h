// Pages of HTML that need nothing else: style, pictures and charts are inside them, for light and dark screens, wide
// and narrow. Pure functions; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/result.h"

namespace scree {

/// Text as it stands in HTML and SVG, in attributes too.
std::string escaped(std::string_view text);

/// Three significant digits, as people write them: 0.0123, 45.6, 1234 as "1234", 12.3 k, 4.56 M. What is not finite:
/// the sign of infinity.
std::string short_number(double value);
/// Shortest on axes: 5k, 1.5M.
std::string tick_number(double value);
/// 10^6 bytes, one digit after the point.
std::string page_megabytes(std::int64_t bytes);

/// A word of a command line as a shell takes it.
std::string shell_quoted(const std::string& word);

/// sRGB RGB8, top row first.
struct PagePicture {
    int width_px = 0, height_px = 0;
    std::vector<std::uint8_t> rgb;
};
/// `<img>` with the picture inside. Errors: ErrorCode::io (no memory).
Result<std::string> image_html(const PagePicture& picture, std::string_view description);
/// No wider than that: each pixel the mean, in light, of those that it covers. Narrow pictures stay as they are.
PagePicture reduced(const PagePicture& picture, int most_width_px);

/// Cells are HTML already. The first `text_columns` are words, the others figures. `row_classes`: by row, or empty.
std::string html_table(const std::vector<std::string>& heads, const std::vector<std::vector<std::string>>& rows,
                       std::size_t text_columns, const std::vector<std::string>& row_classes = {});

/// A page from its head to its end.
class HtmlPage {
public:
    /// `title` is text; `lead`, the line under it, HTML.
    HtmlPage(std::string_view title, std::string_view lead);
    /// CSS and JavaScript beyond what all pages have.
    void style(std::string_view css) { style_ += css; }
    void script(std::string_view js) { script_ += js; }
    void add(std::string_view html) { body_ += html; }
    /// A heading, and a paragraph of HTML under it; empty: none.
    void section(std::string_view heading, std::string_view words = {});
    std::string finish() &&;

private:
    std::string title_, style_, script_, body_;
};

}  // namespace scree
