#!/usr/bin/env bash
# Fails, with the lines at fault, where a part of the house includes what it must not see (docs/architecture.md), or
# where a tracked file is larger than 2 MB.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
cd -- "$root"

largest_bytes=$((2 * 1024 * 1024))

# Extended regular expressions for the first part of an included path.
opengl='epoxy/|GL/|GLES[23]?/|EGL/|KHR/|glad/'
window='GLFW/|imgui'
images='OpenImageIO/|geotiff/|xtiffio\.h|geo_[a-z]+\.h|geotiff[a-z]*\.h|tiff[a-z]*\.hx?|tiffio'
proj='proj\.h|proj/|proj_api\.h|geodesic\.h'

failures=0

# fail HEADING: what follows on standard input is what is wrong; nothing there, nothing is.
fail() {
    local lines
    lines=$(cat)
    [[ -n $lines ]] || return 0
    printf '%s\n%s\n' "$1" "$lines"
    failures=$((failures + 1))
}

# forbid "DIRECTORIES" PATTERN HEADING [EXCEPT]: no file under the directories (EXCEPT apart) includes what the pattern
# names, from the root or by a relative path.
forbid() {
    local directories directory present=()
    read -ra directories <<<"$1"
    for directory in "${directories[@]}"; do
        # A rule about a directory that has moved would hold for ever.
        if [[ -d $directory ]]; then present+=("$directory"); else fail "$3" <<<"$directory: no such directory"; fi
    done
    ((${#present[@]} > 0)) || return 0
    fail "$3" < <(grep -rnIE "^[[:space:]]*#[[:space:]]*include[[:space:]]*[<\"](\.{1,2}/)*($2)" \
        --include='*.h' --include='*.hpp' --include='*.inl' --include='*.c' --include='*.cc' --include='*.cpp' \
        --include='*.h.in' --include='*.cpp.in' -- "${present[@]}" | grep -vE "^(${4:-$^})" || true)
}

below_render='runtime/view runtime/paging runtime/lod'

forbid common 'tools/|runtime/' "common/ includes neither tools/ nor runtime/:"
forbid common "$opengl|$window|$images|$proj" "common/ sees no OpenGL, no window, no image library, no PROJ:"
forbid "common/mesh common/store" 'common/query/' "common/mesh and common/store lie below common/query:"
forbid "common/mesh common/store common/query" 'common/cli/|common/c_api/' "common/cli and c_api lie above the rest of common:"
forbid tools 'runtime/' "tools/ and runtime/ never meet:"
forbid runtime 'tools/' "runtime/ and tools/ never meet:"
forbid "common tools runtime" 'experiments/' "experiments/ is included by nothing but its tests:"
forbid "$below_render" 'runtime/render/|runtime/scene/|runtime/app/' \
    "runtime/view, paging and lod lie below scene, render and app:"
forbid "$below_render runtime/scene" "$window" "runtime/view, paging, lod and scene know no window:"
forbid runtime/render 'runtime/scene/|runtime/app/' "runtime/render lies below scene_renderer and app:"
forbid runtime/scene 'runtime/app/' "runtime/scene lies below app:"
forbid runtime/window 'runtime/app/|runtime/lod/|runtime/paging/|runtime/render/|runtime/scene/' \
    "runtime/window lies below app and beside what is drawn:"
forbid runtime/window "$window" "of runtime/window, window_input, full_screen and hud alone know the window, key_table its keys:" \
    'runtime/window/(window_input|full_screen|hud(_panels|_profile)?)\.|runtime/window/key_table\.cpp:[0-9]+:#include <GLFW/glfw3\.h>'
forbid runtime/scene 'runtime/render/' "of runtime/scene, scene_renderer alone knows the renderer:" \
    'runtime/scene/scene_renderer\.'
forbid runtime/report "$window|runtime/(view|paging|lod|scene|app|window)/" \
    "runtime/report knows neither terrain nor window:"
forbid runtime/report 'runtime/render/(\.\.|[^p]|p[^n])' "of runtime/render, reports have png.h alone:"
forbid "$below_render runtime/render runtime/scene" 'runtime/report/' "runtime/report is for app alone:"
forbid "tools runtime" "$opengl" "OpenGL and EGL headers stand in runtime/render alone:" 'runtime/render/'
forbid tools "$window" "tools/ knows no window:"
forbid "tools runtime" "$images" "OpenImageIO, libgeotiff and libtiff stand in tools/source alone:" 'tools/source/'
forbid runtime "$proj" "runtime/ sees no PROJ:"

# Root's checkout of somebody else's folder is one that git would not look into.
if git -c safe.directory="$root" rev-parse --is-inside-work-tree >/dev/null 2>&1; then
    fail "tracked files larger than $largest_bytes bytes:" < <(
        git -c safe.directory="$root" ls-files -z |
            while IFS= read -r -d '' file; do
                [[ -f $file && ! -L $file ]] || continue
                bytes=$(stat --format=%s -- "$file")
                ((bytes <= largest_bytes)) || printf '%s: %s bytes\n' "$file" "$bytes"
            done
    )
fi

if ((failures > 0)); then
    printf 'check_layers: %d rules are broken\n' "$failures"
    exit 1
fi
echo "check_layers: all rules hold"
