//! Curvature by fitting a surface to the points around each point.
//!
//! - Cazals, Pouget. Estimating Differential Quantities Using Polynomial Fitting of Osculating Jets. SGP 2003.
//! - Panozzo, Puppo, Rocca. Efficient Multi-scale Curvature and Crease Estimation. 2010.
//!
//! Over the tangent plane, `z = d x + e y + (a x² + 2 b x y + c y² + g z²) / 2 + cubic terms`, by least squares over two
//! rings of neighbours. The normals serve as directions of projection only, so their errors, which on irregular meshes
//! are most of the error of [`faces`](super::faces), hardly matter; cubic terms take up what an uneven ring would leave
//! in the quadratic ones. With too few neighbours for them the fit is quadratic.
//!
//! Two things keep coarse meshes from being found too round. A graph that bends like a circle rises faster than its
//! parabola, by `k³ x⁴ / 8`: the term `g z²` knows that, with the g of a sphere or cylinder that bends as the fit does;
//! these are fitted exactly. And a neighbour counts by the curvature that its height says, `2 z / r²`, so that the far
//! ones, of which there are more, do not say it all.
//!
//! On scans that is too near: the noise of the point itself and of its nearest neighbours is most of what they say. What a
//! fit leaves over tells, by the usual propagation of errors, how uncertain its second derivatives are. Noise makes them
//! half as uncertain over three rings, shape that the fit does not follow makes them more so. Where it is noise, the point
//! is fitted over three rings with a height of its own and all neighbours alike, unless that contradicts the nearer fit.

use super::faces::frame;
use super::surface::{Fans, Welded, others};
use crate::pieces::Pieces;
use crate::simd::dispatch;
use glam::{DVec3, Vec3};
use kinran_image::{Cancelled, Tick};
use kinran_shading::Sym2;
use rayon::prelude::*;

/// Coefficients with and without cubic terms.
const CUBIC: usize = 9;
const QUADRATIC: usize = 5;

/// Cubic terms and the point's own height.
const FREE: usize = 10;

/// Neighbours that a cubic fit wants: half as many again as coefficients.
const ENOUGH: usize = 14;

/// Rings that are searched for enough neighbours.
const RINGS_MAX: usize = 4;

/// Neighbours that are looked at.
const NEIGHBOURS_MAX: usize = 64;

/// Squared distance, over the farthest one's, below which nearer neighbours count no more: a double point would say all.
/// Chosen by eye.
const NEAREST: f64 = 0.01;

/// Cosine to the normal from triangles, below which a fitted normal is that of no surface but of a crease: 18°, several
/// times what they differ by on the coarsest of smooth meshes. Chosen by eye.
const SAME_NORMAL: f32 = 0.95;

/// Standard deviation of second derivatives, over the curvature, below which a fit needs no second look; and how much of it
/// may be left over three rings, where noise leaves 0.44 to 0.55 and coarse meshes 1.3 to 1.8. Between these, chosen by eye.
const CERTAIN: f64 = 0.01;
const LESS_UNCERTAIN: f64 = 0.6;

/// Standard deviations of the nearer fit by which a smooth one may differ from it.
const CONTRADICTS: f64 = 3.0;

/// Points of one piece of work.
const BAND: usize = 4096;

/// Points that are fitted at once.
const LANES: usize = 8;

/// A number of each of the points that are fitted at once. Double precision: normal equations of cubic terms lose half of
/// the digits.
type Lanes = [f64; LANES];

/// Tensors of points as [`face_tensors`](super::faces::face_tensors) gives them, and how many points could not be fitted and
/// keep the given ones. `tick` is told of so many `units`.
pub(crate) fn quadric_tensors(
    surface: &Welded,
    fans: &Fans,
    normals: &[Vec3],
    tensors: &mut [Sym2],
    units: u64,
    tick: &Tick<'_>,
) -> Result<usize, Cancelled> {
    let pieces = Pieces::new(tick, units, tensors.len().div_ceil(BAND));
    fit(surface, fans, normals, tensors, |graph, _| graph.shape_operator(), &pieces)
}

/// Normals of the fitted surfaces, whose error falls with the square of the distance between points or faster. Points that
/// cannot be fitted, and those on creases, keep the given ones. `tick` is told of so many `units`.
pub(crate) fn quadric_normals(
    surface: &Welded,
    fans: &Fans,
    given: &[Vec3],
    units: u64,
    tick: &Tick<'_>,
) -> Result<Vec<Vec3>, Cancelled> {
    let mut normals = given.to_vec();
    let of = |graph: Graph, point: usize| {
        let normal = graph.normal(given[point]);
        if normal.dot(given[point]) > SAME_NORMAL { normal } else { given[point] }
    };
    let pieces = Pieces::new(tick, units, normals.len().div_ceil(BAND));
    fit(surface, fans, given, &mut normals, of, &pieces)?;
    Ok(normals)
}

/// Puts what `of` makes of the surface fitted at each point into `results`, and leaves them as they are where there is
/// none; how many these are.
fn fit<T: Send>(
    surface: &Welded,
    fans: &Fans,
    normals: &[Vec3],
    results: &mut [T],
    of: impl Fn(Graph, usize) -> T + Sync,
    pieces: &Pieces<'_>,
) -> Result<usize, Cancelled> {
    let points = surface.positions.len();
    let rings = || Rings { seen: vec![u32::MAX; points], points: Vec::with_capacity(NEIGHBOURS_MAX) };
    let bands = results.par_chunks_mut(BAND).enumerate();
    let unfitted = bands.map_init(rings, |rings, (band, results)| {
        let first = band * BAND;
        let unfitted = dispatch(FitBand { surface, fans, normals, rings, first, results, of: &of });
        pieces.done()?;
        Ok(unfitted)
    });
    unfitted.try_reduce(|| 0, |a, b| Ok(a + b))
}

struct FitBand<'a, T, F> {
    surface: &'a Welded,
    fans: &'a Fans,
    normals: &'a [Vec3],
    rings: &'a mut Rings,
    first: usize,
    results: &'a mut [T],
    of: &'a F,
}

impl<T, F: Fn(Graph, usize) -> T> pulp::WithSimd for FitBand<'_, T, F> {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, _: S) -> usize {
        let mut unfitted = 0;
        let mut group =
            Group { local: [[[0.0; LANES]; 3]; NEIGHBOURS_MAX], counts: [0; LANES], inverse: [0.0; LANES] };
        for i in 0..self.results.len().div_ceil(LANES) {
            let (first, len) = (self.first + i * LANES, LANES.min(self.results.len() - i * LANES));
            let has_normal = std::array::from_fn(|l| l < len && self.normals[first + l] != Vec3::ZERO);
            self.gather(&mut group, first, has_normal, 2);
            let cubic = solve::<CUBIC>(&group);
            let mut graphs = [const { None::<Graph> }; LANES];
            let is_cubic: [bool; LANES] =
                std::array::from_fn(|l| cubic.solved[l] && group.counts[l] >= ENOUGH);
            for l in (0..len).filter(|&l| is_cubic[l]) {
                graphs[l] = Some(Graph::new(&cubic, l, group.inverse[l]));
            }
            if is_cubic[..len].contains(&false) {
                let quadratic = solve::<QUADRATIC>(&group);
                for l in (0..len).filter(|&l| !is_cubic[l]) {
                    let fits = quadratic.solved[l] && group.counts[l] >= QUADRATIC;
                    graphs[l] = fits.then(|| Graph::new(&quadratic, l, group.inverse[l]));
                }
            }
            let near = doubt(&group, &cubic);
            let is_doubtful: [bool; LANES] = std::array::from_fn(|l| {
                is_cubic[l] && graphs[l].as_ref().is_some_and(|graph| near[l] > CERTAIN * graph.size())
            });
            if is_doubtful.contains(&true) {
                self.smooth(&mut group, first, is_doubtful, near, &mut graphs);
            }
            for (l, graph) in graphs.into_iter().take(len).enumerate() {
                match graph {
                    Some(graph) => self.results[i * LANES + l] = (self.of)(graph, first + l),
                    None => unfitted += 1,
                }
            }
        }
        unfitted
    }
}

impl<T, F: Fn(Graph, usize) -> T> FitBand<'_, T, F> {
    /// Puts the neighbours of the points from `first` on into their lanes, where they are `wanted`: at least so many rings.
    #[inline(always)]
    fn gather(&mut self, group: &mut Group, first: usize, wanted: [bool; LANES], rings: usize) {
        group.counts = [0; LANES];
        for l in (0..LANES).filter(|&l| wanted[l]) {
            self.rings.collect(self.surface, self.fans, first + l, rings);
            group.place(l, self.surface, self.normals, &self.rings.points);
        }
        group.pad();
    }

    /// Replaces graphs of which noise is what is uncertain, by `near`, by smooth ones.
    #[inline(always)]
    fn smooth(
        &mut self,
        group: &mut Group,
        first: usize,
        wanted: [bool; LANES],
        near: Lanes,
        graphs: &mut [Option<Graph>; LANES],
    ) {
        self.gather(group, first, wanted, 3);
        let cubic = solve::<CUBIC>(group);
        let far = doubt(group, &cubic);
        let free = solve::<FREE>(group);
        for l in (0..LANES).filter(|&l| wanted[l] && cubic.solved[l] && free.solved[l]) {
            let smooth = Graph::new(&free, l, group.inverse[l]);
            let apart = graphs[l].as_ref().map_or(f64::INFINITY, |graph| {
                let pairs = graph.second.iter().zip(smooth.second);
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            });
            if far[l] < LESS_UNCERTAIN * near[l] && apart < CONTRADICTS * near[l] {
                graphs[l] = Some(smooth);
            }
        }
    }
}

/// Neighbours of a point.
struct Rings {
    /// For each point of the surface the last one whose neighbour it was.
    seen: Vec<u32>,
    points: Vec<u32>,
}

impl Rings {
    /// Collects at least so many rings, until there are enough neighbours; the point itself comes first.
    fn collect(&mut self, surface: &Welded, fans: &Fans, point: usize, least: usize) {
        let mark = point as u32;
        self.points.clear();
        self.points.push(mark);
        self.seen[point] = mark;
        let mut from = 0;
        for ring in 0..RINGS_MAX {
            let to = self.points.len();
            for i in from..to {
                let center = self.points[i];
                for &triangle in fans.around(center as usize) {
                    let (a, b) = others(surface.triangles[triangle as usize], center);
                    for other in [a, b] {
                        if self.seen[other as usize] != mark && self.points.len() < NEIGHBOURS_MAX {
                            self.seen[other as usize] = mark;
                            self.points.push(other);
                        }
                    }
                }
            }
            if self.points.len() == to || (ring + 1 >= least && self.points.len() > ENOUGH) {
                break;
            }
            from = to;
        }
    }
}

/// The neighbours of the points that are fitted at once, each in the frame of its point's normal and in units of the
/// farthest one's distance.
struct Group {
    local: [[Lanes; 3]; NEIGHBOURS_MAX],
    counts: [usize; LANES],
    /// One over that distance.
    inverse: Lanes,
}

impl Group {
    /// Puts the neighbours of the first of `points` into a lane; those that face away belong to another side.
    #[inline(always)]
    fn place(&mut self, l: usize, surface: &Welded, normals: &[Vec3], points: &[u32]) {
        let point = points[0] as usize;
        let normal = normals[point];
        let (t, b) = frame(normal);
        let (n, t, b) = (normal.as_dvec3(), t.as_dvec3(), b.as_dvec3());
        let origin = surface.positions[point].as_dvec3();
        let (mut count, mut farthest) = (0, 0.0f64);
        for &other in &points[1..] {
            if normals[other as usize].dot(normal) <= 0.0 {
                continue;
            }
            let d = surface.positions[other as usize].as_dvec3() - origin;
            for (to, axis) in self.local[count].iter_mut().zip([t, b, n]) {
                to[l] = d.dot(axis);
            }
            farthest = farthest.max(d.length_squared());
            count += 1;
        }
        self.counts[l] = if farthest > 0.0 { count } else { 0 };
        self.inverse[l] = if farthest > 0.0 { farthest.sqrt().recip() } else { 0.0 };
    }

    /// The neighbours, of each lane as many as of the longest.
    #[inline(always)]
    fn neighbours(&self) -> &[[Lanes; 3]] {
        &self.local[..self.counts.iter().copied().max().unwrap_or(0)]
    }

    /// Scales what was placed, and fills lanes with zeros, which change no sum, up to the longest.
    #[inline(always)]
    fn pad(&mut self) {
        let longest = self.neighbours().len();
        for (i, place) in self.local[..longest].iter_mut().enumerate() {
            for axis in place {
                for (l, x) in axis.iter_mut().enumerate() {
                    *x = if i < self.counts[l] { *x * self.inverse[l] } else { 0.0 };
                }
            }
        }
    }
}

/// A fitted surface at its point: a graph over the plane of a given normal.
struct Graph {
    /// Slopes along the frame's tangent and bitangent.
    slopes: [f64; 2],
    /// Second derivatives (xx, xy, yy), 1 over the mesh's unit; convex is negative.
    second: [f64; 3],
}

impl Graph {
    /// From what [`solve`] gives for a lane whose neighbours were scaled by `inverse`.
    fn new<const N: usize>(fit: &Fit<N>, l: usize, inverse: f64) -> Self {
        let g = fit.bend(l);
        let c = [0, 1, 2, 3, 4].map(|i| fit.height[i][l] - g * fit.square[i][l]);
        Graph { slopes: [c[0], c[1]], second: [c[2], c[3], c[4]].map(|c| c * inverse) }
    }

    /// Root of the sum of squares of all second derivatives.
    fn size(&self) -> f64 {
        let [xx, xy, yy] = self.second;
        (xx * xx + 2.0 * xy * xy + yy * yy).sqrt()
    }

    /// The unit normal, where the graph stands over the plane of the unit normal `n`.
    fn normal(&self, n: Vec3) -> Vec3 {
        let (t, b) = frame(n);
        let [d, e] = self.slopes;
        let normal: DVec3 = n.as_dvec3() - d * t.as_dvec3() - e * b.as_dvec3();
        normal.normalize().as_vec3()
    }

    /// The shape operator, convex positive, in the frame of the given normal: the one of the fitted tangent plane, turned
    /// back by the shortest arc.
    fn shape_operator(&self) -> Sym2 {
        let [d, e] = self.slopes;
        // Second form over the length of the normal, convex positive.
        let length = (1.0 + d * d + e * e).sqrt();
        let second = self.second.map(|c| -c / length);

        // Tangent vectors u whose pictures under the arc are x and y: with n = (-d, -e, 1) / |n| the arc from z to n takes x
        // to a vector whose plane coordinates are these.
        let (nx, ny, nz) = (-d / length, -e / length, 1.0 / length);
        let k = 1.0 / (1.0 + nz);
        let u = [1.0 - nx * nx * k, -nx * ny * k];
        let v = [-nx * ny * k, 1.0 - ny * ny * k];
        let form = |p: [f64; 2], q: [f64; 2]| {
            second[0] * p[0] * q[0] + second[1] * (p[0] * q[1] + p[1] * q[0]) + second[2] * p[1] * q[1]
        };
        Sym2 { xx: form(u, u) as f32, xy: form(u, v) as f32, yy: form(v, v) as f32 }
    }
}

/// `to += a b` in every lane.
#[inline(always)]
fn add_product(to: &mut Lanes, a: Lanes, b: Lanes) {
    for (l, to) in to.iter_mut().enumerate() {
        *to += a[l] * b[l];
    }
}

/// `to -= a b` in every lane.
#[inline(always)]
fn subtract_product(to: &mut Lanes, a: Lanes, b: Lanes) {
    for (l, to) in to.iter_mut().enumerate() {
        *to -= a[l] * b[l];
    }
}

/// `to *= a` in every lane.
#[inline(always)]
fn multiply(to: &mut Lanes, a: Lanes) {
    for (l, to) in to.iter_mut().enumerate() {
        *to *= a[l];
    }
}

/// Coefficients in every lane.
struct Fit<const N: usize> {
    /// Of `z`, and of `z²/2`.
    height: [Lanes; N],
    square: [Lanes; N],
    /// Rows of the normal equations' inverse, of the second derivatives xx, xy, yy.
    inverse: [[Lanes; N]; 3],
    /// Whether the neighbours determine them.
    solved: [bool; LANES],
}

impl<const N: usize> Fit<N> {
    /// The g of `g z²`. The coefficients are linear in it, and it follows from them: k where the surface bends to one side
    /// only, as a sphere (both curvatures k) or a cylinder (k and 0), and less the more it is a saddle, whose height knows
    /// no z².
    fn bend(&self, l: usize) -> f64 {
        let mut g = 0.0;
        for _ in 0..4 {
            let c = [2, 3, 4].map(|i| self.height[i][l] - g * self.square[i][l]);
            let (mean, half) = (0.5 * (c[0] + c[2]), 0.5 * (c[0] - c[2]));
            let apart = (half * half + c[1] * c[1]).sqrt();
            let length = (mean * mean + apart * apart).sqrt().max(f64::MIN_POSITIVE);
            let share = (std::f64::consts::SQRT_2 * mean / length).clamp(-1.0, 1.0);
            g = mean + share * apart;
        }
        g
    }
}

/// Standard deviation of second derivatives, over the mesh's unit: as if what a cubic fit leaves over were noise of all
/// neighbours alike.
#[inline(always)]
fn doubt(group: &Group, fit: &Fit<CUBIC>) -> Lanes {
    let bend: Lanes = std::array::from_fn(|l| fit.bend(l));
    let coefficients: [Lanes; CUBIC] =
        std::array::from_fn(|i| std::array::from_fn(|l| fit.height[i][l] - bend[l] * fit.square[i][l]));
    let mut left = [0.0f64; LANES];
    let mut gains = [[0.0f64; LANES]; 3];
    for [x, y, z] in group.neighbours() {
        let (terms, weights) = terms(x, y, z);
        let mut over: Lanes = std::array::from_fn(|l| z[l] - 0.5 * bend[l] * z[l] * z[l]);
        let mut gain = [[0.0f64; LANES]; 3];
        for i in 0..CUBIC {
            subtract_product(&mut over, coefficients[i], terms[i]);
            for (gain, row) in gain.iter_mut().zip(&fit.inverse) {
                add_product(gain, row[i], terms[i]);
            }
        }
        add_product(&mut left, over, over);
        for (sum, gain) in gains.iter_mut().zip(&mut gain) {
            multiply(gain, weights);
            multiply(gain, weights);
            add_product(sum, *gain, *gain);
        }
    }
    std::array::from_fn(|l| {
        let free = group.counts[l].saturating_sub(CUBIC).max(1) as f64;
        let gain = gains[0][l].max(gains[1][l]).max(gains[2][l]);
        (left[l] / free * gain).sqrt() * group.inverse[l]
    })
}

/// Terms of a fit, of which the first ones are taken, and weights of neighbours in one through the point: over their squared
/// distance.
#[inline(always)]
fn terms(x: &Lanes, y: &Lanes, z: &Lanes) -> ([Lanes; FREE], Lanes) {
    let mut terms = [[1.0f64; LANES]; FREE];
    let mut weights = [0.0f64; LANES];
    for l in 0..LANES {
        let (x, y, z) = (x[l], y[l], z[l]);
        let (x2, xy, y2) = (x * x, x * y, y * y);
        let monomials = [x, y, 0.5 * x2, xy, 0.5 * y2, x2 * x, x2 * y, x * y2, y2 * y];
        for (term, monomial) in terms.iter_mut().zip(monomials) {
            term[l] = monomial;
        }
        weights[l] = 1.0 / (x2 + y2 + z * z + NEAREST);
    }
    (terms, weights)
}

/// Least squares of `z` and of `z²/2` on `x, y, x²/2, xy, y²/2`, with nine coefficients the cubic monomials, each neighbour
/// over its squared distance, and with ten a constant, all neighbours and the point itself alike: normal equations by Cholesky, in
/// every lane.
#[inline(always)]
fn solve<const N: usize>(group: &Group) -> Fit<N> {
    let mut matrix = [[[0.0f64; LANES]; N]; N];
    let mut rights = [[[0.0f64; LANES]; N]; 5];
    for (row, right) in [2, 3, 4].into_iter().zip(&mut rights[2..]) {
        right[row] = [1.0; LANES];
    }
    if N == FREE {
        matrix[N - 1][N - 1] = [1.0; LANES];
    }
    for (i, [x, y, z]) in group.neighbours().iter().enumerate() {
        let (mut all, mut weights) = terms(x, y, z);
        if N == FREE {
            weights = std::array::from_fn(|l| f64::from(u8::from(i < group.counts[l])));
        }
        all.iter_mut().for_each(|term| multiply(term, weights));
        let goals: [Lanes; 2] = [
            std::array::from_fn(|l| weights[l] * z[l]),
            std::array::from_fn(|l| 0.5 * weights[l] * z[l] * z[l]),
        ];
        for i in 0..N {
            for (right, goal) in rights.iter_mut().zip(goals) {
                add_product(&mut right[i], all[i], goal);
            }
            // Row i from the diagonal on.
            for j in i..N {
                add_product(&mut matrix[i][j], all[i], all[j]);
            }
        }
    }
    let mut solved = [true; LANES];
    for i in 0..N {
        let before = matrix[i][i];
        for k in 0..i {
            let above = matrix[k][i];
            subtract_product(&mut matrix[i][i], above, above);
        }
        for (l, pivot) in matrix[i][i].iter_mut().enumerate() {
            // Below, the column is a combination of those before it to all digits that count.
            solved[l] &= *pivot > 1e-9 * before[l];
            *pivot = 1.0 / pivot.sqrt();
        }
        for j in i + 1..N {
            for k in 0..i {
                let (a, b) = (matrix[k][i], matrix[k][j]);
                subtract_product(&mut matrix[i][j], a, b);
            }
            let pivot = matrix[i][i];
            multiply(&mut matrix[i][j], pivot);
        }
    }
    for right in &mut rights {
        for i in 0..N {
            for k in 0..i {
                let known = right[k];
                subtract_product(&mut right[i], matrix[k][i], known);
            }
            multiply(&mut right[i], matrix[i][i]);
        }
        for i in (0..N).rev() {
            for k in i + 1..N {
                let known = right[k];
                subtract_product(&mut right[i], matrix[i][k], known);
            }
            multiply(&mut right[i], matrix[i][i]);
        }
    }
    let [height, square, xx, xy, yy] = rights;
    Fit { height, square, inverse: [xx, xy, yy], solved }
}
