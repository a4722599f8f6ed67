#!/usr/bin/env bash
# Hands inputs as other tools write them to `kinran` and holds what comes out against what went in, by readers that are
# not ours (OpenImageIO, numpy), which are installed into .tools/check_inputs. Inputs are made
# there too and stay, so that a failure can be tried again.
# Usage: tools/check_inputs/check.sh KINRAN [KIND...] Prints a line a kind; fails where anything is not as wanted.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
work=$root/.tools/check_inputs
# The stamp is written last, so that an install that broke off is done again.
if [ ! -e "$work/venv/installed" ]; then
    rm -rf "$work/venv"
    mkdir -p "$work"
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet --disable-pip-version-check --only-binary :all: \
        OpenImageIO==3.2.2.0 tifffile imagecodecs numpy Pillow
    touch "$work/venv/installed"
fi
kinran=$(realpath "$1")
shift
PYTHONDONTWRITEBYTECODE=1 "$work/venv/bin/python" "$here/check.py" "$kinran" "$work/made" "$@"
