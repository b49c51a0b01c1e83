#!/usr/bin/env bash
# Does the regression suite see what it is there for? Plants one fault after the other in a copy of the shaders, renders the
# suite with each, and says which pictures saw it. A fault takes minutes, the first one a build of everything; the checkout stays
# as it is.
#
#   ci/mutations.sh            all
#   ci/mutations.sh fresnel    those with this in their names
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
copy=${VITRUM_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/vitrum}/mutations
mkdir -p "$copy/.native"
ln -sfn "$(readlink -f "$root/.native/shaderc")" "$copy/.native/shaderc"

# name;file in shaders;what sed does to it
faults='
fresnel-0.1-percent;fresnel.glsl;s/return Interface(reflectance, Fresnel/return Interface(1.001 * reflectance, Fresnel/
fresnel-original-0.1-percent;fresnel.glsl;s|return (f0 \* f0 + f90 \* f90) / 2.0;|return 1.001 * (f0 * f0 + f90 * f90) / 2.0;|
normal-flipped;surface.glsl;s/return normalize(mat3(instance.normalToWorld) \* normal);/return -normalize(mat3(instance.normalToWorld) * normal);/
one-mip-off;environment.glsl;s/return floor(lod + dither);/return floor(lod + dither) + 1.0;/
one-bounce-fewer-tree;tree.glsl;s/branch.depth >= frame.maxDepth/branch.depth + 1 >= frame.maxDepth/
one-bounce-fewer-path;path.glsl;s/goesOn = depth < frame.maxDepth;/goesOn = depth + 1 < frame.maxDepth;/
one-bounce-fewer-double;double.frag;s/depth < frame.maxDepth \&\&/depth + 1 < frame.maxDepth \&\&/
'

status=0
while IFS=';' read -r name file change; do
    case $name in *"${1-}"*) ;; *) continue ;; esac
    [ -n "$name" ] || continue
    rm -rf "$copy/shaders" "$copy/tests/regress"
    (cd "$root" && git ls-files -z | tar -c --null -T -) | tar -x -C "$copy"
    touch "$copy"/shaders/*
    sed -i "$change" "$copy/shaders/$file"
    if cmp -s "$root/shaders/$file" "$copy/shaders/$file"; then
        echo "$name: changes nothing in shaders/$file" >&2
        exit 2
    fi
    (cd "$copy" && cargo build --release --locked --quiet)
    (cd "$copy" && target/release/vitrum regress tests/regress/suite.toml -q -o regress-report >seen.txt 2>/dev/null) || true
    seen=$(awk '/^FAILED/ { print $2 }' "$copy/seen.txt" | tr '\n' ' ')
    if [ -z "$seen" ]; then
        echo "$name: NOT SEEN"
        status=1
    else
        echo "$name: seen by $(wc -w <<<"$seen"): $seen"
    fi
done <<<"$faults"
exit $status
