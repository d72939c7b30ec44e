// scree height
#pragma once

namespace scree {
int run_height(int argc, char** argv);
}
