#!/usr/bin/env bash
# Draws the pictures of README.md, docs/lod-and-paging.md and docs/lod-methods.md anew, from the synthetic landscape.
#     scripts/figures.sh [BUILD_FOLDER]
# ImageMagick, where it is installed, makes the files smaller.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
build=${1:-$root/build/release}
scree=$build/tools/scree view=$build/runtime/scree-view out=$root/docs/images
work=$(mktemp -d)
trap 'rm -r -- "$work"' EXIT

"$scree" synth -o "$work" --quiet
"$scree" build "$work/dem.tif" --imagery "$work/ortho.tif" -o "$work/synth.scree" --quiet >/dev/null

# figure NAME COLOURS OPTION...: docs/images/NAME.png
figure() {
    local name=$1 colours=$2
    shift 2
    "$view" shot "$work/synth.scree" -o "$work/$name.png" "$@"
    if command -v convert >/dev/null; then
        convert "$work/$name.png" -dither None -colors "$colours" PNG8:"$out/$name.png"
    else
        cp -- "$work/$name.png" "$out/$name.png"
    fi
}

valley=(--size 900x560 --eye '412000,5266000,2600' --look '422000,5280000,700')
figure lod_levels 128 --size 900x560 --eye 412000,5266000,2600 --look 422000,5280000,900 --colour level \
    --seen-from 414000,5248000,26000 --seen-look 420000,5279000,0
figure lod_strides 128 "${valley[@]}" --tau 4 --colour geomip --wireframe
figure lod_errors 128 "${valley[@]}" --tau 2 --colour error
figure lod_block_rsg 128 "${valley[@]}" --tau 4 --lod block-rsg --wireframe

pass=(--eye '434000,5267000,3400' --look '423500,5273500,1600')
figure mountains 256 "${pass[@]}" --size 960x540 --msaa 4 --anisotropy 8
figure wireframe 64 "${pass[@]}" --size 960x480 --wireframe --tau 8
