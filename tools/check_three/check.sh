#!/usr/bin/env bash
# Draws a baked glTF file with three.js (GLTFLoader, KTX2Loader) in headless Chromium and checks what arrived.
# Usage: tools/check_three/check.sh BAKED.gltf|.glb [SCREENSHOT.png [AUTHORED.gltf|.glb BESIDE.png]]
# Prints a line per texture: three.js' format, size, levels, colour space, and how far each level's texels, sampled
# by WebGL, are from what another decoder (texture2ddecoder) makes of the file. With AUTHORED, BESIDE.png shows it
# next to the baked one, near and four times as far, beside 64 samples a pixel of level 0.
# Exits with 1 when something is wrong, with 2 when the tools cannot be had.
# Needs node, npm and python3; installs Chromium by apt where there is none, and the rest into .tools/check_three.
set -euo pipefail

THREE=0.187.0
PLAYWRIGHT=1.65.1

here=$(CDPATH= cd -- "$(dirname -- "$0")" && pwd)
tools=$(CDPATH= cd -- "$here/../.." && pwd)/.tools/check_three

if [ $# -ne 1 ] && [ $# -ne 2 ] && [ $# -ne 4 ]; then
    sed -n '2,8s/^# //p' "$0" >&2
    exit 2
fi

chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
if [ -z "$chromium" ]; then
    echo "installing Chromium by apt" >&2
    as_root=
    [ "$(id -u)" -eq 0 ] || as_root="sudo -n"
    export DEBIAN_FRONTEND=noninteractive
    # An install that broke off half-way is put right by a second one.
    { $as_root apt-get update -q && $as_root apt-get install -q -y --no-install-recommends chromium ||
        $as_root apt-get install -q -y --no-install-recommends chromium; } >&2 || exit 2
    chromium=$(command -v chromium) || exit 2
fi
# The stamps are written last, so that an install that broke off is done again.
mkdir -p "$tools"
if [ ! -e "$tools/node_modules/installed-$THREE-$PLAYWRIGHT" ]; then
    echo "installing three $THREE and playwright-core $PLAYWRIGHT into $tools" >&2
    npm install --silent --no-save --no-audit --no-fund --prefix "$tools" \
        "three@$THREE" "playwright-core@$PLAYWRIGHT" >&2 || exit 2
    touch "$tools/node_modules/installed-$THREE-$PLAYWRIGHT"
fi
if [ ! -e "$tools/venv/installed" ]; then
    echo "installing texture2ddecoder, zstandard and numpy into $tools" >&2
    rm -rf "$tools/venv"
    python3 -m venv "$tools/venv" >&2 || exit 2
    "$tools/venv/bin/pip" install --quiet --disable-pip-version-check --only-binary :all: \
        texture2ddecoder==1.0.6 zstandard==0.25.0 numpy >&2 || exit 2
    touch "$tools/venv/installed"
fi

exec node "$here/check.mjs" "$tools" "$chromium" "$@"
