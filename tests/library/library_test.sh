#!/usr/bin/env bash
# The library as others meet it: installed, found by find_package, and built upon. Nothing of the source tree is seen.
#     library_test.sh SOURCE BUILD C++_FLAGS PART       PART: headers, height_profile or glfw_viewer
set -euo pipefail

source=$1 build=$2 flags=$3 part=$4
scree=$build/tools/scree
work=$build/library_test
prefix=$work/prefix
store=$work/land.scree

fail() {
    printf 'library_test: %s\n' "$*" >&2
    exit 1
}

# Once for all parts, which run after it.
prepare() {
    rm -rf -- "$work"
    mkdir -p "$work"
    cmake --install "$build" --prefix "$prefix" --component dev >"$work/install.log"
    "$scree" synth -o "$work" --size 129 --spacing 20 --imagery-scale 1 --quiet
    "$scree" build "$work/dem.tif" --imagery "$work/ortho.tif" -o "$store" --quiet
    CXXFLAGS="$flags -Wall -Wextra -Wconversion -Werror" cmake -S "$source/examples" -B "$work/examples" -G Ninja \
        -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release >"$work/configure.log"
}

# All headers together, by a compiler that knows nothing but the prefix; and the C one, linked by pkg-config.
headers() {
    (cd "$prefix/include" && find scree -name '*.h' | LC_ALL=C sort | sed 's/.*/#include <&>/') >"$work/all.cpp"
    (($(wc -l <"$work/all.cpp") > 40)) || fail "few headers were installed"
    c++ -std=c++20 -Wall -Wextra -Wpedantic -Werror -fsyntax-only -I "$prefix/include" "$work/all.cpp"
    ! grep -rnE '#include "(common|runtime)/' "$prefix/include" || fail "headers include what is not installed so"
    ! grep -rn 'Werror' "$prefix/lib" --include='*.cmake' || fail "users are given our warnings"
    printf '%s\n' '#include <scree/scree.h>' '#include <stdio.h>' 'int main(int argc, char** argv) {' \
        'scree_store* s; double z; (void)argc;' \
        'if (scree_open(argv[1], &s) != SCREE_OK) return puts(scree_error_message()), 1;' \
        'if (scree_height(s, 401280, 5298720, &z, NULL) != SCREE_OK) return 2;' \
        'printf("%s %.3f\n", scree_version(), z); scree_close(s); return 0; }' >"$work/program.c"
    # shellcheck disable=SC2046,SC2086 # several words each
    PKG_CONFIG_PATH=$(dirname -- "$(find "$prefix" -name scree.pc)") cc -std=c99 -Wall -Werror $flags "$work/program.c" \
        -o "$work/program" $(PKG_CONFIG_PATH=$(dirname -- "$(find "$prefix" -name scree.pc)") pkg-config --cflags --libs scree)
    "$work/program" "$store"
}

# The example's line against the program's points.
height_profile() {
    cmake --build "$work/examples" --target height_profile >"$work/height_profile.log" || fail "$(cat "$work/height_profile.log")"
    local x1 y1 line expected
    read -r x1 y1 < <("$scree" info "$store" --json - | sed -n '/"origin_m"/,/]/p' | tr -dc '0-9.\n-' | xargs)
    "$work/examples/height_profile/height_profile" "$store" "$x1" "$y1" \
        "$(awk "BEGIN { print $x1 + 2560 }")" "$(awk "BEGIN { print $y1 - 2560 }")" 9 >"$work/profile.csv"
    [[ $(wc -l <"$work/profile.csv") == 10 ]] || fail "no nine heights: $(cat "$work/profile.csv")"
    while IFS=, read -r x y z _; do
        [[ $x != x_m ]] || continue
        line=$("$scree" height "$store" "$x" "$y")
        expected=$(awk '{ printf "%.3f", $3 }' <<<"$line")
        [[ $z == "$expected" ]] || fail "at $x,$y the example says $z, scree height says $line"
    done <"$work/profile.csv"
    "$work/examples/height_profile/height_profile" "$work/none.scree" 0 0 1 1 2 2>"$work/error" && fail "no store, no error"
    grep -q none.scree "$work/error" || fail "an error that does not name the file: $(cat "$work/error")"
}

# A window of a virtual display; the picture shows a landscape.
glfw_viewer() {
    command -v xvfb-run >/dev/null || {
        echo "SKIPPED: there is no xvfb-run"
        exit 77
    }
    cmake --build "$work/examples" --target glfw_viewer >"$work/glfw_viewer.log" || fail "$(cat "$work/glfw_viewer.log")"
    LIBGL_ALWAYS_SOFTWARE=1 xvfb-run -a -s '-screen 0 1024x768x24' "$work/examples/glfw_viewer/glfw_viewer" "$store" 5 \
        "$work/picture.png" >"$work/said"
    grep -qE '^[0-9]+ triangles, within (0|1)\.[0-9]+ px$' "$work/said" || fail "it said: $(cat "$work/said")"
    local width height colours
    read -r width height colours < <(identify -format '%w %h %k\n' "$work/picture.png")
    [[ "$width $height" == "800 600" ]] || fail "the picture is $width x $height"
    ((colours > 300)) || fail "the picture has $colours colours"
}

"$part"
