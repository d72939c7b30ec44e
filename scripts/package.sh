#!/usr/bin/env bash
# Makes the Debian packages scree, scree-view and libscree-dev in build/package/. They fit the release of Debian that they
# are made on.
#
#     SCREE_MAINTAINER="Name <address>" scripts/package.sh
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
build=$root/build/package

"$root/scripts/setup.sh"
cd -- "$root"
cmake --preset package ${SCREE_MAINTAINER:+-DSCREE_MAINTAINER="$SCREE_MAINTAINER"}
cmake --build --preset package --parallel "$(nproc)"
umask 022
(cd -- "$build" && rm -f -- *.deb && cpack)
printf '\nInstall them with: apt install %s\n' "$build/*.deb"
