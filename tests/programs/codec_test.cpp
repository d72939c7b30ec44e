// Every codec of heights and of textures through every command that meets one.
#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "common/store/height_codec.h"
#include "common/store/sqlite_store.h"
#include "common/store/texture_codec.h"
#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"
#include "tools/pyramid/build_record.h"

namespace scree::test {
namespace {

using List = std::vector<std::string>;

std::set<int> codecs_of(TileKind kind, const std::string& path) {
    std::set<int> found;
    auto store = SqliteStore::open(path);
    EXPECT_TRUE(store.ok());
    if (!store) return found;
    const auto seen = (*store)->for_each(kind, [&](const SqliteStore::RowView& row) {
        found.insert(row.codec);
        return true;
    });
    EXPECT_TRUE(seen.ok());
    return found;
}

class HeightCodecs : public ::testing::Test {
protected:
    void SetUp() override {
        write_heights(dem_, hills(150, 130, 5));
        Place inset;  // five times as fine: tiles below the base's
        inset.x += 300;
        inset.y -= 300;
        inset.step /= 5;
        write_heights(inset_, hills(90, 80, 6), inset);
    }
    std::string build(const char* codec, const List& more = {}) {
        List arguments{dem_, inset_, "--texture-size", "16", "--force", "--height-codec", codec};
        arguments.insert(arguments.end(), more.begin(), more.end());
        build_store_from(arguments, store_);
        return digest_of(store_);
    }
    std::set<int> codecs_in_the_store() const { return codecs_of(TileKind::height, store_); }

    TemporaryFolder folder_;
    std::string dem_ = folder_.file("dem.tif"), inset_ = folder_.file("inset.tif"), store_ = folder_.file("s.scree");
};

TEST_F(HeightCodecs, AreWrittenReadVerifiedAndDrawn) {
    std::set<std::string> digests, heights;
    for (const NamedHeightCodec& codec : height_codecs()) {
        SCOPED_TRACE(codec.name);
        EXPECT_TRUE(digests.insert(build(codec.name)).second) << "another codec, the same bytes";
        EXPECT_EQ(codecs_in_the_store(), std::set<int>{static_cast<int>(codec.codec)});
        expect_sound_store(store_, {1}, {"8M"});
        const std::string out = folder_.file(std::string(codec.name) + ".tif");
        ASSERT_EQ(scree({"export", store_, "--heights", out}).exit_code, 0);
        const auto bytes = read_bytes(out);
        heights.insert(std::string(bytes.begin(), bytes.end()));
    }
    EXPECT_EQ(heights.size(), 1u) << "a codec may not change a height";
}

TEST_F(HeightCodecs, GiveTheSameBytesForAnyThreads) {
    for (const NamedHeightCodec& codec : height_codecs()) {
        const std::string digest = build(codec.name, {"--threads", "1"});
        EXPECT_EQ(build(codec.name, {"--threads", "4"}), digest) << codec.name;
    }
}

TEST_F(HeightCodecs, AreKeptByUpdates) {
    const std::string later = folder_.file("later.tif");
    Place place;
    place.x += 100;
    write_heights(later, hills(40, 40, 9), place);
    for (const NamedHeightCodec& codec : height_codecs()) {
        SCOPED_TRACE(codec.name);
        build(codec.name);
        const auto run = scree({"update", store_, later, "--quiet"});
        ASSERT_EQ(run.exit_code, 0) << describe(run);
        EXPECT_EQ(codecs_in_the_store(), std::set<int>{static_cast<int>(codec.codec)});
        const std::string updated = digest_of(store_);
        build_store_from({dem_, inset_, later, "--texture-size", "16", "--force", "--height-codec", codec.name},
                         store_);
        EXPECT_EQ(digest_of(store_), updated);
    }
}

TEST_F(HeightCodecs, OneThatIsUnknownIsRefusedAndTheKnownAreNamed) {
    const auto run = scree({"build", dem_, "-o", store_, "--height-codec", "newer"});
    EXPECT_EQ(run.exit_code, 2) << describe(run);
    for (const NamedHeightCodec& codec : height_codecs())
        EXPECT_NE(run.err.find(codec.name), std::string::npos) << describe(run);
}

class TextureCodecs : public HeightCodecs {
protected:
    std::string build(const char* codec, const List& images, const List& more = {}) {
        List arguments{dem_, inset_, "--imagery"};
        arguments.insert(arguments.end(), images.begin(), images.end());
        for (const char* word : {"--texture-size", "16", "--force", "--texture-codec", codec})
            arguments.push_back(word);
        arguments.insert(arguments.end(), more.begin(), more.end());
        build_store_from(arguments, store_);
        return digest_of(store_);
    }
    std::vector<char> texels(const std::string& name) {
        const std::string out = folder_.file(name);
        const auto run = scree({"export", store_, "--imagery", out});
        EXPECT_EQ(run.exit_code, 0) << describe(run);
        const auto bytes = read_bytes(out);
        return {bytes.begin(), bytes.end()};
    }
    std::string image(const char* name, double shift, const Colour& colour) {
        const std::string path = folder_.file(name);
        Place place;
        place.x += shift;
        place.area = true;
        write_image(path, 120, 110, 3, 8, &place, colour);
        return path;
    }
};

TEST_F(TextureCodecs, ShowTheSameAndAreKeptByUpdatesForAnyThreads) {
    const std::string photo = image("photo.tif", 0, patchwork);
    const std::string later = image("later.tif", 600, [](int x, int y, int c) { return patchwork(y, x, c); });
    std::set<std::string> digests;
    std::set<std::vector<char>> seen, seen_later;
    for (const NamedTextureCodec& codec : texture_codecs()) {
        SCOPED_TRACE(codec.name);
        const std::string digest = build(codec.name, {photo}, {"--threads", "1"});
        EXPECT_TRUE(digests.insert(digest).second) << "another codec, the same bytes";
        EXPECT_EQ(build(codec.name, {photo}, {"--threads", "4"}), digest);
        EXPECT_EQ(codecs_of(TileKind::texture, store_), std::set<int>{static_cast<int>(codec.codec)});
        expect_sound_store(store_, {1}, {"8M"});
        seen.insert(texels(std::string(codec.name) + ".tif"));
        const auto run = scree({"update", store_, "--imagery", later, "--quiet"});
        ASSERT_EQ(run.exit_code, 0) << describe(run);
        EXPECT_EQ(codecs_of(TileKind::texture, store_), std::set<int>{static_cast<int>(codec.codec)});
        const std::string updated = digest_of(store_);
        EXPECT_NE(updated, digest);
        seen_later.insert(texels(std::string(codec.name) + "_later.tif"));
        EXPECT_EQ(build(codec.name, {photo, later}), updated);
    }
    EXPECT_EQ(seen.size(), 1u) << "a codec may not change a texel";
    EXPECT_EQ(seen_later.size(), 1u);
}

TEST_F(TextureCodecs, OneThatIsUnknownIsRefusedAndTheKnownAreNamed) {
    const auto run = scree({"build", dem_, "-o", store_, "--texture-codec", "newer"});
    EXPECT_EQ(run.exit_code, 2) << describe(run);
    for (const NamedTextureCodec& codec : texture_codecs())
        EXPECT_NE(run.err.find(codec.name), std::string::npos) << describe(run);
}

// An option that bears on the bytes and is not recorded gives stores that updates spoil, and takes up what a build with
// another value has left.
TEST(BuildOptionsOfTheProgram, AreRecordedOrDoNotBearOnTheBytes) {
    const std::set<std::string> elsewhere = {"imagery", "attribution"},  // fields of the dataset
        harmless = {"output", "threads", "memory", "force", "dry-run", "quiet", "json", "help"};
    const auto recorded = recorded_options();
    std::set<std::string> known(recorded.begin(), recorded.end());
    known.insert(elsewhere.begin(), elsewhere.end());
    known.insert(harmless.begin(), harmless.end());
    const std::string help = scree({"build", "--help"}).out;
    const std::regex option("\\n +(?:-[a-z],)?--([a-z-]+)");
    std::set<std::string> offered;
    for (std::sregex_iterator it(help.begin(), help.end(), option), end; it != end; ++it) offered.insert((*it)[1]);
    EXPECT_GT(offered.size(), 20u);
    for (const std::string& name : offered)
        EXPECT_EQ(known.count(name), 1u) << "--" << name << " is neither in build_record.cpp nor listed here";
    for (const std::string& name : recorded) EXPECT_EQ(offered.count(name), 1u) << "--" << name << " is not offered";
}

}  // namespace
}  // namespace scree::test
