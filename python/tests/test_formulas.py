import numpy as np
import pytest
from kinran import formulas


def directions(count, seed=1):
    rng = np.random.default_rng(seed)
    v = rng.normal(size=(count, 3))
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    v[:, 2] = np.abs(v[:, 2])
    return v.astype(np.float32)


def test_ggx_is_the_closed_form_over_arrays():
    h = directions(4000)
    at, ab = 0.3, np.linspace(0.05, 0.9, 4000, dtype=np.float32)
    x, y, z = h.astype(np.float64).T
    wanted = 1 / (np.pi * at * ab * ((x / at) ** 2 + (y / ab) ** 2 + z**2) ** 2)
    got = formulas.ggx_aniso_d(h, at, ab)
    assert got.dtype == np.float32 and got.shape == (4000,)
    np.testing.assert_allclose(got, wanted, rtol=3e-5)


def test_a_round_trip_of_the_texel_loses_the_matrix():
    at, ab = np.float32(0.5), np.float32(0.1)
    angle = np.linspace(0, np.pi, 7)
    s = formulas.aniso_from_alphas(at, ab, np.stack([np.cos(angle), np.sin(angle)], -1))
    np.testing.assert_allclose(s[..., 0] + s[..., 2], at**2 + ab**2, rtol=1e-5)
    texel = formulas.aniso_encode(s)
    assert texel.shape == (7, 3) and texel.min() >= 0 and texel.max() <= 1
    np.testing.assert_allclose(formulas.aniso_decode_matrix(texel), s, atol=2e-6)


def test_sggx_integrates_to_the_projected_area():
    # The area that a direction sees is the mean of the cosine over all normals (Heitz et al. 2015, equation 3).
    s = formulas.sggx_from_ggx([0.0, 0.0, 1.0], [0.25, 0.0, 0.04])
    v = directions(1, 5)[0]
    theta = (np.arange(400) + 0.5) * np.pi / 400
    phi = (np.arange(800) + 0.5) * 2 * np.pi / 800
    t, p = np.meshgrid(theta, phi, indexing="ij")
    m = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1)
    weight = np.sin(t) * (np.pi / 400) * (2 * np.pi / 800)
    got = (formulas.sggx_d(s, m) * np.maximum(m @ v, 0) * weight).sum()
    assert got == pytest.approx(float(formulas.sggx_projected_area(s, v)), rel=2e-3)


def test_shapes_broadcast_and_pairs_come_apart():
    assert formulas.ggx_d(0.5, 0.5).shape == ()
    assert formulas.ggx_d(np.ones((3, 1)), np.full((1, 4), 0.5)).shape == (3, 4)
    assert formulas.schlick_f(np.full((2, 1, 3), 0.04), np.ones(5)).shape == (2, 5, 3)
    assert formulas.ggx_d(np.zeros((0,)), 0.5).shape == (0,)
    normal, a = formulas.ggx_from_sggx(formulas.sggx_from_ggx([0, 0, 1], [0.25, 0, 0.04]), [0, 0, 1])
    np.testing.assert_allclose(normal, [0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(a, [0.25, 0, 0.04], rtol=1e-4, atol=1e-6)
    # Views with gaps and other types are what they look like.
    wide = np.linspace(0, 1, 20)
    np.testing.assert_array_equal(formulas.ggx_d(wide[::2], 0.5), formulas.ggx_d(wide[::2].copy(), 0.5))


def test_numbers_that_are_none_are_taken():
    with pytest.raises(ValueError, match=r"h has the shape \(4, 2\); its last axis must be of 3"):
        formulas.ggx_aniso_d(np.zeros((4, 2)), 0.1, 0.1)
    with pytest.raises(TypeError, match="alpha is of"):
        formulas.ggx_d(0.5, "rough")
    with pytest.raises(ValueError):
        formulas.ggx_d(np.zeros(3), np.zeros(4))
    with pytest.raises(TypeError):
        formulas.ggx_d(0.5)


def test_every_formula_has_a_text_and_a_shape():
    for name in formulas.__all__:
        doc = getattr(formulas, name).__doc__
        assert "Shapes: " in doc and len(doc.split("\n\nShapes: ")[0]) > 20, name
