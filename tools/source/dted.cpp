#include <array>
#include <cstring>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tools/source/grid_file.h"

namespace scree {
namespace {

constexpr std::int64_t kLabelBytes = 80;  // UHL, and the tape labels that may precede it
constexpr std::int64_t kDsiBytes = 648;
constexpr std::int64_t kAccBytes = 2700;
constexpr std::int64_t kMaxTapeLabels = 8;
constexpr std::int64_t kRecordHeadBytes = 8;  // sentinel, block count, longitude count, latitude count
constexpr std::int64_t kChecksumBytes = 4;
constexpr std::uint8_t kSentinel = 0xAA;
constexpr int kVoid = -32767;
// No ground is so low. What reads lower was written in two's complement instead of sign and magnitude, as some did.
constexpr int kLowestGround_m = -16000;

struct Cell {
    std::int64_t columns = 0;
    std::int64_t rows = 0;
    std::int64_t first_record = 0;  ///< offset
    Georeference place;
    std::int64_t record_bytes() const { return kRecordHeadBytes + 2 * rows + kChecksumBytes; }
};

// DDDMMSSH or, of the recording's precision, DDDMMSS.SH.
std::optional<double> angle_deg(std::string_view text) {
    if (text.size() != 8) return std::nullopt;
    const auto degrees = whole_number(text.substr(0, 3), 0, 180);
    const auto minutes = whole_number(text.substr(3, 2), 0, 59);
    const auto seconds = whole_number(text.substr(5, 2), 0, 59);
    const char side = text[7];
    if (!degrees || !minutes || !seconds) return std::nullopt;
    const double angle = static_cast<double>(*degrees) + static_cast<double>(*minutes * 60 + *seconds) / 3600;
    if (side == 'N' || side == 'E') return angle;
    if (side == 'S' || side == 'W') return -angle;
    return std::nullopt;
}

// Step in degrees of `count` samples that are some tenths of a second apart. Whole degrees are divided, so that the far
// edge of a cell is exactly its neighbour's near edge.
double step_deg(std::int64_t tenths, std::int64_t count) {
    const double extent = static_cast<double>(tenths * (count - 1)) / 36000;
    return count > 1 ? extent / static_cast<double>(count - 1) : static_cast<double>(tenths) / 36000;
}

Result<Cell> read_labels(const ByteFile& file) {
    std::int64_t at = 0;
    std::string label(static_cast<std::size_t>(kLabelBytes), ' ');
    for (std::int64_t i = 0; i <= kMaxTapeLabels; ++i, at += kLabelBytes) {
        if (auto read = file.read_at(at, std::as_writable_bytes(std::span(label))); !read)
            return unusable_grid(file.path(), "no DTED file: it ends within its header");
        if (!label.starts_with("VOL") && !label.starts_with("HDR")) break;
    }
    if (!label.starts_with("UHL"))
        return unusable_grid(file.path(), "no DTED file: its user header label (UHL) is missing");
    const std::string_view text(label);
    const auto west = angle_deg(text.substr(4, 8));
    const auto south = angle_deg(text.substr(12, 8));
    const auto step_x = whole_number(text.substr(20, 4), 1, 9999);
    const auto step_y = whole_number(text.substr(24, 4), 1, 9999);
    const auto columns = whole_number(text.substr(47, 4), 2, 9999);
    const auto rows = whole_number(text.substr(51, 4), 2, 9999);
    if (!west || !south)
        return unusable_grid(
            file.path(),
            fmt::format("its header places it at '{}', which is no longitude and latitude", text.substr(4, 16)));
    if (!step_x || !step_y || !columns || !rows)
        return unusable_grid(
            file.path(), fmt::format("its header says '{}' x '{}' samples '{}' and '{}' tenths of a "
                                     "second apart, which cannot be",
                                     text.substr(47, 4), text.substr(51, 4), text.substr(20, 4), text.substr(24, 4)));
    Cell cell;
    cell.columns = *columns;
    cell.rows = *rows;
    cell.first_record = at + kLabelBytes + kDsiBytes + kAccBytes;
    cell.place.column_x = step_deg(*step_x, *columns);
    cell.place.row_y = -step_deg(*step_y, *rows);
    cell.place.first_x = *west;
    cell.place.first_y = *south + static_cast<double>(*step_y * (*rows - 1)) / 36000;
    cell.place.raster_is_point = true;
    cell.place.crs = "EPSG:4326";
    cell.place.crs_name = "WGS 84";
    cell.place.geographic = true;
    cell.place.vertical_datum = "EPSG:5773";
    cell.place.height_unit_m = 1;
    return cell;
}

std::uint32_t big_endian(const std::byte* bytes, int count) {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) value = value << 8 | std::to_integer<std::uint32_t>(bytes[i]);
    return value;
}

std::int16_t height_of(const std::byte* bytes) {
    const std::uint32_t stored = big_endian(bytes, 2);
    if (stored < 0x8000) return static_cast<std::int16_t>(stored);
    const int height = -static_cast<int>(stored & 0x7FFF);
    if (height < kLowestGround_m && height != kVoid)
        return static_cast<std::int16_t>(static_cast<int>(stored) - 0x10000);
    return static_cast<std::int16_t>(height);
}

// A record is a column from south to north. Rows are picked out of all columns; every record is checked once, before
// any row is given out.
class DtedDecoder final : public PixelDecoder {
public:
    DtedDecoder(ByteFile file, const Cell& cell) : file_(std::move(file)), cell_(cell) {
        layout_ = {cell.columns, cell.rows, 1, -1, SampleType::i16, 0};
    }

    const DecodedLayout& layout() const override { return layout_; }

    Result<void> decode(std::int64_t begin, std::int64_t end, std::byte* out) override {
        if (!checked_) {
            if (auto ok = check_records(); !ok) return ok;
            checked_ = true;
        }
        const std::int64_t rows = end - begin;
        std::vector<std::byte> part(static_cast<std::size_t>(2 * rows));
        for (std::int64_t column = 0; column < cell_.columns; ++column) {
            const std::int64_t southmost = cell_.rows - end;
            const std::int64_t at =
                cell_.first_record + column * cell_.record_bytes() + kRecordHeadBytes + 2 * southmost;
            if (auto read = file_.read_at(at, part); !read) return read;
            for (std::int64_t row = 0; row < rows; ++row) {
                const std::int16_t height = height_of(part.data() + 2 * (rows - 1 - row));
                std::memcpy(out + 2 * (row * cell_.columns + column), &height, 2);
            }
        }
        return {};
    }

private:
    Result<void> check_records() const {
        std::vector<std::byte> record(static_cast<std::size_t>(cell_.record_bytes()));
        for (std::int64_t column = 0; column < cell_.columns; ++column) {
            if (auto read = file_.read_at(cell_.first_record + column * cell_.record_bytes(), record); !read)
                return read;
            if (std::to_integer<std::uint8_t>(record[0]) != kSentinel)
                return Error{ErrorCode::input,
                             fmt::format("column {} begins with byte {:#04x} where a record begins with 0xaa", column,
                                         std::to_integer<unsigned>(record[0]))};
            const std::uint32_t index = big_endian(record.data() + 4, 2);
            if (index != static_cast<std::uint32_t>(column))
                return Error{ErrorCode::input, fmt::format("column {} says that it is column {}", column, index)};
            std::uint32_t sum = 0;
            const std::size_t summed = record.size() - kChecksumBytes;
            for (std::size_t i = 0; i < summed; ++i) sum += std::to_integer<std::uint32_t>(record[i]);
            const std::uint32_t stored = big_endian(record.data() + summed, kChecksumBytes);
            if (sum != stored)
                return Error{ErrorCode::input, fmt::format("column {}: its bytes add up to {}, its checksum says {}",
                                                           column, sum, stored)};
        }
        return {};
    }

    ByteFile file_;
    Cell cell_;
    DecodedLayout layout_;
    bool checked_ = false;
};

}  // namespace

bool looks_like_dted(std::string_view start) {
    return start.starts_with("UHL1") || (start.starts_with("VOL1") && start.find("UHL1") != std::string_view::npos) ||
           (start.starts_with("HDR1") && start.find("UHL1") != std::string_view::npos);
}

Result<GridFile> open_dted(ByteFile file) {
    const Result<Cell> cell = read_labels(file);
    if (!cell) return cell.error();
    const std::int64_t needed = cell->first_record + cell->columns * cell->record_bytes();
    if (needed > file.size())
        return unusable_grid(file.path(),
                             fmt::format("{} columns of {} samples need {} bytes, but the file has {}; it is cut off",
                                         cell->columns, cell->rows, needed, file.size()));
    GridFile grid;
    grid.nodata = fmt::format("{}", kVoid);
    grid.georeference = cell->place;
    grid.decoder = std::make_unique<DtedDecoder>(std::move(file), *cell);
    return grid;
}

}  // namespace scree
