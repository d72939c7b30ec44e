#include "tools/cli/samples_command.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/cli/arguments.h"
#include "common/process_usage.h"
#include "common/progress.h"
#include "common/report.h"
#include "common/store/byte_io.h"
#include "tools/cli/height_options.h"
#include "tools/mosaic/mosaic_plan.h"
#include "tools/mosaic/sample_positions.h"
#include "tools/mosaic/visible_samples.h"
#include "tools/partial_file.h"
#include "tools/source/isolated_decoder.h"

namespace scree {
namespace {

constexpr std::uint32_t kVersion = 2;
constexpr std::int64_t kBandRows = RasterSpool<float>::kBlock;
constexpr std::int64_t kWindowColumns = 64 * RasterSpool<float>::kBlock;
constexpr std::int64_t kMaxSide = (std::int64_t{1} << 30) + 1;       // as along the largest lattice
constexpr std::int64_t kLeastMemoryBytes = std::int64_t{192} << 20;  // as for a build: most of it is OpenImageIO itself

struct SamplesOptions {
    MosaicRequest request;
    std::string out;
    int descriptor = -1;
    std::int64_t memory_bytes = 0;
    bool force = false, quiet = false;
};

struct Block {
    std::vector<std::string> names;
    std::int64_t columns = 0, rows = 0, step = 1, sample_bytes = 4;
    std::int64_t control_offset = 0, offset = 0;
    std::int64_t valid = 0, hidden = 0;
    double lowest_m = std::numeric_limits<double>::infinity(), highest_m = -lowest_m;
    std::int64_t bytes() const { return columns * rows * sample_bytes; }
};

Error stopped() { return {ErrorCode::interrupted, "stopped; nothing was written"}; }
std::string file_name(const std::string& path) { return std::filesystem::path(path).filename().string(); }
std::int64_t aligned(std::int64_t bytes) { return (bytes + 7) / 8 * 8; }

std::vector<std::uint8_t> encode_header(const std::vector<Block>& blocks) {
    std::vector<std::uint8_t> bytes;
    ByteWriter out(bytes);
    const auto text = [&](const std::string& s) {
        out.bytes({reinterpret_cast<const std::uint8_t*>(s.data()), s.size()});
    };
    text("SCREESMP");
    out.u32(kVersion);
    out.u32(static_cast<std::uint32_t>(blocks.size()));
    for (const Block& b : blocks) {
        out.u32(static_cast<std::uint32_t>(b.names.size()));
        for (const std::string& name : b.names) {
            out.u32(static_cast<std::uint32_t>(name.size()));
            text(name);
        }
        for (const std::int64_t v : {b.columns, b.rows, b.step}) out.u64(static_cast<std::uint64_t>(v));
        out.u32(static_cast<std::uint32_t>(b.sample_bytes));
        for (const std::int64_t v : {b.control_offset, b.offset}) out.u64(static_cast<std::uint64_t>(v));
    }
    return bytes;
}

class SamplesWriter {
public:
    SamplesWriter(const SamplesOptions& options, const MosaicPlan& plan, int descriptor, Progress& progress)
        : options_(options), plan_(plan), fd_(descriptor), progress_(progress) {}

    Result<std::vector<Block>> write() {
        double samples = 0;
        for (const PlacedFile& f : plan_.heights)
            samples += static_cast<double>(f.info.width) * static_cast<double>(f.info.height);
        for (const Layer& l : plan_.height_layers)
            samples += static_cast<double>(l.columns) * static_cast<double>(l.rows);
        progress_.set_total(samples / 1e6);
        if (auto ok = lay_out(); !ok) return ok.error();
        const StackOptions reading{Kernel::bilinear, options_.request.open, options_.request.reading, temporary()};
        auto stack =
            HeightStack::read(plan_.heights, plan_.height_layers, plan_.same_units, reading, [&](std::int64_t count) {
                progress_.add(static_cast<double>(count) / 1e6);
                return !interrupt_flag();
            });
        if (!stack) return stack.error();
        stack_ = std::move(*stack);
        auto visible = VisibleSamples::make(*stack_);
        if (!visible) return visible.error();
        for (std::size_t k = 0; k < blocks_.size(); ++k) {
            if (auto ok = write_control(k); !ok) return ok.error();
            if (auto ok = write_samples(k, *visible); !ok) return ok.error();
        }
        // The header comes last: what was cut short has no magic.
        const auto header = encode_header(blocks_);
        if (auto ok = write_at(header.data(), static_cast<std::int64_t>(header.size()), 0); !ok) return ok.error();
        return blocks_;
    }

private:
    std::string temporary() const {
        if (!options_.out.empty()) return options_.out;
        const char* chosen = std::getenv("TMPDIR");
        return (chosen != nullptr && *chosen != '\0' ? std::string(chosen) : "/tmp") + "/scree-samples";
    }

    // Where everything goes, before anything is read.
    Result<void> lay_out() {
        if (plan_.same_units)
            units_ = units_of(plan_.heights.front().info, plan_.heights.front().where, options_.request.reading);
        for (const Layer& layer : plan_.height_layers) {
            Block block;
            block.columns = layer.columns;
            block.rows = layer.rows;
            bool exact_in_float = true;
            for (const LayerMember& member : layer.members) {
                const PlacedFile& f = plan_.heights[member.file];
                block.names.push_back(file_name(f.path));
                exact_in_float = exact_in_float && fits_float32(f.info.type) && !f.datum_change &&
                                 units_of(f.info, f.where, options_.request.reading) == HeightUnits{};
            }
            block.sample_bytes = exact_in_float ? 4 : 8;
            if (layer.columns > kMaxSide || layer.rows > kMaxSide)
                return Error{ErrorCode::input, fmt::format("{}: its grid with the files beside it has {} x {} samples; "
                                                           "at most {} a side are written",
                                                           plan_.heights[layer.members.front().file].path,
                                                           layer.columns, layer.rows, kMaxSide)};
            auto positions = SamplePositions::make(layer, plan_.crs);
            if (!positions) return positions.error();
            block.step = positions->columns().step;
            positions_.push_back(std::move(*positions));
            blocks_.push_back(std::move(block));
        }
        std::int64_t end = aligned(static_cast<std::int64_t>(encode_header(blocks_).size()));
        for (std::size_t k = 0; k < blocks_.size(); ++k) {
            blocks_[k].control_offset = end;
            end += positions_[k].columns().points() * positions_[k].rows().points() * 16;
            blocks_[k].offset = end;
            end = aligned(end + blocks_[k].bytes());
        }
        return {};
    }

    Result<void> write_control(std::size_t k) const {
        const std::int64_t columns = positions_[k].columns().points(), rows = positions_[k].rows().points();
        std::vector<PlanePoint> points;
        std::vector<double> numbers;
        for (std::int64_t row = 0; row < rows; ++row)
            for (std::int64_t column = 0; column < columns; column += kWindowColumns) {
                const std::int64_t count = std::min(kWindowColumns, columns - column);
                points.resize(static_cast<std::size_t>(count));
                if (auto ok = positions_[k].control(column, row, count, 1, points); !ok) return ok;
                numbers.clear();
                for (const PlanePoint& p : points) numbers.insert(numbers.end(), {p.x, p.y});
                const std::int64_t at = blocks_[k].control_offset + (row * columns + column) * 16;
                if (auto ok = write_at(numbers.data(), count * 16, at); !ok) return ok;
            }
        return {};
    }

    Result<void> write_samples(std::size_t k, const VisibleSamples& visible) {
        Block& block = blocks_[k];
        std::vector<double> values;
        for (std::int64_t row = 0; row < block.rows; row += kBandRows) {
            const std::int64_t rows = std::min(kBandRows, block.rows - row);
            for (std::int64_t column = 0; column < block.columns; column += kWindowColumns) {
                if (interrupt_flag()) return stopped();
                const std::int64_t columns = std::min(kWindowColumns, block.columns - column);
                values.resize(static_cast<std::size_t>(columns * rows));
                if (auto ok = visible.read(k, column, row, columns, rows, values); !ok) return ok;
                if (auto ok = to_metres(k, values); !ok) return ok;
                for (std::int64_t r = 0; r < rows; ++r) {
                    const std::span<const double> line(values.data() + r * columns, static_cast<std::size_t>(columns));
                    if (auto ok = write_line(line, block, (row + r) * block.columns + column); !ok) return ok;
                }
                progress_.add(static_cast<double>(columns * rows) / 1e6);
            }
        }
        return {};
    }

    Result<void> to_metres(std::size_t k, std::span<double> values) {
        Block& block = blocks_[k];
        for (double& v : values) {
            if (v == kHiddenSample) ++block.hidden;
            if (!std::isfinite(v)) continue;
            const double raw = v;
            v = v * units_.scale + units_.offset_m;
            if (!std::isfinite(v))
                return Error{
                    ErrorCode::input,
                    fmt::format("{}: value {} times --height-scale {} is no finite height",
                                plan_.heights[plan_.height_layers[k].members.front().file].path, raw, units_.scale)};
            ++block.valid;
            block.lowest_m = std::min(block.lowest_m, v);
            block.highest_m = std::max(block.highest_m, v);
        }
        return {};
    }

    Result<void> write_line(std::span<const double> line, const Block& block, std::int64_t first) {
        static_assert(std::endian::native == std::endian::little && std::numeric_limits<float>::is_iec559);
        const std::int64_t offset = block.offset + first * block.sample_bytes;
        const auto count = static_cast<std::int64_t>(line.size());
        if (block.sample_bytes == 8) return write_at(line.data(), count * 8, offset);
        narrow_.resize(line.size());
        std::transform(line.begin(), line.end(), narrow_.begin(), [](double v) { return static_cast<float>(v); });
        return write_at(narrow_.data(), count * 4, offset);
    }

    Result<void> write_at(const void* data, std::int64_t size, std::int64_t offset) const {
        const auto* from = static_cast<const std::uint8_t*>(data);
        while (size > 0) {
            const ssize_t n = ::pwrite(fd_, from, static_cast<std::size_t>(size), offset);
            if (n < 0 && errno == EINTR) {
                if (interrupt_flag()) return stopped();
                continue;
            }
            if (n <= 0)
                return Error{ErrorCode::io, fmt::format("{}: cannot write the samples: {}",
                                                        options_.out.empty() ? "--fd" : options_.out,
                                                        n < 0 ? std::strerror(errno) : "the disk takes no more")};
            from += n;
            size -= n;
            offset += n;
        }
        return {};
    }

    const SamplesOptions& options_;
    const MosaicPlan& plan_;
    int fd_;
    Progress& progress_;
    std::unique_ptr<HeightStack> stack_;
    std::vector<SamplePositions> positions_;
    std::vector<Block> blocks_;
    HeightUnits units_;  ///< of raw values
    std::vector<float> narrow_;
};

Result<void> check_output(const SamplesOptions& o, const MosaicPlan& plan) {
    std::error_code error;
    for (const PlacedFile& source : plan.heights)
        if (std::filesystem::equivalent(source.path, o.out, error))
            return Error{ErrorCode::usage, fmt::format("{}: is an input, and the output would replace it", o.out)};
    const auto status = std::filesystem::status(o.out, error);
    if (!std::filesystem::exists(status)) return {};
    if (!o.force) return Error{ErrorCode::usage, fmt::format("{}: exists; --force replaces it", o.out)};
    if (!std::filesystem::is_regular_file(status))
        return Error{ErrorCode::usage, fmt::format("{}: is not a regular file", o.out)};
    return {};
}

Result<std::vector<Block>> write_file(const SamplesOptions& o, const MosaicPlan& plan, Progress& progress) {
    if (auto ok = check_output(o, plan); !ok) return ok.error();
    auto partial = PartialFile::create(o.out + ".partial");
    if (!partial) return partial.error();
    auto blocks = SamplesWriter(o, plan, (*partial)->descriptor(), progress).write();
    if (!blocks) return blocks;
    if (interrupt_flag()) return stopped();
    if (auto ok = (*partial)->rename_to(o.out); !ok) return ok.error();
    return blocks;
}

Result<std::vector<Block>> write_descriptor(const SamplesOptions& o, const MosaicPlan& plan, Progress& progress) {
    struct stat status {};
    const int flags = ::fcntl(o.descriptor, F_GETFL);
    // Linux writes at the end, whatever the offset, where a file was opened to append.
    if (flags < 0 || (flags & O_ACCMODE) == O_RDONLY || (flags & O_APPEND) != 0 ||
        ::fstat(o.descriptor, &status) != 0 || !S_ISREG(status.st_mode))
        return Error{ErrorCode::usage, fmt::format("--fd {} is not a file open for writing", o.descriptor)};
    if (::ftruncate(o.descriptor, 0) != 0)
        return Error{ErrorCode::io, fmt::format("--fd {}: {}", o.descriptor, std::strerror(errno))};
    return SamplesWriter(o, plan, o.descriptor, progress).write();
}

Result<void> check_memory(const SamplesOptions& o, const MosaicPlan& plan) {
    for (const PlacedFile& f : plan.heights) {
        const std::int64_t band_bytes =
            f.info.width * kBandRows * 24 + 2 * f.info.unit_bytes;  // read, spooled, written
        if (band_bytes > o.memory_bytes / 2)
            return Error{ErrorCode::usage,
                         fmt::format("{}: --memory {} MiB is not enough for rows of {} samples: {} MiB are needed",
                                     f.path, o.memory_bytes >> 20, f.info.width, (2 * band_bytes >> 20) + 1)};
    }
    return {};
}

std::string json_of(const std::vector<Block>& blocks, const MosaicPlan& plan, double seconds) {
    const ProcessUsage usage = process_usage();
    const DecoderUsage decoders = decoder_usage();
    nlohmann::ordered_json json = {{"seconds", seconds},
                                   {"cpu_seconds", usage.cpu_seconds + decoders.cpu_seconds},
                                   {"peak_rss_bytes", usage.peak_rss_bytes + decoders.peak_rss_bytes},
                                   {"crs", plan.crs_known ? plan.crs.text() : ""}};
    for (const Block& b : blocks) {
        nlohmann::ordered_json layer = {
            {"names", b.names},       {"samples", {b.columns, b.rows}}, {"sample_bytes", b.sample_bytes},
            {"control_step", b.step}, {"valid_samples", b.valid},       {"hidden_samples", b.hidden}};
        if (b.valid > 0) layer["height_range_m"] = {b.lowest_m, b.highest_m};
        json["layers"].push_back(std::move(layer));
    }
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

int run_samples(int argc, char** argv) {
    CLI::App app{"Writes the samples of DEMs raw, as they are read and placed, to judge a store by.", "scree samples"};
    SamplesOptions o;
    std::string memory = "256M", json;
    app.add_option("DEM", o.request.heights,
                   "Heights: files and folders; where several have a value the later one lies on top")
        ->required()
        ->expected(1, -1);
    auto* out = app.add_option("-o,--output", o.out, "The file to write")->type_name("FILE");
    app.add_option("--fd", o.descriptor, "Instead of -o: number of a file that is already open for writing")
        ->excludes(out)
        ->check(CLI::Range(3, 1 << 20));
    add_height_options(app, o.request.reading);
    app.add_option("--crs", o.request.crs, "CRS of the positions, as for scree build: that of the store");
    app.add_option("--assume-crs", o.request.assume_crs, "CRS of files that name none");
    app.add_flag("--assume-same-datum", o.request.assume_same_datum, "Take heights above different datums as they are");
    app.add_option("--memory", memory, "Ceiling of resident memory, at least 192M")->capture_default_str();
    app.add_flag("--force", o.force, "Replace an existing OUT");
    app.add_flag("--quiet", o.quiet, "No progress");
    add_json_option(app, json);
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    const auto failed = [](const Error& error) { return report_error("scree samples", error); };
    if (o.out.empty() && o.descriptor < 0) return failed({ErrorCode::usage, "-o FILE or --fd N is required"});
    o.memory_bytes = parse_bytes(memory).value_or(0);
    if (o.memory_bytes < kLeastMemoryBytes)
        return failed({ErrorCode::usage,
                       fmt::format("--memory {} is not a size of at least {} MiB", memory, kLeastMemoryBytes >> 20)});
    o.request.open.max_unit_bytes = o.memory_bytes / 4;
    if (auto ok = check_height_reading(o.request.reading); !ok) return failed(ok.error());

    install_interrupt_handler();
    const auto start = std::chrono::steady_clock::now();
    const auto plan = plan_mosaic(o.request);
    if (!plan) return failed(plan.error());
    if (auto ok = check_memory(o, *plan); !ok) return failed(ok.error());
    Progress progress("samples", "MPix", o.quiet);
    const auto blocks = o.descriptor < 0 ? write_file(o, *plan, progress) : write_descriptor(o, *plan, progress);
    if (!blocks) return failed(blocks.error());
    progress.finish();
    if (json.empty()) return 0;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (auto ok = write_text(json, json_of(*blocks, *plan, seconds)); !ok) return failed(ok.error());
    return 0;
}

}  // namespace scree
