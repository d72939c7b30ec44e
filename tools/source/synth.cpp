#include "tools/source/synth.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <exception>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <fmt/format.h>
#include <tiffio.h>

#include <geotiff/geokeys.h>
#include <geotiff/geotiff.h>
#include <geotiff/geovalues.h>
#include <geotiff/xtiffio.h>

#include "tools/source/band_pipeline.h"
#include "tools/source/landscape.h"
#include "tools/source/tiff_file.h"

namespace scree {
namespace {

constexpr std::int64_t kMaxSize = std::int64_t{1} << 20;
constexpr int kMaxImageryScale = 64;
constexpr int kMaxThreads = 256;
constexpr double kMinSpacing_m = 0.001;      // below, coordinates of 5,300,000 m lose their last digits
constexpr double kMaxExtent_m = 10'000'000;  // a quarter of the way round the Earth; a UTM zone ends long before
constexpr double kFirstX_m = 400'000;        // the north-west sample, in UTM zone 33 north
constexpr double kFirstY_m = 5'300'000;
constexpr unsigned short kUtm33North = 32633;
constexpr std::int64_t kBandBytes = 2 << 20;  // a strip: large enough to write fast, small enough for one a thread
constexpr std::int64_t kClassicTiffBytes = 3'500'000'000;  // offsets of a classic TIFF end at 2^32; tags need room too
constexpr std::int64_t kSpareBytes = 16 << 20;             // of free space: tags, strip offsets, directories
constexpr std::chrono::milliseconds kProgressInterval{200};

using Clock = std::chrono::steady_clock;

Error usage(const std::string& message) { return {ErrorCode::usage, message}; }

Error io_error(const std::string& message) { return {ErrorCode::io, message}; }

Result<void> check(const SynthOptions& options) {
    if (options.directory.empty()) return usage("no output directory was given");
    if (options.size < 3 || options.size > kMaxSize)
        return usage(fmt::format("--size {} is outside 3..{}", options.size, kMaxSize));
    if (!std::isfinite(options.spacing_m) || options.spacing_m < kMinSpacing_m)
        return usage(
            fmt::format("--spacing {} must be a number of metres, at least {}", options.spacing_m, kMinSpacing_m));
    if (static_cast<double>(options.size - 1) * options.spacing_m > kMaxExtent_m)
        return usage(fmt::format(
            "--size {} at --spacing {} is {:.0f} km wide; at most {:.0f} km fit the coordinate system", options.size,
            options.spacing_m, static_cast<double>(options.size - 1) * options.spacing_m / 1000, kMaxExtent_m / 1000));
    if (options.imagery_scale < 0 || options.imagery_scale > kMaxImageryScale)
        return usage(fmt::format("--imagery-scale {} is outside 0..{}", options.imagery_scale, kMaxImageryScale));
    if ((options.size - 1) * options.imagery_scale > std::int64_t{1} << 24)
        return usage(
            fmt::format("--size {} with --imagery-scale {} asks for an image of {} pixels a side; 2^24 is the most",
                        options.size, options.imagery_scale, (options.size - 1) * options.imagery_scale));
    if (options.threads < 0 || options.threads > kMaxThreads)
        return usage(fmt::format("--threads {} is outside 0..{}", options.threads, kMaxThreads));
    return {};
}

// A file that exists as NAME.partial until it is complete; removes what is left of it when it is not.
class PartialFile {
public:
    explicit PartialFile(std::string final_path)
        : final_path_(std::move(final_path)), partial_path_(final_path_ + ".partial") {}
    ~PartialFile() {
        if (!committed_) ::unlink(partial_path_.c_str());
    }
    PartialFile(const PartialFile&) = delete;
    PartialFile& operator=(const PartialFile&) = delete;

    const std::string& path() const { return partial_path_; }
    const std::string& final_path() const { return final_path_; }

    Result<void> sync() const {
        const int file = ::open(partial_path_.c_str(), O_RDONLY | O_CLOEXEC);
        const bool synced = file >= 0 && ::fsync(file) == 0;
        const int reason = errno;
        if (file >= 0) ::close(file);
        if (!synced)
            return io_error(fmt::format("{}: cannot be written out ({})", partial_path_, std::strerror(reason)));
        return {};
    }
    Result<void> commit() {
        if (::rename(partial_path_.c_str(), final_path_.c_str()) != 0)
            return io_error(
                fmt::format("{}: cannot be named {} ({})", partial_path_, final_path_, std::strerror(errno)));
        committed_ = true;
        return {};
    }

private:
    std::string final_path_;
    std::string partial_path_;
    bool committed_ = false;
};

Landscape::Ground between(const Landscape::Ground& a, const Landscape::Ground& b, float t) {
    return {a.height_m + t * (b.height_m - a.height_m),
            a.slope_east + t * (b.slope_east - a.slope_east),
            a.slope_south + t * (b.slope_south - a.slope_south),
            {a.cover.patch + t * (b.cover.patch - a.cover.patch), a.cover.wide + t * (b.cover.wide - a.cover.wide)}};
}

struct RasterLayout {
    std::int64_t side = 0;  ///< pixels
    int channels = 1;
    int bits = 8;
    double step_m = 1;
    bool is_point = false;

    std::int64_t row_bytes() const { return side * channels * (bits / 8); }
    std::int64_t bytes() const { return row_bytes() * side; }
    std::int64_t band_rows() const {
        return std::clamp<std::int64_t>(kBandBytes / row_bytes(), 1, std::min<std::int64_t>(side, 256));
    }
    std::int64_t bands() const { return (side + band_rows() - 1) / band_rows(); }
};

Result<void> write_header(TiffFile& file, const RasterLayout& layout, const std::string& path) {
    TIFF* tiff = file.get();
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(layout.side));
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(layout.side));
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, layout.channels);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, layout.bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, layout.bits == 32 ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, layout.channels == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, static_cast<std::uint32_t>(layout.band_rows()));
    const double scale[3] = {layout.step_m, layout.step_m, 0};
    const double tie_point[6] = {0, 0, 0, kFirstX_m, kFirstY_m, 0};
    TIFFSetField(tiff, TIFFTAG_GEOPIXELSCALE, 3, scale);
    TIFFSetField(tiff, TIFFTAG_GEOTIEPOINTS, 6, tie_point);

    GTIF* keys = GTIFNew(tiff);
    if (keys == nullptr) return io_error(fmt::format("{}: its GeoTIFF keys cannot be made", path));
    GTIFKeySet(keys, GTModelTypeGeoKey, TYPE_SHORT, 1, ModelTypeProjected);
    GTIFKeySet(keys, GTRasterTypeGeoKey, TYPE_SHORT, 1, layout.is_point ? RasterPixelIsPoint : RasterPixelIsArea);
    GTIFKeySet(keys, ProjectedCSTypeGeoKey, TYPE_SHORT, 1, kUtm33North);
    GTIFKeySet(keys, GTCitationGeoKey, TYPE_ASCII, 0, "WGS 84 / UTM zone 33N");
    GTIFKeySet(keys, ProjLinearUnitsGeoKey, TYPE_SHORT, 1, Linear_Meter);
    const bool written = GTIFWriteKeys(keys) == 1;
    GTIFFree(keys);
    if (!written || !file.messages().empty())
        return io_error(fmt::format("{}: its header cannot be written ({})", path, file.messages()));
    return {};
}

class Synthesis {
public:
    Synthesis(const SynthOptions& options, ProgressSink progress)
        : options_(options),
          progress_(std::move(progress)),
          landscape_(options.seed),
          dem_{options.size, 1, 32, options.spacing_m, true},
          ortho_{(options.size - 1) * options.imagery_scale, 3, 8,
                 options.imagery_scale > 0 ? options.spacing_m / options.imagery_scale : 0, false} {
        const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
        threads_ = options.threads > 0 ? options.threads : static_cast<int>(std::min<unsigned>(cores, kMaxThreads));
    }

    Result<SynthReport> run() {
        const std::filesystem::path directory(options_.directory);
        if (Result<void> ready = prepare(directory); !ready) return ready.error();
        PartialFile dem((directory / "dem.tif").string());
        PartialFile ortho((directory / "ortho.tif").string());

        const Clock::time_point start = Clock::now();
        if (Result<void> done = write_raster(dem.path(), dem_, "dem", nullptr); !done) return done.error();
        report_.dem_seconds = std::chrono::duration<double>(Clock::now() - start).count();
        const Clock::time_point middle = Clock::now();
        if (has_ortho()) {
            if (Result<void> done = write_raster(ortho.path(), ortho_, "ortho", &dem.path()); !done)
                return done.error();
            report_.ortho_seconds = std::chrono::duration<double>(Clock::now() - middle).count();
        }
        if (Result<void> synced = dem.sync(); !synced) return synced.error();
        if (has_ortho()) {
            if (Result<void> synced = ortho.sync(); !synced) return synced.error();
            if (Result<void> named = ortho.commit(); !named) return named.error();
            report_.ortho_path = ortho.final_path();
        }
        if (Result<void> named = dem.commit(); !named) return named.error();
        report_.dem_path = dem.final_path();
        report_.dem_samples = dem_.side;
        report_.ortho_pixels = has_ortho() ? ortho_.side : 0;
        report_.bytes = total_bytes();
        return report_;
    }

private:
    // What one thread needs to make a band.
    struct Worker {
        std::vector<float> heights;        ///< the DEM band, or the DEM rows under an ortho band
        std::vector<std::uint8_t> pixels;  ///< the ortho band
        std::unique_ptr<TiffFile> dem;     ///< its own handle: libtiff's are for one thread
        float lowest_m = std::numeric_limits<float>::max();
        float highest_m = std::numeric_limits<float>::lowest();
    };

    bool has_ortho() const { return options_.imagery_scale > 0; }
    std::int64_t total_bytes() const { return dem_.bytes() + (has_ortho() ? ortho_.bytes() : 0); }
    std::int64_t total_pixels() const { return dem_.side * dem_.side + (has_ortho() ? ortho_.side * ortho_.side : 0); }

    Result<void> prepare(const std::filesystem::path& directory) const {
        std::error_code status;
        std::filesystem::create_directories(directory, status);
        if (status)
            return io_error(fmt::format("{}: the directory cannot be made ({})", directory.string(), status.message()));
        for (const char* name : {"dem.tif", "ortho.tif"}) {
            const std::filesystem::path file = directory / name;
            if (!options_.force && std::filesystem::exists(std::filesystem::symlink_status(file, status)))
                return Error{ErrorCode::usage, fmt::format("{}: exists; --force replaces it", file.string())};
        }
        struct statvfs space {};
        if (::statvfs(directory.c_str(), &space) == 0) {
            const auto available = static_cast<double>(space.f_bavail) * static_cast<double>(space.f_frsize);
            const auto needed = static_cast<double>(total_bytes() + kSpareBytes);
            if (available < needed)
                return io_error(fmt::format("{}: {:.1f} MB are needed but {:.1f} MB are free", directory.string(),
                                            needed / 1e6, available / 1e6));
        }
        return {};
    }

    Result<void> write_raster(const std::string& path, const RasterLayout& layout, const char* phase,
                              const std::string* dem_path) {
        TiffFile file(path, layout.bytes() > kClassicTiffBytes ? "w8" : "w");
        if (!file.valid()) return io_error(fmt::format("{}: cannot be created ({})", path, file.messages()));
        if (Result<void> header = write_header(file, layout, path); !header) return header;

        std::vector<Worker> workers(static_cast<std::size_t>(threads_));
        if (dem_path != nullptr) {
            for (Worker& worker : workers) {
                worker.dem = std::make_unique<TiffFile>(*dem_path, "rm");
                if (!worker.dem->valid())
                    return io_error(fmt::format("{}: cannot be read back ({})", *dem_path, worker.dem->messages()));
            }
        }
        BandPipeline pipeline;
        pipeline.bands = layout.bands();
        pipeline.threads = threads_;
        pipeline.make = [&](int thread, std::int64_t band) -> Result<void> {
            Worker& worker = workers[static_cast<std::size_t>(thread)];
            const std::int64_t begin = band * layout.band_rows();
            const std::int64_t end = std::min(begin + layout.band_rows(), layout.side);
            return dem_path == nullptr ? make_heights(worker, begin, end) : make_colours(worker, begin, end);
        };
        pipeline.write = [&](int thread, std::int64_t band) -> Result<void> {
            Worker& worker = workers[static_cast<std::size_t>(thread)];
            const std::int64_t rows = std::min(layout.band_rows(), layout.side - band * layout.band_rows());
            void* data = dem_path == nullptr ? static_cast<void*>(worker.heights.data())
                                             : static_cast<void*>(worker.pixels.data());
            if (TIFFWriteEncodedStrip(file.get(), static_cast<std::uint32_t>(band), data, rows * layout.row_bytes()) <
                0)
                return io_error(fmt::format("{}: strip {} cannot be written ({})", path, band, file.messages()));
            note_progress(phase, rows * layout.side);
            return {};
        };
        if (Result<void> done = run_bands(pipeline); !done) return done;
        if (!file.flush_and_close())
            return io_error(fmt::format("{}: cannot be completed ({})", path, file.messages()));
        if (dem_path == nullptr) note_range(workers);
        return {};
    }

    Result<void> check_stop() const {
        if (options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed))
            return Error{ErrorCode::interrupted, "stopped; what was written is removed"};
        return {};
    }

    Result<void> make_heights(Worker& worker, std::int64_t begin, std::int64_t end) const {
        worker.heights.resize(static_cast<std::size_t>((end - begin) * dem_.side));
        for (std::int64_t row = begin; row < end; ++row) {
            if (Result<void> going = check_stop(); !going) return going;
            const std::span<float> out(worker.heights.data() + (row - begin) * dem_.side,
                                       static_cast<std::size_t>(dem_.side));
            landscape_.heights_m(0, options_.spacing_m, static_cast<double>(row) * options_.spacing_m, out);
            const auto [lowest, highest] = std::minmax_element(out.begin(), out.end());
            worker.lowest_m = std::min(worker.lowest_m, *lowest);
            worker.highest_m = std::max(worker.highest_m, *highest);
        }
        return {};
    }

    // The ortho shows the surface of the DEM as written: heights bilinear, slopes bilinear between those at the
    // samples.
    Result<void> make_colours(Worker& worker, std::int64_t begin, std::int64_t end) const {
        const int scale = options_.imagery_scale;
        const std::int64_t last = dem_.side - 1;
        const std::int64_t first_row = std::max<std::int64_t>(begin / scale - 1, 0);
        const std::int64_t last_row = std::min<std::int64_t>((end - 1) / scale + 2, last);
        worker.heights.resize(static_cast<std::size_t>((last_row - first_row + 1) * dem_.side));
        for (std::int64_t row = first_row; row <= last_row; ++row) {
            if (TIFFReadScanline(worker.dem->get(), worker.heights.data() + (row - first_row) * dem_.side,
                                 static_cast<std::uint32_t>(row)) < 0)
                return io_error(
                    fmt::format("the heights just written cannot be read back ({})", worker.dem->messages()));
        }
        const auto height_row = [&](std::int64_t row) {
            return worker.heights.data() + (std::clamp<std::int64_t>(row, first_row, last_row) - first_row) * dem_.side;
        };

        worker.pixels.resize(static_cast<std::size_t>((end - begin) * ortho_.row_bytes()));
        std::uint8_t* out = worker.pixels.data();
        const float per_step = 1.0f / static_cast<float>(options_.spacing_m);
        for (std::int64_t pixel_row = begin; pixel_row < end; ++pixel_row) {
            if (Result<void> going = check_stop(); !going) return going;
            const std::int64_t row = pixel_row / scale;
            const float v = (static_cast<float>(pixel_row % scale) + 0.5f) / static_cast<float>(scale);
            const double south_m = (static_cast<double>(pixel_row) + 0.5) * ortho_.step_m;
            const float* above = height_row(row - 1);
            const float* top = height_row(row);
            const float* bottom = height_row(row + 1);
            const float* below = height_row(row + 2);
            // Along this row of pixels: height and both slopes at a column of samples.
            const auto at_column = [&](std::int64_t c) {
                const std::int64_t west = std::max<std::int64_t>(c - 1, 0);
                const std::int64_t east = std::min(c + 1, last);
                const float per_width = per_step / static_cast<float>(east - west);
                const float east_top = top[east] - top[west];
                const float east_bottom = bottom[east] - bottom[west];
                const float south_top = bottom[c] - above[c];
                const float south_bottom = below[c] - top[c];
                return Landscape::Ground{top[c] + v * (bottom[c] - top[c]),
                                         (east_top + v * (east_bottom - east_top)) * per_width,
                                         (south_top + v * (south_bottom - south_top)) * per_step * 0.5f,
                                         landscape_.cover(static_cast<double>(c) * options_.spacing_m, south_m)};
            };
            Landscape::Ground right = at_column(0);
            for (std::int64_t column = 0; column < last; ++column) {
                const Landscape::Ground left = right;
                right = at_column(column + 1);
                for (int step = 0; step < scale; ++step, out += 3) {
                    const float u = (static_cast<float>(step) + 0.5f) / static_cast<float>(scale);
                    const double east_m = (static_cast<double>(column * scale + step) + 0.5) * ortho_.step_m;
                    const Colour colour = landscape_.colour(east_m, south_m, between(left, right, u));
                    out[0] = colour.red;
                    out[1] = colour.green;
                    out[2] = colour.blue;
                }
            }
        }
        return {};
    }

    void note_progress(const char* phase, std::int64_t pixels) {
        pixels_done_ += pixels;  // the writers take turns
        const Clock::time_point now = Clock::now();
        if (!progress_ || (now - last_progress_ < kProgressInterval && pixels_done_ < total_pixels())) return;
        last_progress_ = now;
        progress_({phase, pixels_done_, total_pixels()});
    }

    void note_range(const std::vector<Worker>& workers) {
        float lowest = std::numeric_limits<float>::max();
        float highest = std::numeric_limits<float>::lowest();
        for (const Worker& worker : workers) {
            lowest = std::min(lowest, worker.lowest_m);
            highest = std::max(highest, worker.highest_m);
        }
        report_.lowest_m = static_cast<double>(lowest);
        report_.highest_m = static_cast<double>(highest);
    }

    const SynthOptions& options_;
    ProgressSink progress_;
    Landscape landscape_;
    RasterLayout dem_;
    RasterLayout ortho_;
    int threads_ = 1;
    SynthReport report_;
    std::int64_t pixels_done_ = 0;
    Clock::time_point last_progress_{};
};

}  // namespace

Result<SynthReport> synthesize(const SynthOptions& options, ProgressSink progress) {
    if (Result<void> checked = check(options); !checked) return checked.error();
    try {
        return Synthesis(options, std::move(progress)).run();
    } catch (const std::exception& problem) {
        return io_error(fmt::format("{}: cannot be written ({})", options.directory, problem.what()));
    }
}

}  // namespace scree
