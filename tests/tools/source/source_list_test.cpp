#include "tools/source/source_list.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tools/source/temp_directory.h"

namespace scree {
namespace {

using test::TempDirectory;

TEST(SourceList, FoldersGiveTheirRastersInByteOrderAndPassOverTheRest) {
    const TempDirectory directory;
    std::filesystem::create_directories(directory.path("dem/b/.hidden"));
    std::filesystem::create_directories(directory.path("dem/empty"));
    for (const char* name :
         {"dem/b.TIF", "dem/a.tif", "dem/B.tif", "dem/b/z.hgt", "dem/b/a.img", "dem/b/a.hdr", "dem/b/lonely.img",
          "dem/b/.hidden/x.tif", "dem/.x.tif", "dem/a.tfw", "dem/a.tif.aux.xml", "dem/a.tif.ovr", "dem/a.prj",
          "dem/readme.txt", "dem/b/c.bil", "dem/b/c.hdr", "dem/b/envi", "dem/b/envi.hdr", "dem/b/LICENSE"})
        directory.write(name, "x");
    const auto listed = list_sources({directory.path("dem")});
    ASSERT_TRUE(listed.ok()) << listed.error().message;
    EXPECT_EQ(*listed, (std::vector<std::string>{directory.path("dem/B.tif"), directory.path("dem/a.tif"),
                                                 directory.path("dem/b.TIF"), directory.path("dem/b/a.img"),
                                                 directory.path("dem/b/c.bil"), directory.path("dem/b/envi"),
                                                 directory.path("dem/b/z.hgt")}));
}

TEST(SourceList, FilesStandAsTypedWhateverTheyAreCalled) {
    const TempDirectory directory;
    const std::string second = directory.write("b.txt", "x");
    const std::string first = directory.write("z.tif", "x");
    std::filesystem::create_directories(directory.path("f"));
    const std::string inside = directory.write("f/a.tif", "x");
    const auto listed = list_sources({first, directory.path("f"), second});
    ASSERT_TRUE(listed.ok());
    EXPECT_EQ(*listed, (std::vector<std::string>{first, inside, second}));
}

TEST(SourceList, MissingPathsAndFoldersWithoutRastersAreErrors) {
    const TempDirectory directory;
    std::filesystem::create_directories(directory.path("f"));
    directory.write("f/readme.txt", "x");
    for (const std::string& path : {directory.path("none"), directory.path("f")}) {
        const auto listed = list_sources({path});
        ASSERT_FALSE(listed.ok()) << path;
        EXPECT_EQ(listed.error().code, ErrorCode::input);
        EXPECT_EQ(listed.error().message.find(path), 0u);
    }
}

TEST(SourceList, LinksThatLeadInACircleEnd) {
    const TempDirectory directory;
    std::filesystem::create_directories(directory.path("f"));
    directory.write("f/a.tif", "x");
    std::filesystem::create_directory_symlink(directory.path("f"), directory.path("f/again"));
    const auto listed = list_sources({directory.path("f")});
    ASSERT_TRUE(listed.ok());
    EXPECT_EQ(listed->size(), 1u);
}

}  // namespace
}  // namespace scree
