#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tools/source/grid_file.h"
#include "tools/source/number_text.h"
#include "tools/source/text_reader.h"

namespace scree {
namespace {

constexpr std::size_t kHeaderBytes = 4096;  // ten lines of 40 are enough; writers of more have not been seen
constexpr std::size_t kMaxWordBytes = 512;  // the longest double written out in full has 327 characters
constexpr std::int64_t kRowsPerMark = 256;
constexpr int kInt32Digits = 9;

struct Header {
    std::int64_t columns = 0;
    std::int64_t rows = 0;
    std::optional<double> x, y, step_x, step_y;
    bool x_is_centre = false;
    bool y_is_centre = false;
    std::optional<std::string> nodata;
    std::size_t bytes = 0;  ///< up to the first value
};

enum class Key { columns, rows, x_corner, x_centre, y_corner, y_centre, step, step_x, step_y, nodata };

std::optional<Key> key_of(std::string_view word) {
    constexpr std::pair<std::string_view, Key> kKeys[] = {
        {"ncols", Key::columns},       {"nrows", Key::rows},         {"xllcorner", Key::x_corner},
        {"xllcenter", Key::x_centre},  {"yllcorner", Key::y_corner}, {"yllcenter", Key::y_centre},
        {"cellsize", Key::step},       {"dx", Key::step_x},          {"dy", Key::step_y},
        {"nodata_value", Key::nodata}, {"nodata", Key::nodata}};
    const std::string lower = lower_case(word);
    for (const auto& [name, key] : kKeys)
        if (lower == name) return key;
    return std::nullopt;
}

Result<void> take(const std::string& path, Key key, std::string_view word, std::string_view value, Header& header) {
    const auto number = parse_number(value);
    if (key == Key::nodata) {
        header.nodata = std::string(value);
        return {};
    }
    if (key == Key::columns || key == Key::rows) {
        const auto count = whole_number(value, 1, kMaxGridSide);
        if (!count)
            return unusable_grid(path, fmt::format("{} is '{}', but a grid has 1 to {} of them", word,
                                                   value.substr(0, 40), kMaxGridSide));
        (key == Key::columns ? header.columns : header.rows) = *count;
        return {};
    }
    if (!number || !std::isfinite(*number))
        return unusable_grid(path, fmt::format("{} is '{}', which is no number, so the grid cannot be placed", word,
                                               value.substr(0, 40)));
    if ((key == Key::step || key == Key::step_x || key == Key::step_y) && !(*number > 0))
        return unusable_grid(path, fmt::format("{} is {}, but the distance of samples is above 0", word, *number));
    switch (key) {
        case Key::x_corner:
        case Key::x_centre:
            header.x = number;
            header.x_is_centre = key == Key::x_centre;
            break;
        case Key::y_corner:
        case Key::y_centre:
            header.y = number;
            header.y_is_centre = key == Key::y_centre;
            break;
        case Key::step:
            header.step_x = header.step_y = number;
            break;
        case Key::step_x:
            header.step_x = number;
            break;
        default:
            header.step_y = number;
            break;
    }
    return {};
}

Result<Header> read_header(const std::string& path, std::string_view text) {
    Header header;
    std::string_view rest = text;
    while (true) {
        std::string_view after = rest;
        const std::string_view word = next_word(after);
        const auto key = key_of(word);
        if (!key) {
            // "nan" may be the first value.
            const bool value = !word.empty() && parse_number(word).has_value();
            if (!value)
                return unusable_grid(path, fmt::format("'{}' in its header is neither a keyword of an ASCII grid nor a "
                                                       "value",
                                                       word.substr(0, 40)));
            header.bytes = static_cast<std::size_t>(word.data() - text.data());
            break;
        }
        const std::string_view value = next_word(after);
        if (auto taken = take(path, *key, word, value, header); !taken) return taken.error();
        rest = after;
    }
    if (header.columns == 0 || header.rows == 0)
        return unusable_grid(path, "its header lacks ncols or nrows, so its rows cannot be told apart");
    if (!header.x || !header.y || !header.step_x || !header.step_y)
        return unusable_grid(path,
                             "its header lacks xllcorner, yllcorner (or ...center) or cellsize, so it lies nowhere");
    return header;
}

// Every value is an integer that fits an int32: nothing but digits, signs and space, no more than nine digits in a row.
Result<bool> holds_only_integers(const ByteFile& file, std::int64_t first) {
    std::vector<char> buffer(TextReader::kBufferBytes);
    int run = 0;
    for (std::int64_t at = first; at < file.size(); at += static_cast<std::int64_t>(buffer.size())) {
        buffer.resize(static_cast<std::size_t>(
            std::min<std::int64_t>(file.size() - at, static_cast<std::int64_t>(TextReader::kBufferBytes))));
        if (auto read = file.read_at(at, std::as_writable_bytes(std::span(buffer))); !read)
            return unusable_grid(file.path(), read.error().message);
        for (const char c : buffer) {
            if (c >= '0' && c <= '9') {
                if (++run > kInt32Digits) return false;
            } else if (c == '-' || c == '+' || is_text_space(c)) {
                run = 0;
            } else {
                return false;
            }
        }
    }
    return true;
}

// A decimal beyond a double's range: so small that it is nothing, or else infinite.
double beyond_range(std::string_view word) {
    const bool negative = word[0] == '-';
    if (negative) word.remove_prefix(1);
    const bool small = word[0] == '0' || word[0] == '.' || word.find_first_of("eE") + 1 == word.find('-');
    if (small) return 0;
    return negative ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::infinity();
}

template <class T>
std::optional<T> parse(std::string_view word) {
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    T value = 0;
    const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (end != word.data() + word.size()) return std::nullopt;
    if constexpr (std::is_floating_point_v<T>) {
        if (status == std::errc::result_out_of_range) return beyond_range(word);
    }
    if (status != std::errc()) return std::nullopt;
    return value;
}

class AsciiGridDecoder final : public PixelDecoder {
public:
    AsciiGridDecoder(ByteFile file, const Header& header, SampleType type)
        : file_(std::move(file)), words_(file_, kMaxWordBytes), marks_{static_cast<std::int64_t>(header.bytes)} {
        layout_ = {header.columns, header.rows, 1, -1, type, 0};
        words_.seek(marks_[0]);
    }

    const DecodedLayout& layout() const override { return layout_; }

    Result<void> decode(std::int64_t begin, std::int64_t end, std::byte* out) override {
        if (begin != row_) {
            const auto mark = std::min(static_cast<std::size_t>(begin / kRowsPerMark), marks_.size() - 1);
            // Going on from here is nearer than any mark?
            if (row_ > begin || row_ < static_cast<std::int64_t>(mark) * kRowsPerMark) {
                words_.seek(marks_[mark]);
                row_ = static_cast<std::int64_t>(mark) * kRowsPerMark;
            }
        }
        while (row_ < end) {
            std::byte* to = row_ < begin ? nullptr : out;
            if (auto read = read_row(to); !read) {
                words_.seek(marks_[0]);
                row_ = 0;
                return read;
            }
            if (to != nullptr) out += layout_.width * static_cast<std::int64_t>(memory_bytes(layout_.type));
        }
        return {};
    }

private:
    // A row is parsed even where only the next ones are wanted: what is broken before them moves them.
    Result<void> read_row(std::byte* out) {
        if (row_ == static_cast<std::int64_t>(marks_.size()) * kRowsPerMark) marks_.push_back(words_.offset());
        const auto read = layout_.type == SampleType::i32 ? read_values<std::int32_t>(out) : read_values<double>(out);
        if (!read) return read;
        if (++row_ == layout_.height) return check_end();
        return {};
    }

    template <class T>
    Result<void> read_values(std::byte* out) {
        for (std::int64_t column = 0; column < layout_.width; ++column) {
            const Result<std::string_view> word = words_.take_run();
            if (!word) return word.error();
            if (word->empty())
                return Error{ErrorCode::input, fmt::format("the file ends before row {}, column {}", row_, column)};
            const std::optional<T> value = parse<T>(*word);
            if (!value)
                return Error{ErrorCode::input,
                             fmt::format("'{}' in row {}, column {} is no number", word->substr(0, 40), row_, column)};
            if (out == nullptr) continue;
            std::memcpy(out, &*value, sizeof(T));
            out += sizeof(T);
        }
        return {};
    }

    // One value too many: then ncols is wrong, and every row is sheared.
    Result<void> check_end() {
        const Result<std::string_view> word = words_.take_run();
        if (!word) return word.error();
        if (word->empty()) return {};
        return Error{ErrorCode::input, fmt::format("'{}' follows the last of the {} x {} values its header promises",
                                                   word->substr(0, 40), layout_.width, layout_.height)};
    }

    ByteFile file_;
    TextReader words_;
    DecodedLayout layout_;
    std::vector<std::int64_t> marks_;  ///< offsets of rows 0, 256, 512...
    std::int64_t row_ = 0;             ///< the next row that words_ gives
};

Georeference place_of(const Header& header) {
    Georeference place;
    place.column_x = *header.step_x;
    place.row_y = -*header.step_y;
    place.first_x = *header.x + (header.x_is_centre ? 0 : 0.5) * *header.step_x;
    place.first_y = *header.y + (static_cast<double>(header.rows) - (header.y_is_centre ? 1 : 0.5)) * *header.step_y;
    return place;
}

}  // namespace

bool looks_like_ascii_grid(std::string_view start) {
    const std::string_view word = next_word(start);
    return key_of(word).has_value() && parse_number(next_word(start)).has_value();
}

Result<GridFile> open_ascii_grid(ByteFile file) {
    const Result<std::string> start = file.head(kHeaderBytes);
    if (!start) return start.error();
    if (!looks_like_ascii_grid(*start))
        return unusable_grid(file.path(), "not an ESRI ASCII grid: it does not begin with ncols or another keyword");
    const Result<Header> header = read_header(file.path(), *start);
    if (!header) return header.error();
    // A value is a digit and the space before it, at least.
    const std::int64_t least = header->columns > (std::numeric_limits<std::int64_t>::max() / 2) / header->rows
                                   ? std::numeric_limits<std::int64_t>::max()
                                   : header->columns * header->rows * 2 - 1;
    if (least > file.size() - static_cast<std::int64_t>(header->bytes))
        return unusable_grid(
            file.path(),
            fmt::format("{} x {} values need at least {} bytes after the header, but the file has {}; "
                        "it is cut off or its header is wrong",
                        header->columns, header->rows, least, file.size() - static_cast<std::int64_t>(header->bytes)));
    const Result<bool> integers = holds_only_integers(file, static_cast<std::int64_t>(header->bytes));
    if (!integers) return integers.error();
    GridFile grid;
    grid.nodata = header->nodata;
    grid.georeference = place_of(*header);
    if (auto checked = check_place(*grid.georeference, file.path(), "its header"); !checked) return checked.error();
    grid.decoder =
        std::make_unique<AsciiGridDecoder>(std::move(file), *header, *integers ? SampleType::i32 : SampleType::f64);
    return grid;
}

}  // namespace scree
