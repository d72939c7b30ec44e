#!/usr/bin/env bash
# Installs what is missing, builds Scree, makes a mountain landscape, cuts it into a pyramid and flies over it: in a
# window where there is a display, else headless, with pictures and figures in demo/.
#
#     scripts/demo.sh [--headless]
#
# What is there is not made again; without demo/ everything starts over.
set -euo pipefail

usage="usage: scripts/demo.sh [--headless]"
headless=false
for argument in "$@"; do
    case $argument in
        --headless) headless=true ;;
        -h | --help)
            echo "$usage"
            echo "Builds Scree and flies over a made-up landscape; --headless opens no window even where there is a display."
            exit 0
            ;;
        *)
            echo "$usage" >&2
            exit 2
            ;;
    esac
done
[[ -n ${DISPLAY:-} || -n ${WAYLAND_DISPLAY:-} ]] || headless=true

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
build=build/release
store=demo/landscape.scree
dem=demo/landscape/dem.tif
ortho=demo/landscape/ortho.tif
no_display=6 # the exit code of scree-view without a display or without OpenGL 4.5

# Prints a command as one would type it, then runs it.
run() {
    local word line=
    for word in "$@"; do
        [[ $word =~ ^[[:alnum:]_./,:=+-]+$ ]] || word=${word@Q}
        line+=" $word"
    done
    printf '\n$%s\n' "$line"
    "$@"
}

# produce OUTPUT INPUT COMMAND...: runs the command unless OUTPUT is there and no older than INPUT. A command that fails
# leaves no OUTPUT behind, so that the next run does not take it for done.
produce() {
    local output=$1 input=$2 status=0
    shift 2
    [[ ! -e $output || $output -ot $input ]] || return 0
    rm -f -- "$output"
    run "$@" || status=$?
    if ((status != 0)); then
        rm -f -- "$output"
        exit "$status"
    fi
}

# The path of a program in the build tree.
program() {
    local path
    path=$(find "$build" -name CMakeFiles -prune -o -type f -name "$1" -perm -u+x -print -quit)
    if [[ -z $path ]]; then
        echo "demo: the build made no program $1 under $build" >&2
        exit 1
    fi
    printf '%s\n' "$path"
}

"$root/scripts/configure.sh" release
cd -- "$root"
run cmake --build --preset release --parallel "$(nproc)" --target scree scree-view
scree=$(program scree)
view=$(program scree-view)

# 41 km of mountains at 20 m, and an image at 5 m.
mkdir -p demo
if [[ ! -e $dem || ! -e $ortho ]]; then
    rm -f -- "$dem" "$ortho"
    run "$scree" synth -o demo/landscape --size 2049 --spacing 20 --imagery-scale 4
fi
produce "$store" "$dem" "$scree" build "$dem" --imagery "$ortho" -o "$store"
produce demo/verify.json "$store" "$scree" verify "$store" --json demo/verify.json

if ! $headless; then
    status=0
    run "$view" "$store" || status=$?
    if ((status != no_display)); then
        printf '\nFor pictures and figures: scripts/demo.sh --headless\n'
        exit "$status"
    fi
    echo "No window could be opened; headless instead."
fi

shot() { produce "demo/$1.png" "$store" "$view" shot "$store" -o "demo/$1.png" --size 1280x720 "${@:2}"; }

produce demo/fly.json "$store" "$view" fly "$store" --headless --frames 120 --json demo/fly.json
shot whole
shot ridges --eye 410500,5286500,3600 --look 412500,5268000,900
shot valley --eye 427000,5275500,1500 --look 418500,5266500,1350

printf '\nThe pictures:\n'
printf '  %s\n' "$root"/demo/{whole,ridges,valley}.png
printf 'The flight in figures:\n  %s\n' "$root/demo/fly.json"
