#!/usr/bin/env bash
# Flies restlessly over a store, with several seeds and budgets, and checks that nothing gives way: no hole, no pixel
# seen through, no damaged tile, tile memory within the budget, memory flat, exit code 0. A line a run; exit code 1 if
# any run failed.
#
#     scripts/soak.sh [OPTIONS] STORE [MINUTES]
#     scripts/soak.sh --cut-off [--build FOLDER] [MINUTES]
#
#     --build FOLDER    the build to try (build/release)
#     --frames N        poses a run (1500)
#     --size WxH        picture (320x240)
#     --budgets LIST    (32M,64M,256M)
#     --out FOLDER      keeps the reports there
#     --sanitized       the build is one of the presets asan or tsan: resident memory is the sanitizer's and is not held
#                       against the budget, nor to 2 % of growth but to 25 %
#
# Runs begin until MINUTES (10) have passed, at least one a budget. Every second run looks for see-through pixels, which
# costs a second drawing and a ray a pixel.
#
# With --cut-off no flight: the long forms of the tests that cut builds and updates off (docs/resume-and-update.md, "How it
# is proved"), with the seeds 1, 2, 3 and so on, until MINUTES have passed: a fault of every kind at every operation,
# hundreds of builds and updates killed. A line a seed and program; what failed is printed whole. The tests read
# SCREE_LONG=1 and SCREE_TEST_SEED, which repeat one by hand.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
. "$root/scripts/report_values.sh"

build=$root/build/release frames=1500 size=320x240 budgets=32M,64M,256M cut_off= out= sanitized= growth_limit=1.02
usage() { sed -n '2,/^set /{/^set /d; s/^# \{0,1\}//; p}' "${BASH_SOURCE[0]}"; }
words=()
while (($# > 0)); do
    case $1 in
        --build | --frames | --size | --budgets | --out)
            [[ $# -ge 2 ]] || { echo "$1 wants a value" >&2; exit 2; }
            printf -v "${1#--}" %s "$2"
            shift
            ;;
        --cut-off) cut_off=1 ;;
        --sanitized) sanitized=1 growth_limit=1.25 ;;
        -h | --help) usage; exit 0 ;;
        -*) usage >&2; exit 2 ;;
        *) words+=("$1") ;;
    esac
    shift
done
# cut_off_once SEED PROGRAM FILTER: one run of tests in their long form; its line, and 1 if any failed.
cut_off_once() {
    local name=${2##*/} text
    if text=$(SCREE_LONG=1 SCREE_TEST_SEED=$1 "$2" --gtest_filter="$3" 2>&1); then
        echo "seed $1, $name: $(grep -E '\(seed |tests? suites? ran|updates killed' <<<"$text" | sed 's/ (seed.*//; s/^\[=*\] //' | paste -sd ';')"
    else
        echo "FAILED seed $1, $name:"
        echo "$text"
        return 1
    fi
}

if [[ -n $cut_off ]]; then
    [[ ${#words[@]} -le 1 ]] || { usage >&2; exit 2; }
    minutes=${words[0]:-10}
    [[ $minutes =~ ^[0-9]+$ ]] || { echo "MINUTES $minutes is not a whole number" >&2; exit 2; }
    crashes=$build/tests/tools/pyramid/scree_build_crash_test programs=$build/tests/programs/scree_program_tests
    for program in "$crashes" "$programs"; do
        [[ -x $program ]] || { echo "$program is not there: build first" >&2; exit 2; }
    done
    end=$((SECONDS + 60 * minutes)) seed=0 failed=0
    while ((seed == 0 || SECONDS < end)); do
        seed=$((seed + 1))
        cut_off_once $seed "$crashes" '*' || failed=$((failed + 1))
        cut_off_once $seed "$programs" 'Interruption.*:Resumed.*:UpdateKilled.*' || failed=$((failed + 1))
    done
    echo "$seed seeds, $failed runs failed"
    ((failed == 0))
    exit
fi
[[ ${#words[@]} -ge 1 && ${#words[@]} -le 2 ]] || { usage >&2; exit 2; }
store=${words[0]} minutes=${words[1]:-10}
[[ $minutes =~ ^[0-9]+$ ]] || { echo "MINUTES $minutes is not a whole number" >&2; exit 2; }
view=$build/runtime/scree-view
[[ -x $view ]] || { echo "$view is not there: build first" >&2; exit 2; }
[[ -z $sanitized ]] || export TSAN_OPTIONS="suppressions=$root/scripts/tsan.supp:exitcode=66 ${TSAN_OPTIONS:-}"
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
    [[ -n $sanitized ]] || ((used <= limit)) || wrong+=" $used bytes of tiles in a budget of $limit;"
    growth=$(rss_growth "$name.csv")
    awk -v growth="$growth" -v limit=$growth_limit 'BEGIN { exit !(growth != "" && growth <= limit) }' || wrong+=" memory grew by a factor of $growth;"
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
