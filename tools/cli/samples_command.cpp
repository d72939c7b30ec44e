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
#include <cstring>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/lattice.h"
#include "common/process_usage.h"
#include "common/report.h"
#include "common/store/byte_io.h"
#include "tools/cli/height_options.h"
#include "tools/partial_file.h"
#include "tools/progress.h"
#include "tools/source/isolated_decoder.h"

namespace scree {
namespace {

constexpr std::uint32_t kVersion = 1;
constexpr std::int64_t kBandBytes = std::int64_t{1} << 20;
constexpr std::int64_t kLeastMemoryBytes = std::int64_t{192} << 20;  // as for a build: most of it is OpenImageIO itself

struct SamplesOptions {
    HeightReading reading;
    std::vector<std::string> sources;
    std::string out;
    int descriptor = -1;
    std::int64_t memory_bytes = 0;
    bool force = false, quiet = false;
};

struct Block {
    std::string name;
    HeightPlace place;
    std::int64_t columns = 0, rows = 0, sample_bytes = 4, offset = 0;
    std::int64_t valid = 0;
    double lowest_m = std::numeric_limits<double>::infinity(), highest_m = -lowest_m;
    std::int64_t bytes() const { return columns * rows * sample_bytes; }
};

Error stopped() { return {ErrorCode::interrupted, "stopped; nothing was written"}; }
std::string file_name(const std::string& path) { return std::filesystem::path(path).filename().string(); }
std::int64_t aligned(std::int64_t bytes) { return (bytes + 7) / 8 * 8; }

std::int64_t header_bytes(const std::vector<std::string>& sources) {
    std::int64_t bytes = 8 + 4 + 4;
    for (const std::string& path : sources)
        bytes += 4 + static_cast<std::int64_t>(file_name(path).size()) + 4 * 8 + 2 * 8 + 4 + 8;
    return bytes;
}

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
        out.u32(static_cast<std::uint32_t>(b.name.size()));
        text(b.name);
        for (const double v : {b.place.x_m, b.place.y_m, b.place.step_x_m, b.place.step_y_m}) out.f64(v);
        out.u64(static_cast<std::uint64_t>(b.columns));
        out.u64(static_cast<std::uint64_t>(b.rows));
        out.u32(static_cast<std::uint32_t>(b.sample_bytes));
        out.u64(static_cast<std::uint64_t>(b.offset));
    }
    return bytes;
}

class SamplesWriter {
public:
    SamplesWriter(const SamplesOptions& options, int descriptor, Progress& progress)
        : options_(options), fd_(descriptor), progress_(progress) {}

    Result<std::vector<Block>> write() {
        std::vector<Block> blocks;
        end_ = aligned(header_bytes(options_.sources));
        progress_.set_total(static_cast<double>(options_.sources.size()));
        for (const std::string& path : options_.sources) {
            auto block = write_source(path);
            if (!block) return block.error();
            blocks.push_back(std::move(*block));
        }
        // The header comes last: what was cut short has no magic.
        const auto header = encode_header(blocks);
        if (auto ok = write_at(header.data(), static_cast<std::int64_t>(header.size()), 0); !ok) return ok.error();
        return blocks;
    }

private:
    Result<Block> write_source(const std::string& path) {
        auto dem = open_heights(path, {options_.memory_bytes / 4});
        if (!dem) return dem.error();
        const ImageInfo& info = (*dem)->info();
        const auto place = place_heights(path, **dem, options_.reading);
        if (!place) return place.error();
        // What a build would refuse as no lattice is refused here, too.
        const auto lattice =
            make_lattice(place->x_m, place->y_m, place->step_x_m, info.width - 1, info.height - 1, kMinTileCellsLog2);
        if (!lattice) return Error{lattice.error().code, fmt::format("{}: {}", path, lattice.error().message)};
        const HeightReading& r = options_.reading;
        const bool exact_in_float = fits_float32(info.type) && r.height_scale == 1 && r.height_offset_m == 0;
        const std::int64_t row_bytes = info.width * 12;  // as read, and as written
        if (row_bytes > options_.memory_bytes / 4)
            return Error{ErrorCode::usage,
                         fmt::format("{}: --memory {} MiB is not enough for rows of {} samples: {} MiB are needed",
                                     path, options_.memory_bytes >> 20, info.width, (4 * row_bytes >> 20) + 1)};
        Block block{file_name(path), *place, info.width, info.height, exact_in_float ? 4 : 8, end_};
        end_ += aligned(block.bytes());
        if (auto ok = write_rows(path, **dem, block); !ok) return ok.error();
        ++sources_done_;
        return block;
    }

    Result<void> write_rows(const std::string& path, ImageSource& dem, Block& block) {
        const VoidRule voids(dem.info(), options_.reading);
        const std::int64_t band_rows = std::clamp<std::int64_t>(kBandBytes / (block.columns * 8), 1, block.rows);
        std::vector<double> heights(static_cast<std::size_t>(band_rows * block.columns));
        for (std::int64_t row = 0; row < block.rows; row += band_rows) {
            if (interrupt_flag()) return stopped();
            const std::int64_t rows = std::min(band_rows, block.rows - row);
            const std::span<double> band(heights.data(), static_cast<std::size_t>(rows * block.columns));
            if (auto ok = dem.read_channel(row, row + rows, band); !ok) return ok;
            voids.apply(band);
            if (auto ok = to_metres(path, band, block); !ok) return ok;
            if (auto ok = write_band(band, block, row); !ok) return ok;
            progress_.update(static_cast<double>(sources_done_) +
                             static_cast<double>(row + rows) / static_cast<double>(block.rows));
        }
        return {};
    }

    Result<void> to_metres(const std::string& path, std::span<double> band, Block& block) const {
        for (double& v : band) {
            if (std::isnan(v)) continue;
            const double raw = v;
            v = v * options_.reading.height_scale + options_.reading.height_offset_m;
            if (!std::isfinite(v))
                return Error{ErrorCode::input, fmt::format("{}: value {} times --height-scale {} is no finite height",
                                                           path, raw, options_.reading.height_scale)};
            ++block.valid;
            block.lowest_m = std::min(block.lowest_m, v);
            block.highest_m = std::max(block.highest_m, v);
        }
        return {};
    }

    Result<void> write_band(std::span<const double> band, const Block& block, std::int64_t row) {
        static_assert(std::endian::native == std::endian::little && std::numeric_limits<float>::is_iec559);
        const std::int64_t offset = block.offset + row * block.columns * block.sample_bytes;
        const auto count = static_cast<std::int64_t>(band.size());
        if (block.sample_bytes == 8) return write_at(band.data(), count * 8, offset);
        narrow_.resize(band.size());
        std::transform(band.begin(), band.end(), narrow_.begin(), [](double v) { return static_cast<float>(v); });
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
    int fd_;
    Progress& progress_;
    std::int64_t end_ = 0, sources_done_ = 0;
    std::vector<float> narrow_;
};

Result<void> check_output(const SamplesOptions& o) {
    std::error_code error;
    for (const std::string& source : o.sources)
        if (std::filesystem::equivalent(source, o.out, error))
            return Error{ErrorCode::usage, fmt::format("{}: is an input, and the output would replace it", o.out)};
    const auto status = std::filesystem::status(o.out, error);
    if (!std::filesystem::exists(status)) return {};
    if (!o.force) return Error{ErrorCode::usage, fmt::format("{}: exists; --force replaces it", o.out)};
    if (!std::filesystem::is_regular_file(status))
        return Error{ErrorCode::usage, fmt::format("{}: is not a regular file", o.out)};
    return {};
}

Result<std::vector<Block>> write_file(const SamplesOptions& o, Progress& progress) {
    if (auto ok = check_output(o); !ok) return ok.error();
    auto partial = PartialFile::create(o.out + ".partial");
    if (!partial) return partial.error();
    auto blocks = SamplesWriter(o, (*partial)->descriptor(), progress).write();
    if (!blocks) return blocks;
    if (interrupt_flag()) return stopped();
    if (auto ok = (*partial)->rename_to(o.out); !ok) return ok.error();
    return blocks;
}

Result<std::vector<Block>> write_descriptor(const SamplesOptions& o, Progress& progress) {
    struct stat status {};
    const int flags = ::fcntl(o.descriptor, F_GETFL);
    // Linux writes at the end, whatever the offset, where a file was opened to append.
    if (flags < 0 || (flags & O_ACCMODE) == O_RDONLY || (flags & O_APPEND) != 0 ||
        ::fstat(o.descriptor, &status) != 0 || !S_ISREG(status.st_mode))
        return Error{ErrorCode::usage, fmt::format("--fd {} is not a file open for writing", o.descriptor)};
    if (::ftruncate(o.descriptor, 0) != 0)
        return Error{ErrorCode::io, fmt::format("--fd {}: {}", o.descriptor, std::strerror(errno))};
    return SamplesWriter(o, o.descriptor, progress).write();
}

std::string json_of(const std::vector<Block>& blocks, double seconds) {
    const ProcessUsage usage = process_usage();
    const DecoderUsage decoders = decoder_usage();
    nlohmann::ordered_json json = {{"seconds", seconds},
                                   {"cpu_seconds", usage.cpu_seconds + decoders.cpu_seconds},
                                   {"peak_rss_bytes", usage.peak_rss_bytes + decoders.peak_rss_bytes}};
    for (const Block& b : blocks) {
        nlohmann::ordered_json source = {{"name", b.name},
                                         {"first_m", {b.place.x_m, b.place.y_m}},
                                         {"spacing_m", {b.place.step_x_m, b.place.step_y_m}},
                                         {"samples", {b.columns, b.rows}},
                                         {"sample_bytes", b.sample_bytes},
                                         {"valid_samples", b.valid}};
        if (b.valid > 0) source["height_range_m"] = {b.lowest_m, b.highest_m};
        json["sources"].push_back(std::move(source));
    }
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

int run_samples(int argc, char** argv) {
    CLI::App app{"Writes the samples of DEMs raw, as they are read and placed, to judge a store by.", "scree samples"};
    SamplesOptions o;
    std::string memory = "256M", json;
    app.add_option("DEM", o.sources, "Heights: GeoTIFF or any image; channel 1")->required()->expected(1, -1);
    auto* out = app.add_option("-o,--output", o.out, "The file to write");
    app.add_option("--fd", o.descriptor, "Instead of -o: number of a file that is already open for writing")
        ->excludes(out)
        ->check(CLI::Range(3, 1 << 20));
    add_height_options(app, o.reading);
    app.add_option("--memory", memory, "Ceiling of resident memory, at least 192M")->capture_default_str();
    app.add_flag("--force", o.force, "Replace an existing OUT");
    app.add_flag("--quiet", o.quiet, "No progress");
    app.add_option("--json", json, "Write the report as JSON to a file, or - for standard output");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorCode::usage);
    }
    const auto failed = [](const Error& error) { return report_error("scree samples", error); };
    if (o.out.empty() && o.descriptor < 0) return failed({ErrorCode::usage, "-o FILE or --fd N is required"});
    o.memory_bytes = parse_bytes(memory).value_or(0);
    if (o.memory_bytes < kLeastMemoryBytes)
        return failed({ErrorCode::usage,
                       fmt::format("--memory {} is not a size of at least {} MiB", memory, kLeastMemoryBytes >> 20)});
    if (auto ok = check_height_reading(o.reading); !ok) return failed(ok.error());

    install_interrupt_handler();
    const auto start = std::chrono::steady_clock::now();
    Progress progress("samples", "source", o.quiet);
    const auto blocks = o.descriptor < 0 ? write_file(o, progress) : write_descriptor(o, progress);
    if (!blocks) return failed(blocks.error());
    progress.finish();
    if (json.empty()) return 0;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (auto ok = write_text(json, json_of(*blocks, seconds)); !ok) return failed(ok.error());
    return 0;
}

}  // namespace scree
