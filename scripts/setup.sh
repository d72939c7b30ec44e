#!/usr/bin/env bash
# Installs the Debian 12 packages that Scree needs and that are missing. Where none is missing it says nothing and does
# not call apt. Runs as root, or as a user with sudo. test.sh, demo.sh and .ci/run call it.
set -euo pipefail

packages=(
    # building
    ca-certificates cmake dpkg-dev g++ git ninja-build pkg-config
    # both programs
    libcli11-dev libfmt-dev libsqlite3-dev libssl-dev libxxhash-dev libzstd-dev nlohmann-json3-dev
    # scree: images in, georeference and CRS (libproj-dev brings the registry, proj-data), the pipeline
    libgeotiff-dev libimath-dev libopenimageio-dev libproj-dev libtbb-dev libtiff-dev
    # scree-view: the window, headless OpenGL with Mesa's software driver, pictures out
    libegl-dev libegl-mesa0 libepoxy-dev libgl1-mesa-dri libglfw3-dev libglm-dev libimgui-dev libpng-dev
    # tests; a virtual display for those of the window, shells for those of completion
    fish groff-base imagemagick libgtest-dev libstb-dev xauth xdotool xvfb zsh
    # benches, and the encoders they measure against
    libbenchmark-dev libsquish-dev
)

say() { printf 'setup: %s\n' "$*" >&2; }

# The packages of the list that are not installed, one a line.
missing_packages() {
    local installed package
    # dpkg-query fails when it knows nothing of one of them: that is an answer here.
    installed=$(dpkg-query --show --showformat='${Package} ${db:Status-Status}\n' "${packages[@]}" 2>/dev/null || true)
    for package in "${packages[@]}"; do
        [[ $'\n'"$installed"$'\n' == *$'\n'"$package installed"$'\n'* ]] || printf '%s\n' "$package"
    done
}

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    say "this is not Debian, so nothing can be installed from here. Scree needs what these Debian packages hold:"
    say "  ${packages[*]}"
    say "With their like installed: cmake --workflow --preset release"
    exit 1
fi

mapfile -t missing < <(missing_packages)
((${#missing[@]} > 0)) || exit 0

if ((EUID == 0)); then
    as_root=(env)
elif command -v sudo >/dev/null && { sudo -n true 2>/dev/null || [[ -t 0 ]]; }; then
    as_root=(sudo env) # asks for the password where one is needed and someone is there to give it
else
    say "these packages are missing, and installing them takes root or sudo. As root:"
    say "  apt-get update && apt-get install --no-install-recommends ${missing[*]}"
    exit 1
fi

# A machine that has just started may hold the lock for its own updates: wait, do not fail.
apt_get=("${as_root[@]}" DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=300)

say "installing ${missing[*]}"
# One source of several that cannot be reached need not matter: the installation decides.
"${apt_get[@]}" update </dev/null || say "apt-get update failed; trying with the lists at hand"
if ! "${apt_get[@]}" install --yes --no-install-recommends "${missing[@]}" </dev/null; then
    say "apt-get could not install: ${missing[*]}"
    exit 1
fi
