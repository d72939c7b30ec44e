#!/usr/bin/env bash
# Measures the builder on this machine: what a build costs beyond decoding, stage by stage, the largest case, two cores against one, memory
# against size, updates; and peers on the same files, where they are installed (Debian's libvips-tools, gdal-bin). Prints tables and leaves
# the reports that they come from, as JSON, in a folder.
#
#     scripts/bench_builder.sh [OPTIONS] [PART...]
#
#     --out FOLDER      where reports and stores go (bench-builder)
#     --data FOLDER     where the inputs are made and kept (bench-builder-data): 3.5 GB, with `large` 8 GB
#     --build FOLDER    the build to measure (build/release)
#
# Parts: ortho dem large giga threads memory update peers; all but `large` and `giga` when none is named. docs/measuring.md says what the
# lines mean. `memory` compares two sizes of strips, one-row strips, tiles, a mosaic of 300 files and a warp (with gdal-bin); `giga` is
# 65536^2 pixels of one JPEG file that lies in 16 places.
# Nothing else should run meanwhile. Synthetic inputs: the same bytes everywhere.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
. "$root/scripts/report_values.sh"

out=bench-builder data=bench-builder-data build=$root/build/release
usage() { sed -n '2,/^set /{/^set /d; s/^# \{0,1\}//; p}' "${BASH_SOURCE[0]}"; }
parts=()
while (($# > 0)); do
    case $1 in
        --out | --data | --build)
            [[ $# -ge 2 ]] || { echo "$1 wants a value" >&2; exit 2; }
            printf -v "${1#--}" %s "$2"
            shift
            ;;
        -h | --help) usage; exit 0 ;;
        ortho | dem | large | giga | threads | memory | update | peers) parts+=("$1") ;;
        *) usage >&2; exit 2 ;;
    esac
    shift
done
[[ ${#parts[@]} -gt 0 ]] || parts=(ortho dem threads memory update peers)
scree=$build/tools/scree
reader=$build/tests/bench/scree_stack_bench
[[ -x $scree ]] || { echo "$scree is not there: build first" >&2; exit 2; }
[[ -x $reader ]] || { echo "$reader is not there: ninja -C $build scree_stack_bench" >&2; exit 2; }
mkdir -p -- "$out" "$data"

has() { command -v "$1" >/dev/null; }
wants() { [[ " ${parts[*]} " == *" $1 "* ]]; }
# land NAME SIZE SPACING SCALE
land() {
    [[ -e $data/$1/dem.tif ]] || "$scree" synth -o "$data/$1" --size "$2" --spacing "$3" --imagery-scale "$4" --quiet
}
# variant FROM TO OPTIONS...: the same pixels in another coding
variant() {
    local from=$1 to=$2
    shift 2
    [[ -e $to ]] || gdal_translate -q "$@" "$from" "$to"
}
# built NAME ARGUMENTS...: a report $out/NAME.json. The inputs are read once before, so that the disk has no say.
built() {
    local name=$1
    shift
    for file in "$@"; do [[ -f $file ]] && cat "$file" >/dev/null; done
    "$scree" build "$@" -o "$out/$name.scree" --force --quiet --json "$out/$name.json"
}
field() { report_value "$out/$1.json" "$2"; }
stages() {
    printf '%s' "decode $(field "$1" decode_seconds) warp $(field "$1" warp_seconds) filter $(field "$1" filter_seconds)"
    printf '%s\n' " encode $(field "$1" encode_seconds) error $(field "$1" error_seconds) store $(field "$1" store_seconds)"
}
line() {
    awk -v n="$1" -v s="$(field "$1" seconds)" -v c="$(field "$1" cpu_seconds)" -v r="$(field "$1" peak_rss_bytes)" \
        -v b="$(field "$1" store_bytes)" 'BEGIN { printf "%-22s %7.2f s %7.2f CPU s %6.0f MiB peak %8.1f MB store\n", n, s, c, r / 1048576, b / 1e6 }'
    echo "    $(stages "$1")"
}
# The CPU seconds of merely reading an image as the builder reads it.
reading() {
    cat "$1" >/dev/null
    "$reader" "$1" | awk '{ for (k = 1; k < NF; ++k) { if ($k == "own") a = $(k + 1); if ($k == "decoder") b = $(k + 1) } print a + b }'
}

if wants ortho || wants peers; then
    land ortho 1025 40 16
    images=("$data/ortho/ortho.tif")
    if has gdal_translate; then
        variant "$data/ortho/ortho.tif" "$data/ortho/deflate.tif" -co COMPRESS=DEFLATE -co PREDICTOR=2
        variant "$data/ortho/ortho.tif" "$data/ortho/jpeg.tif" -co COMPRESS=JPEG -co TILED=YES -co PHOTOMETRIC=YCBCR -co JPEG_QUALITY=85
        images+=("$data/ortho/deflate.tif" "$data/ortho/jpeg.tif")
    fi
fi
if wants ortho; then
    echo "16384^2 orthophotos over a 1025^2 DEM"
    built alone "$data/ortho/dem.tif"
    for image in "${images[@]}"; do
        decode=$(reading "$image")
        for codec in split raw; do
            name=$(basename -- "$image" .tif)
            [[ $codec == split ]] || name=${name}_unpacked
            built "$name" "$data/ortho/dem.tif" --imagery "$image" --texture-codec "$codec"
            line "$name"
            awk -v all="$(field "$name" cpu_seconds)" -v decode="$decode" 'BEGIN {
                printf "    decoding %.2f CPU s; beyond it %.2f ns a source pixel\n", decode, (all - decode) / (16384 * 16384) * 1e9 }'
        done
    done
fi
if wants dem; then
    echo "8193^2 DEM, tint"
    land dem8193 8193 10 0
    built dem8193 "$data/dem8193/dem.tif"
    line dem8193
fi
if wants large; then
    echo "16385^2 DEM and 32768^2 image: 4.3 GB raw"
    land large 16385 10 2
    built large "$data/large/dem.tif" --imagery "$data/large/ortho.tif"
    line large
fi
if wants threads || wants memory || wants update; then land synth 4097 10 4; fi
if wants threads; then
    echo "4097^2 DEM and 16384^2 image, one thread and two"
    for threads in 1 2; do
        built "threads$threads" "$data/synth/dem.tif" --imagery "$data/synth/ortho.tif" --threads "$threads"
        line "threads$threads"
    done
    echo "    two are $(ratio_of "$(field threads1 seconds)" "$(field threads2 seconds)") times as fast"
    # With one thread the decoder's process and the thread that writes have the other core to themselves.
    if has taskset; then
        scree_anywhere=$scree
        one_core() { taskset -c 0 "$scree_anywhere" "$@"; }
        scree=one_core
        built onecore "$data/synth/dem.tif" --imagery "$data/synth/ortho.tif" --threads 1
        scree=$scree_anywhere
        line onecore
        echo "    two threads on all cores are $(ratio_of "$(field onecore seconds)" "$(field threads2 seconds)") times as fast as one core"
    fi
fi
if wants memory; then
    echo "Peak memory from 1 to 16 times the input, --memory 192M"
    land small 1025 10 4
    # compared NAME SMALL LARGE: images over the two pieces of land
    compared() {
        built "small_$1" "$data/small/dem.tif" --imagery "$2" --memory 192M
        built "sixteen_$1" "$data/synth/dem.tif" --imagery "$3" --memory 192M
        awk -v n="$1" -v a="$(field "small_$1" peak_rss_bytes)" -v b="$(field "sixteen_$1" peak_rss_bytes)" 'BEGIN {
            printf "    %-14s %6.1f MiB, %6.1f MiB: %+.0f %%\n", n, a / 1048576, b / 1048576, (b / a - 1) * 100 }'
        rm -f -- "$out/small_$1.scree" "$out/sixteen_$1.scree"
    }
    # three_hundred FROM FOLDER: the image in 20 x 15 files
    three_hundred() {
        [[ -e $2/done ]] && return
        mkdir -p -- "$2"
        local size r c
        size=$(gdalinfo "$1" | sed -n 's/^Size is \([0-9]*\),.*/\1/p')
        for ((r = 0; r < 15; r++)); do
            for ((c = 0; c < 20; c++)); do
                gdal_translate -q "${jpeg[@]}" -srcwin $((c * size / 20)) $((r * size / 15)) $(((c + 1) * size / 20 - c * size / 20)) \
                    $(((r + 1) * size / 15 - r * size / 15)) "$1" "$2/t_${r}_$c.tif"
            done
        done
        rm -f -- "$2"/*.aux.xml
        touch "$2/done"
    }
    compared strips "$data/small/ortho.tif" "$data/synth/ortho.tif"
    if has gdalwarp; then
        jpeg=(-co COMPRESS=JPEG -co TILED=YES -co PHOTOMETRIC=YCBCR -co JPEG_QUALITY=85)
        for land in small synth; do
            variant "$data/$land/ortho.tif" "$data/$land/rows.tif" -co BLOCKYSIZE=1
            variant "$data/$land/ortho.tif" "$data/$land/tiles.tif" "${jpeg[@]}"
            three_hundred "$data/$land/ortho.tif" "$data/$land/mosaic"
            [[ -e $data/$land/degrees.tif ]] ||
                gdalwarp -q -r near -t_srs EPSG:4326 -dstalpha -co COMPRESS=DEFLATE -co TILED=YES "$data/$land/tiles.tif" "$data/$land/degrees.tif"
        done
        compared one-row "$data/small/rows.tif" "$data/synth/rows.tif"
        compared tiles "$data/small/tiles.tif" "$data/synth/tiles.tif"
        compared mosaic-of-300 "$data/small/mosaic" "$data/synth/mosaic"
        compared warp "$data/small/degrees.tif" "$data/synth/degrees.tif"
    fi
fi
if wants giga; then
    echo "65536^2 pixels: a 16384^2 JPEG in 16 places"
    has gdal_translate || { echo "    gdal_translate is not installed"; exit 0; }
    land ortho 1025 40 16
    land giga 2049 80 0
    base=$data/giga/base.tif
    variant "$data/ortho/ortho.tif" "$base" -co PROFILE=BASELINE -co COMPRESS=JPEG -co TILED=YES -co PHOTOMETRIC=YCBCR -co JPEG_QUALITY=85
    mkdir -p -- "$data/giga/places"
    for ((k = 0; k < 16; k++)); do
        ln -f -- "$base" "$data/giga/places/t$k.tif"
        printf '2.5\n0\n0\n-2.5\n%s\n%s\n' "$((400000 + k % 4 * 40960 + 1)).25" "$((5300000 - k / 4 * 40960 - 2)).75" >"$data/giga/places/t$k.tfw"
    done
    built giga "$data/giga/dem.tif" --imagery "$data/giga/places" --assume-crs EPSG:32633 --memory 192M
    line giga
    awk -v all="$(field giga cpu_seconds)" -v decode="$(reading "$base")" 'BEGIN {
        printf "    decoding %.2f CPU s; beyond it %.2f ns a source pixel\n", 16 * decode, (all - 16 * decode) / (65536 * 65536) * 1e9 }'
    rm -f -- "$out/giga.scree"
fi
if wants update; then
    echo "Updating a 4097^2 + 16384^2 store by a 1024^2 image"
    has gdal_translate || { echo "    gdal_translate is not installed"; exit 0; }
    variant "$data/synth/ortho.tif" "$data/synth_patch.tif" -srcwin 6000 6000 1024 1024
    built updated "$data/synth/dem.tif" --imagery "$data/synth/ortho.tif"
    "$scree" update "$out/updated.scree" --imagery "$data/synth_patch.tif" --sources "$data/synth" --quiet --json "$out/update.json"
    awk -v c="$(field update cpu_seconds)" -v s="$(field update seconds)" -v b="$(field updated cpu_seconds)" -v d="$(field update districts_built)" -v n="$(field update districts)" \
        'BEGIN { printf "    %.2f s, %.2f CPU s for %d of %d districts; building takes %.2f CPU s\n", s, c, d, n, b }'
fi
if wants peers; then
    echo "Peers on the 16384^2 orthophotos"
    TIMEFORMAT='%U %S %R'
    # cost NAME COMMAND...: CPU and wall seconds
    cost() {
        local name=$1 took
        shift
        took=$({ time "$@" >/dev/null 2>&1; } 2>&1)
        awk -v n="$name" -v t="$took" 'BEGIN { split(t, v, " "); printf "    %-40s %7.2f s %7.2f CPU s\n", n, v[3], v[1] + v[2] }'
    }
    for image in "${images[@]}"; do
        name=$(basename -- "$image" .tif)
        if has vips; then
            cost "vips tiffsave --pyramid, JPEG: $name" vips tiffsave "$image" "$out/vips.tif" --tile --pyramid --compression jpeg
            rm -rf -- "$out/dz"_files "$out/dz.dzi"
            cost "vips dzsave: $name" vips dzsave "$image" "$out/dz"
        fi
        if has gdaladdo; then
            cp -- "$image" "$out/addo.tif"
            cost "gdaladdo average, JPEG: $name" gdaladdo -q -ro -r average --config COMPRESS_OVERVIEW JPEG "$out/addo.tif" 2 4 8 16 32 64
            rm -f -- "$out/addo.tif" "$out/addo.tif.ovr"
        fi
    done
    has vips || echo "    libvips-tools is not installed"
    has gdaladdo || echo "    gdal-bin is not installed"
fi
