// Counts what is asked of operator new: a program that links counted_new.cpp has it replaced.
#pragma once

#include <cstdint>

namespace scree::test {

/// Calls of operator new by this thread so far.
std::int64_t allocations();

}  // namespace scree::test
