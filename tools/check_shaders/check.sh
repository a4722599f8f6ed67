#!/usr/bin/env bash
# Compiles the shader library with compilers that are not ours: glslang, spirv-val, spirv-link, and DXC and Slang, which
# come with PyPI packages and are kept in .tools. Needs glslang-tools, spirv-tools, Python and a C++ compiler.
# What compiles in a browser is for browser.sh.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
dxc=$root/.tools/dxc-compushady-0.17.5
slang=$root/.tools/slang-slangtorch-1.3.22

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

# slangc and its library, 2026.14.1.
fetch_slang() {
    local fresh
    fresh=$(mktemp -d "$slang.XXXXXX")
    python3 -m venv "$fresh/venv" &&
        "$fresh/venv/bin/pip" download --quiet --disable-pip-version-check --no-deps --only-binary :all: \
            --platform manylinux_2_27_x86_64 -d "$fresh" slangtorch==1.3.22 &&
        python3 -m zipfile -e "$fresh"/slangtorch-*.whl "$fresh/wheel" &&
        mv "$fresh/wheel/slangtorch/bin" "$fresh/bin" &&
        chmod +x "$fresh/bin/slangc" &&
        rm -rf "$fresh/venv" "$fresh/wheel" "$fresh"/*.whl &&
        mv "$fresh" "$slang" && return
    rm -rf "$fresh"
    return 1
}

mkdir -p "$root/.tools"
command=()
slangc=
if [ "$(uname -sm)" != "Linux x86_64" ]; then
    echo "SKIPPED, because their libraries are for Linux on x86-64 only: DXC, Slang"
elif [ -d "$dxc" ] || { echo "installing DXC into .tools" && fetch_dxc; }; then
    [ "$dxc/dxc" -nt "$here/dxc.cpp" ] || c++ -std=c++17 -fms-extensions -w -I"$dxc" "$here/dxc.cpp" -o "$dxc/dxc" -ldl
    command=("$dxc/dxc" "$dxc/libdxcompiler_x86_64.so.3.7")
else
    echo "SKIPPED, because it cannot be downloaded: DXC"
fi
if [ "$(uname -sm)" = "Linux x86_64" ]; then
    if [ -d "$slang" ] || { echo "installing Slang into .tools" && fetch_slang; }; then
        slangc=$slang/bin/slangc
    else
        echo "SKIPPED, because it cannot be downloaded: Slang"
    fi
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 "$here/check.py" "$root/crates/kinran-shaders" "$work" "$slangc" "${command[@]}"
