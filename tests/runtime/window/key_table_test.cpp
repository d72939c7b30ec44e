#include "runtime/window/key_table.h"

#include <gtest/gtest.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <fstream>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace scree {
namespace {

TEST(KeyTable, GivesEveryActionOneKeyAndNoKeyTwoActions) {
    std::set<Action> actions;
    std::set<std::pair<int, bool>> keys;
    std::set<std::string_view> names;
    for (const KeyBinding& b : key_bindings()) {
        EXPECT_TRUE(actions.insert(b.action).second) << b.name;
        EXPECT_TRUE(keys.insert({b.key, b.shift}).second) << b.name;
        EXPECT_TRUE(names.insert(b.name).second) << b.name;
        EXPECT_EQ(b.shift, b.name.starts_with("Shift+")) << b.name;
        EXPECT_FALSE(b.does.empty());
    }
    EXPECT_EQ(actions.size(), static_cast<std::size_t>(kActions));
}

TEST(KeyTable, ShowsAGroupInOnePiece) {
    std::set<std::string_view> seen;
    std::string_view last;
    for (const KeyBinding& b : key_bindings()) {
        if (b.group != last) {
            EXPECT_TRUE(seen.insert(b.group).second) << b.group;
        }
        last = b.group;
    }
    EXPECT_GE(seen.size(), 4u);
}

TEST(KeyTable, NamesTheKeysThatItMeans) {
    for (const KeyBinding& b : key_bindings()) {
        std::string_view name = b.name;
        if (b.shift) name.remove_prefix(6);
        // GLFW gives printable keys their ASCII code.
        if (name.size() == 1) {
            EXPECT_EQ(b.key, name[0]) << b.name;
        }
        if (name.size() < 2 || name[0] != 'F') continue;
        EXPECT_EQ(b.key, GLFW_KEY_F1 - 1 + std::stoi(std::string(name.substr(1))));
    }
}

TEST(KeyTable, NoPressIsAHeldKey) {
    for (const int held : {GLFW_KEY_W, GLFW_KEY_A, GLFW_KEY_S, GLFW_KEY_D, GLFW_KEY_Q, GLFW_KEY_E, GLFW_KEY_LEFT,
                           GLFW_KEY_RIGHT, GLFW_KEY_UP, GLFW_KEY_DOWN, GLFW_KEY_LEFT_SHIFT})
        EXPECT_EQ(binding_of(held, false), nullptr) << held;
}

TEST(KeyTable, AKeyMeansTheSameWithShiftUnlessItHasAMeaningOfItsOwn) {
    const auto action = [](int key, bool shift) {
        const KeyBinding* b = binding_of(key, shift);
        return b != nullptr ? static_cast<int>(b->action) : -1;
    };
    EXPECT_EQ(action(GLFW_KEY_X, false), static_cast<int>(Action::higher));
    EXPECT_EQ(action(GLFW_KEY_X, true), static_cast<int>(Action::lower));
    EXPECT_EQ(action(GLFW_KEY_F, true), static_cast<int>(Action::wireframe)) << "while flying fast";
    EXPECT_EQ(action(GLFW_KEY_RIGHT_BRACKET, false), static_cast<int>(Action::finer));
    EXPECT_EQ(action(GLFW_KEY_LEFT_BRACKET, false), static_cast<int>(Action::coarser));
    EXPECT_EQ(action(GLFW_KEY_Y, false), -1);
}

using Rows = std::vector<std::vector<std::string>>;

// The rows of the page's tables with so many columns, without the heading and what is under it.
Rows rows_of_page(std::size_t columns) {
    std::ifstream page(SCREE_SOURCE_FOLDER "/docs/flying.md");
    EXPECT_TRUE(page.is_open());
    Rows rows;
    bool in_table = false;
    for (std::string line; std::getline(page, line);) {
        if (!line.starts_with("| ")) {
            in_table = false;
            continue;
        }
        const bool heading = !std::exchange(in_table, true), rule = line.starts_with("| -");
        if (heading || rule) continue;
        std::vector<std::string> cells;
        for (std::size_t at = 2, end = 0; (end = line.find(" |", at)) != std::string::npos; at = end + 3)
            cells.push_back(line.substr(at, end - at));
        if (cells.size() == columns) rows.push_back(cells);
    }
    return rows;
}

TEST(KeyTable, IsTheTableOfTheManual) {
    Rows expected;
    std::string_view last;
    for (const KeyBinding& b : key_bindings()) {
        expected.push_back(
            {b.group == last ? "" : std::string(b.group), "`" + std::string(b.name) + "`", std::string(b.does)});
        last = b.group;
    }
    EXPECT_EQ(rows_of_page(3), expected);
}

TEST(KeyTable, WhatIsHeldIsInTheManual) {
    Rows expected;
    for (const HeldBinding& b : held_bindings()) expected.push_back({std::string(b.name), std::string(b.does)});
    EXPECT_EQ(rows_of_page(2), expected);
}

}  // namespace
}  // namespace scree
