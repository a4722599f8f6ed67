#!/usr/bin/env bash
# Bakes a folder of maps painted here with `kinran bake`, reads the textures with readers that are not ours
# (ktx-parse and zstddec, OpenImageIO, texture2ddecoder) and compares level 0 with what was painted, by formulas
# written a second time. Run check.sh first: it installs what this needs. KINRAN_BUILT names a folder of programs that
# are built already.
set -euo pipefail
cd "$(dirname "$0")"
here=$PWD
root=$(cd ../.. && pwd)
work=$root/.tools/check_textures

rm -rf "$work/painted" "$work/baked"
mkdir -p "$work/painted"
python=$work/venv/bin/python
"$python" "$here/check_baked.py" paint "$work/painted"
kinran=(cargo run --quiet --release --locked --manifest-path "$root/Cargo.toml" -p kinran-cli --)
[ -z "${KINRAN_BUILT:-}" ] || kinran=("$KINRAN_BUILT/kinran")
"${kinran[@]}" --quiet bake "$work/painted" -o "$work/baked" --form both --container both
cp "$here/read_ktx2.mjs" "$work/"
node "$work/read_ktx2.mjs" "$work/baked"
"$python" "$here/check_baked.py" check "$work/painted" "$work/baked"
