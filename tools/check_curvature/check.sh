#!/usr/bin/env bash
# Holds curvature of meshes, or without any of two made here, against libigl and PyMeshLab, which are installed into .tools/curvature.
# Usage: tools/check_curvature/check.sh KINRAN [MESH.obj...] Prints a table; fails where medians are apart.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
venv=$root/.tools/curvature
if [ ! -x "$venv/bin/python" ]; then
    mkdir -p "$root/.tools"
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet --disable-pip-version-check --only-binary :all: numpy libigl==2.6.3 pymeshlab==2025.7.post1
fi
kinran=$1
shift
"$venv/bin/python" "$here/check.py" "$kinran" "$@"
