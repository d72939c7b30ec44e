#!/usr/bin/env bash
# Makes every experiment's tables and charts from scratch, and the page that shows them: docs/experiments/README.md.
#
#     scripts/experiments.sh [OPTIONS]
#
#     --out FOLDER      where tables, charts and the page go (docs/experiments)
#     --build FOLDER    the build to run (build/release): scree, scree-view, scree_chart, scree_paper_tables, scree_claims
#     --only PARTS      of paper,methods,deboer,ke,claims; the page keeps the others as they were
#     --large           Ke et al. at full size: 4.3 GB are made, 6 GB of disk; otherwise a sixty-fourth
#     --data FOLDER     where --large keeps what it made (not kept), in FOLDER/large
#     --quick           fewer rows and frames: a minute instead of a quarter of an hour
#
# The landscape is made up (scree synth). Where SCREE_DATA is set, $SCREE_DATA/taipei/window_660_30m.tif is flown too, the
# papers' own region, and $SCREE_DATA/puget/ps_height_1k.png. Nothing else should run meanwhile.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
. "$root/scripts/report_values.sh"
. "$root/scripts/experiments_paged.sh"

out=$root/docs/experiments build=$root/build/release only=paper,methods,deboer,ke,claims large=0 data='' quick=()
usage() { sed -n 's/^# \{0,1\}//; 2,16p' "${BASH_SOURCE[0]}"; }
while (($# > 0)); do
    case $1 in
        --out | --build | --only | --data)
            [[ $# -ge 2 ]] || { echo "$1 wants a value" >&2; exit 2; }
            printf -v "${1#--}" %s "$2"
            shift
            ;;
        --quick) quick=(--quick) ;;
        --large) large=1 ;;
        -h | --help) usage; exit 0 ;;
        *) usage >&2; exit 2 ;;
    esac
    shift
done
scree=$build/tools/scree view=$build/runtime/scree-view programs=$build/experiments
chart=$programs/scree_chart
for program in "$scree" "$view" "$chart" "$programs/scree_paper_tables" "$programs/scree_claims"; do
    [[ -x $program ]] || { echo "$program is not there: build it first" >&2; exit 2; }
done
wanted() { [[ ,$only, == *,$1,* ]]; }
if ((${#quick[@]})); then
    deboer_taus=(2 8) deboer_frames=6 ke_frames=12 ke_poses=2 methods_taus=0.5,1 methods_frames=2 methods_rounds=1
else
    deboer_taus=(1 2 4 8 16) deboer_frames=24 ke_frames=48 ke_poses=2 methods_taus=0.5,0.71,1,2 methods_frames=4 methods_rounds=2
fi

work=$(mktemp -d)
trap 'rm -rf -- "$work"' EXIT
mkdir -p -- "$out" "$work/parts"
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
    mv -- "$out/paper_$1.md" "$work/parts/paper_$1.md"
}
if wanted paper; then
    [[ -z $taipei ]] || tables taipei "Taipei: a window of the papers' region"
    tables synth "A made-up landscape"
fi

# ---- de Boer, Ke et al., and all methods side by side: scripts/experiments_paged.sh ----

if wanted deboer; then
    echo "de Boer" >&2
    deboer
fi
if wanted ke; then
    echo "Ke et al." >&2
    ke
fi
if wanted methods; then
    echo "methods" >&2
    [[ -z $taipei ]] || methods taipei "Taipei, 660 x 660 heights" "$work/taipei.scree"
    "$scree" synth -o "$work/scenery" --size 1025 --spacing 20 --quiet
    "$scree" build "$work/scenery/dem.tif" --imagery "$work/scenery/ortho.tif" -o "$work/scenery.scree" --quiet
    methods synth "a made-up landscape, 1025 x 1025 heights, 4096 x 4096 texels" "$work/scenery.scree"
fi

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
if wanted claims; then
    echo scree_claims >&2
    terrain=$work/synth.scree
    [[ -z $taipei ]] || terrain=$work/taipei.scree
    "$programs/scree_claims" --store "$terrain" --out "$out/claims" ${quick[@]+"${quick[@]}"} >"$work/claims.txt" ||
        echo "scree_claims: a verdict is not as theory has it" >&2
    claims_part >"$work/parts/claims.md"
fi

# ---- the page ----

# part NAME: made now, or as the page had it.
part() {
    printf '<!-- part %s -->\n\n' "$1"
    if [[ -f $work/parts/$1.md ]]; then
        cat -- "$work/parts/$1.md"
    elif [[ -f $out/README.md ]]; then
        awk -v mark="<!-- part $1 -->" '/^<!-- part / { inside = $0 == mark; next } inside && (NF || any) { any = 1; print }' "$out/README.md"
    fi
}

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
    local name
    for name in paper_taipei paper_synth methods_taipei methods_synth deboer ke claims; do part "$name"; done
}

page >"$work/README.md"
cp -- "$work/README.md" "$out/README.md"
echo "$out/README.md" >&2
