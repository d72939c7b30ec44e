# The experiments that need no program of their own: scree-view's reports as tables and charts. Sourced by
# experiments.sh, which sets what is used here. No more than bash and awk besides.
# shellcheck disable=SC2154 # those variables
# shellcheck disable=SC2016 # awk's programs and Markdown stand in single quotes

# run_view NAME ARGUMENTS: scree-view, its report in $work/NAME.json. An audit that finds a broken promise exits with 1
# and has a report: methods that promise nothing are what is measured here.
run_view() {
    local name=$1 code=0
    shift
    echo "  scree-view $*" >&2
    "$view" "$@" --json "$work/$name.json" >"$work/$name.log" 2>&1 || code=$?
    if ((code > 1)) || [[ ! -s $work/$name.json ]]; then
        cat "$work/$name.log" >&2
        exit 1
    fi
}
of() { report_value "$work/$1.json" "$2"; }

# For awk over CSV with a header: v(COLUMN) of the line, a text (+ 0 makes it a number); promise() and grouped() (131072 as 131,072) for tables.
csv_awk='
    function fields(line, into,    n, k, c, quoted) {
        n = 1; into[1] = ""; quoted = 0
        for (k = 1; k <= length(line); ++k) {
            c = substr(line, k, 1)
            if (c == "\"") quoted = !quoted
            else if (c == "," && !quoted) into[++n] = ""
            else into[n] = into[n] c
        }
        return n
    }
    function grouped(n) {
        n = sprintf("%.0f", n)
        while (match(n, /[0-9][0-9][0-9][0-9]($|,)/)) n = substr(n, 1, RSTART) "," substr(n, RSTART + 1)
        return n
    }
    function promise(guaranteed, px, kept) { return guaranteed + 0 ? sprintf("%g px, %s", px, kept + 0 ? "kept" : "BROKEN") : "none" }
    FNR == 1 { count = fields($0, names); for (k = 1; k <= count; ++k) at[names[k]] = k; next }
    { fields($0, f) }
    function v(name) { return f[at[name]] }'

# load: what a page says of the machine beside times.
load() { printf 'Load of the machine when this was written: %s on %s cores.' "$(cut -d ' ' -f 2 /proc/loadavg)" "$(nproc)"; }

# ---- de Boer: 257 x 257, blocks of 17 x 17 ----

# deboer_rows CSV STORE LABEL: triangles and errors of both metrics over one path, as lines of CSV.
deboer_rows() {
    local csv=$1 store=$2 label=$3 tau metric promised
    for tau in "${deboer_taus[@]}"; do
        for metric in guaranteed deboer; do
            run_view deboer_audit audit "$store" --tau "$tau" --metric "$metric" --frames "$deboer_frames"
            run_view deboer_fly fly "$store" --headless --wait --tau "$tau" --metric "$metric" --frames "$deboer_frames"
            promised=0
            [[ $metric != guaranteed ]] || promised=1
            printf '"%s",%s,%s,%s,%s,%s,%s,%s,%s,%s,%s,"%s, %s"\n' "$label" "$metric" "$tau" \
                "$(of deboer_fly triangles.mean)" "$(of deboer_fly triangles.max)" "$(of deboer_audit max_error_px)" \
                "$(of deboer_audit p99_error_px)" "$(of deboer_audit mean_error_px)" "$(of deboer_audit samples)" \
                "$promised" "$(if [[ $(of deboer_audit kept) == true ]]; then echo 1; else echo 0; fi)" "$label" "$metric" >>"$csv"
        done
    done
}

# crop STORE OUT XMIN YMIN XMAX YMAX: 257 x 257 samples of it as a store of 17 x 17 tiles.
crop() {
    "$scree" export "$1" --heights "$work/crop.tif" --box "$3,$4,$5,$6" --force --quiet
    "$scree" build "$work/crop.tif" -o "$2" --tile-size 17 --quiet
}

deboer_page() {
    cat <<'END'
## De Boer: 257 x 257 samples in tiles of 17 x 17

A whole mesh has 131,072 triangles. Both metrics draw the same poses of the default flight, complete; errors are the audit's, against every finest vertex in
view. The paper takes tau for the error that is seen, and looks at its metric no further. The prototype: greatest errors of 10 to 12.4 px at tau 8 by
the distance to the centre (1.09 to 1.32 at tau 1), 5.96 to 7.90 by the guaranteed metric, on landscapes of 660^2 to 1025^2. In Scree pages are refined by
the same metric, so a far page errs by its own corrections as well.

| terrain | metric | tau | triangles | of whole % | most in a frame | greatest error px | over tau | p99 | mean | promise |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
END
    awk "$csv_awk"'{
        printf "| %s | %s | %s | %s | %.1f | %s | %.2f | %.2f | %.2f | %.3f | %s |\n", v("terrain"), v("metric"), v("tau_px"),
            grouped(v("triangles_mean")), 100 * v("triangles_mean") / 131072, grouped(v("triangles_max")), v("true_max_px"),
            v("true_max_px") / v("tau_px"), v("true_p99_px"), v("true_mean_px"), promise(v("guaranteed"), v("tau_px"), v("kept"))
    }' "$out/deboer.csv"
    printf '\n![Greatest error at tau 8](deboer_error.svg)\n![Triangles against error](deboer_triangles.svg)\n\n'
}

deboer() {
    local csv=$out/deboer.csv spot puget=${SCREE_DATA:+$SCREE_DATA/puget/ps_height_1k.png}
    echo "terrain,metric,tau_px,triangles_mean,triangles_max,true_max_px,true_p99_px,true_mean_px,samples,guaranteed,kept,series" >"$csv"
    "$scree" synth -o "$work/deboer" --size 257 --spacing 40 --imagery-scale 0 --quiet
    "$scree" build "$work/deboer/dem.tif" -o "$work/deboer.scree" --tile-size 17 --quiet
    deboer_rows "$csv" "$work/deboer.scree" made-up
    if [[ -n $taipei ]]; then
        crop "$work/taipei.scree" "$work/taipei257.scree" 6015 -13695 13695 -6015
        deboer_rows "$csv" "$work/taipei257.scree" Taipei
    fi
    if [[ -n $puget && -f $puget ]]; then
        "$scree" build "$puget" -o "$work/puget.scree" --spacing 160 --height-scale 0.1 --quiet
        crop "$work/puget.scree" "$work/puget257.scree" 81920 -122880 122880 -81920
        deboer_rows "$csv" "$work/puget257.scree" Puget
    fi
    spot="257 x 257 samples, tiles of 17 x 17, $deboer_frames poses of the default flight, 800 x 800 px"
    { head -n 1 "$csv"; awk "$csv_awk"'v("tau_px") == 8' "$csv"; } >"$work/deboer8.csv"
    "$chart" "$work/deboer8.csv" -o "$out/deboer_error.svg" --bars --x terrain --y true_max_px --series metric --level "tau=8" \
        --title "Greatest error at tau 8" --subtitle "$spot" --x-label "terrain" --y-label "greatest error (px)"
    "$chart" "$csv" -o "$out/deboer_triangles.svg" --x true_max_px --y triangles_mean --series series --log-x --log-y \
        --title "Triangles against error" --subtitle "$spot; tau ${deboer_taus[*]}" \
        --x-label "greatest error (px)" --y-label "triangles a frame"
    deboer_page >"$work/parts/deboer.md"
}

# ---- Ke et al.: gigabytes of heights and imagery ----

# ke_rows CSV STORE TILE REPORT: flights and audits of one store under both kinds of culling.
ke_rows() {
    local csv=$1 store=$2 tile=$3 report=$4 tau cull levels taus=(1 4)
    # Of the finest large tiles at tau 1 the budget holds too few: tau would be what the slots allow.
    ((tile < 257)) || taus=(4)
    levels=$("$scree" info "$store" | sed -n 's/^  lattice .*m, \([0-9]*\) levels.*/\1/p')
    for tau in "${taus[@]}"; do
        for cull in box corners; do
            run_view ke_fly fly "$store" --headless --budget 256M --tau "$tau" --cull "$cull" --frames "$ke_frames"
            run_view ke_audit audit "$store" --budget 256M --tau "$tau" --cull "$cull" --frames "$ke_poses"
            awk -v tile="$tile" -v levels="$levels" -v tau="$tau" -v cull="$cull" -v bytes="$(report_value "$report" store_bytes)" \
                -v seconds="$(report_value "$report" seconds)" -v tri="$(of ke_fly triangles.mean)" -v tiles="$(of ke_fly tiles_drawn.mean)" \
                -v ms="$(of ke_fly frame_ms.median)" -v p99="$(of ke_fly frame_ms.p99)" -v select_ms="$(of ke_fly select_ms.median)" \
                -v rss="$(of ke_fly tile_rss_bytes)" -v stand="$(of ke_fly frames_with_stand_ins)" -v holes="$(of ke_audit holes)" \
                -v samples="$(of ke_audit samples)" -v worst="$(of ke_audit max_error_px)" 'BEGIN {
                    printf "\"%s^2, %d levels\",%s,%s,%s,%.1f,%.1f,%.0f,%.1f,%.2f,%.2f,%.2f,%.4f,%.1f,%d,%d,%d,%.4f,%.4f,\"%s^2, tau %s\"\n",
                        tile, levels, levels, tau, cull, bytes / 1e6, seconds, tri, tiles, ms, p99, 1000 / ms, select_ms, rss / 1e6,
                        stand, holes, samples, 100 * holes / (holes + samples), worst, tile, tau }' >>"$csv"
        done
    done
}

ke_page() {
    printf '## Ke et al.: %s\n\n' "$1"
    cat <<'END'
Ke et al. print 30 minutes of building and 700 MB of pyramid for their 4 GB in seven levels, and, for one run, both 15 and 60 frames a second. Frames here are of
a software renderer on cores that other work shares: only columns of one run compare, and only as ratios. "box" tests a tile's box against the frustum,
"corners" draws a tile where one of its four corners is in view, as published. Lost: finest cells in view under no drawn tile, of those and the vertices in view,
complete poses (an audit judges every finest vertex of this much terrain, so there are few). Budget 256M. The prototype loses 1.1 to 2.1 % of the visible tiles of 1.3 km, 10.7 to 15.8 % of 5.3 km, 29 to 45 % of 21 km, over random cameras.

| tiles | store MB | built in s | tau | cull | triangles | tiles drawn | frame ms, median | p99 | fps | of box | select ms | tile memory MB | frames with stand-ins | lost cells | lost % | greatest error px of what is drawn |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
END
    awk "$csv_awk"'{
        if (v("cull") == "box") box = v("frame_ms")
        printf "| %s | %.0f | %.0f | %s | %s | %s | %.0f | %.0f | %.0f | %.2f | %.2f | %.3f | %.0f | %d | %s | %.3f | %.2f |\n", v("store"), v("store_mb"),
            v("build_s"), v("tau_px"), v("cull"), grouped(v("triangles_mean")), v("tiles_mean"), v("frame_ms"), v("frame_p99_ms"), v("fps"),
            box / v("frame_ms"), v("select_ms"), v("tile_mb"), v("stand_ins"), grouped(v("lost_cells")), v("lost_percent"), v("true_max_px")
    }' "$out/ke.csv"
    printf '\n%s\n' "$(load)"
    printf '\n![Cells lost](ke_lost.svg)\n![Frames a second](ke_fps.svg)\n\n'
}

ke() {
    local csv=$out/ke.csv source size=2049 title tile
    if ((large)); then
        size=16385 source=${data:-$work}/large
        title="16,385 x 16,385 heights and 32,768 x 32,768 texels, 4.3 GB"
    else
        source=$work/large title="2,049 x 2,049 heights and 4,096 x 4,096 texels, in place of 4.3 GB (\`--large\`)"
    fi
    [[ -e $source/dem.tif ]] || "$scree" synth -o "$source" --size "$size" --imagery-scale 2 --quiet
    echo "store,levels,tau_px,cull,store_mb,build_s,triangles_mean,tiles_mean,frame_ms,frame_p99_ms,fps,select_ms,tile_mb,stand_ins,lost_cells,samples,lost_percent,true_max_px,group" >"$csv"
    for tile in 33 257; do
        echo "  scree build $size, tiles of $tile" >&2
        "$scree" build "$source/dem.tif" --imagery "$source/ortho.tif" -o "$work/ke.scree" --tile-size "$tile" --force --quiet \
            --json "$work/ke_build.json"
        ke_rows "$csv" "$work/ke.scree" "$tile" "$work/ke_build.json"
        rm -f -- "$work/ke.scree"
    done
    show_ke "$title"
}

# show_ke TITLE: charts and part of the page of what ke measured.
show_ke() {
    local csv=$out/ke.csv title=$1
    "$chart" "$csv" -o "$out/ke_lost.svg" --bars --x group --y lost_percent --series cull --title "Terrain lost by culling" \
        --subtitle "$title; $ke_poses complete poses of the default flight" --x-label "tiles, tolerance" --y-label "cells lost (%)"
    "$chart" "$csv" -o "$out/ke_fps.svg" --bars --x group --y fps --series cull --title "Frames a second" \
        --subtitle "$title; $ke_frames frames in flight, 800 x 800 px, budget 256M, software renderer" \
        --x-label "tiles, tolerance" --y-label "frames a second (1 / median)"
    ke_page "$title" >"$work/parts/ke.md"
}

# ---- methods side by side ----

# methods_of NAME: the cases of a comparison that the page shows, the same columns as compare's.
methods_of() {
    awk "$csv_awk"'v("sweep") == "tolerance" && v("method") !~ /s = 0\.(25|5) tau|corners/' "$work/compare_$1.csv" |
        sed 's/^\(tolerance\),"geomip, no morph"/\1,no morph/; s/"rsg, cache exact, s = 0.1 tau"/rsg exact/; s/"rsg, cache paper, s = 0.1 tau"/rsg P1/
            s/"geomip, metric deboer"/deboer/; s/"rsg, metric uc"/rsg uc/'
}

# within_one NAME: of every method the case of fewest triangles whose greatest error is within a pixel.
within_one() {
    awk "$csv_awk"'
        v("true_max_px") + 0 <= 1 && v("holes") == 0 && v("open_edges") == 0 {
            m = v("method")
            if (!(m in best)) { order[++n] = m }
            if (!(m in best) || v("triangles_mean") + 0 < best[m] + 0) { best[m] = v("triangles_mean"); line[m] = $0 }
        }
        END { for (k = 1; k <= n; ++k) print line[order[k]] }' "$out/methods_$1.csv"
}

methods_page() {
    local name=$1
    printf '## Methods side by side: %s\n\n%s poses, complete; every second pose moved on by 15 m (`scree-view compare`).' "$2" "$methods_frames"
    cat <<'END'
 Times of one run, cases in turns, on cores that other work shares: they compare as ratios ("of geomip": to `geomip` at tau 1). Errors are the audit's, against every
finest vertex in view, at the pose moved on. PSNR against tolerance 0. `no morph`: `geomip --no-morph`; `deboer`: `geomip --metric deboer`; `rsg exact`: `rsg --cache exact`
and `rsg P1`: `--cache paper`, s = tau / 10; `rsg uc`: `rsg --metric uc`.

| method | tau | triangles | tile MB | LOD ms | of geomip | after a leap | frame ms | of geomip | greatest error px | p99 | mean | promise | PSNR dB |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
END
    awk "$csv_awk"'
        NR == FNR { if (v("method") == "geomip" && v("tau_px") == 1) { lod = v("lod_ms"); frame = v("frame_ms") } next }
        { printf "| %s | %g | %s | %.1f | %.3f | %.1f | %.3f | %.1f | %.2f | %.2f | %.2f | %.3f | %s | %.1f |\n", v("method"), v("tau_px"),
            grouped(v("triangles_mean")), v("tile_bytes") / 1e6, v("lod_ms"), v("lod_ms") / lod, v("lod_cold_ms"), v("frame_ms"), v("frame_ms") / frame,
            v("true_max_px"), v("true_p99_px"), v("true_mean_px"), promise(v("guaranteed"), v("promised_px"), v("kept")), v("psnr_db") }' \
        "$out/methods_$name.csv" "$out/methods_$name.csv"
    printf '\n%s\n' "$(load)"
    cat <<'END'

### A frame whose audited error is at most 1 px

Of every method the case of fewest triangles of those with no error above 1 px at any pose. Only where something is promised would another path find the same.

| method | tau | greatest error px | promise | triangles | LOD ms | frame ms | of geomip |
| --- | --- | --- | --- | --- | --- | --- | --- |
END
    awk "$csv_awk"'{
            if (v("method") == "geomip") frame = v("frame_ms")
            printf "| %s | %g | %.2f | %s | %s | %.3f | %.1f | %.2f |\n", v("method"), v("tau_px"), v("true_max_px"),
            promise(v("guaranteed"), v("promised_px"), v("kept")), grouped(v("triangles_mean")), v("lod_ms"), v("frame_ms"), v("frame_ms") / frame }' \
        "$work/within_$name.csv"
    printf '\n![Frame time at 1 px](methods_%s_frame.svg)\n![Triangles against error](methods_%s_triangles.svg)\n![LOD time against error](methods_%s_lod.svg)\n\n' \
        "$name" "$name" "$name"
}

# methods NAME TITLE STORE
methods() {
    local name=$1 title=$2 store=$3
    run_view "compare_$name" compare "$store" --taus "$methods_taus" --frames "$methods_frames" --rounds "$methods_rounds" --quiet \
        --csv "$work/compare_$name.csv"
    { head -n 1 "$work/compare_$name.csv"; methods_of "$name"; } >"$out/methods_$name.csv"
    show_methods "$name" "$title"
}

# show_methods NAME TITLE: charts and part of the page of what methods measured.
show_methods() {
    local name=$1 title=$2 spot csv=$out/methods_$1.csv
    { head -n 1 "$csv"; within_one "$name"; } >"$work/within_$name.csv"
    # What is drawn without error would stretch the axis by decades; cached meshes have the triangles of rsg.
    { head -n 1 "$csv"; awk "$csv_awk"'v("true_max_px") + 0 >= 0.01' "$csv"; } >"$work/erring_$name.csv"
    grep -Ev '^tolerance,rsg (exact|P1),' "$work/erring_$name.csv" >"$work/uncached_$name.csv"
    spot="$title; $methods_frames poses, 800 x 800 px, tau ${methods_taus//,/ }"
    "$chart" "$work/within_$name.csv" -o "$out/methods_${name}_frame.svg" --bars --x method --y frame_ms --title "Frame time at an audited error of at most 1 px" \
        --subtitle "$spot; ratios compare" --x-label "method" --y-label "frame (ms)"
    "$chart" "$work/uncached_$name.csv" -o "$out/methods_${name}_triangles.svg" --x true_max_px --y triangles_mean --series method --log-x --log-y \
        --title "Triangles against error" --subtitle "$spot" --x-label "greatest error (px)" --y-label "triangles a frame"
    "$chart" "$work/erring_$name.csv" -o "$out/methods_${name}_lod.svg" --x true_max_px --y lod_ms --series method --log-x --log-y \
        --title "Time of level of detail against error" --subtitle "$spot" --x-label "greatest error (px)" --y-label "selection and meshes (ms CPU)"
    methods_page "$name" "$title" >"$work/parts/methods_$name.md"
}
