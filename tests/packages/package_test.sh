#!/usr/bin/env bash
# CPack makes the three packages, each with what belongs into it, and with what it needs.
#     package_test.sh BUILD
set -euo pipefail

build=$1
out=$build/package_test

fail() {
    printf 'package_test: %s\n' "$*" >&2
    exit 1
}

for program in cpack dpkg-deb dpkg-shlibdeps; do
    command -v "$program" >/dev/null || {
        echo "SKIPPED: there is no $program"
        exit 77
    }
done
rm -rf -- "$out"
mkdir "$out"
(umask 022 && cd -- "$out" && cpack --config "$build/CPackConfig.cmake" -B "$out" -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip >log 2>&1) ||
    fail "$(cat "$out/log")"

# holds PACKAGE FILE...: relative to the root of a system, patterns of grep.
holds() {
    local package=$1 list file
    list=$(dpkg-deb -c "$out/${package}"_*.deb | awk '{ print $6 }')
    shift
    for file in "$@" "usr/share/doc/$package/copyright" "usr/share/doc/$package/changelog.Debian.gz"; do
        grep -qx "\./$file" <<<"$list" || fail "$package holds no $file, but: $list"
    done
    ! grep -vE '^\./(usr/.*)?$' <<<"$list" || fail "$package holds what is not under /usr"
}

field() { dpkg-deb -f "$out/$1"_*.deb "$2"; }

holds scree usr/bin/scree usr/libexec/scree/scree-decoder usr/libexec/scree/scree-decoder-openimageio \
    usr/share/man/man1/scree.1.gz usr/share/man/man1/scree-build.1.gz usr/share/bash-completion/completions/scree \
    usr/share/zsh/vendor-completions/_scree usr/share/fish/vendor_completions.d/scree.fish
holds scree-view usr/bin/scree-view usr/share/man/man1/scree-view-fly.1.gz usr/share/bash-completion/completions/scree-view \
    usr/share/zsh/vendor-completions/_scree-view usr/share/fish/vendor_completions.d/scree-view.fish
holds libscree-dev usr/include/scree/scree.h usr/include/scree/runtime/scene/scene.h 'usr/lib/.*libscree_gl.a' \
    'usr/lib/.*cmake/scree/screeConfig.cmake' 'usr/lib/.*pkgconfig/scree.pc'
[[ $(find "$out" -maxdepth 1 -name '*.deb' | wc -l) == 3 ]] || fail "not three packages: $(ls "$out")"
[[ $(field scree Depends) == *libc6*libproj* ]] || fail "scree depends on $(field scree Depends)"
[[ $(field scree-view Depends) == *libglfw3* ]] || fail "scree-view depends on $(field scree-view Depends)"
[[ $(field scree-view Depends) != *libproj* ]] || fail "scree-view needs PROJ?"
[[ $(field libscree-dev Depends) == *libsqlite3-dev* ]] || fail "libscree-dev depends on $(field libscree-dev Depends)"
