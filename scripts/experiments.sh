#!/usr/bin/env bash
# Makes every experiment's tables and charts from scratch, and the page that shows them: docs/experiments/README.md.
#
#     scripts/experiments.sh [OPTIONS]
#
#     --out FOLDER      where tables, charts and the page go (docs/experiments)
#     --build FOLDER    the build to run (build/release); scree and scree_paper_tables must be there, the rest is run
#                       where it has been built
#     --quick           fewer rows and frames: a few seconds instead of minutes
#
# The landscape is made up (scree synth). Where SCREE_DATA is set, $SCREE_DATA/taipei/window_660_30m.tif is flown too:
# the papers' own region. Times are CPU times of one thread; nothing else should run meanwhile.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
out=$root/docs/experiments build=$root/build/release quick=()
usage() { sed -n 's/^# \{0,1\}//; 2,13p' "${BASH_SOURCE[0]}"; }
while (($# > 0)); do
    case $1 in
        --out | --build)
            [[ $# -ge 2 ]] || { echo "$1 wants a value" >&2; exit 2; }
            printf -v "${1#--}" %s "$2"
            shift
            ;;
        --quick) quick=(--quick) ;;
        -h | --help) usage; exit 0 ;;
        *) usage >&2; exit 2 ;;
    esac
    shift
done
scree=$build/tools/scree programs=$build/experiments
for program in "$scree" "$programs/scree_paper_tables"; do
    [[ -x $program ]] || { echo "$program is not there: build it first" >&2; exit 2; }
done

work=$(mktemp -d)
trap 'rm -rf -- "$work"' EXIT
mkdir -p -- "$out" "$work/parts"
parts=10 # numbers the parts of the page, in order
out=$(cd -- "$out" && pwd -P)

# ---- stores ----

echo "stores" >&2
"$scree" synth -o "$work/landscape" --size 660 --spacing 40 --imagery-scale 0 --quiet
"$scree" build "$work/landscape/dem.tif" -o "$work/synth.scree" --quiet
taipei=${SCREE_DATA:+$SCREE_DATA/taipei/window_660_30m.tif}
if [[ -n $taipei && -f $taipei ]]; then
    "$scree" build "$taipei" -o "$work/taipei.scree" --quiet
else
    echo "SCREE_DATA is not set, or has no taipei/window_660_30m.tif: only the made-up landscape is flown" >&2
    taipei=
fi

# ---- Ueng & Chuang: the paper's own layout ----

# tables NAME TITLE: over $work/NAME.scree.
tables() {
    echo "scree_paper_tables: $2" >&2
    "$programs/scree_paper_tables" --store "$work/$1.scree" --out "$out" --name "$1" --title "$2" \
        ${quick[@]+"${quick[@]}"} 2>"$work/$1.log" || { cat "$work/$1.log" >&2; exit 1; }
    mv -- "$out/paper_$1.md" "$work/parts/$parts-paper_$1.md"
    parts=$((parts + 1))
}
[[ -z $taipei ]] || tables taipei "Taipei: a window of the papers' region"
tables synth "A made-up landscape"

# ---- claims of the papers that fail ----

# claims_part: the verdicts, and the charts that $out/claims holds.
claims_part() {
    printf '## Claims\n\n```\n'
    cat -- "$work/claims.txt"
    printf '```\n\n'
    local chart
    for chart in "$out"/claims/*.svg; do
        [[ ! -f $chart ]] || printf '![%s](claims/%s)\n' "$(basename -- "$chart" .svg)" "${chart##*/}"
    done
}
if [[ -x $programs/scree_claims ]]; then
    echo scree_claims >&2
    terrain=$work/synth.scree
    [[ -z $taipei ]] || terrain=$work/taipei.scree
    "$programs/scree_claims" --store "$terrain" --out "$out/claims" ${quick[@]+"${quick[@]}"} >"$work/claims.txt" ||
        echo "scree_claims: a verdict is not as theory has it" >&2
    claims_part >"$work/parts/$parts-claims.md"
    parts=$((parts + 1))
fi

# ---- Ke et al. and de Boer ----
# Their programs go here, each run where it has been built: tables and charts into $out, its part of the page into
# $work/parts/$parts-NAME.md.

# ---- the page ----

page() {
    cat <<'END'
# Experiments

Made by `scripts/experiments.sh`; do not edit. "Paper": the figures that Ueng & Chuang print (their own 40 m data, a Pentium III of 660 MHz).
"Prototype": an independent one, on the window of Taipei and another path of the same kind. Which stretch of a path is flown matters: over the same ground
others draw 0.7 to 1.3 times as many triangles. Share, trend and errors are what compares.

UC is the paper's own metric; N\*, N\*K and BSK are what docs/lod-methods.md explains: N\*K and BSK promise tau, with an exact cache tau + s, dikes
included where they are counted. P1 and P2 are readings of the paper's reuse test by the corners of a block, "exact" is T1 (or T3, where the metric has a
floor). **Missing**: vertices whose own test fails at this eye and that the cache left out, over those selected without a cache. **Worst vertex**: greatest
error, by the paper's own measure, of a vertex that is not selected. **Greatest error**: distance in pixels between the full mesh and what is drawn,
over all vertices in view, and over the insides of strips. **LOD ms**: culling, reuse tests, selections, meshes and dikes of a frame; the first frame apart.
END
    printf '\nMachine: %s.\n\n' "$(lscpu | sed -n 's/^Model name: *//p' | head -n 1), one thread"
    cat -- "$work"/parts/*.md
}

page >"$work/README.md"
cp -- "$work/README.md" "$out/README.md"
echo "$out/README.md" >&2
