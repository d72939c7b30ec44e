// scree info
#pragma once

namespace scree {
int run_info(int argc, char** argv);
}
