#include "tools/verify/problem_list.h"

#include <fmt/format.h>

#include <algorithm>

namespace scree {

void ProblemList::add(std::string text) {
    if (std::find(texts_.begin(), texts_.end(), text) != texts_.end()) return;
    if (texts_.size() < kMax)
        texts_.push_back(std::move(text));
    else
        ++left_out_;
}

std::vector<std::string> ProblemList::take() {
    if (left_out_ > 0) texts_.push_back(fmt::format("and {} more problems", left_out_));
    left_out_ = 0;
    return std::move(texts_);
}

}  // namespace scree
