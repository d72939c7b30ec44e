// scree build
#pragma once

namespace scree {
int run_build(int argc, char** argv);
}
