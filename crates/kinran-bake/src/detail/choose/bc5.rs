//! BC5 of normals: the two channels in turn, each texel by the blended normal.

use glam::{Vec3, vec3};
use kinran_shading::detail::{rnm, rnm_inverse};
use kinran_shading::normal_from_xy;
use pulp::Simd;

use super::{BlockGoal, TEXELS, bc4, lanes_of, sum};

/// How often both channels are fitted. The third round gains less than a hundredth.
const ROUNDS: usize = 2;

/// Steps of the two ends of a channel that are tried.
const STEPS: [(i32, i32); 6] = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1)];

/// A channel of a block: its ends, the larger first, and what each texel takes of them.
#[derive(Clone, Copy)]
struct Channel {
    ends: [i32; 2],
    choices: [u32; TEXELS],
}

impl Channel {
    /// `None` for six values with black and white: for blocks that reach both, and seldom.
    #[inline(always)]
    fn read(block: &[u8]) -> Option<Self> {
        let ends = [i32::from(block[0]), i32::from(block[1])];
        let mut bytes = [0; 8];
        bytes[..6].copy_from_slice(&block[2..8]);
        let bits = u64::from_le_bytes(bytes);
        let choices = std::array::from_fn(|i| (bits >> (3 * i) & 7) as u32);
        (ends[0] > ends[1]).then_some(Channel { ends, choices })
    }

    /// What each texel has, −1 to 1.
    #[inline(always)]
    fn components(&self) -> [f32; TEXELS] {
        let values = bc4::values(self.ends).map(component);
        self.choices.map(|choice| values[choice as usize])
    }
}

/// The component of the synthesized normal that a value stands for.
#[inline(always)]
fn component(value: f32) -> f32 {
    bc4::synthesized(value) * 2.0 - 1.0
}

/// Replaces a block by one whose blended normals are nearer to the target's, if there is one.
#[inline(always)]
pub(super) fn choose<S: Simd>(simd: S, block: &mut [u8], goal: &BlockGoal) {
    let (Some(x), Some(y)) = (Channel::read(&block[..8]), Channel::read(&block[8..])) else { return };
    let mut channels = [x, y];
    let normal = |of: &[[f32; TEXELS]; 3], i: usize| normal_from_xy(of[0][i], of[1][i]);
    let target: [Vec3; TEXELS] = std::array::from_fn(|i| normal(&goal.t, i));
    let detail: [Vec3; TEXELS] = std::array::from_fn(|i| vec3(goal.d[0][i], goal.d[1][i], goal.d[2][i]));
    let exact: [Vec3; TEXELS] = std::array::from_fn(|i| rnm_inverse(target[i], detail[i]));
    let normals = Normals {
        target: planes(&target),
        detail: planes(&detail),
        inside: goal.gain[0],
        exact: planes(&exact),
    };
    for _ in 0..ROUNDS {
        let before = channels.map(|channel| channel.ends);
        for c in 0..2 {
            let other = channels[1 - c].components();
            let mut ends = channels[c].ends;
            let (mut least, mut choices) = normals.nearest(simd, c, ends, &other);
            let v = normals.exact[c].map(|v| ((v * 0.5 + 0.5) * 254.0 + 1.0) * (1.0 / 255.0));
            let fitted = bc4::fit(simd, &choices, &v, &normals.weight(c, &exact, &detail));
            let (error, fitted_choices) = normals.nearest(simd, c, fitted, &other);
            if error < least {
                (ends, least, choices) = (fitted, error, fitted_choices);
            }
            for (a, b) in STEPS {
                let moved = [ends[0] + a, ends[1] + b];
                if moved[0] <= 255 && moved[1] >= 0 && moved[0] >= moved[1] {
                    let (error, moved_choices) = normals.nearest(simd, c, moved, &other);
                    if error < least {
                        (ends, least, choices) = (moved, error, moved_choices);
                    }
                }
            }
            channels[c] = Channel { ends, choices };
        }
        if channels.map(|channel| channel.ends) == before {
            break;
        }
    }
    for (block, channel) in block.chunks_exact_mut(8).zip(channels) {
        bc4::pack(block, channel.ends, &channel.choices);
    }
}

fn planes(normals: &[Vec3; TEXELS]) -> [[f32; TEXELS]; 3] {
    std::array::from_fn(|c| normals.map(|n| n[c]))
}

/// The normals of a block.
struct Normals {
    target: [[f32; TEXELS]; 3],
    detail: [[f32; TEXELS]; 3],
    /// The exact solution.
    exact: [[f32; TEXELS]; 3],
    /// 1 in the image, 0 outside.
    inside: [f32; TEXELS],
}

impl Normals {
    /// Squared change of the blended normal by one component of `s`, at the exact solution.
    fn weight(&self, channel: usize, exact: &[Vec3; TEXELS], detail: &[Vec3; TEXELS]) -> [f32; TEXELS] {
        const H: f32 = 1e-2;
        std::array::from_fn(|i| {
            let at = |step: f32| {
                let (x, y) = (exact[i].x, exact[i].y);
                let (x, y) = if channel == 0 { (x + step, y) } else { (x, y + step) };
                rnm(normal_from_xy(x, y), detail[i])
            };
            ((at(H) - at(-H)) / (2.0 * H)).length_squared() * self.inside[i]
        })
    }

    /// Which of eight components each texel's blended normal is nearest with, where the other component is `other`; in
    /// lanes what [`normal_from_xy`] and [`rnm`] do.
    #[inline(always)]
    fn nearest<S: Simd>(
        &self,
        simd: S,
        channel: usize,
        ends: [i32; 2],
        other: &[f32; TEXELS],
    ) -> (f32, [u32; TEXELS]) {
        let (one, zero) = (simd.splat_f32s(1.0), simd.splat_f32s(0.0));
        let (mut errors, mut choices) = ([0.0; TEXELS], [0; TEXELS]);
        let components = bc4::values(ends).map(component);
        for part in 0..TEXELS / S::F32_LANES {
            let [dx, dy, dz] = lanes_of_each::<S>(&self.detail, part);
            let [tx, ty, tz] = lanes_of_each::<S>(&self.target, part);
            let inside = lanes_of::<S>(&self.inside, part);
            let other = lanes_of::<S>(other, part);
            let (mut least, mut choice) = (simd.splat_f32s(f32::INFINITY), simd.splat_u32s(0));
            for (i, component) in components.into_iter().enumerate() {
                let component = simd.splat_f32s(component);
                let (x, y) = if channel == 0 { (component, other) } else { (other, component) };
                let flat = simd.add_f32s(simd.mul_f32s(x, x), simd.mul_f32s(y, y));
                let scale = simd.div_f32s(one, simd.sqrt_f32s(simd.max_f32s(flat, one)));
                let (x, y) = (simd.mul_f32s(x, scale), simd.mul_f32s(y, scale));
                let z = simd.sqrt_f32s(simd.max_f32s(simd.sub_f32s(one, flat), zero));
                let z = simd.add_f32s(z, one);
                let level = simd.add_f32s(simd.mul_f32s(x, dx), simd.mul_f32s(y, dy));
                let by = simd.div_f32s(simd.sub_f32s(simd.mul_f32s(z, dz), level), z);
                let a = simd.sub_f32s(simd.add_f32s(simd.mul_f32s(x, by), dx), tx);
                let b = simd.sub_f32s(simd.add_f32s(simd.mul_f32s(y, by), dy), ty);
                let c = simd.sub_f32s(simd.sub_f32s(simd.mul_f32s(z, by), dz), tz);
                let ab = simd.add_f32s(simd.mul_f32s(a, a), simd.mul_f32s(b, b));
                let error = simd.mul_f32s(simd.add_f32s(ab, simd.mul_f32s(c, c)), inside);
                let nearer = simd.less_than_f32s(error, least);
                least = simd.select_f32s(nearer, error, least);
                choice = simd.select_u32s(nearer, simd.splat_u32s(i as u32), choice);
            }
            S::as_mut_simd_f32s(&mut errors).0[part] = least;
            S::as_mut_simd_u32s(&mut choices).0[part] = choice;
        }
        (sum(&errors), choices)
    }
}

#[inline(always)]
fn lanes_of_each<S: Simd>(planes: &[[f32; TEXELS]; 3], part: usize) -> [S::f32s; 3] {
    [lanes_of::<S>(&planes[0], part), lanes_of::<S>(&planes[1], part), lanes_of::<S>(&planes[2], part)]
}
