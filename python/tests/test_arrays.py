import kinran
import numpy as np
import pytest
from kinran import formulas

from conftest import png


def test_levels_keep_the_mean_slope_and_all_of_its_spread(normals):
    n = normals.astype(np.float64) / 255 * 2 - 1
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    levels = kinran.filter_mips(n, np.full((32, 32), 0.3), filter="lean")
    assert [level.normal.shape for level in levels] == [(s, s, 3) for s in (32, 16, 8, 4, 2, 1)]
    np.testing.assert_allclose(levels[0].normal, n, atol=3e-3)
    # LEAN mapping adds up moments of slopes (Olano and Baker 2010): those of the last level are all texels'. GGX has no
    # variance of its own; half its squared alpha stands for it.
    slopes = n[..., :2] / n[..., 2:]
    spread = slopes.reshape(-1, 2).var(0)
    last = levels[-1]
    np.testing.assert_allclose(last.normal[0, 0], [0, 0, 1], atol=5e-3)
    wanted = 0.3**4 + 2 * spread
    np.testing.assert_allclose(last.roughness[0, 0, [0, 2]], wanted, rtol=0.05)


def test_a_texture_that_was_encoded_is_decoded(normals):
    levels = [normals.astype(np.float32)[:: 1 << i, :: 1 << i] / 255 for i in range(6)]
    for container in ("ktx2", "dds"):
        file = kinran.encode_texture(levels, format="bc7", container=container, keys={} if container == "dds" else {"KinranMap": "data"})
        texture = kinran.decode_texture(file, name="a." + container)
        assert (texture.format, len(texture.levels)) == ("bc7", 6)
        error = np.abs(texture.levels[0][..., :3] - levels[0]).mean()
        assert error < 0.02, error
    assert kinran.encode_texture(levels) == kinran.encode_texture(levels)
    grey = kinran.encode_texture([np.full((4, 4), 0.5), np.full((2, 2), 0.5), np.full((1, 1), 0.5)], format="bc4")
    np.testing.assert_allclose(kinran.decode_texture(grey).levels[0][..., 0], 0.5, atol=0.01)
    with pytest.raises(ValueError, match="format='bc6'"):
        kinran.encode_texture(levels, format="bc6")
    with pytest.raises(ValueError, match="no levels"):
        kinran.encode_texture([])
    with pytest.raises(ValueError, match="level 1"):
        kinran.encode_texture([levels[0], np.zeros(4)])


def test_an_image_is_read_as_it_is_stored(tmp_path, normals):
    (tmp_path / "n.png").write_bytes(png(normals))
    image = kinran.read_image(tmp_path / "n.png")
    assert image.dtype == np.float32 and image.shape == (32, 32, 3)
    np.testing.assert_array_equal(np.round(image * 255), normals)
    with pytest.raises(kinran.InputError, match="truncated"):
        kinran.read_image("n.png", data=png(normals)[:200])


def test_a_sphere_is_as_curved_as_one_over_its_radius():
    rings, sectors = 48, 96
    t, p = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, sectors + 1), indexing="ij")
    n = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    at = np.arange((rings + 1) * (sectors + 1)).reshape(rings + 1, sectors + 1)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    tensors, tangents, report = kinran.curvature(0.02 * n, triangles, normals=n, blur=[])
    away = (np.abs(n[:, 2]) < 0.9).nonzero()[0]
    np.testing.assert_allclose(tensors[away], np.tile([0.05, 0, 0.05], (len(away), 1)), atol=2e-3)
    assert report["triangles"] == len(triangles) and tangents.shape == (len(n), 4)
    for wrong, message in (
        (dict(positions=n[:, :2], triangles=triangles), "shape"),
        (dict(positions=n, triangles=triangles.astype(float)), "is of float64"),
        (dict(positions=n, triangles=triangles + len(n)), "names vertex"),
        (dict(positions=n, triangles=-triangles - 1), "no vertex has"),
        (dict(positions=np.full_like(n, np.nan), triangles=triangles), "not finite"),
        (dict(positions=n, triangles=triangles, normals=n[1:]), "for"),
        (dict(positions=n[:0], triangles=triangles[:0]), "no triangles"),
    ):
        with pytest.raises((TypeError, ValueError), match=message):
            kinran.curvature(**wrong)


@pytest.mark.parametrize("wrong, message", [
    (dict(normal=np.zeros((4, 4, 2)), roughness=np.zeros((4, 4))), "normal has the shape"),
    (dict(normal=None, roughness=np.zeros((0, 4))), "empty"),
    (dict(normal=None, roughness=np.full((4, 4), np.nan)), "not finite"),
    (dict(normal=np.zeros((8, 8, 3)), roughness=np.zeros((4, 4))), "roughness is"),
    (dict(normal=None, roughness=np.zeros((4, 4)), filter="best"), "filter='best'"),
])
def test_an_array_that_cannot_be_filtered_is(wrong, message):
    with pytest.raises((TypeError, ValueError), match=message):
        kinran.filter_mips(**wrong)


def test_direction_and_strength_come_out_of_the_matrix():
    along, across = 0.8, 0.3
    d = np.zeros((8, 8, 2))
    d[..., 1] = 1
    level = kinran.filter_mips(None, np.full((8, 8), along), np.full((8, 8), across), d, filter="linear")[-1]
    # Perceptual roughness squared is alpha, and the matrix holds alpha squared; along y here.
    np.testing.assert_allclose(level.roughness[0, 0], [across**4, 0, along**4], rtol=0.02, atol=2e-3)
    texel = formulas.aniso_encode(level.roughness)
    np.testing.assert_allclose(texel[0, 0], [across**2, 0.5, along**2], rtol=0.01, atol=2e-3)


def test_the_shader_library_is_there():
    text = kinran.shader("wgsl", "aniso")
    assert "fn aniso_decode(" in text and "fn m_n(" in text
    assert "float2x2" in kinran.shader("hlsl")
    with pytest.raises(kinran.InputError, match="choose one of"):
        kinran.shader("wgsl", "nope")
    with pytest.raises(kinran.InputError, match="glsl"):
        kinran.shader("cg")


def test_fuzz_is_fitted():
    fit = kinran.fit_fuzz(30, 0.2)
    assert fit["tilt"] == 30 and "returned" in fit
    with pytest.raises(kinran.InputError, match="tilt"):
        kinran.fit_fuzz(120)
