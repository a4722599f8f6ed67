#!/usr/bin/env bash
# Draws a model, as it was authored and baked for each target, with the viewers of the web in headless Chromium.
# Usage: tools/check_viewers/check.sh MODEL.gltf|.glb [FOLDER]
# Prints a table in Markdown: how far the baked model is from the authored one near by (mean difference), and how far each
# is from ground truth when it is drawn four times as small (RMSE to the authored model drawn eight times as large and
# averaged in linear light by the same viewer). FOLDER gets the pictures and a sheet of them. Everything is served from
# npm packages; nothing is fetched from elsewhere. KINRAN_BUILT names a folder of programs that are built already.
# Exits with 1 where a viewer that shows the authored model does not show one baked for the web, or shows another, with 2
# when the tools cannot be had.
set -euo pipefail

PACKAGES=(three@0.187.0 three-r183@npm:three@0.183.2 babylonjs@9.28.0 babylonjs-loaders@9.28.0 playcanvas@2.23.3
    filament@1.53.4 cesium@1.140.0 @google/model-viewer@4.4.0 playwright-core@1.65.1)

here=$(CDPATH= cd -- "$(dirname -- "$0")" && pwd)
root=$(CDPATH= cd -- "$here/../.." && pwd)
tools=$root/.tools/check_viewers

if [ $# -ne 1 ] && [ $# -ne 2 ]; then
    sed -n '2,8s/^# //p' "$0" >&2
    exit 2
fi
model=$1
out=${2:-$tools/pictures}

chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
[ -n "$chromium" ] || { echo "there is no Chromium; install it (apt install chromium)" >&2; exit 2; }
mkdir -p "$tools"
# The stamps are written last, so that an install that broke off is done again.
stamp=$tools/node_modules/installed-$(printf '%s ' "${PACKAGES[@]}" | cksum | cut -d' ' -f1)
if [ ! -e "$stamp" ]; then
    echo "installing ${PACKAGES[*]} into $tools" >&2
    npm install --silent --no-save --no-audit --no-fund --ignore-scripts --legacy-peer-deps --prefix "$tools" \
        "${PACKAGES[@]}" >&2 || exit 2
    touch "$stamp"
fi
if [ ! -e "$tools/venv/installed" ]; then
    rm -rf "$tools/venv"
    python3 -m venv "$tools/venv" >&2 || exit 2
    "$tools/venv/bin/pip" install --quiet --disable-pip-version-check --only-binary :all: numpy Pillow >&2 || exit 2
    touch "$tools/venv/installed"
fi

kinran=(cargo run --quiet --release --locked --manifest-path "$root/Cargo.toml" -p kinran-cli --)
[ -z "${KINRAN_BUILT:-}" ] || kinran=("$KINRAN_BUILT/kinran")
rm -rf "$out"
mkdir -p "$out"
for target in web desktop engine; do
    "${kinran[@]}" --quiet bake "$model" -o "$out/$target" --target "$target" --all-textures
done
node "$here/check.mjs" "$tools" "$chromium" "$model" "$out"
"$tools/venv/bin/python" "$here/compare.py" "$out"
