#!/bin/sh
# Checks glTF files with Khronos' own validator (npm gltf-validator, Apache-2.0).
# Usage: tools/check_gltf/validate.sh FILE...
# Prints a line for each file, and below it what is wrong; exits with 1 when a file has an error,
# with 2 when the validator cannot be had. Needs node and, the first time, npm and the network.
set -eu

VERSION=2.0.0-dev.3.10
here=$(CDPATH= cd -- "$(dirname -- "$0")" && pwd)
tools=$(CDPATH= cd -- "$here/../.." && pwd)/.tools/gltf-validator-$VERSION

if [ $# -eq 0 ]; then
    sed -n '2,5s/^# //p' "$0" >&2
    exit 2
fi
if [ ! -d "$tools" ]; then
    echo "installing gltf-validator $VERSION into $tools" >&2
    mkdir -p "${tools%/*}"
    # Appears by rename: tests that run at the same time must not see half an installation.
    fresh=$(mktemp -d "$tools.XXXXXX") || exit 2
    trap 'rm -rf "$fresh"' EXIT
    npm install --silent --no-audit --no-fund --no-save --prefix "$fresh" "gltf-validator@$VERSION" >&2 || exit 2
    # Of two installations the first stays; the second would be moved into it.
    [ -d "$tools" ] || mv "$fresh" "$tools" || exit 2
    rm -rf "$fresh" "$tools/${fresh##*/}"
fi
NODE_PATH="$tools/node_modules" exec node "$here/validate.cjs" "$@"
