#!/usr/bin/env bash
# Flies restlessly over a store, with several seeds and budgets, and checks that nothing gives way: no hole, no pixel
# seen through, no damaged tile, tile memory within the budget, memory flat, exit code 0. A line a run; exit code 1 if
# any run failed.
#
#     scripts/soak.sh [OPTIONS] STORE [MINUTES]
#
#     --build FOLDER    the build to try (build/release)
#     --frames N        poses a run (1500)
#     --size WxH        picture (320x240)
#     --budgets LIST    (32M,64M,256M)
#     --out FOLDER      keeps the reports there
#
# Runs begin until MINUTES (10) have passed, at least one a budget. Every second run looks for see-through pixels, which
# costs a second drawing and a ray a pixel.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
. "$root/scripts/report_values.sh"

build=$root/build/release frames=1500 size=320x240 budgets=32M,64M,256M out=
usage() { sed -n 's/^# \{0,1\}//; 2,15p' "${BASH_SOURCE[0]}"; }
words=()
while (($# > 0)); do
    case $1 in
        --build | --frames | --size | --budgets | --out)
            [[ $# -ge 2 ]] || { echo "$1 wants a value" >&2; exit 2; }
            printf -v "${1#--}" %s "$2"
            shift
            ;;
        -h | --help) usage; exit 0 ;;
        -*) usage >&2; exit 2 ;;
        *) words+=("$1") ;;
    esac
    shift
done
[[ ${#words[@]} -ge 1 && ${#words[@]} -le 2 ]] || { usage >&2; exit 2; }
store=${words[0]} minutes=${words[1]:-10}
[[ $minutes =~ ^[0-9]+$ ]] || { echo "MINUTES $minutes is not a whole number" >&2; exit 2; }
view=$build/runtime/scree-view
[[ -x $view ]] || { echo "$view is not there: build first" >&2; exit 2; }
if [[ -z $out ]]; then
    out=$(mktemp -d)
    trap 'rm -rf -- "$out"' EXIT
fi
mkdir -p -- "$out"

# rss_growth CSV: peak of rss_bytes in the second half of the lines over that in the first.
rss_growth() {
    awk -F, 'NR == 1 { for (k = 1; k <= NF; ++k) if ($k == "rss_bytes") column = k; next }
        { rss[++count] = $column }
        END {
            for (k = 1; k <= count; ++k) if (k <= count / 2) { if (rss[k] > first) first = rss[k] } else if (rss[k] > second) second = rss[k]
            if (first > 0) printf "%.4f", second / first
        }' "$1"
}

# soak_once SEED BUDGET SEE_THROUGH: one run; its line, and 1 if anything is wrong with it.
soak_once() {
    local seed=$1 budget=$2 name=$out/$2-$1 code=0 wrong= growth value
    local -a looking=()
    [[ $3 == 0 ]] || looking=(--see-through)
    "$view" fly "$store" --roam "$seed" --frames "$frames" --headless --size "$size" --budget "$budget" \
        --json "$name.json" --csv "$name.csv" "${looking[@]}" >"$name.txt" 2>&1 || code=$?
    if [[ $code != 0 ]]; then
        echo "FAILED seed $seed, $budget: exit code $code: $(tail -n 1 "$name.txt")"
        return 1
    fi
    for value in holes damaged_tiles see_through_pixels; do
        [[ $(report_value "$name.json" $value) =~ ^0?$ ]] || wrong+=" $value $(report_value "$name.json" $value);"
    done
    local used limit
    used=$(report_value "$name.json" tile_rss_bytes) limit=$(report_value "$name.json" budget_bytes)
    ((used <= limit)) || wrong+=" $used bytes of tiles in a budget of $limit;"
    growth=$(rss_growth "$name.csv")
    awk -v growth="$growth" 'BEGIN { exit !(growth != "" && growth <= 1.02) }' || wrong+=" memory grew by a factor of $growth;"
    echo "${wrong:+FAILED }seed $seed, $budget: $frames frames, $(report_value "$name.json" tiles_paged_in) tiles in," \
        "$(report_value "$name.json" tiles_paged_out) out, $(megabytes "$used") of $(megabytes "$limit") MB," \
        "memory x $growth${looking:+, looked through}${wrong:+:$wrong}"
    [[ -z $wrong ]]
}

IFS=, read -r -a budget_list <<<"$budgets"
end=$((SECONDS + 60 * minutes)) run=0 failed=0
while ((run < ${#budget_list[@]} || SECONDS < end)); do
    soak_once $((run + 1)) "${budget_list[run % ${#budget_list[@]}]}" $(((run + 1) % 2)) || failed=$((failed + 1))
    run=$((run + 1))
done
echo "$run runs, $failed failed"
((failed == 0))
