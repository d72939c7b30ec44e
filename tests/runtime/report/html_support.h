// What every page must be.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace scree::test {

/// Every element is closed in its turn, and attributes are quoted.
inline void expect_well_formed(const std::string& html) {
    const std::set<std::string> empty_elements{"meta", "img", "br", "!DOCTYPE"};
    std::vector<std::string> open;
    for (std::size_t at = 0; (at = html.find('<', at)) != std::string::npos;) {
        const std::size_t end = html.find('>', at);
        ASSERT_NE(end, std::string::npos);
        std::string tag = html.substr(at + 1, end - at - 1);
        ASSERT_EQ(tag.find('<'), std::string::npos) << tag.substr(0, 80);
        EXPECT_EQ(std::count(tag.begin(), tag.end(), '"') % 2, 0) << tag.substr(0, 80);
        at = end + 1;
        if (tag.back() == '/') continue;
        const std::string name = tag.substr(0, tag.find_first_of(" \n"));
        if (name[0] == '/') {
            ASSERT_FALSE(open.empty()) << name;
            EXPECT_EQ("/" + open.back(), name) << "at " << at;
            open.pop_back();
        } else if (empty_elements.count(name) == 0) {
            open.push_back(name);
            if (name == "style" || name == "script") at = html.find("</" + name, at);
        }
    }
    EXPECT_TRUE(open.empty()) << open.back();
}

/// Nothing is fetched from anywhere: no address at all but those of pictures that are inside.
inline void expect_self_contained(const std::string& html) {
    for (const char* outside : {"http:", "https:", "url(", "@import", "<link", "<iframe", "file:"})
        EXPECT_EQ(html.find(outside), std::string::npos) << outside;
    for (std::size_t at = html.find("src="); at != std::string::npos; at = html.find("src=", at + 1))
        EXPECT_EQ(html.compare(at, 27, "src=\"data:image/png;base64,"), 0) << html.substr(at, 60);
}

}  // namespace scree::test
