#!/usr/bin/env bash
# Checks the KTX2 and DDS files that kinran-image writes with readers that are not ours: ktx-parse and zstddec
# (npm, what three.js loads KTX2 with), Binomial's transcoder of UASTC (as three.js brings it), texture2ddecoder and OpenImageIO (PyPI). Prints a line per file and
# fails at any difference. Everything it installs goes to .tools/check_textures; a second run installs nothing.
# KINRAN_BUILT names a folder of programs that are built already (target/checked).
set -euo pipefail
cd "$(dirname "$0")"
here=$PWD
root=$(cd ../.. && pwd)
work=$root/.tools/check_textures
mkdir -p "$work"

# The stamps are written last, so that an install that broke off is done again.
if [ ! -e "$work/venv/installed" ]; then
    rm -rf "$work/venv"
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet --disable-pip-version-check --only-binary :all: \
        OpenImageIO==3.2.2.0 texture2ddecoder==1.0.6 numpy Pillow
    touch "$work/venv/installed"
fi
if [ ! -e "$work/node_modules/installed-2" ]; then
    npm install --silent --no-save --no-audit --no-fund --prefix "$work" ktx-parse@2.0 zstddec@0.3 three@0.187.0
    touch "$work/node_modules/installed-2"
fi

samples=$work/samples
rm -rf "$samples"
write_samples=(cargo run --quiet --release --locked --manifest-path "$root/Cargo.toml" -p kinran-image --example write_samples --)
[ -z "${KINRAN_BUILT:-}" ] || write_samples=("$KINRAN_BUILT/examples/write_samples")
"${write_samples[@]}" "$samples"

# Node looks for packages beside the script, so the script goes beside the packages.
cp "$here/read_ktx2.mjs" "$work/"
node "$work/read_ktx2.mjs" "$samples"
"$work/venv/bin/python" "$here/check.py" "$samples"
