// Same inputs, same store: whatever the threads, the memory or the repetition.
#include <gtest/gtest.h>

#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

TEST(Digest, DoesNotDependOnThreadsMemoryOrRepetition) {
    const TemporaryFolder folder;
    ASSERT_EQ(scree({"synth", "-o", folder.file("land"), "--size", "300", "--imagery-scale", "3", "--quiet"}).exit_code,
              0);
    const std::string dem = folder.file("land/dem.tif"), ortho = folder.file("land/ortho.tif"),
                      store = folder.file("s.scree");
    build_store_from({dem, "--imagery", ortho}, store);
    const std::string digest = digest_of(store);
    const std::vector<std::vector<std::string>> ways = {{},
                                                        {"--threads", "1"},
                                                        {"--threads", "2"},
                                                        {"--threads", "4"},
                                                        {"--memory", "192M"},
                                                        {"--memory", "512M", "--threads", "3"}};
    for (const auto& way : ways) {
        std::vector<std::string> inputs{dem, "--imagery", ortho, "--force"};
        inputs.insert(inputs.end(), way.begin(), way.end());
        build_store_from(inputs, store);
        EXPECT_EQ(digest_of(store), digest) << (way.empty() ? "again" : way[0] + " " + way[1]);
    }
    build_store_from({dem, "--imagery", ortho, "--force", "--height-quantum", "0.5"}, store);
    EXPECT_NE(digest_of(store), digest) << "another quantum is another store";
    build_store_from({dem, "--force"}, store);
    EXPECT_NE(digest_of(store), digest) << "no imagery is another store";
}

TEST(Digest, OneChangedSampleOrPixelChangesIt) {
    const TemporaryFolder folder;
    HeightGrid grid = hills(50, 40, 3);
    const Place whole{399995, 5300005, 5, 32633, true};
    int changed_x = -1;
    const Colour colour = [&](int x, int y, int c) {
        return x == changed_x && y == 20 ? 255u - patchwork(x, y, c) : patchwork(x, y, c);
    };
    const auto digest = [&] {
        write_heights(folder.file("d.tif"), grid);
        write_image(folder.file("i.tif"), 100, 80, 3, 8, &whole, colour);
        build_store_from({folder.file("d.tif"), "--imagery", folder.file("i.tif"), "--force"}, folder.file("d.scree"));
        return digest_of(folder.file("d.scree"));
    };
    const std::string first = digest();
    grid.at(17, 23) += 1;
    const std::string second = digest();
    EXPECT_NE(first, second);
    changed_x = 33;
    EXPECT_NE(digest(), second);
}

TEST(Digest, SyntheticLandIsTheSameForAnyThreads) {
    const TemporaryFolder folder;
    for (const char* threads : {"1", "2", "4"})
        ASSERT_EQ(scree({"synth", "-o", folder.file(threads), "--size", "129", "--imagery-scale", "2", "--threads",
                         threads, "--quiet"})
                      .exit_code,
                  0);
    for (const char* name : {"/dem.tif", "/ortho.tif"}) {
        EXPECT_EQ(read_bytes(folder.file("1") + name), read_bytes(folder.file("2") + name));
        EXPECT_EQ(read_bytes(folder.file("1") + name), read_bytes(folder.file("4") + name));
    }
}

}  // namespace
}  // namespace scree::test
