#!/usr/bin/env bash
# Measures the runtime on this machine, store by store: frame and selection times, cold start, loading, memory, a slow
# disk. Prints a table and leaves the reports that it comes from, as JSON and text, in a folder.
#
#     scripts/bench_runtime.sh [OPTIONS] STORE [STORE...]
#
#     --out FOLDER      where the reports go (bench-runtime)
#     --build FOLDER    the build to measure (build/release)
#     --budget SIZE     tile memory in MiB with a final M (256M); the half budget is half of it
#     --frames N        poses a flight (300)
#     --size WxH        picture (800x800)
#
# docs/measuring.md, "One machine in one go", says what the lines mean. Nothing else should run meanwhile.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
. "$root/scripts/report_values.sh"

out=bench-runtime build=$root/build/release budget=256M frames=300 size=800x800
usage() { sed -n 's/^# \{0,1\}//; 2,13p' "${BASH_SOURCE[0]}"; }
stores=()
while (($# > 0)); do
    case $1 in
        --out | --build | --budget | --frames | --size)
            [[ $# -ge 2 ]] || { echo "$1 wants a value" >&2; exit 2; }
            printf -v "${1#--}" %s "$2"
            shift
            ;;
        -h | --help) usage; exit 0 ;;
        -*) usage >&2; exit 2 ;;
        *) stores+=("$1") ;;
    esac
    shift
done
[[ ${#stores[@]} -gt 0 ]] || { usage >&2; exit 2; }
[[ $budget =~ ^[0-9]+M$ ]] || { echo "--budget $budget is not a number of MiB such as 256M" >&2; exit 2; }
view=$build/runtime/scree-view
[[ -x $view ]] || { echo "$view is not there: build first" >&2; exit 2; }
half=$((${budget%M} * 1024 / 2))K
mkdir -p -- "$out"

# fly NAME ARGUMENTS: one flight over $store, its report in $folder/NAME.json.
fly() {
    local name=$1
    shift
    echo "  $name: scree-view fly ${store##*/} $*" >&2
    "$view" fly "$store" --headless --frames "$frames" --size "$size" --json "$folder/$name.json" "$@" \
        >"$folder/$name.txt" 2>&1 || { cat "$folder/$name.txt" >&2; exit 1; }
}

# of NAME PATH: a value of that flight's report.
of() { report_value "$folder/$1.json" "$2"; }

# row LABEL FORMAT VALUE...: a line of the table, which is also kept for the JSON.
row() {
    local label=$1 format=$2
    shift 2
    # shellcheck disable=SC2059 # the format is the row's own
    printf "  %-44s $format\n" "$label" "$@"
}

# json KEY VALUE: a line of the summary.
json() { printf '    "%s": %s,\n' "$1" "${2:-null}" >>"$summary.part"; }

measure() {
    fly flight --step 120 --budget "$budget"
    fly settled --step 15 --budget "$budget" --settled
    fly half_budget --step 120 --budget "$half"
    fly latency_50 --step 120 --budget "$budget" --latency 50
    fly latency_2000 --step 120 --budget "$budget" --latency 2000
    bench selection_bench "$store" 1 "$frames" 120
    bench loader_bench "$store"
}

# bench NAME ARGUMENTS: a program of tests/bench, where it has been built.
bench() {
    local program=$build/tests/bench/scree_$1
    [[ -x $program ]] || return 0
    echo "  $1" >&2
    "$program" "${@:2}" >"$folder/$1.txt" 2>&1 || { cat "$folder/$1.txt" >&2; exit 1; }
}

figures() {
    local ratio name key p99
    row "frame, median / p99 (ms)" "%10.2f %10.2f" "$(of flight frame_ms.median)" "$(of flight frame_ms.p99)"
    row "selection and requests, median / p99 (ms CPU)" "%10.3f %10.3f" "$(of flight select_ms.median)" "$(of flight select_ms.p99)"
    row "triangles, mean / most" "%10.0f %10.0f" "$(of flight triangles.mean)" "$(of flight triangles.max)"
    row "cold start to 8 px / to tau (ms)" "%10.1f %10.1f" "$(of flight cold_start_ms.within_8_px)" "$(of flight cold_start_ms.within_tau)"
    row "loading a tile: heights / texture (us CPU)" "%10.1f %10.1f" "$(of flight heights_loaded.cpu_us_per_tile)" "$(of flight textures_loaded.cpu_us_per_tile)"
    row "frames with stand-ins, holes" "%10d %10d" "$(of flight frames_with_stand_ins)" "$(of flight holes)"
    row "tile memory: resident / budget (MB)" "%10.1f %10.1f" "$(megabytes "$(of flight tile_rss_bytes)")" "$(megabytes "$(of flight budget_bytes)")"
    row "error over the flight / settled (15 m steps)" "%9.3f %s" "$(of settled settled.error_integral_ratio)" "times"
    row "least share of the settled triangles" "%10.3f" "$(of settled settled.least_triangle_share)"
    row "half budget: triangles / of the full" "%10.0f %10.3f" "$(of half_budget triangles.mean)" "$(ratio_of "$(of half_budget triangles.mean)" "$(of flight triangles.mean)")"
    row "half budget: frame median (ms) / of the full" "%10.2f %10.3f" "$(of half_budget frame_ms.median)" "$(ratio_of "$(of half_budget frame_ms.median)" "$(of flight frame_ms.median)")"
    row "half budget: tau mean / most (px)" "%10.2f %10.2f" "$(of half_budget tau_effective_px.mean)" "$(of half_budget tau_effective_px.max)"
    row "half budget: frames in which it binds" "%10d" "$(of half_budget budget_limited_frames)"
    for name in latency_50 latency_2000; do
        ratio=$(ratio_of "$(of $name frame_ms.p99)" "$(of flight frame_ms.p99)")
        row "${name/_/ } ms: frame p99, times; stand-ins" "%10.3f %10d" "$ratio" "$(of $name frames_with_stand_ins)"
    done
    json store "\"${store##*/}\""
    json renderer "\"$(of flight renderer)\""
    for key in frame_ms.median frame_ms.p99 select_ms.median select_ms.p99 triangles.mean triangles.max \
        cold_start_ms.within_8_px cold_start_ms.within_tau heights_loaded.cpu_us_per_tile textures_loaded.cpu_us_per_tile \
        frames_with_stand_ins holes tile_rss_bytes budget_bytes; do
        json "$key" "$(of flight $key)"
    done
    json settled.error_integral_ratio "$(of settled settled.error_integral_ratio)"
    json settled.least_triangle_share "$(of settled settled.least_triangle_share)"
    for name in half_budget latency_50 latency_2000; do
        for key in frame_ms.median frame_ms.p99 triangles.mean tau_effective_px.mean tau_effective_px.max \
            budget_limited_frames frames_with_stand_ins; do
            json "$name.$key" "$(of $name $key)"
        done
        p99=$(ratio_of "$(of $name frame_ms.p99)" "$(of flight frame_ms.p99)")
        json "$name.frame_ms.p99_ratio" "$p99"
    done
}

summary=$out/summary.json
table=$out/summary.txt
echo '[' >"$summary.part"
: >"$table"
separator=
for store in "${stores[@]}"; do
    name=${store##*/}
    folder=$out/${name%.scree}
    mkdir -p -- "$folder"
    echo "$store" >&2
    measure
    printf '%s  {\n' "$separator" >>"$summary.part"
    {
        echo "$name, $frames frames of $size on $(of flight renderer), budget $budget"
        figures
        for text in selection_bench loader_bench; do
            [[ ! -f $folder/$text.txt ]] || sed "s/^/  $text: /" "$folder/$text.txt"
        done
    } | tee -a "$table"
    sed -i '$ s/,$/\n  }/' "$summary.part"
    separator=$',\n'
done
folder=$out
store=
bench render_bench
[[ ! -f $out/render_bench.txt ]] || tee -a "$table" <"$out/render_bench.txt"
printf ']\n' >>"$summary.part"
mv -- "$summary.part" "$summary"
echo "reports in $out" >&2
