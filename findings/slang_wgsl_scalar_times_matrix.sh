#!/usr/bin/env bash
# Expected: `mul(s, m)` of a scalar and a matrix is `s * m` by HLSL's definition of `mul`; so a function with it that Slang
# compiles for GLSL, HLSL and Metal compiles for WGSL as well, whose `*` knows the product.
# What happens: the same entry point compiles for three targets, and for WGSL ends with E36107, "unavailable features in entry
# point", in both orders of the arguments. `s * m` compiles for all four, and so does `mul` of a matrix and a vector.
# Why care: shader libraries in HLSL's words are full of `mul`, and Slang is the way by which engines take them to WebGPU. The
# message names the entry point, not the call, which has to be found by bisection; writing `s * m` mends it.
# Version: Slang 2026.14.1, the slangc of slangtorch 1.3.22 (PyPI; x86-64 Linux). Source: found by running; WGSL's products
# are in its specification, under "Arithmetic Expressions".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv env
env/bin/pip download --quiet --disable-pip-version-check --no-deps --only-binary :all: \
    --platform manylinux_2_27_x86_64 -d . slangtorch==1.3.22
env/bin/python -m zipfile -e slangtorch-*.whl wheel
slangc=$work/wheel/slangtorch/bin/slangc
chmod +x "$slangc"
echo "slangc $("$slangc" -v 2>&1)"

changed=0
for product in 'mul(s, m)' 'mul(m, s)' 's * m'; do
    cat >a.slang <<SLANG
RWStructuredBuffer<float3> result;
uniform float s;
uniform float3x3 m;

[shader("compute")]
[numthreads(1, 1, 1)]
void main()
{
    result[0] = mul($product, float3(1, 2, 3));
}
SLANG
    for target in glsl hlsl metal wgsl; do
        got=compiles
        "$slangc" a.slang -target "$target" -entry main -stage compute -o "out.$target" >said 2>&1 ||
            got=$(grep -o 'E[0-9]*' said | head -n 1)
        echo "$product, $target: $got"
        wanted=compiles
        [ "$target" != wgsl ] || [ "$product" = 's * m' ] || wanted=E36107
        [ "$got" = "$wanted" ] || changed=1
    done
done
[ "$changed" -eq 0 ] || echo "the behaviour has changed"
exit "$changed"
