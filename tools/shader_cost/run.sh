#!/usr/bin/env bash
# Measures what the shader library costs on AMD hardware, without the hardware (see docs/shader_cost.md).
# Usage: tools/shader_cost/run.sh [--check]. Without a flag it writes budget.json and docs/shader_cost.md; with it,
# it fails where an instruction count has grown. KINRAN_RADV and KINRAN_RADV_NEW name the manifests of two versions of
# Mesa's RADV; by default the system's, and for RDNA 3, which that of Debian 12 cannot compile for, the one of its
# backports, unpacked in .tools.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
mesa=$root/.tools/mesa-25.0.7

# Unpacks Debian's backport into a folder; nothing is installed. Appears by rename.
fetch_mesa() {
    local fresh
    fresh=$(mktemp -d "$root/.tools/mesa.XXXXXX")
    mkdir -p "$fresh"/{lists/partial,cache/archives/partial,debs}
    echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian bookworm-backports main" \
        >"$fresh/sources.list"
    local apt=(apt-get -qq -o "Dir::Etc::SourceList=$fresh/sources.list" -o Dir::Etc::SourceParts=-
        -o "Dir::State::lists=$fresh/lists" -o "Dir::Cache=$fresh/cache" -o APT::Sandbox::User=)
    "${apt[@]}" update || return 1
    local packages=(mesa-vulkan-drivers=25.0.7-2~bpo12+1 libdrm2=2.4.123-1~bpo12+1 libdrm-amdgpu1=2.4.123-1~bpo12+1)
    (cd "$fresh/debs" && "${apt[@]}" download "${packages[@]}") || return 1
    for package in "$fresh"/debs/*.deb; do dpkg -x "$package" "$fresh/unpacked" || return 1; done
    mkdir "$fresh/mesa"
    cp -L "$fresh"/unpacked/usr/lib/x86_64-linux-gnu/{libvulkan_radeon.so,libdrm.so.2,libdrm_amdgpu.so.1} "$fresh/mesa" || return 1
    printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "%s/libvulkan_radeon.so", "api_version": "1.4.305"}}\n' \
        "$mesa" >"$fresh/mesa/radeon_icd.json"
    [ -d "$mesa" ] || mv "$fresh/mesa" "$mesa"
    rm -rf "$fresh"
}

if [ -z "${KINRAN_RADV:-}" ]; then
    for manifest in /usr/share/vulkan/icd.d/radeon_icd{.x86_64,}.json; do
        [ ! -e "$manifest" ] || export KINRAN_RADV=$manifest
    done
fi
if [ -z "${KINRAN_RADV_NEW:-}" ]; then
    mkdir -p "$root/.tools"
    if [ ! -d "$mesa" ] && grep -q '^VERSION_CODENAME=bookworm' /etc/os-release && [ "$(uname -m)" = x86_64 ]; then
        echo "unpacking Mesa 25.0.7 of Debian's backports into .tools, for RDNA 3" >&2
        fetch_mesa || { rm -rf "$root"/.tools/mesa.??????; echo "Mesa 25.0.7 cannot be had" >&2; }
    fi
    [ ! -d "$mesa" ] || export KINRAN_RADV_NEW=$mesa/radeon_icd.json
fi

target=$(realpath -m "${CARGO_TARGET_DIR:-$root/target}")
cargo build --quiet --release --locked --manifest-path "$here/Cargo.toml" --target-dir "$target"
"$target/release/shader_cost" "$@"
