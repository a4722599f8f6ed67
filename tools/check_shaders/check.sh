#!/usr/bin/env bash
# Compiles the shader library with compilers that are not ours: glslang, spirv-val, spirv-link, and DXC, which comes
# as a library with a PyPI package and is kept in .tools. Needs glslang-tools, spirv-tools, Python and a C++ compiler.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
dxc=$root/.tools/dxc-compushady-0.17.5

# Appears by rename, so that half an installation is none.
fetch_dxc() {
    local fresh package=compushady-0.17.5
    fresh=$(mktemp -d "$dxc.XXXXXX")
    python3 -m venv "$fresh/venv" &&
        "$fresh/venv/bin/pip" download --quiet --disable-pip-version-check --no-deps --no-binary :all: -d "$fresh" \
            compushady==0.17.5 &&
        tar -xzf "$fresh/$package.tar.gz" -C "$fresh" --strip-components=3 \
            "$package/compushady/backends/"{WinAdapter.h,dxcapi.h,libdxcompiler_x86_64.so.3.7} &&
        rm -rf "$fresh/venv" "$fresh/$package.tar.gz" &&
        mv "$fresh" "$dxc" && return
    rm -rf "$fresh"
    return 1
}

mkdir -p "$root/.tools"
command=()
if [ "$(uname -sm)" != "Linux x86_64" ]; then
    echo "SKIPPED, because its library is for Linux on x86-64 only: DXC"
elif [ -d "$dxc" ] || { echo "installing DXC into .tools" && fetch_dxc; }; then
    [ "$dxc/dxc" -nt "$here/dxc.cpp" ] || c++ -std=c++17 -fms-extensions -w -I"$dxc" "$here/dxc.cpp" -o "$dxc/dxc" -ldl
    command=("$dxc/dxc" "$dxc/libdxcompiler_x86_64.so.3.7")
else
    echo "SKIPPED, because it cannot be downloaded: DXC"
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 "$here/check.py" "$root/crates/kinran-shaders" "$work" "${command[@]}"
