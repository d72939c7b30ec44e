// Every file of $SCREE_DATA/zoo and $SCREE_DATA/bad, as heights and as imagery: a right result or a clear refusal, soon
// and in bounded memory. One file in 25 by default; all of them with SCREE_HOSTILE=all (scripts/hostile.sh).
// Where gdal_translate is installed and reads the file without complaint, its samples are ours.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "tests/common/test_support.h"
#include "tests/programs/child_program.h"
#include "tests/programs/sample_inputs.h"
#include "tools/source/image_source.h"

namespace scree::test {
namespace {

// Of processor time, which a busy machine does not stretch; a file that makes everything wait takes the other one.
constexpr double kLimit_s = 20, kHang_s = 120;
// The least --memory, and what a decoder may add to OpenImageIO's own 120 MiB: 64 MiB and --memory once more.
constexpr const char* kMemory = "192M";
constexpr std::int64_t kMostRssBytes = std::int64_t{120 + 64 + 192} << 20;
constexpr std::int64_t kMostComparedSamples = std::int64_t{1} << 22;
constexpr std::size_t kStride = 25;

bool all_of_them() {
    const char* which = std::getenv("SCREE_HOSTILE");
    return which != nullptr && std::string(which) == "all";
}

std::vector<std::string> hostile_files() {
    std::vector<std::string> files;
    const char* root = std::getenv("SCREE_DATA");
    if (root == nullptr) return files;
    for (const char* folder : {"zoo", "bad"}) {
        std::error_code error;
        for (const auto& entry :
             std::filesystem::recursive_directory_iterator(std::filesystem::path(root) / folder, error))
            if (entry.is_regular_file()) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    if (all_of_them()) return files;
    std::vector<std::string> some;
    for (std::size_t i = 0; i < files.size(); i += kStride) some.push_back(files[i]);
    return some;
}

struct Count {
    int read = 0, refused = 0, misused = 0, compared = 0, different = 0;
};

class HostileFiles : public ::testing::Test {
protected:
    void SetUp() override {
        files_ = hostile_files();
        if (files_.empty()) GTEST_SKIP() << "needs zoo/ and bad/ in the folder that $SCREE_DATA names";
        write_heights_u16(unplaced_, hills(9, 9, 1), nullptr);
    }

    // Heights at the image's first pixels.
    static std::string dem_under(const std::string& image, const std::string& scratch) {
        Place place;
        const auto source = ImageSource::open(image);
        if (source && (*source)->georeference()) {
            const Georeference& where = *(*source)->georeference();
            place.step = std::clamp(std::abs(where.column_x), 1e-3, 1e5);
            place.x = where.first_x;
            place.y = where.first_y;
            if (where.crs.starts_with("EPSG:")) place.epsg = std::atoi(where.crs.c_str() + 5);
        }
        write_heights(scratch + " dem.tif", hills(9, 9, 1), place);
        return scratch + " dem.tif";
    }

    // Two at a time.
    void for_each_file(const std::function<void(const std::string& file, const std::string& scratch)>& visit) {
        std::atomic<std::size_t> next{0};
        std::vector<std::jthread> threads;
        for (int thread = 0; thread < 2; ++thread)
            threads.emplace_back([&, thread] {
                for (std::size_t i = 0; (i = next.fetch_add(1)) < files_.size();)
                    visit(files_[i], folder_.file(fmt::format("{}", thread)));
            });
    }

    ProgramRun build(std::vector<std::string> words, const std::string& scratch) const {
        words.insert(words.begin(), "build");
        for (const char* word : {"--quiet", "--force", "--memory", kMemory, "--threads", "1", "-o"})
            words.emplace_back(word);
        words.push_back(scratch + ".scree");
        return scree(words, within(kSanitized ? 10 * kHang_s : kHang_s));
    }

    void judge(const ProgramRun& run, const std::string& file, Count& count) {
        const std::lock_guard lock(mutex_);
        SCOPED_TRACE(file);
        EXPECT_FALSE(run.timed_out) << file << " after " << run.seconds << " s";
        // This one is sound, and of 140 million samples.
        EXPECT_TRUE(kSanitized || run.cpu_seconds <= kLimit_s || file.ends_with("arcgis93_geodataxform_gcp.tif"))
            << run.cpu_seconds;
        const bool too_large_here = run.exit_code == 5 && run.err.find(" MB are free") != std::string::npos;
        EXPECT_TRUE(run.exit_code == 0 || run.exit_code == 2 || run.exit_code == 3 || too_large_here) << describe(run);
        if (run.exit_code == 3) {
            // The file itself, the world file beside it, or heights in units or at places that were taken over from it.
            const std::string stem = std::filesystem::path(file).replace_extension();
            EXPECT_TRUE(run.err.find(stem) != std::string::npos ||
                        run.err.find(" dem.tif: CRS units") != std::string::npos ||
                        run.err.find(": no part of the Earth") != std::string::npos)
                << "no name in: " << run.err;
            EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << "one line: " << run.err;
        }
        EXPECT_TRUE(kSanitized || run.peak_rss_bytes <= kMostRssBytes) << run.peak_rss_bytes;
        ++(run.exit_code == 0 ? count.read : run.exit_code == 3 ? count.refused : count.misused);
    }

    TemporaryFolder folder_;
    std::string unplaced_ = folder_.file("dem.tif");
    std::vector<std::string> files_;
    std::mutex mutex_;
};

TEST_F(HostileFiles, AsHeightsTheyAreBuiltOrRefused) {
    Count count;
    for_each_file([&](const std::string& file, const std::string& scratch) {
        ProgramRun run = build({file, "--spacing", "10"}, scratch);
        // The option is for files without a place of their own, and the message says so.
        if (run.exit_code == 2 && run.err.find("carries its own georeference") != std::string::npos)
            run = build({file}, scratch);
        judge(run, file, count);
        if (run.exit_code == 2) {
            const std::lock_guard lock(mutex_);
            EXPECT_NE(run.err.find("--memory"), std::string::npos) << file << describe(run);
        }
    });
    fmt::print("as heights: {} built, {} refused, {} need another option\n", count.read, count.refused, count.misused);
}

TEST_F(HostileFiles, AsImageryTheyAreBuiltOrRefused) {
    Count count;
    for_each_file([&](const std::string& file, const std::string& scratch) {
        ProgramRun run = build({unplaced_, "--spacing", "10", "--imagery", file}, scratch);
        if (run.exit_code == 3 && run.err.find("either both or neither") != std::string::npos)
            run = build({dem_under(file, scratch), "--imagery", file}, scratch);
        judge(run, file, count);
        if (run.exit_code == 2) {
            const std::lock_guard lock(mutex_);
            EXPECT_NE(run.err.find("--memory"), std::string::npos) << file << describe(run);
        }
    });
    fmt::print("as imagery: {} built, {} refused, {} need another option\n", count.read, count.refused, count.misused);
}

// --- samples ---

struct Samples {
    std::int64_t width = 0, height = 0;
    int channels = 0;
    SampleType type = SampleType::u8;
    std::vector<double> first_channel;
    std::vector<std::uint8_t> rgba;
};

Result<Samples> decoded(const std::string& file) {
    OpenOptions options;
    options.max_unit_bytes = std::int64_t{48} << 20;
    auto source = ImageSource::open(file, options);
    if (!source) return source.error();
    const ImageInfo& info = (*source)->info();
    Samples samples{info.width, info.height, info.channels, info.type, {}, {}};
    const auto count = static_cast<std::size_t>(info.width * info.height);
    if (info.width * info.height > kMostComparedSamples) return Error{ErrorCode::check_failed, "too large to compare"};
    samples.first_channel.resize(count);
    samples.rgba.resize(4 * count);
    if (auto ok = (*source)->read_channel(0, info.height, std::span<double>(samples.first_channel)); !ok)
        return ok.error();
    if (auto ok = (*source)->read_rgba8(0, info.height, std::span<std::uint8_t>(samples.rgba)); !ok) return ok.error();
    return samples;
}

// Bands of the file as GDAL reads them, band after band; nullopt where it complains.
template <class T>
std::optional<std::vector<T>> by_gdal(const std::string& file, const std::string& scratch, const char* type,
                                      const std::vector<std::string>& bands, std::int64_t samples) {
    std::vector<std::string> words{"-q", "-of", "ENVI", "-co", "INTERLEAVE=BSQ", "-ot", type};
    for (const std::string& band : bands) words.insert(words.end(), {"-b", band});
    words.insert(words.end(), {file, scratch + ".raw"});
    const ProgramRun run = run_program("gdal_translate", words, within(60));
    if (run.exit_code != 0 || run.err.find("rror") != std::string::npos || run.err.find("arning") != std::string::npos)
        return std::nullopt;
    std::vector<T> values(bands.size() * static_cast<std::size_t>(samples));
    std::ifstream raw(scratch + ".raw", std::ios::binary);
    const auto bytes = static_cast<std::streamsize>(values.size() * sizeof(T));
    if (!raw.read(reinterpret_cast<char*>(values.data()), bytes)) return std::nullopt;
    return values;
}

// What is read otherwise than by GDAL, and why that is meant.
const std::map<std::string, std::string>& meant_otherwise() {
    static const std::map<std::string, std::string> files = {
        {"bug4468.tif", "colours that were multiplied by alpha are divided by it"},
        {"zoo__image-tiff__images__seq__seq-3c-7b-contig-2e4f43c5.tiff", "seven bits fill eight"},
        // The same pictures by lines (basn...) agree.
        {"basi0g16.png", "GDAL 3.6 leaves interlaced 16-bit samples in the file's byte order"},
        {"basi4a16.png", "the same"},
        {"bgai4a16.png", "the same"},
    };
    return files;
}

TEST_F(HostileFiles, SamplesAreThoseOfGdal) {
    if (!on_path("gdal_translate")) GTEST_SKIP() << "needs gdal_translate";
    Count heights, colours;
    for_each_file([&](const std::string& file, const std::string& scratch) {
        const Result<Samples> ours = decoded(file);
        {
            const std::lock_guard lock(mutex_);
            if (!ours) {
                ++heights.refused;
                EXPECT_EQ(ours.error().message.find('\n'), std::string::npos) << ours.error().message;
                return;
            }
            ++heights.read;
        }
        const std::int64_t count = ours->width * ours->height;
        // More than two channels are refused as heights; some are a palette's, of which GDAL gives places.
        std::optional<std::vector<double>> first;
        if (ours->channels <= 2) first = by_gdal<double>(file, scratch, "Float64", {"1"}, count);
        const auto name = std::filesystem::path(file).filename().string();
        const bool excused = meant_otherwise().contains(name);
        if (first) {
            // What alpha or mask hides is no height, which GDAL leaves to its user.
            for (std::size_t i = 0; i < first->size(); ++i)
                if (ours->rgba[4 * i + 3] == 0 && std::isnan(ours->first_channel[i]))
                    (*first)[i] = ours->first_channel[i];
            const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
            const auto [a, b] = std::mismatch(first->begin(), first->end(), ours->first_channel.begin(), same);
            const std::lock_guard lock(mutex_);
            ++heights.compared;
            if (a != first->end()) {
                ++heights.different;
                EXPECT_TRUE(excused) << file << ": heights: sample " << a - first->begin() << " of " << count << " is "
                                     << *b << " here and " << *a << " there";
            }
        }
        if (ours->channels < 3 || ours->type != SampleType::u8) return;
        const auto rgb = by_gdal<std::uint8_t>(file, scratch, "Byte", {"1", "2", "3"}, count);
        if (!rgb) return;
        int worst = 0;
        for (std::int64_t i = 0; i < count; ++i)
            for (std::int64_t c = 0; c < 3; ++c)
                worst = std::max(worst, std::abs((*rgb)[static_cast<std::size_t>(c * count + i)] -
                                                 ours->rgba[static_cast<std::size_t>(4 * i + c)]));
        const std::lock_guard lock(mutex_);
        ++colours.compared;
        if (worst > 0) {
            ++colours.different;
            EXPECT_TRUE(excused) << file << ": colours differ by up to " << worst;
        }
    });
    fmt::print(
        "samples: {} files read, {} refused; heights compared {}, different {}; colours compared {}, different {}\n",
        heights.read, heights.refused, heights.compared, heights.different, colours.compared, colours.different);
}

// --- what is no file at all ---

class OddInputs : public ::testing::Test {
protected:
    void SetUp() override { write_heights(dem_, hills(9, 9, 1)); }
    void expect_refused(const std::string& path, const std::string& words) const {
        for (const auto& arguments : {std::vector<std::string>{"build", path, "--spacing", "10"},
                                      std::vector<std::string>{"build", dem_, "--imagery", path}}) {
            auto all = arguments;
            all.insert(all.end(), {"-o", folder_.file("s.scree"), "--quiet"});
            const ProgramRun run = scree(all, within(kHang_s));
            EXPECT_EQ(run.exit_code, 3) << path << describe(run);
            EXPECT_NE(run.err.find(path + ": "), std::string::npos) << describe(run);
            EXPECT_NE(run.err.find(words), std::string::npos) << path << describe(run);
        }
    }
    TemporaryFolder folder_;
    std::string dem_ = folder_.file("dem.tif");
};

TEST_F(OddInputs, WhatIsNoRegularFileIsRefusedAtOnce) {
    const std::string fifo = folder_.file("fifo.tif"), loop = folder_.file("loop.tif"), empty = folder_.file("e.tif");
    const std::string folder = folder_.file("folder");
    ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
    ASSERT_EQ(::symlink(loop.c_str(), loop.c_str()), 0);
    std::ofstream(empty).close();
    std::filesystem::create_directory(folder);
    expect_refused(fifo, "not a regular file");
    expect_refused(loop, "cannot be reached");
    expect_refused(empty, "the file is empty");
    expect_refused(folder, "no raster of a known kind");
    expect_refused(folder_.file("missing.tif"), "no such file");
    expect_refused("/dev/zero", "not a regular file");
    expect_refused("/dev/null", "not a regular file");
    expect_refused(dem_ + "/inside.tif", "no such file");
    expect_refused(folder_.file(std::string(300, 'a') + ".tif"), "cannot be reached");
    if (::geteuid() == 0) return;  // root reads everything
    std::filesystem::permissions(dem_, std::filesystem::perms::none);
    expect_refused(dem_, "cannot be opened");
}

TEST_F(OddInputs, AFifoBesideAnImageIsNoWorldFile) {
    ASSERT_EQ(::mkfifo(folder_.file("dem.tfw").c_str(), 0600), 0);
    const ProgramRun run = scree({"build", dem_, "-o", folder_.file("s.scree"), "--quiet"}, within(kHang_s));
    EXPECT_TRUE(run.exit_code == 0 || run.exit_code == 3) << describe(run);
    EXPECT_FALSE(run.timed_out);
}

}  // namespace
}  // namespace scree::test
