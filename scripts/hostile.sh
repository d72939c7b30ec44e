#!/usr/bin/env bash
# Builds from every damaged, odd and hostile file of $SCREE_DATA/zoo and $SCREE_DATA/bad, as heights and as imagery, and
# compares samples with GDAL's where gdal_translate is installed: the tests that ctest runs over a few of the files.
# Takes ten minutes on two cores. Exit code 1 if any file ends otherwise than in a result or a clear refusal.
#
#     scripts/hostile.sh [BUILD]        (build/release)
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
[[ ${1:-} != -h && ${1:-} != --help ]] || { sed -n 's/^# \{0,1\}//; 2,6p' "${BASH_SOURCE[0]}"; exit 0; }
tests=${1:-$root/build/release}/tests/programs/scree_hostile_tests
[[ -x $tests ]] || { echo "$tests is not there: build scree_hostile_tests first" >&2; exit 2; }
[[ -n ${SCREE_DATA:-} ]] || { echo "SCREE_DATA does not name the folder of zoo/ and bad/" >&2; exit 2; }
SCREE_HOSTILE=all exec "$tests"
