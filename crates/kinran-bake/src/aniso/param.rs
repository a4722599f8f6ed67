//! `param`: SGGX parameter estimation, section 4 of [1].
//!
//! The lobe has the axes of the covariance of the footprint's microfacet normals, and keeps the area that the
//! microfacets project along each of them. Slower than the other filters and worse than `ml`; it is here
//! because the talk's filter is defined as its approximation.
//!
//! [1] Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.

use glam::{Mat3, Vec3, vec3};
use kinran_shading::{
    Sym2, Sym3, UNIT_SLOPES, ggx_from_sggx, microfacet_basis, sggx_from_ggx, sggx_principal_axis,
    sggx_projected_area,
};

use super::footprint::Taps;
use super::maps::{SurfaceMaps, TexelSpan};
use super::weights;

/// Fits some rows of a level: `columns` are the footprints of their texels along x, `rows` those along y.
pub(crate) fn fit_band(maps: &SurfaceMaps, columns: &[Taps], rows: &[Taps], out: &mut TexelSpan) {
    out.resize(columns.len() * rows.len());
    for (y, rows) in rows.iter().enumerate() {
        fit_row(maps, columns, rows, y * columns.len(), out);
    }
}

/// Fits one row and puts it at `at` and behind it.
fn fit_row(maps: &SurfaceMaps, columns: &[Taps], rows: &Taps, at: usize, out: &mut TexelSpan) {
    let mut sums = vec![Sums::default(); columns.len()];
    for_each_texel(maps, columns, rows, |x, n, a, weight| {
        let sum = &mut sums[x];
        sum.mean += n * weight;
        sum.covariance = sum.covariance + normal_covariance(n, a) * weight;
        let first = *sum.first.get_or_insert((n, a));
        sum.varies |= first != (n, a);
        sum.weight += weight;
    });
    // Weights of taps add up to one.
    let is_weighted = maps.weights.is_some();
    for sum in sums.iter_mut().filter(|_| is_weighted) {
        sum.mean /= sum.weight;
        sum.covariance = sum.covariance * sum.weight.recip();
    }

    let axes: Vec<Mat3> =
        sums.iter().map(|s| principal_axes(s.covariance, s.mean.normalize_or(Vec3::Z))).collect();
    let mut areas = vec![Vec3::ZERO; columns.len()];
    for_each_texel(maps, columns, rows, |x, n, a, weight| {
        let s = sggx_from_ggx(n, a);
        let area = |axis| sggx_projected_area(s, axis);
        areas[x] += vec3(area(axes[x].x_axis), area(axes[x].y_axis), area(axes[x].z_axis)) * weight;
    });

    for (x, sum) in sums.iter().enumerate() {
        let (n, a) = match sum.first {
            Some(texel) if !sum.varies => texel,
            _ => {
                let area = if is_weighted { areas[x] / sum.weight } else { areas[x] };
                let squared = area * area;
                let diagonal = Sym3 { xx: squared.x, yy: squared.y, zz: squared.z, ..Sym3::default() };
                ggx_from_sggx(diagonal.in_frame(axes[x].transpose()), sum.mean.normalize_or(Vec3::Z))
            }
        };
        out.set(at + x, n, a);
    }
}

/// What one pass over a footprint finds.
#[derive(Clone, Default)]
struct Sums {
    mean: Vec3,
    covariance: Sym3,
    /// The first texel: a constant footprint comes out as it went in.
    first: Option<(Vec3, Sym2)>,
    varies: bool,
    weight: f32,
}

/// Calls `visit(x, n, a, weight)` for every texel of the footprint of every `x` of a row, row by row of level 0.
fn for_each_texel(
    maps: &SurfaceMaps,
    columns: &[Taps],
    rows: &Taps,
    mut visit: impl FnMut(usize, Vec3, Sym2, f32),
) {
    let size = maps.size();
    let mut span = TexelSpan::default();
    for &(row, row_weight) in rows {
        maps.decode_span(size, row, 0, size.0 as usize, &mut span);
        let weights = maps.weights.as_ref().map(|weights| weights.row(row, 0, size.0 as usize));
        for (x, taps) in columns.iter().enumerate() {
            for &(column, weight) in taps {
                let (n, a) = span.texel(column as usize);
                let own = weights.map_or(1.0, |weights| weights::share(weights[column as usize]));
                visit(x, n, a, weight * row_weight * own);
            }
        }
    }
}

/// Covariance of a GGX surface's microfacet normals, `∫ h h^T D(h) dω`, by [`UNIT_SLOPES`]: they are
/// distributed as `D(h) h·n`, hence the division by the cosine.
fn normal_covariance(n: Vec3, a: Sym2) -> Sym3 {
    let [x, y, z] = microfacet_basis(n, a);
    let mut sum = Sym3::default();
    for slope in UNIT_SLOPES {
        let h = x * slope.x + y * slope.y + z;
        // h has the length 1/cosine, so h h^T / |h|² / cosine = h h^T / |h|.
        sum = sum + Sym3::outer(h) * (h.length().recip() / UNIT_SLOPES.len() as f32);
    }
    sum
}

/// Eigenvectors as the columns of a rotation, the one nearest to `mean` last.
fn principal_axes(s: Sym3, mean: Vec3) -> Mat3 {
    let z = sggx_principal_axis(s, mean);
    let m = kinran_shading::m_n(z);
    let local = s.in_frame(m);
    let (_, _, axis) = Sym2 { xx: local.xx, xy: local.xy, yy: local.yy }.eigen();
    let x = m.x_axis * axis.x + m.y_axis * axis.y;
    Mat3::from_cols(x, z.cross(x), z)
}
