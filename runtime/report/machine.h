// The machine that figures were measured on, in words: "Intel(R) Xeon(R) Processor, 2 cores". Any thread.
#pragma once

#include <string>

namespace scree {

std::string machine_name();

}  // namespace scree
