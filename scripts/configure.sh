#!/usr/bin/env bash
# Installs what is missing and configures a preset (release when none is named) unless that has been done. From then on
# the build sees by itself when it must be configured again.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
preset=${1:-release}
build=$root/build/$preset

"$root/scripts/setup.sh"

if [[ -f $build/build.ninja ]] && grep -qsxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$build/CMakeCache.txt"; then
    exit 0
fi
cd -- "$root"
# --fresh, because a cache that is here all the same is broken off or was made where the checkout stood before.
cmake --preset "$preset" --fresh
