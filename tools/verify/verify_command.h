// scree verify STORE [--json FILE|-] [--quiet]
#pragma once

namespace scree {

/// Runs the subcommand. argv[0] is its name as shown in the help text, the rest its arguments. Returns the exit code of
/// the program: 0 sound; 1 a promise is broken; 2 usage; 3, 4, 5, 130 as ErrorCode says.
int run_verify(int argc, char** argv);

}  // namespace scree
