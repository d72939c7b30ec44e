#include "tools/source/raster_formats.h"

#include <map>
#include <string>

#include <gtest/gtest.h>

#include "tests/tools/source/temp_directory.h"

namespace scree {
namespace {

using test::TempDirectory;

std::vector<Extensions> all_extensions() {
    std::vector<Extensions> all;
    for (const GridFormat& f : grid_formats()) {
        all.push_back(f.extensions);
        all.push_back(f.shared_extensions);
        all.push_back(f.headered_extensions);
    }
    for (const ImageFormat& f : image_formats()) all.push_back(f.extensions);
    return all;
}

TEST(RasterFormats, ExtensionsAreWrittenAsTheyAreCompared) {
    for (const Extensions& extensions : all_extensions())
        for (const std::string_view e : extensions) {
            EXPECT_TRUE(e.empty() || (e[0] == '.' && e.size() > 1)) << e;
            EXPECT_EQ(lower_case(e), e);
        }
}

TEST(RasterFormats, EveryGridCanBeKnownAndOpened) {
    for (const GridFormat& format : grid_formats()) {
        EXPECT_NE(format.open, nullptr) << format.name;
        EXPECT_TRUE(!format.extensions.empty() || format.begins_so != nullptr) << format.name;
        // Without a signature nothing tells it from the others that are called so.
        EXPECT_TRUE(format.shared_extensions.empty() || format.begins_so != nullptr) << format.name;
    }
}

TEST(RasterFormats, AnExtensionSaysOneFormat) {
    std::map<std::string_view, std::string_view> owners;
    const auto own = [&](const Extensions& extensions, std::string_view name) {
        for (const std::string_view e : extensions) {
            const auto [at, is_new] = owners.emplace(e, name);
            EXPECT_TRUE(is_new) << e << " is " << at->second << " and " << name;
        }
    };
    for (const GridFormat& format : grid_formats()) own(format.extensions, format.name);
    for (const GridFormat& format : grid_formats()) own(format.shared_extensions, format.name);
    for (const ImageFormat& format : image_formats()) own(format.extensions, format.name);
}

TEST(RasterFormats, EveryExtensionOfItsOwnIsFoundInFoldersAndIsThatFormat) {
    const TempDirectory directory;
    for (const GridFormat& format : grid_formats())
        for (const std::string_view extension : format.extensions) {
            const std::string path = directory.write("a" + std::string(extension), "x");
            EXPECT_TRUE(is_raster_in_folder(path)) << path;
            EXPECT_EQ(grid_format_of(path, "x"), &format) << path;
        }
    for (const ImageFormat& format : image_formats())
        for (const std::string_view extension : format.extensions)
            EXPECT_TRUE(is_raster_in_folder(directory.write("b" + std::string(extension), "x"))) << extension;
}

TEST(RasterFormats, WhatIsRawOnlyWithAHeaderWantsOne) {
    const TempDirectory directory;
    for (const GridFormat& format : grid_formats())
        for (const std::string_view extension : format.headered_extensions) {
            const std::string path = directory.write("c" + std::string(extension), "x");
            EXPECT_NE(grid_format_of(path, "x"), &format) << path;
            directory.write("c.hdr", "x");
            EXPECT_EQ(grid_format_of(path, "x"), &format) << path;
            EXPECT_NE(grid_format_of(path, "II*"), &format) << path;
            EXPECT_TRUE(is_raster_in_folder(path)) << path;
            std::filesystem::remove(directory.path("c.hdr"));
        }
}

TEST(RasterFormats, EveryKindOfImageHasItsReader) {
    for (const ImageFormat& format : image_formats()) {
        EXPECT_EQ(&image_format(format.kind), &format);
        EXPECT_STREQ(reader_name(format.kind), format.reader);
    }
}

}  // namespace
}  // namespace scree
