// What is wrong with a store, in words: bounded, each text once.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace scree {

class ProblemList {
public:
    static constexpr std::size_t kMax = 100;  // enough to see the pattern; a ruined store has millions

    void add(std::string text);
    bool empty() const { return texts_.empty(); }
    /// The texts, and one that counts those left out.
    std::vector<std::string> take();

private:
    std::vector<std::string> texts_;
    std::int64_t left_out_ = 0;
};

}  // namespace scree
