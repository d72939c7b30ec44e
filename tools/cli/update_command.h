// scree update
#pragma once

namespace scree {
int run_update(int argc, char** argv);
}
