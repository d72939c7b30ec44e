#!/usr/bin/env bash
# Manual pages and completion say what --help says; docs name every format that is read.
#     documentation_test.sh BUILD PART        PART: man_pages, completion (of bash), zsh, fish or formats
set -euo pipefail

build=$1 part=$2
docs=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../../docs" && pwd -P)
pages=$build/documentation

fail() {
    printf 'documentation_test: %s\n' "$*" >&2
    exit 1
}

help_of() {
    case $1 in
        scree) "$build/tools/scree" --help ;;
        scree-view) "$build/runtime/scree-view" --help ;;
        scree-view-*) "$build/runtime/scree-view" "${1#scree-view-}" --help ;;
        scree-*) "$build/tools/scree" "${1#scree-}" --help ;;
    esac
}

commands_of_scree() { help_of scree | sed -n 's/^  \([a-z][a-z]*\) .*/\1/p'; }

man_pages() {
    command -v groff >/dev/null || {
        echo "SKIPPED: there is no groff"
        exit 77
    }
    local page name option text complaints count=0
    for page in "$pages"/*.1; do
        name=$(basename -- "$page" .1)
        complaints=$(groff -man -ww -z "$page" 2>&1) || true
        [[ -z $complaints ]] || fail "$complaints"
        zcat -- "$page.gz" | cmp -s - "$page" || fail "$page.gz is of another page"
        text=$(LC_ALL=C groff -man -Tascii -P-c -rLL=500n "$page" | sed 's/.\x08//g')
        grep -qE "^ +$name - [a-z].*[a-z]$" <<<"$text" || fail "$name: no name and what it is"
        grep -q "SEE ALSO" <<<"$text" || fail "$name: no other pages"
        for option in $(help_of "$name" | grep -oE '^ +(-[a-z],)?--[a-z-]+' | grep -oE -- '--[a-z-]+'); do
            [[ $name != scree ]] || continue
            grep -qE -- "^ +(-[a-z], )?$option( |$)" <<<"$text" || fail "$name: $option is missing"
            count=$((count + 1))
        done
    done
    ((count > 100)) || fail "only $count options were looked at"
    for name in $(commands_of_scree); do
        [[ -s $pages/scree-$name.1 ]] || fail "scree $name has no page"
        grep -qF "\\fB$name\\fR" "$pages/scree.1" || fail "scree(1) does not name $name"
    done
    # What is said in plain words: a value, a default, a range, what an option needs.
    grep -qF '\fInearest|bilinear|cubic\fR' "$pages/scree-build.1" || fail "no choices of --resampling"
    grep -A3 -F '\fB\-\-threads\fR' "$pages/scree-build.1" | grep -qx '0 to 1024\.' || fail "no range of --threads"
    grep -A3 -F '\fB\-\-texture\-size\fR' "$pages/scree-build.1" | grep -qx 'Default: 256\.' || fail "no default"
    grep -A3 -F '\fB\-\-look\fR' "$pages/scree-view-shot.1" | grep -qxF 'Needs \fB\-\-eye\fR.' || fail "no need of --look"
}

# words PROGRAM WORD...: what completes the last word, in one line.
words() {
    COMP_WORDS=("$@")
    COMP_CWORD=$(($# - 1))
    COMPREPLY=()
    if [[ $1 == scree ]]; then _scree; else _scree_view; fi
    printf '%s\n' "${COMPREPLY[@]}" | LC_ALL=C sort | xargs
}

# expect ANSWER PROGRAM WORD...
expect() {
    local answer
    answer=$(words "${@:2}")
    [[ $answer == "$1" ]] || fail "'${*:2}' completes to '$answer', not '$1'"
}

completion() {
    # shellcheck source=/dev/null
    source "$pages/scree"
    # shellcheck source=/dev/null
    source "$pages/scree-view"
    complete -p scree scree-view >/dev/null || fail "nothing is registered"
    folder=$(mktemp -d) # not local: the trap wants it
    trap 'rm -rf -- "$folder"' EXIT
    cd -- "$folder"
    mkdir alps.d
    touch alps.scree 'alps two.scree' alps.tif
    local name
    for name in $(commands_of_scree); do expect "$name" scree "$name"; done
    expect "samples synth" scree s
    expect "--imagery --imagery-nodata" scree build --im
    expect "bilinear" scree build dem.tif --resampling b
    expect "none smooth" scree build --fill ''
    expect "" scree build --threads ''
    expect "alps two.scree alps.d alps.scree alps.tif" scree build al
    expect "alps two.scree alps.d alps.scree" scree info al
    expect "alps two.scree alps.d alps.scree alps.tif" scree info alps.scree --json al
    expect "--heights --help" scree export --he
    expect "" scree nosuch ''
    expect "audit" scree-view au
    expect "alps two.scree alps.d alps.scree" scree-view al
    expect "auto" scree-view shot --curvature au
    expect "--tau --tau-max" scree-view fly --tau
    expect "--fov --fps" scree-view alps.scree --f
}

# What zsh would offer, of which it takes what begins as the last word does.
zsh_words() {
    zsh -f -c 'compadd() { shift; print -l -- "$@"; }
        _files() { print -r -- "files $*"; }
        complete_it() { local -a words=("${@:2}"); local CURRENT=${#words}; source "$1"; }
        complete_it "$@"' zsh "$pages/_$1" "$@" | { grep -E -- "^(${*: -1}|files)" || true; } | LC_ALL=C sort | xargs
}

zsh() {
    [[ -n $(type -P zsh) ]] || { printf 'needs zsh\n' && exit 77; }
    zsh() { command zsh "$@"; }
    words() { zsh_words "$@"; }
    [[ $(head -n 1 "$pages/_scree-view") == "#compdef scree-view" ]] || fail "zsh does not know whose completion it is"
    expect "samples synth" scree s
    expect "--imagery --imagery-nodata" scree build --im
    expect "bilinear" scree build dem.tif --resampling b
    expect "none smooth" scree build --fill ''
    expect "" scree build --threads ''
    expect "files" scree build al
    expect "files -g *.scree" scree info al
    expect "--heights --help" scree export --he
    expect "" scree nosuch ''
    expect "audit files -g *.scree" scree-view au
    expect "auto" scree-view shot --curvature au
    expect "--fov --fps" scree-view alps.scree --f
}

fish_words() {
    fish --no-config -c 'source $argv[1]; complete -C $argv[2]' "$pages/$1.fish" "$*" | cut -f 1 | LC_ALL=C sort | xargs
}

fish() {
    [[ -n $(type -P fish) ]] || { printf 'needs fish\n' && exit 77; }
    fish() { command fish "$@"; }
    words() { fish_words "$@"; }
    folder=$(mktemp -d) # not local: the trap wants it
    trap 'rm -rf -- "$folder"' EXIT
    cd -- "$folder"
    touch alps.scree 'alps two.scree' alps.tif
    expect "samples synth" scree s
    expect "--imagery --imagery-nodata" scree build --im
    expect "bilinear" scree build dem.tif --resampling b
    expect "none smooth" scree build --fill ''
    expect "" scree build --threads ''
    expect "alps two.scree alps.scree alps.tif" scree build al
    expect "--heights --help" scree export --he
    expect "audit" scree-view au
    expect "auto" scree-view shot --curvature au
    expect "--tau --tau-max" scree-view fly --tau
    expect "--fov --fps" scree-view alps.scree --f
}

# The refusal of a file of no known kind names all that are: (TIFF, ...) nor ... (DTED, ...).
formats() {
    folder=$(mktemp -d) # not local: the trap wants it
    trap 'rm -rf -- "$folder"' EXIT
    printf 'no raster' >"$folder/a.xyz"
    local refusal name table count=0
    refusal=$("$build/tools/scree" build "$folder/a.xyz" -o "$folder/a.scree" 2>&1) && fail "text was built"
    table=$(grep -E '^\| (heights|imagery) \|' "$docs/building-pyramids.md" | tr -d '`')
    while read -r name; do
        grep -qwF -- "$name" <<<"$table" || fail "building-pyramids.md does not name $name among what is read"
        count=$((count + 1))
    done < <(grep -oE '\([^)]*\)' <<<"$refusal" | tr -d '()' | sed 's/, /\n/g')
    ((count > 10)) || fail "only $count formats were found in: $refusal"
}

"$part"
