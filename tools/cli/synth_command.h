// `scree synth`: makes a landscape to try things on.
#pragma once

namespace scree {

/// argv[0] is the name to show ("scree synth"). Returns the exit code of the process.
int run_synth(int argc, char** argv);

}  // namespace scree
