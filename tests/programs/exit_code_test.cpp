// The contract of the commands: exit codes and messages that people script against.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

constexpr int kUsage = 2, kInput = 3, kStore = 4, kIo = 5, kNoDisplay = 6;

// One line that begins with the program's name, unless CLI11 says it.
void expect_refused(const ProgramRun& run, int code, const std::vector<std::string>& words) {
    EXPECT_EQ(run.exit_code, code) << describe(run);
    EXPECT_EQ(run.out, "") << "errors go to stderr";
    EXPECT_NE(run.err, "");
    for (const std::string& word : words)
        EXPECT_NE(run.err.find(word), std::string::npos) << "'" << word << "' is missing\n" << describe(run);
}

class ExitCodes : public ::testing::Test {
protected:
    void SetUp() override {
        write_heights(dem_, hills(40, 33, 1));
        build_store_from({dem_, "--texture-size", "32"}, store_);
    }
    std::string damaged(const std::string& name, const std::function<void(std::vector<std::uint8_t>&)>& damage) const {
        auto bytes = read_bytes(store_);
        damage(bytes);
        write_bytes(folder_.file(name), bytes);
        return folder_.file(name);
    }

    TemporaryFolder folder_;
    std::string dem_ = folder_.file("h\xC3\xB6hen 1.tif"), store_ = folder_.file("gel\xC3\xA4nde 1.scree"),
                other_ = folder_.file("other.scree");
};

TEST_F(ExitCodes, HelpIsZeroForEveryCommand) {
    for (const char* command : {"synth", "build", "info", "height", "samples", "verify", "export"}) {
        const auto run = scree({command, "--help"});
        EXPECT_EQ(run.exit_code, 0) << describe(run);
        EXPECT_NE(run.out.find("--json"), std::string::npos) << describe(run);
    }
    for (const char* command : {"view", "shot", "fly", "audit", "compare"}) {
        const auto run = scree_view({command, "--help"});
        EXPECT_EQ(run.exit_code, 0) << describe(run);
        EXPECT_NE(run.out.find("--json"), std::string::npos) << describe(run);
    }
    EXPECT_EQ(scree({"--help"}).exit_code, 0);
    EXPECT_EQ(scree_view({"--help"}).exit_code, 0);
    EXPECT_EQ(scree({"--version"}).exit_code, 0);
    EXPECT_EQ(scree_view({"--version"}).exit_code, 0);
}

TEST_F(ExitCodes, WrongUseIsTwo) {
    expect_refused(scree({}), kUsage, {"command"});
    expect_refused(scree({"buidl"}), kUsage, {"buidl"});
    EXPECT_EQ(scree_view({}).exit_code, kUsage);
    const std::vector<std::vector<std::string>> wrong = {
        {"build"},
        {"build", dem_},
        {"build", dem_, "-o", other_, "--no-such-option"},
        {"build", dem_, "-o", other_, "--tile-size", "34"},
        {"build", dem_, "-o", other_, "--texture-size", "100"},
        {"build", dem_, "-o", other_, "--memory", "191M"},
        {"build", dem_, "-o", other_, "--memory", "much"},
        {"build", dem_, "-o", other_, "--threads", "-1"},
        {"build", dem_, "-o", other_, "--height-scale", "0"},
        {"build", dem_, "-o", other_, "--height-scale", "nan"},
        {"build", dem_, "-o", other_, "--height-quantum", "-1"},
        {"build", dem_, "-o", other_, "--spacing", "0"},
        {"build", dem_, "-o", other_, "--fill", "rough"},
        {"build", dem_, "-o", other_, "--resampling", "lanczos"},
        {"info"},
        {"info", store_, "--bogus"},
        {"height"},
        {"height", store_},
        {"height", store_, "1"},
        {"height", store_, "1", "2", "3"},
        {"height", store_, "1", "nan"},
        {"height", store_, "inf", "1"},
        {"height", store_, "1", "-inf"},
        {"height", store_, "1", "2x"},
        {"height", store_, "--ray", "0", "0", "0", "0", "0"},
        {"height", store_, "--ray", "0", "0", "0", "0", "0", "0"},
        {"height", store_, "--ray", "0", "0", "0", "0", "0", "nan"},
        {"verify"},
        {"export", store_, "-o", other_},
        {"export", store_, "-o", other_, "--texture", "0/0"},
        {"export", store_, "-o", other_, "--texture", "0/0/0/0"},
        {"synth"},
        {"synth", "-o", folder_.file("land"), "--size", "2"},
        {"synth", "-o", folder_.file("land"), "--size", "many"},
    };
    for (const auto& arguments : wrong) expect_refused(scree(arguments), kUsage, {});
    const std::vector<std::vector<std::string>> wrong_views = {
        {"audit", store_, "--tau", "-1"},
        {"audit", store_, "--exaggeration", "0"},
        {"shot", store_, "-o", other_, "--exaggeration", "101"},
        {"audit", store_, "--tau", "nan"},
        {"audit", store_, "--fov", "0"},
        {"audit", store_, "--fov", "180"},
        {"audit", store_, "--size", "0x10"},
        {"audit", store_, "--size", "800"},
        {"audit", store_, "--frames", "0"},
        {"audit", store_, "--budget", "all"},
        {"fly", store_, "--headless", "--budget", "1K"},
        {"fly", "--headless"},
        {"shot", store_},
        {"shot", store_, "-o", other_, "--eye", "1,2"},
        {"shot", store_, "-o", other_, "--eye", "1,2,3"},
        {"shot", store_, "-o", other_, "--eye", "1,2,nan", "--look", "0,0,0"},
        {"shot", store_, "-o", other_, "--eye", "1,2,3", "--look", "1,2,3"},
        {"shot", store_, "-o", other_, "--sun", "10"},
        {"shot", store_, "-o", other_, "--sun", "10,91"},
        {"shot", store_, "-o", other_, "--sun", "nan,10"},
        {"shot", store_, "-o", other_, "--sun", "10,20,"},
        {"shot", store_, "-o", other_, "--msaa", "3"},
        {"shot", store_, "-o", other_, "--anisotropy", "0.5"},
        {"shot", store_, "-o", other_, "--edge", "round"},
        {"shot", store_, "-o", other_, "--colour", "age"},
        {"audit", store_, "--json"},
        {"audit", store_, "--lod", "roam"},
        {"audit", store_, "--lod", "rsg", "--metric", "deboer"},
        {"audit", store_, "--s", "0.1"},
        {"audit", store_, "--cache", "exact"},
    };
    for (const auto& arguments : wrong_views) expect_refused(scree_view(arguments), kUsage, {});
    EXPECT_FALSE(std::filesystem::exists(other_));
}

TEST_F(ExitCodes, InputsThatCannotBeUsedAreThreeAndNamed) {
    const std::string missing = folder_.file("missing.tif");
    expect_refused(scree({"build", missing, "-o", other_, "--quiet"}), kInput, {missing});
    expect_refused(scree({"build", dem_, "--imagery", missing, "-o", other_, "--quiet"}), kInput, {missing});
    const std::string hollow = folder_.file("hollow");
    std::filesystem::create_directory(hollow);
    expect_refused(scree({"build", hollow, "-o", other_, "--quiet"}), kInput, {hollow});
    const std::string text = folder_.file("text.tif");
    write_bytes(text, {'h', 'e', 'l', 'l', 'o'});
    expect_refused(scree({"build", text, "-o", other_, "--quiet"}), kInput, {text});
    write_bytes(text, {});
    expect_refused(scree({"build", text, "-o", other_, "--quiet"}), kInput, {text});

    const std::string geographic = folder_.file("degrees.tif");
    write_geographic_heights(geographic, hills(20, 20, 2));
    expect_refused(scree({"build", geographic, "--crs", "EPSG:4326", "-o", other_, "--quiet"}), kUsage,
                   {"--crs", "metres"});
    expect_refused(scree({"build", geographic, "--crs", "EPSG:999999", "-o", other_, "--quiet"}), kUsage, {"--crs"});

    const std::string bare = folder_.file("bare.tif");
    write_heights_u16(bare, hills(20, 20, 2), nullptr);
    expect_refused(scree({"build", bare, "-o", other_, "--quiet"}), kInput, {bare, "--spacing"});

    const std::string row = folder_.file("row.tif");
    write_heights(row, hills(20, 1, 2));
    expect_refused(scree({"build", row, "-o", other_, "--quiet"}), kInput, {row, "2 x 2"});

    HeightGrid empty = hills(20, 20, 2);
    for (float& z : empty.z) z = -9999;
    const std::string voids = folder_.file("voids.tif");
    write_heights(voids, empty, {}, "-9999");
    expect_refused(scree({"build", voids, "-o", other_, "--quiet"}), kInput, {voids, "void"});
    empty.at(3, 3) = empty.at(7, 3) = 5;
    write_heights(voids, empty, {}, "-9999");
    expect_refused(scree({"build", voids, "-o", other_, "--quiet"}), kInput, {voids, "nothing to build"});
    empty.at(3, 3) = 1.7e38F;
    write_heights(voids, empty, {}, "-9999");
    expect_refused(scree({"build", voids, "-o", other_, "--quiet"}), kInput, {voids, "nodata"});

    const std::string image = folder_.file("image.tif");
    const Place elsewhere{700000, 5300000, 5, 32633, true}, other_zone{400000, 5300000, 5, 32634, true};
    write_image(image, 40, 40, 3, 8, &elsewhere, patchwork);
    expect_refused(scree({"build", dem_, "--imagery", image, "-o", other_, "--quiet"}), kInput,
                   {image, "does not meet"});
    expect_refused(scree({"build", image, "-o", other_, "--quiet"}), kInput, {image, "3 channels"});
    write_image(image, 40, 40, 3, 8, &other_zone, patchwork);
    expect_refused(scree({"build", dem_, "--imagery", image, "-o", other_, "--quiet"}), kInput,
                   {image, "does not meet"});
    write_image(image, 40, 40, 3, 8, nullptr, patchwork);
    expect_refused(scree({"build", dem_, "--imagery", image, "-o", other_, "--quiet"}), kInput,
                   {image, "georeference"});
    EXPECT_FALSE(std::filesystem::exists(other_));
    EXPECT_FALSE(std::filesystem::exists(other_ + ".partial"));
    EXPECT_FALSE(std::filesystem::exists(other_ + ".heights"));
}

TEST_F(ExitCodes, TruncatedTiffIsThree) {
    const auto bytes = read_bytes(dem_);
    const std::string cut = folder_.file("cut.tif");
    for (const double share : {0.01, 0.3, 0.6, 0.95}) {
        write_bytes(cut, {bytes.begin(),
                          bytes.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(bytes.size()))});
        expect_refused(scree({"build", cut, "-o", other_, "--quiet"}), kInput, {cut});
    }
    EXPECT_FALSE(std::filesystem::exists(other_));
}

TEST_F(ExitCodes, ExistingOutputIsRefusedUnchangedUnlessForced) {
    const auto before = read_bytes(store_);
    expect_refused(scree({"build", dem_, "-o", store_, "--quiet"}), kUsage, {store_, "--force"});
    EXPECT_EQ(read_bytes(store_), before);
    EXPECT_EQ(scree({"build", dem_, "-o", store_, "--quiet", "--force", "--height-quantum", "1"}).exit_code, 0);
    EXPECT_NE(read_bytes(store_), before);
    EXPECT_EQ(scree({"verify", store_, "--quiet"}).exit_code, 0);

    const std::string dds = folder_.file("t.dds");
    EXPECT_EQ(scree({"export", store_, "--texture", "0/0/0", "-o", dds}).exit_code, 0);
    expect_refused(scree({"export", store_, "--texture", "0/0/0", "-o", dds}), kUsage, {dds, "--force"});
    EXPECT_EQ(scree({"export", store_, "--texture", "0/0/0", "-o", dds, "--force"}).exit_code, 0);

    EXPECT_EQ(scree({"synth", "-o", folder_.file("land"), "--size", "9", "--quiet"}).exit_code, 0);
    const auto land = read_bytes(folder_.file("land/dem.tif"));
    const auto again = scree({"synth", "-o", folder_.file("land"), "--size", "9", "--seed", "2", "--quiet"});
    EXPECT_EQ(again.exit_code, kUsage) << describe(again);
    EXPECT_EQ(read_bytes(folder_.file("land/dem.tif")), land);
}

TEST_F(ExitCodes, ForceNeverDestroysAnInput) {
    const auto before = read_bytes(dem_);
    expect_refused(scree({"build", dem_, "-o", dem_, "--force", "--quiet"}), kUsage, {dem_});
    EXPECT_EQ(read_bytes(dem_), before);
}

TEST_F(ExitCodes, DryRunWritesNothing) {
    const auto run = scree({"build", dem_, "-o", other_, "--dry-run"});
    EXPECT_EQ(run.exit_code, 0) << describe(run);
    EXPECT_NE(run.err.find("39 x 32 cells"), std::string::npos) << describe(run);
    EXPECT_FALSE(std::filesystem::exists(other_));
    EXPECT_EQ(scree({"build", folder_.file("missing.tif"), "-o", other_, "--dry-run"}).exit_code, kInput);
}

TEST_F(ExitCodes, MissingStoreIsThreeForEveryReader) {
    const std::string missing = folder_.file("missing.scree");
    expect_refused(scree({"info", missing}), kInput, {missing});
    expect_refused(scree({"verify", missing, "--quiet"}), kInput, {missing});
    expect_refused(scree({"height", missing, "1", "2"}), kInput, {missing});
    expect_refused(scree({"export", missing, "--texture", "0/0/0", "-o", other_}), kInput, {missing});
    expect_refused(scree_view({"audit", missing}), kInput, {missing});
    expect_refused(scree_view({"fly", missing, "--headless"}), kInput, {missing});
    expect_refused(scree_view({"shot", missing, "-o", other_}), kInput, {missing});
    expect_refused(scree_view({missing}), kInput, {missing});
    EXPECT_FALSE(std::filesystem::exists(missing)) << "reading must not make a file";
}

TEST_F(ExitCodes, WhatIsNoStoreIsFour) {
    const std::vector<std::string> files = {
        dem_,
        damaged("empty.scree", [](auto& b) { b.clear(); }),
        damaged("text.scree", [](auto& b) { b.assign(5000, 'x'); }),
        damaged("half.scree", [](auto& b) { b.resize(b.size() / 2); }),
        damaged("page.scree", [](auto& b) { b.resize(16384); }),
        damaged("header.scree", [](auto& b) { b.resize(100); }),
        damaged("other sqlite.scree", [](auto& b) { b[68] = 1; }),
        damaged("schema.scree",
                [](auto& b) {
                    for (std::size_t k = 100; k < 16384; ++k) b[k] = 0;
                }),
    };
    for (const std::string& file : files) {
        SCOPED_TRACE(file);
        expect_refused(scree({"verify", file, "--quiet"}), kStore, {file});
        const auto info = scree({"info", file});
        const auto audit = scree_view({"audit", file});
        const auto flight = scree_view({"fly", file, "--headless", "--frames", "2", "--size", "32x32"});
        if (file.find("half.scree") ==
            std::string::npos) {  // half of a store may open; its missing rows are found when read
            expect_refused(info, kStore, {file});
            expect_refused(audit, kStore, {file});
            expect_refused(flight, kStore, {file});
        } else {
            EXPECT_TRUE(info.exit_code == 0 || info.exit_code == kStore) << describe(info);
            EXPECT_NE(audit.exit_code, 0) << describe(audit);
            EXPECT_LT(flight.exit_code, 128) << describe(flight);
        }
    }
}

TEST_F(ExitCodes, NewerFormatNamesBothVersions) {
    const std::string newer = damaged("newer.scree", [](auto& b) { b[63] = 77; });
    for (const auto& run : {scree({"info", newer}), scree({"verify", newer, "--quiet"}), scree_view({"audit", newer}),
                            scree_view({"shot", newer, "-o", other_})})
        expect_refused(run, kStore, {newer, "version 77", "version 1"});
}

TEST_F(ExitCodes, UnwritablePlacesAreFive) {
    const std::string nowhere = folder_.file("no such folder/out");
    expect_refused(scree({"build", dem_, "-o", nowhere, "--quiet"}), kIo, {folder_.file("no such folder")});
    expect_refused(scree({"export", store_, "--texture", "0/0/0", "-o", nowhere}), kIo, {nowhere});
    expect_refused(scree_view({"shot", store_, "-o", nowhere, "--size", "16x16"}), kIo, {nowhere});
    EXPECT_EQ(scree({"info", store_, "--json", nowhere}).exit_code, kIo);
    EXPECT_EQ(scree({"build", dem_, "-o", "/proc/out.scree", "--quiet"}).exit_code, kIo);
    EXPECT_EQ(scree({"synth", "-o", "/proc/land", "--size", "9", "--quiet"}).exit_code, kIo);
    EXPECT_EQ(scree({"build", dem_, "-o", folder_.file(""), "--force", "--quiet"}).exit_code, kIo);
    if (::geteuid() != 0) {
        std::filesystem::create_directory(folder_.file("closed"));
        ::chmod(folder_.file("closed").c_str(), 0555);
        expect_refused(scree({"build", dem_, "-o", folder_.file("closed/out.scree"), "--quiet"}), kIo, {});
    }
}

TEST_F(ExitCodes, LostOutputIsFive) {
    if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "needs /dev/full";
    ProgramOptions full;
    full.standard_output = "/dev/full";
    for (const char* json : {"", "-"})
        for (const char* command : {"info", "verify", "height"}) {
            std::vector<std::string> arguments{command, store_};
            if (std::string(command) == "height") arguments.insert(arguments.end(), {"400000", "5300000"});
            if (*json != 0) arguments.insert(arguments.end(), {"--json", json});
            EXPECT_EQ(scree(arguments, full).exit_code, kIo) << command << " --json " << json;
        }
    EXPECT_EQ(scree_view({"audit", store_, "--frames", "1"}, full).exit_code, kIo);
    EXPECT_EQ(scree_view({"audit", store_, "--frames", "1", "--json", "-"}, full).exit_code, kIo);
}

TEST_F(ExitCodes, AStandardErrorThatTakesNothingChangesNoResult) {
    if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "needs /dev/full";
    ProgramOptions full;
    full.standard_error = "/dev/full";
    EXPECT_EQ(scree({"build", folder_.file("missing.tif"), "-o", other_}, full).exit_code, kInput);
    EXPECT_EQ(scree({"build", dem_, "-o", other_}, full).exit_code, 0);
    EXPECT_EQ(scree({"verify", other_}, full).exit_code, 0);
    EXPECT_EQ(scree({"synth", "-o", folder_.file("land"), "--size", "9"}, full).exit_code, 0);
    EXPECT_EQ(scree_view({"audit", folder_.file("missing.scree")}, full).exit_code, kInput);
}

TEST_F(ExitCodes, ReportsGoToPipesAndDevicesWithoutReplacingThem) {
    const std::string device = folder_.file("null");
    if (::mknod(device.c_str(), S_IFCHR | 0666, makedev(1, 3)) != 0)
        GTEST_SKIP() << "needs the right to make a device node";
    EXPECT_EQ(scree({"info", store_, "--json", device}).exit_code, 0);
    struct stat status {};
    ASSERT_EQ(::stat(device.c_str(), &status), 0);
    EXPECT_TRUE(S_ISCHR(status.st_mode)) << "--json /dev/null replaced the device";
}

TEST_F(ExitCodes, JsonOnStdoutIsAlone) {
    report_of(scree({"build", dem_, "-o", other_, "--json", "-"}));
    report_of(scree({"info", store_, "--json", "-"}));
    report_of(scree({"verify", store_, "--json", "-"}));
    report_of(
        scree({"height", store_, "400000", "5300000", "0", "0", "--ray", "0", "0", "0", "0", "0", "1", "--json", "-"}));
    report_of(scree({"export", store_, "--texture", "0/0/0", "-o", folder_.file("t.dds"), "--json", "-"}));
    report_of(scree({"synth", "-o", folder_.file("land"), "--size", "9", "--json", "-"}));
    report_of(scree_view({"audit", store_, "--frames", "1", "--json", "-"}));
    report_of(scree_view({"fly", store_, "--headless", "--frames", "1", "--size", "16x16", "--json", "-"}));
    report_of(scree_view({"shot", store_, "-o", folder_.file("p.png"), "--size", "16x16", "--json", "-"}));
}

TEST_F(ExitCodes, JsonFilesHoldTheSameReport) {
    EXPECT_EQ(scree({"info", store_, "--digest", "--json", folder_.file("i.json")}).exit_code, 0);
    const auto bytes = read_bytes(folder_.file("i.json"));
    EXPECT_EQ(nlohmann::json::parse(bytes.begin(), bytes.end()),
              report_of(scree({"info", store_, "--digest", "--json", "-"})));
    EXPECT_FALSE(std::filesystem::exists(folder_.file("i.json.partial")));
}

TEST_F(ExitCodes, LocaleChangesNothing) {
    ProgramOptions german;
    german.environment = {"LC_ALL=de_DE.UTF-8", "LANG=de_DE.UTF-8"};
    EXPECT_EQ(scree({"info", store_, "--digest"}, german).out, scree({"info", store_, "--digest"}).out);
    EXPECT_EQ(scree({"build", dem_, "-o", other_, "--height-quantum", "0.25", "--quiet"}, german).exit_code, 0);
    EXPECT_EQ(report_of(scree({"info", other_, "--json", "-"}, german))["height_quantum_m"], 0.25);
}

TEST_F(ExitCodes, MissingTilesCannotBeExported) {
    for (const char* tile : {"0/2/0", "9/0/0", "31/0/0", "-1/0/0", "0/-1/0", "2/9223372036854775807/0"}) {
        const auto run = scree({"export", store_, "--texture", tile, "-o", folder_.file("t.dds")});
        EXPECT_TRUE(run.exit_code == kInput || run.exit_code == kUsage) << tile << '\n' << describe(run);
    }
    EXPECT_FALSE(std::filesystem::exists(folder_.file("t.dds")));
}

TEST_F(ExitCodes, FlightPathsAreChecked) {
    const std::string path = folder_.file("p.csv");
    expect_refused(scree_view({"audit", store_, "--path", path}), kInput, {path});
    const std::vector<std::string> bad = {"",
                                          "eye_x,eye_y\n1,2\n",
                                          "eye_x,eye_y,eye_z,look_x,look_y,look_z\n",
                                          "eye_x,eye_y,eye_z,look_x,look_y,look_z\n1,2,3,4,5\n",
                                          "eye_x,eye_y,eye_z,look_x,look_y,look_z\n1,2,3,4,5,inf\n",
                                          "eye_x,eye_y,eye_z,look_x,look_y,look_z\n1,2,3,1,2,3\n"};
    for (const std::string& text : bad) {
        write_bytes(path, {text.begin(), text.end()});
        const auto run = scree_view({"audit", store_, "--path", path, "--frames", "2"});
        EXPECT_TRUE(run.exit_code == kInput || run.exit_code == kUsage) << text << '\n' << describe(run);
        EXPECT_NE(run.err, "");
    }
    const std::string good =
        "eye_x,eye_y,eye_z,look_x,look_y,look_z\r\n400100,5299000,2500,400200,5299800,1000\r\n400150,5299100,2400,"
        "400200,5299800,1000";
    write_bytes(path, {good.begin(), good.end()});
    EXPECT_EQ(report_of(scree_view({"audit", store_, "--path", path, "--frames", "3", "--json", "-"}))["frames"], 3);
}

TEST_F(ExitCodes, WindowWithoutADisplayIsSix) {
    ProgramOptions bare;
    bare.environment = {"DISPLAY", "WAYLAND_DISPLAY", "XDG_RUNTIME_DIR"};
    expect_refused(scree_view({store_, "--seconds", "2"}, bare), kNoDisplay, {"display"});
    expect_refused(scree_view({"fly", store_, "--frames", "2"}, bare), kNoDisplay, {"display"});
    bare.environment = {"DISPLAY=:987", "WAYLAND_DISPLAY", "XDG_RUNTIME_DIR"};
    expect_refused(scree_view({store_, "--seconds", "2"}, bare), kNoDisplay, {"display"});
}

}  // namespace
}  // namespace scree::test
