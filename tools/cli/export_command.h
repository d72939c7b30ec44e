// scree export
#pragma once

namespace scree {
int run_export(int argc, char** argv);
}
