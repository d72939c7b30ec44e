#!/usr/bin/env bash
# Installs what is missing, builds, runs every test. The last lines are ctest's; arguments go to ctest:
#
#     scripts/test.sh                          every test, optimised
#     scripts/test.sh -R store                 only those whose name has "store" in it
#     SCREE_PRESET=asan scripts/test.sh        with AddressSanitizer and UndefinedBehaviorSanitizer
#
# SCREE_PRESET is release (the default), debug or asan. SCREE_DATA names a folder of real elevation data; tests that
# want it are skipped where it is not set.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
preset=${SCREE_PRESET:-release}
jobs=$(nproc)

"$root/scripts/configure.sh" "$preset"
cd -- "$root"
cmake --build --preset "$preset" --parallel "$jobs"
exec ctest --preset "$preset" --parallel "$jobs" "$@"
