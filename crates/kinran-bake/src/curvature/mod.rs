//! Curvature tensors of the vertices of a mesh, for skin (slides: Skin Shading | Curvature).
//!
//! Vertices that UV and normal seams have split are joined, tensors are computed at the points that result, concave
//! curvature is clamped to zero, the rest is blurred along the surface, and every vertex gets its tensor in the frame
//! of its own tangent, packed into four bytes. Convex is positive: a sphere of radius r with outward normals
//! has 1/r.
//!
//! ```
//! use glam::{Vec3, vec3};
//! use kinran_bake::curvature::{Mesh, Method, Options, bake_curvature, principal};
//!
//! // A cylinder of radius 2 mm along z.
//! let (sides, rings) = (48, 24);
//! let normal = |i: usize| Vec3::from((glam::Vec2::from_angle((i % sides) as f32 * 6.283_185_5 / sides as f32), 0.0));
//! let normals: Vec<Vec3> = (0..sides * rings).map(normal).collect();
//! let positions: Vec<Vec3> = (0..sides * rings).map(|i| 2.0 * normals[i] + vec3(0.0, 0.0, (i / sides) as f32 * 0.26)).collect();
//! let quad = |i: usize| {
//!     let (ring, side) = (i / sides * sides, i % sides);
//!     let [a, b, c, d] = [ring + side, ring + (side + 1) % sides, ring + sides + side, ring + sides + (side + 1) % sides];
//!     [[a, b, c], [b, d, c]].map(|t| t.map(|i| i as u32))
//! };
//! let triangles: Vec<[u32; 3]> = (0..sides * (rings - 1)).flat_map(quad).collect();
//! let mesh = Mesh { positions: &positions, normals: Some(&normals), tangents: None, triangles: &triangles };
//! let options = Options { method: Method::Normals, millimetres: 1.0, blur: vec![], clamp: true };
//! let baked = bake_curvature(&mesh, &options, &kinran_image::untold)?;
//! let (across, along, _) = principal(baked.tensors[sides * rings / 2]);
//! assert!((across - 0.5).abs() < 0.01 && along.abs() < 0.01, "{across} {along}");
//! # Ok::<(), kinran_bake::curvature::CurvatureError>(())
//! ```

mod blur;
mod faces;
mod normals;
mod quadric;
mod surface;

use std::fmt::Write;

use glam::{DVec3, Vec3, Vec4};
use kinran_image::{Cancelled, Tick};
use kinran_shading::Sym2;
use kinran_shading::skin::curvature::{curvature_decode, curvature_encode};

use faces::frame;
use surface::{Fans, Welded, weld};

/// Deviations of the talk's two Gaussians, millimetres.
pub const BLUR: [f64; 2] = [8.0, 2.3];

/// How tensors are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Method {
    /// By the change of normals along edges (Rusinkiewicz 2004), as in the talk: fast, and as good as the normals.
    #[default]
    Normals,
    /// By fitting a surface to two rings of neighbours: for irregular and scanned meshes.
    Fit,
}

/// How to bake.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How tensors are found.
    pub method: Method,
    /// Millimetres in the mesh's unit of length.
    pub millimetres: f64,
    /// Deviations in millimetres of the Gaussians whose mean blurs the tensors, each with the same share; none for no blur.
    pub blur: Vec<f64>,
    /// Concave curvature becomes zero, before the blur. Without it only packing clamps.
    pub clamp: bool,
}

impl Default for Options {
    /// The talk's, for a mesh in metres.
    fn default() -> Self {
        Options { method: Method::Normals, millimetres: 1000.0, blur: BLUR.to_vec(), clamp: true }
    }
}

/// A mesh to bake; several primitives of one surface stand one after the other.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// Rest pose.
    pub positions: &'a [Vec3],
    /// The artist's, unit length; `None` has them estimated, as [`estimated_normals`] does.
    pub normals: Option<&'a [Vec3]>,
    /// Unit xyz and the sign of the bitangent, `b = w cross(n, t)`; `None` takes an arbitrary frame about the normal.
    pub tangents: Option<&'a [Vec4]>,
    /// Counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
}

/// Why a mesh cannot be baked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurvatureError {
    /// There is nothing to bake.
    #[error("the mesh has no triangles, so no curvature; export it with its faces")]
    NoTriangles,
    /// A number of a vertex is no number.
    #[error("vertex {vertex} has a {what} that is not finite ({value}); repair or remove it")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
        /// `position`, `normal` or `tangent`.
        what: &'static str,
        /// What stands there.
        value: String,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {index}, but there are only {vertices}; export the mesh anew")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// What it names.
        index: u32,
        /// How many there are.
        vertices: usize,
    },
    /// Arrays of different lengths.
    #[error("there are {got} {what}s for {vertices} vertices; export the mesh anew")]
    Length {
        /// `normal` or `tangent`.
        what: &'static str,
        /// How many there are.
        got: usize,
        /// How many there should be.
        vertices: usize,
    },
    /// The scale or a deviation is no length.
    #[error("{what} is {value}; it must be a positive number of millimetres")]
    Setting {
        /// What is wrong.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// A [`Tick`] stopped the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What was found in a mesh, and left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, schemars::JsonSchema)]
pub struct Report {
    /// Vertices given.
    pub vertices: usize,
    /// Places they stand at: vertices joined across seams count once.
    pub points: usize,
    /// Triangles given.
    pub triangles: usize,
    /// Triangles without area, which say nothing.
    pub degenerate_triangles: usize,
    /// Vertices that no triangle names; they get zero.
    pub unreferenced_vertices: usize,
    /// Points at which normals of a hard edge were averaged.
    pub hard_points: usize,
    /// Edges with a triangle on one side only; the surface ends there.
    pub border_edges: usize,
    /// Edges of more than two triangles; all of them count.
    pub non_manifold_edges: usize,
    /// Points with too few neighbours for a fit, which keep the tensor from normals.
    pub unfitted_points: usize,
}

impl Report {
    /// One sentence about everything out of the ordinary; empty where there is nothing.
    pub fn remarks(&self) -> String {
        let mut text = String::new();
        for (count, what) in [
            (self.degenerate_triangles, "triangles without area were skipped"),
            (self.unreferenced_vertices, "vertices belong to no triangle and got zero curvature"),
            (self.hard_points, "points on hard edges had their normals averaged"),
            (self.border_edges, "edges are open borders"),
            (self.non_manifold_edges, "edges have more than two triangles; all of them were counted"),
            (self.unfitted_points, "points had too few neighbours for a fit and were done from normals"),
        ] {
            if count > 0 {
                let separator = if text.is_empty() { "" } else { "; " };
                let _ = write!(text, "{separator}{count} {what}");
            }
        }
        text
    }
}

/// Curvature of every vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct Curvature {
    /// 1/mm, in the frame of the vertex's tangent and bitangent.
    pub tensors: Vec<Sym2>,
    /// Unit tangent and the sign of the bitangent, as given or as chosen.
    pub tangents: Vec<Vec4>,
    /// What was found and left out.
    pub report: Report,
}

/// Tenths of the units that are told after the joining of vertices, the normals, the tensors of triangles, and the fit,
/// where there is one; the blur has the rest. Chosen by eye, for bars.
const JOINING: u64 = 1;
const NORMALS: u64 = 1;
const FACES: u64 = 1;
const FIT: u64 = 4;

/// Curvature of a mesh. `tick` is told of as many units as the mesh has triangles: of each triangle once, spread over all that
/// is done with them.
///
/// # Errors
/// [`CurvatureError`] where the mesh or a setting is none, or `tick` stops the work.
pub fn bake_curvature(
    mesh: &Mesh<'_>,
    options: &Options,
    tick: &Tick<'_>,
) -> Result<Curvature, CurvatureError> {
    check(mesh, options)?;
    let all = mesh.triangles.len() as u64;
    let units = |tenths| all * tenths / 10;
    let surface = weld(mesh.positions, mesh.normals, mesh.triangles);
    let fans = Fans::new(surface.positions.len(), &surface.triangles);
    tick(units(JOINING))?;
    let (normals, hard_points) = match mesh.normals {
        Some(authored) => {
            let normals = normals::authored_normals(&surface, authored);
            tick(units(NORMALS))?;
            normals
        }
        None => (normals::estimated_normals(&surface, &fans, units(NORMALS), tick)?, 0),
    };
    let from_faces = faces::face_tensors(&surface, &normals);
    let mut tensors = from_faces.tensors;
    let mut report = Report {
        vertices: mesh.positions.len(),
        points: surface.positions.len(),
        triangles: mesh.triangles.len(),
        degenerate_triangles: from_faces.degenerate,
        hard_points,
        ..Report::default()
    };
    (report.border_edges, report.non_manifold_edges) = edges(&surface, &fans);
    tick(units(FACES))?;
    let mut rest = all - units(JOINING) - units(NORMALS) - units(FACES);
    if options.method == Method::Fit {
        report.unfitted_points =
            quadric::quadric_tensors(&surface, &fans, &normals, &mut tensors, units(FIT), tick)?;
        rest -= units(FIT);
    }
    if options.clamp {
        tensors.iter_mut().for_each(|t| *t = clamp_concave(*t));
    }
    let deviations: Vec<f64> = options.blur.iter().map(|mm| mm / options.millimetres).collect();
    blur::blur(&surface, &fans, &normals, &mut tensors, &deviations, rest, tick)?;

    let mut referenced = vec![false; mesh.positions.len()];
    for &vertex in mesh.triangles.as_flattened() {
        referenced[vertex as usize] = true;
    }
    report.unreferenced_vertices = referenced.iter().filter(|&&r| !r).count();
    let scale = (1.0 / options.millimetres) as f32;
    let (tensors, tangents) = at_vertices(mesh, &surface, &normals, &tensors, scale);
    Ok(Curvature { tensors, tangents, report })
}

fn check(mesh: &Mesh<'_>, options: &Options) -> Result<(), CurvatureError> {
    let vertices = mesh.positions.len();
    let lengths =
        [("normal", mesh.normals.map(<[Vec3]>::len)), ("tangent", mesh.tangents.map(<[Vec4]>::len))];
    for (what, length) in lengths {
        if let Some(got) = length
            && got != vertices
        {
            return Err(CurvatureError::Length { what, got, vertices });
        }
    }
    if mesh.triangles.is_empty() {
        return Err(CurvatureError::NoTriangles);
    }
    let not_finite = |vertex, what, value: String| Err(CurvatureError::NotFinite { vertex, what, value });
    if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return not_finite(i, "position", mesh.positions[i].to_string());
    }
    if let Some(normals) = mesh.normals
        && let Some(i) = normals.iter().position(|n| !n.is_finite())
    {
        return not_finite(i, "normal", normals[i].to_string());
    }
    if let Some(tangents) = mesh.tangents
        && let Some(i) = tangents.iter().position(|t| !t.is_finite())
    {
        return not_finite(i, "tangent", tangents[i].to_string());
    }
    let out = mesh.triangles.as_flattened().iter().position(|&i| i as usize >= vertices);
    if let Some(at) = out {
        let index = mesh.triangles.as_flattened()[at];
        return Err(CurvatureError::IndexOutOfRange { triangle: at / 3, index, vertices });
    }
    let lengths = options.blur.iter().map(|&b| ("a deviation of the blur", b));
    for (what, value) in lengths.chain([("the unit of length", options.millimetres)]) {
        if !(value > 0.0 && value.is_finite()) {
            return Err(CurvatureError::Setting { what, value });
        }
    }
    Ok(())
}

/// Principal curvatures below zero become zero. Not component by component: the principal directions stay.
fn clamp_concave(t: Sym2) -> Sym2 {
    // Of an indefinite matrix, which Sym2::eigen does not take: shifted until it is not.
    let half = 0.5 * (t.xx - t.yy);
    let radius = (half * half + t.xy * t.xy).sqrt();
    let mean = 0.5 * t.trace();
    if mean - radius >= 0.0 {
        return t;
    }
    if mean + radius <= 0.0 || radius == 0.0 {
        return Sym2::default();
    }
    // One positive eigenvalue, times the projector on its direction.
    let share = 0.5 * (mean + radius) / radius;
    Sym2 { xx: share * (radius + half), xy: share * t.xy, yy: share * (radius - half) }
}

/// Counts edges of one triangle, and those of more than two.
fn edges(surface: &Welded, fans: &Fans) -> (usize, usize) {
    let (mut borders, mut crowded) = (0, 0);
    let mut seen: Vec<(u32, u32)> = Vec::new();
    for point in 0..surface.positions.len() as u32 {
        seen.clear();
        for &triangle in fans.around(point as usize) {
            let (a, b) = surface::others(surface.triangles[triangle as usize], point);
            // A triangle that has a point twice has no sides.
            if a == b || a == point || b == point {
                continue;
            }
            for other in [a, b].into_iter().filter(|&other| other > point) {
                match seen.iter_mut().find(|(known, _)| *known == other) {
                    Some((_, count)) => *count += 1,
                    None => seen.push((other, 1)),
                }
            }
        }
        borders += seen.iter().filter(|(_, count)| *count == 1).count();
        crowded += seen.iter().filter(|(_, count)| *count > 2).count();
    }
    (borders, crowded)
}

/// Tensors of points, turned to each vertex's normal and tangent, times `scale`.
fn at_vertices(
    mesh: &Mesh<'_>,
    surface: &Welded,
    normals: &[Vec3],
    tensors: &[Sym2],
    scale: f32,
) -> (Vec<Sym2>, Vec<Vec4>) {
    let mut turned = Vec::with_capacity(mesh.positions.len());
    let mut tangents = Vec::with_capacity(mesh.positions.len());
    for (vertex, &point) in surface.point_of.iter().enumerate() {
        let from = normals[point as usize];
        let to = mesh.normals.map_or(from, |n| n[vertex].normalize_or(from));
        let given = mesh.tangents.map(|t| t[vertex]);
        let along = given.map_or(Vec3::ZERO, Vec4::truncate);
        let tangent = (along - to * to.dot(along)).try_normalize().unwrap_or_else(|| frame(to).0);
        let sign = given.map_or(1.0, |t| if t.w < 0.0 { -1.0 } else { 1.0 });
        let bitangent = sign * to.cross(tangent);

        // The point's frame after the shortest arc to the vertex's normal, along tangent and bitangent.
        let (t, b) = frame(from);
        let one_plus = 1.0 + from.dot(to);
        let arc = |v: Vec3| if one_plus > 1e-6 { v - (from + to) * (to.dot(v) / one_plus) } else { v };
        let (t, b) = (arc(t), arc(b));
        let (tt, tb) = (t.dot(tangent), b.dot(tangent));
        let (bt, bb) = (t.dot(bitangent), b.dot(bitangent));
        let m = tensors[point as usize] * scale;
        turned.push(Sym2 {
            xx: tt * tt * m.xx + 2.0 * tt * tb * m.xy + tb * tb * m.yy,
            xy: tt * bt * m.xx + (tt * bb + tb * bt) * m.xy + tb * bb * m.yy,
            yy: bt * bt * m.xx + 2.0 * bt * bb * m.xy + bb * bb * m.yy,
        });
        tangents.push(tangent.extend(sign));
    }
    (turned, tangents)
}

/// Four bytes a vertex, and what they lost.
#[derive(Clone, Debug, PartialEq)]
pub struct Packed {
    /// As [`curvature_encode`] says.
    pub bytes: Vec<[u8; 4]>,
    /// Curvature of the code 255, 1/mm.
    pub range: f32,
    /// Largest error of a curvature in any direction, 1/mm, where nothing was above the range.
    pub largest_error: f32,
    /// Root of the mean square of the error over vertices and directions, 1/mm.
    pub rms_error: f32,
    /// Vertices with a principal curvature above the range, which were clamped to it.
    pub clamped: usize,
}

impl Curvature {
    /// The range that keeps the curvature of all but one vertex in a thousand, 1/mm, and no more than 5 % above the
    /// largest there is; at least 0.001.
    pub fn fitting_range(&self) -> f32 {
        let mut largest: Vec<f32> = self.tensors.iter().map(|t| principal(*t).0).collect();
        if largest.is_empty() {
            return kinran_shading::skin::curvature::CURVATURE_RANGE;
        }
        let rank = (largest.len() - 1) * 999 / 1000;
        let (_, fitting, _) = largest.select_nth_unstable_by(rank, f32::total_cmp);
        (1.05 * *fitting).max(1e-3)
    }

    /// Packs the tensors and their mean curvature; what is concave becomes zero.
    pub fn pack(&self, range: f32) -> Packed {
        let (mut largest_error, mut squares, mut count, mut clamped) = (0.0f32, 0.0f64, 0usize, 0);
        let bytes = self.tensors.iter().map(|&tensor| {
            let tensor = clamp_concave(tensor);
            let above = tensor.xx > range || tensor.yy > range;
            let code = curvature_encode(tensor, 0.5 * tensor.trace(), range);
            let bytes = code.to_array().map(|x| (x * 255.0).round() as u8);
            if above {
                clamped += 1;
            } else {
                let decoded =
                    curvature_decode(Vec4::from_array(bytes.map(|b| f32::from(b) / 255.0)), range).0;
                let d = decoded + tensor * -1.0;
                let (mean, half) = (0.5 * d.trace(), 0.5 * (d.xx - d.yy));
                let radius = (half * half + d.xy * d.xy).sqrt();
                largest_error = largest_error.max(mean.abs() + radius);
                // Over all directions: mean + radius cos 2φ.
                squares += f64::from(mean * mean + 0.5 * radius * radius);
                count += 1;
            }
            bytes
        });
        let bytes = bytes.collect();
        let rms_error = (squares / count.max(1) as f64).sqrt() as f32;
        Packed { bytes, range, largest_error, rms_error, clamped }
    }
}

/// Principal curvatures of a tensor, the larger first, and the unit direction of the larger in its frame.
pub fn principal(tensor: Sym2) -> (f32, f32, [f32; 2]) {
    let half = 0.5 * (tensor.xx - tensor.yy);
    let radius = (half * half + tensor.xy * tensor.xy).sqrt();
    let mean = 0.5 * tensor.trace();
    let shifted = Sym2 { xx: radius + half, xy: tensor.xy, yy: radius - half };
    let axis = shifted.eigen().2;
    (mean + radius, mean - radius, axis.to_array())
}

/// Unit normals of a mesh that has none, as [`bake_curvature`] takes them: of the surfaces fitted to the points around each
/// point, over normals from triangles (Max 1999), which creases keep. On a smooth surface the error falls with the square
/// of the distance between points or faster. Zero at vertices of no triangle. `tick` is told of as many units as there are
/// triangles.
///
/// # Errors
/// Where `tick` stops the work.
pub fn estimated_normals(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    tick: &Tick<'_>,
) -> Result<Vec<Vec3>, Cancelled> {
    let surface = weld(positions, None, triangles);
    let fans = Fans::new(surface.positions.len(), &surface.triangles);
    let normals = normals::estimated_normals(&surface, &fans, triangles.len() as u64, tick)?;
    Ok(surface.point_of.iter().map(|&point| normals[point as usize]).collect())
}

/// The scale of an affine map: the cube root of its determinant, and whether it is the same in all directions to 1 %.
pub fn uniform_scale(columns: [Vec3; 3]) -> (f64, bool) {
    let [x, y, z] = columns.map(Vec3::as_dvec3);
    let scale = libm::cbrt(DVec3::dot(x.cross(y), z).abs());
    let even = [x, y, z].iter().all(|c| (c.length() - scale).abs() <= 0.01 * scale);
    (scale, even)
}
