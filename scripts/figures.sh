#!/usr/bin/env bash
# Draws the figures of docs/lod-and-paging.md and docs/lod-methods.md anew, from the synthetic landscape.
#     scripts/figures.sh [BUILD_FOLDER]
# ImageMagick, where it is installed, makes the files smaller.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
build=${1:-$root/build/release}
scree=$build/tools/scree view=$build/runtime/scree-view out=$root/docs/images
work=$(mktemp -d)
trap 'rm -r -- "$work"' EXIT

"$scree" synth -o "$work" --imagery-scale 1 --quiet
"$scree" build "$work/dem.tif" --imagery "$work/ortho.tif" -o "$work/synth.scree" --quiet >/dev/null

# figure NAME OPTION...: docs/images/NAME.png
figure() {
    local name=$1
    shift
    "$view" shot "$work/synth.scree" -o "$work/$name.png" --size 900x560 "$@"
    if command -v convert >/dev/null; then
        convert "$work/$name.png" -dither None -colors 128 PNG8:"$out/$name.png"
    else
        cp -- "$work/$name.png" "$out/$name.png"
    fi
}

valley=(--eye '412000,5266000,2600' --look '422000,5280000,700')
figure lod_levels --eye 412000,5266000,2600 --look 422000,5280000,900 --colour level \
    --seen-from 414000,5248000,26000 --seen-look 420000,5279000,0
figure lod_strides "${valley[@]}" --tau 4 --colour geomip --wireframe
figure lod_errors "${valley[@]}" --tau 2 --colour error
figure lod_block_rsg "${valley[@]}" --tau 4 --lod block-rsg --wireframe
