//! Curvature of meshes against surfaces whose curvature is known.

mod shapes;

use glam::{Mat3, Vec3, Vec4, dvec3};
use kinran_bake::curvature::{Curvature, CurvatureError, Mesh, Method, Options, bake_curvature, principal};
use kinran_image::untold;
use kinran_shading::Sym2;
use shapes::{Noise, Shape, cylinder, ellipsoid, saddle, sphere, torus};

/// One unit is a millimetre, nothing is blurred or clamped.
fn raw(method: Method) -> Options {
    Options { method, millimetres: 1.0, blur: Vec::new(), clamp: false }
}

fn bake(shape: &Shape, with_normals: bool, options: &Options) -> Curvature {
    let mesh = Mesh {
        positions: &shape.positions,
        normals: with_normals.then_some(shape.normals.as_slice()),
        tangents: None,
        triangles: &shape.triangles,
    };
    bake_curvature(&mesh, options, &untold).expect("a sound mesh")
}

/// The larger of both principal curvatures' errors at every inner vertex, sorted.
fn errors(shape: &Shape, baked: &Curvature) -> Vec<f64> {
    let mut errors: Vec<f64> = (0..shape.positions.len())
        .filter(|&i| shape.inner[i])
        .map(|i| {
            let (k1, k2, _) = principal(baked.tensors[i]);
            let (t1, t2) = shape.curvatures[i];
            (f64::from(k1) - t1).abs().max((f64::from(k2) - t2).abs())
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

fn quantile(errors: &[f64], q: f64) -> f64 {
    errors[((errors.len() - 1) as f64 * q) as usize]
}

#[test]
fn a_sphere_is_exact_with_true_and_with_estimated_normals_however_irregular() {
    for jitter in [0.0, 0.3] {
        for with_normals in [true, false] {
            let shape = sphere(16, 2.0, jitter);
            let worst = *errors(&shape, &bake(&shape, with_normals, &raw(Method::Normals))).last().unwrap();
            assert!(worst < 2e-4, "jitter {jitter}, normals given {with_normals}: off by {worst}");
        }
    }
}

/// RMS errors of an independent double-precision implementation on meshes of the same kind.
#[test]
fn true_normals_give_the_errors_that_the_method_has() {
    let cases = [
        ("torus", torus((80, 32), 2.0, 0.8, 0.3), 0.0141),
        ("regular torus", torus((80, 32), 2.0, 0.8, 0.0), 0.0101),
        ("saddle", saddle((32, 32), 0.5, 0.3), 0.0020),
        ("cylinder", cylinder((48, 24), 1.0, 4.0, 0.3), 0.0003),
    ];
    for (name, shape, known) in cases {
        let got = rms(&errors(&shape, &bake(&shape, true, &raw(Method::Normals))));
        assert!(got < 1.35 * known, "{name}: RMS {got}, elsewhere {known}");
    }
}

/// Beside normals by area weights, which most tools estimate.
#[test]
fn estimated_normals_are_the_good_ones() {
    let cases = [
        ("torus", torus((80, 32), 2.0, 0.8, 0.3)),
        ("cylinder", cylinder((48, 24), 1.0, 4.0, 0.3)),
        ("saddle", saddle((32, 32), 0.5, 0.3)),
    ];
    for (name, mut shape) in cases {
        let ours = rms(&errors(&shape, &bake(&shape, false, &raw(Method::Normals))));
        let mut by_area = vec![Vec3::ZERO; shape.positions.len()];
        for triangle in &shape.triangles {
            let [a, b, c] = triangle.map(|i| shape.positions[i as usize]);
            triangle.iter().for_each(|&i| by_area[i as usize] += (b - a).cross(c - a));
        }
        shape.normals = by_area.into_iter().map(Vec3::normalize).collect();
        let theirs = rms(&errors(&shape, &bake(&shape, true, &raw(Method::Normals))));
        assert!(2.0 * ours < theirs, "{name}: RMS {ours}, with area weights {theirs}");
    }
}

/// On irregular meshes curvature by normals from triangles has the same error however fine the mesh is.
#[test]
fn with_estimated_normals_the_error_does_not_fall() {
    for method in [Method::Normals, Method::Fit] {
        let rms_of = |columns: usize| {
            let shape = ellipsoid((columns, columns / 2), dvec3(1.0, 0.7, 0.5), 0.3);
            rms(&errors(&shape, &bake(&shape, false, &raw(method))))
        };
        let errors = [48, 96, 192].map(rms_of);
        assert!(errors[0] < 0.1, "{method:?}: RMS {errors:?}");
        for pair in errors.windows(2) {
            assert!(2.0 * pair[1] < pair[0], "{method:?}: RMS for cells of half the size each: {errors:?}");
        }
    }
}

/// Of the larger principal curvature's ratio to the true one, the median less one: a parabola is narrower than the circle
/// that touches it, and was taken for it.
#[test]
fn coarse_meshes_are_found_too_round() {
    let cases = [
        ("sphere of 642 points", sphere(8, 1.0, 0.0), 0.001),
        ("irregular sphere", sphere(4, 1.0, 0.3), 0.001),
        ("cylinder", cylinder((12, 6), 1.0, 4.0, 0.0), 0.001),
        ("torus", torus((40, 16), 2.0, 0.8, 0.0), 0.02),
        ("irregular torus", torus((40, 16), 2.0, 0.8, 0.3), 0.02),
        ("coarse torus", torus((20, 8), 2.0, 0.8, 0.3), 0.04),
        ("ellipsoid", ellipsoid((18, 9), dvec3(1.0, 0.7, 0.5), 0.3), 0.04),
    ];
    for (name, shape, allowed) in cases {
        let baked = bake(&shape, false, &raw(Method::Fit));
        let mut ratios: Vec<f64> = (0..shape.positions.len())
            .filter(|&i| shape.inner[i])
            .map(|i| f64::from(principal(baked.tensors[i]).0) / shape.curvatures[i].0)
            .collect();
        ratios.sort_by(f64::total_cmp);
        let bias = quantile(&ratios, 0.5) - 1.0;
        assert!(bias.abs() < allowed, "{name}: biased by {bias:+.4}, wanted within {allowed}");
    }
}

#[test]
fn a_fit_has_no_outlier_on_irregular_meshes() {
    // Median, 99 %, largest.
    let cases = [
        ("torus", torus((500, 250), 1.0, 0.4, 0.3), [0.0017, 0.007, 0.03]),
        ("regular torus", torus((500, 250), 1.0, 0.4, 0.0), [0.0017, 0.007, 0.01]),
        ("saddle", saddle((100, 100), 0.5, 0.3), [0.0005, 0.003, 0.02]),
        ("ellipsoid", ellipsoid((240, 120), dvec3(1.0, 0.7, 0.5), 0.3), [0.0017, 0.007, 0.03]),
        ("cylinder", cylinder((200, 100), 1.0, 3.0, 0.3), [0.0017, 0.003, 0.01]),
    ];
    for (name, shape, wanted) in cases {
        let errors = errors(&shape, &bake(&shape, false, &raw(Method::Fit)));
        let got = [quantile(&errors, 0.5), quantile(&errors, 0.99), errors[errors.len() - 1]];
        assert!(
            got.iter().zip(wanted).all(|(got, wanted)| *got <= wanted),
            "{name}: {got:?}, wanted {wanted:?}"
        );
    }
}

/// As of a scan: irregular points, moved by a share of an edge. Of the error over the median of the larger curvature the
/// median, and how far the larger curvature is off in the median. Bounds are below what libigl 2.6.3 has on such meshes over
/// three rings, on the torus 0.031, 0.039, 0.063, 0.144, on the ellipsoid 0.027, 0.048, 0.098, 0.246; over two it has
/// 0.034 to 0.30 and 0.054 to 0.53.
#[test]
fn the_noise_of_a_scan_becomes_curvature() {
    let shapes = [
        ("torus", torus((96, 48), 1.0, 0.4, 0.3), [0.018, 0.026, 0.046, 0.11]),
        ("ellipsoid", ellipsoid((96, 48), dvec3(1.0, 0.7, 1.4), 0.3), [0.023, 0.043, 0.084, 0.21]),
    ];
    let (mut told, mut is_right) = (String::new(), true);
    for (name, shape, bounds) in &shapes {
        let mut edges: Vec<f64> = (shape.triangles.iter())
            .map(|t| f64::from(shape.positions[t[0] as usize].distance(shape.positions[t[1] as usize])))
            .collect();
        edges.sort_by(f64::total_cmp);
        let edge = quantile(&edges, 0.5);
        let mut sizes: Vec<f64> = shape.curvatures.iter().map(|k| k.0).collect();
        sizes.sort_by(f64::total_cmp);
        let size = quantile(&sizes, 0.5);
        for (noise, wanted) in [0.005, 0.01, 0.02, 0.05].into_iter().zip(*bounds) {
            let mut random = Noise(11);
            // A sum of three is nearly normal, with a deviation of one.
            let mut normal = || (random.next() + random.next() + random.next()) * noise * edge;
            let mut scanned = shape.clone();
            for position in &mut scanned.positions {
                *position += dvec3(normal(), normal(), normal()).as_vec3();
            }
            let baked = bake(&scanned, false, &raw(Method::Fit));
            let found = baked.tensors.iter().zip(&shape.curvatures);
            let pairs: Vec<((f64, f64), (f64, f64))> = found
                .map(|(tensor, truth)| {
                    let (k1, k2, _) = principal(*tensor);
                    ((f64::from(k1), f64::from(k2)), *truth)
                })
                .collect();
            let sorted = |mut all: Vec<f64>| {
                all.sort_by(f64::total_cmp);
                all
            };
            let error =
                |((k1, k2), (t1, t2)): &((f64, f64), (f64, f64))| (k1 - t1).abs().max((k2 - t2).abs());
            let errors = sorted(pairs.iter().map(|pair| error(pair) / size).collect());
            let off = quantile(&sorted(pairs.iter().map(|(k, t)| (k.0 - t.0) / size).collect()), 0.5);
            let median = quantile(&errors, 0.5);
            told += &format!(
                "{name}, noise of {noise} edges: median {median:.4}, wanted {wanted}; off by {off:+.4}\n"
            );
            is_right &= median < wanted && off.abs() < 0.006 + 0.5 * noise;
        }
    }
    assert!(is_right, "\n{told}");
}

#[test]
fn concave_is_negative_and_the_saddle_has_both() {
    let shape = saddle((32, 32), 0.5, 0.0);
    let middle = 16 * 33 + 16;
    for method in [Method::Normals, Method::Fit] {
        let (k1, k2, axis) = principal(bake(&shape, true, &raw(method)).tensors[middle]);
        assert!((k1 - 0.5).abs() < 0.003 && (k2 + 0.5).abs() < 0.003, "{method:?}: {k1}, {k2}, {axis:?}");
    }
    let mut bowl = sphere(8, 1.0, 0.0);
    bowl.normals.iter_mut().for_each(|n| *n = -*n);
    bowl.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let (k1, k2, _) = principal(bake(&bowl, true, &raw(Method::Normals)).tensors[5]);
    assert!((k1 + 1.0).abs() < 1e-4 && (k2 + 1.0).abs() < 1e-4, "{k1}, {k2}");
}

/// The principal directions of a torus run round the tube and round the axis.
#[test]
fn tensors_stand_in_the_mesh_s_own_tangent_frame() {
    let shape = torus((160, 64), 2.0, 0.8, 0.3);
    // Tangents along the tube's circle turned by 30 degrees, and mirrored bitangents.
    let tangents: Vec<Vec4> = (shape.normals.iter().enumerate())
        .map(|(i, &n)| {
            let around = Vec3::Z.cross(n).normalize();
            let along = n.cross(around);
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            (around * 0.5 + along * 0.75f32.sqrt()).extend(sign)
        })
        .collect();
    for method in [Method::Normals, Method::Fit] {
        let mesh = Mesh {
            positions: &shape.positions,
            normals: Some(&shape.normals),
            tangents: Some(&tangents),
            triangles: &shape.triangles,
        };
        let baked = bake_curvature(&mesh, &raw(method), &untold).unwrap();
        for (i, tensor) in baked.tensors.iter().enumerate() {
            let n = shape.normals[i];
            let t = tangents[i].truncate();
            let b = tangents[i].w * n.cross(t);
            let around = Vec3::Z.cross(n).normalize();
            // Curvature round the axis, along `around`.
            let got = tensor.quadratic(glam::vec2(around.dot(t), around.dot(b)));
            let want = shape.curvatures[i].1 as f32;
            assert!((want - got).abs() < 0.07, "{method:?}, vertex {i}: wanted {want}, got {got}");
        }
    }
}

/// Each triangle with vertices of its own, in another order.
#[test]
fn seams_do_not_split_the_curvature() {
    let shape = torus((40, 20), 2.0, 0.8, 0.3);
    let corners: Vec<u32> = shape.triangles.as_flattened().to_vec();
    let split = Shape {
        positions: corners.iter().map(|&i| shape.positions[i as usize]).collect(),
        normals: corners.iter().map(|&i| shape.normals[i as usize]).collect(),
        triangles: (0..corners.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        curvatures: corners.iter().map(|&i| shape.curvatures[i as usize]).collect(),
        inner: vec![true; corners.len()],
    };
    for options in [
        raw(Method::Normals),
        raw(Method::Fit),
        Options { blur: vec![0.4, 0.1], clamp: true, ..raw(Method::Normals) },
    ] {
        let (whole, split) = (bake(&shape, true, &options), bake(&split, true, &options));
        assert_eq!(split.report.points, shape.positions.len());
        for (corner, &vertex) in corners.iter().enumerate() {
            let (want, got) = (whole.tensors[vertex as usize], split.tensors[corner]);
            let d = want + got * -1.0;
            assert!(d.xx.abs().max(d.xy.abs()).max(d.yy.abs()) < 2e-4, "{options:?}: {want:?}, {got:?}");
        }
    }
}

#[test]
fn both_sides_of_a_sheet_that_was_modelled_twice_stay_apart() {
    let front = cylinder((48, 24), 1.0, 4.0, 0.0);
    let count = front.positions.len() as u32;
    let mut sheet = Shape { inner: Vec::new(), curvatures: Vec::new(), ..front };
    sheet.positions.extend_from_within(..);
    let back: Vec<Vec3> = sheet.normals.iter().map(|n| -*n).collect();
    sheet.normals.extend(back);
    let flipped: Vec<[u32; 3]> =
        sheet.triangles.iter().map(|&[a, b, c]| [a, c, b].map(|i| i + count)).collect();
    sheet.triangles.extend(flipped);
    let baked = bake(&sheet, true, &Options { blur: vec![0.5], clamp: true, ..raw(Method::Normals) });
    assert_eq!(baked.report.points, 2 * count as usize);
    let (outside, inside) = (baked.tensors[500].trace(), baked.tensors[500 + count as usize].trace());
    assert!((outside - 1.0).abs() < 0.01 && inside.abs() < 1e-6, "{outside}, {inside}");
}

/// Fingers: two cylinders so close that a Gaussian over space would mix them, one thin, one thick.
#[test]
fn the_blur_does_not_cross_a_gap() {
    let thin = cylinder((64, 64), 1.0, 8.0, 0.2);
    let thick = cylinder((96, 64), 4.0, 8.0, 0.2);
    let mut both = Shape { inner: Vec::new(), curvatures: Vec::new(), ..thin };
    let count = both.positions.len() as u32;
    both.positions.extend(thick.positions.iter().map(|p| *p + Vec3::X * 5.01));
    both.normals.extend(&thick.normals);
    both.triangles.extend(thick.triangles.iter().map(|t| t.map(|i| i + count)));
    let baked = bake(&both, true, &Options { blur: vec![2.0, 0.5], clamp: true, ..raw(Method::Normals) });
    for (i, tensor) in baked.tensors.iter().enumerate() {
        let want = if i < count as usize { 1.0 } else { 0.25 };
        assert!((tensor.trace() - want).abs() < 0.005, "vertex {i}: wanted {want}, got {}", tensor.trace());
    }
}

#[test]
fn the_blur_keeps_spheres_and_cylinders() {
    let shape = sphere(16, 2.0, 0.3);
    let baked = bake(&shape, true, &Options { blur: vec![1.5, 0.4], clamp: true, ..raw(Method::Normals) });
    let worst = *errors(&shape, &baked).last().unwrap();
    assert!(worst < 2e-4, "sphere: off by {worst}");
    let shape = cylinder((64, 48), 1.0, 6.0, 0.0);
    let baked = bake(&shape, true, &Options { blur: vec![1.0, 0.3], clamp: true, ..raw(Method::Normals) });
    for (i, tensor) in baked.tensors.iter().enumerate().filter(|(i, _)| shape.inner[*i]) {
        let (k1, k2, _) = principal(*tensor);
        assert!((k1 - 1.0).abs() < 0.002 && k2.abs() < 1e-3, "cylinder, vertex {i}: {k1}, {k2}");
    }
}

/// Against the definition: tensors of all points, turned by the shortest arc between normals, weighted by area and by the
/// Gaussian of the straight distance. On a gently curved surface straight and along it are the same to a few per cent.
#[test]
fn the_blur_is_the_mean_of_two_gaussians() {
    let mut shape = ellipsoid((96, 64), dvec3(10.0, 7.0, 8.0), 0.3);
    let sigmas = [1.6f64, 0.5];
    // A rough field to blur, by noise in the normals.
    let mut noise = Noise(11);
    for n in &mut shape.normals {
        let mut next = || (0.03 * noise.next()) as f32;
        *n = (*n + Vec3::new(next(), next(), next())).normalize();
    }
    let rough = bake(&shape, true, &Options { clamp: true, ..raw(Method::Normals) });
    let blurred = bake(&shape, true, &Options { blur: sigmas.to_vec(), clamp: true, ..raw(Method::Normals) });
    let areas = vertex_areas(&shape);
    let world = |i: usize, baked: &Curvature| -> Mat3 {
        let (t, n) = (baked.tangents[i].truncate(), shape.normals[i]);
        let b = baked.tangents[i].w * n.cross(t);
        let m: Sym2 = baked.tensors[i];
        let column =
            |v: Vec3| t * (m.xx * t.dot(v) + m.xy * b.dot(v)) + b * (m.xy * t.dot(v) + m.yy * b.dot(v));
        Mat3::from_cols(column(Vec3::X), column(Vec3::Y), column(Vec3::Z))
    };
    let rotation = |from: Vec3, to: Vec3| Mat3::from_quat(glam::Quat::from_rotation_arc(from, to));
    let (mut worst, mut rough_worst) = (0.0f32, 0.0f32);
    for i in (0..shape.positions.len()).filter(|i| i % 37 == 0) {
        // Far enough from the open ends for the whole Gaussian.
        if shape.positions[i].z.abs() > 3.0 {
            continue;
        }
        let mut sum = Mat3::ZERO;
        for sigma in sigmas {
            let (mut one, mut weight) = (Mat3::ZERO, 0.0f32);
            for (j, &area) in areas.iter().enumerate() {
                let d = shape.positions[i].distance(shape.positions[j]);
                if f64::from(d) > 4.0 * sigma || shape.normals[i].dot(shape.normals[j]) <= 0.0 {
                    continue;
                }
                let w = area * (-0.5 * f64::from(d * d) / (sigma * sigma)).exp() as f32;
                let arc = rotation(shape.normals[j], shape.normals[i]);
                one += (arc * world(j, &rough) * arc.transpose()) * w;
                weight += w;
            }
            sum += one * (0.5 / weight);
        }
        let difference = sum + world(i, &blurred) * -1.0;
        let size = |m: Mat3| m.to_cols_array().iter().map(|x| x * x).sum::<f32>().sqrt();
        worst = worst.max(size(difference) / size(sum));
        rough_worst = rough_worst.max(size(sum + world(i, &rough) * -1.0) / size(sum));
    }
    assert!(rough_worst > 0.15, "there is nothing to blur: {rough_worst}");
    assert!(worst < 0.06, "the blur is off by {worst} of the curvature");
}

fn vertex_areas(shape: &Shape) -> Vec<f32> {
    let mut areas = vec![0.0; shape.positions.len()];
    for triangle in &shape.triangles {
        let [a, b, c] = triangle.map(|i| shape.positions[i as usize]);
        let third = (b - a).cross(c - a).length() / 6.0;
        triangle.iter().for_each(|&i| areas[i as usize] += third);
    }
    areas
}

#[test]
fn everything_out_of_the_ordinary_is_counted() {
    let mut shape = saddle((8, 8), 0.5, 0.0);
    // A needle, a double point, a fin on an edge, and a lone vertex.
    let first = shape.positions.len() as u32;
    shape.positions.extend([Vec3::new(0.0, 0.0, 5.0), Vec3::new(9.0, 9.0, 9.0)]);
    shape.normals.extend([Vec3::X, Vec3::Z]);
    shape.triangles.extend([[0, 1, 1], [5, 5, 5], [40, 41, first]]);
    // Blurred or not: a count that was not made would read as none.
    let blurs = [vec![0.1], Vec::new()];
    for (method, blur) in
        [Method::Normals, Method::Fit].into_iter().flat_map(|m| blurs.clone().map(|b| (m, b)))
    {
        let baked = bake(&shape, true, &Options { blur, ..raw(method) });
        let report = baked.report;
        assert_eq!(report.degenerate_triangles, 2, "{report:?}");
        assert_eq!(report.unreferenced_vertices, 1, "{report:?}");
        assert_eq!(report.non_manifold_edges, 1, "{report:?}");
        assert!(report.border_edges >= 32, "{report:?}");
        assert_eq!(baked.tensors[first as usize + 1], Sym2::default(), "a lone vertex is flat");
        assert!(baked.tensors.iter().all(|t| t.xx.is_finite() && t.xy.is_finite() && t.yy.is_finite()));
        assert!(report.remarks().contains("without area"), "{}", report.remarks());
    }
}

#[test]
fn the_unit_of_length_only_scales() {
    let shape = torus((40, 20), 2.0, 0.8, 0.3);
    for (size, millimetres) in [(1e-12f32, 1e12), (1e9, 1e-9)] {
        let mut other = torus((40, 20), 2.0, 0.8, 0.3);
        other.positions.iter_mut().for_each(|p| *p *= size);
        for method in [Method::Normals, Method::Fit] {
            let options =
                |millimetres, blur: f64| Options { millimetres, blur: vec![blur], clamp: true, method };
            let (want, got) =
                (bake(&shape, true, &options(1.0, 0.5)), bake(&other, true, &options(millimetres, 0.5)));
            for (a, b) in want.tensors.iter().zip(&got.tensors) {
                let d = *a + *b * -1.0;
                assert!(
                    d.xx.abs().max(d.xy.abs()).max(d.yy.abs()) < 2e-3,
                    "{method:?}, size {size}: {a:?}, {b:?}"
                );
            }
        }
    }
}

#[test]
fn bad_meshes_are_refused_with_a_reason() {
    let shape = sphere(4, 1.0, 0.0);
    let refused =
        |positions: &[Vec3], normals: Option<&[Vec3]>, triangles: &[[u32; 3]], options: &Options| {
            bake_curvature(&Mesh { positions, normals, tangents: None, triangles }, options, &untold)
                .unwrap_err()
        };
    let options = Options::default();
    assert_eq!(refused(&shape.positions, None, &[], &options), CurvatureError::NoTriangles);
    let mut positions = shape.positions.clone();
    positions[3].y = f32::NAN;
    let error = refused(&positions, None, &shape.triangles, &options).to_string();
    assert!(error.contains("vertex 3 has a position that is not finite"), "{error}");
    let error = refused(&shape.positions, None, &[[0, 1, 4_000_000_000]], &options).to_string();
    assert!(error.contains("names vertex 4000000000"), "{error}");
    let error = refused(&shape.positions, Some(&shape.normals[1..]), &shape.triangles, &options).to_string();
    assert!(error.contains("normals for"), "{error}");
    let error = refused(&shape.positions, None, &shape.triangles, &Options { millimetres: 0.0, ..options });
    assert!(error.to_string().contains("millimetres"), "{error}");
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let shape = torus((200, 100), 100.0, 40.0, 0.3);
    let options = Options { millimetres: 1.0, method: Method::Fit, ..Options::default() };
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let baked = pool.install(|| bake(&shape, true, &options));
        baked.pack(baked.fitting_range()).bytes
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn packing_says_what_it_loses() {
    let mut noise = Noise(3);
    let tensors: Vec<Sym2> = (0..5000)
        .map(|_| {
            let angle = noise.next() * 3.0;
            let (k1, k2) = (0.25 + 0.25 * noise.next(), 0.25 + 0.25 * noise.next());
            Sym2::from_eigen(k1 as f32, k2 as f32, glam::vec2(angle.cos() as f32, angle.sin() as f32))
        })
        .collect();
    let count = tensors.len();
    let curvature = Curvature { tensors, tangents: vec![Vec4::X; count], report: Default::default() };
    let packed = curvature.pack(0.5);
    assert_eq!(packed.clamped, 0);
    assert!(packed.largest_error < 0.0035 && packed.rms_error < 0.0009, "{packed:?}");
    assert!(packed.rms_error > 0.0001, "an error that small is not measured: {}", packed.rms_error);
    assert!(curvature.pack(0.1).clamped > 1000);
    assert!((curvature.fitting_range() - 0.5).abs() < 0.03, "{}", curvature.fitting_range());
}
