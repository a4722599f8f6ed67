//! BC5 of normals: the two channels in turn, each texel by the blended normal.

use glam::{Vec3, vec3};
use kinran_shading::detail::{rnm, rnm_inverse};
use kinran_shading::normal_from_xy;

use super::{BlockGoal, TEXELS, bc4, lower, sum};

/// How often both channels are fitted. The third round gains less than a hundredth.
const ROUNDS: usize = 2;

/// Steps of the two ends of a channel that are tried.
const STEPS: [(i32, i32); 6] = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1)];

/// A channel of a block: its ends, the larger first, and what each texel takes of them.
#[derive(Clone, Copy)]
struct Channel {
    ends: [i32; 2],
    choices: [i32; TEXELS],
}

impl Channel {
    /// `None` for six values with black and white: for blocks that reach both, and seldom.
    #[inline(always)]
    fn read(block: &[u8]) -> Option<Self> {
        let ends = [i32::from(block[0]), i32::from(block[1])];
        let mut bytes = [0; 8];
        bytes[..6].copy_from_slice(&block[2..8]);
        let bits = u64::from_le_bytes(bytes);
        let choices = std::array::from_fn(|i| (bits >> (3 * i) & 7) as i32);
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
pub(super) fn choose(block: &mut [u8], goal: &BlockGoal) {
    let (Some(x), Some(y)) = (Channel::read(&block[..8]), Channel::read(&block[8..])) else { return };
    let mut channels = [x, y];
    let normal = |of: &[[f32; TEXELS]; 3], i: usize| normal_from_xy(of[0][i], of[1][i]);
    let target: [Vec3; TEXELS] = std::array::from_fn(|i| normal(&goal.t, i));
    let detail: [Vec3; TEXELS] = std::array::from_fn(|i| vec3(goal.d[0][i], goal.d[1][i], goal.d[2][i]));
    let exact: [Vec3; TEXELS] = std::array::from_fn(|i| rnm_inverse(target[i], detail[i]));
    // Squared distances of the blended normals where one component is `value` and the other what the texel has.
    let errors = |channel: usize, value: f32, other: &[f32; TEXELS]| -> [f32; TEXELS] {
        let mut errors = [0.0; TEXELS];
        for i in 0..TEXELS {
            let (x, y) = if channel == 0 { (value, other[i]) } else { (other[i], value) };
            let apart = rnm(normal_from_xy(x, y), detail[i]) - target[i];
            errors[i] = apart.length_squared() * goal.inside[i];
        }
        errors
    };
    for _ in 0..ROUNDS {
        let before = channels.map(|channel| channel.ends);
        for c in 0..2 {
            let other = channels[1 - c].components();
            let error = |ends: [i32; 2]| {
                let mut least = [f32::INFINITY; TEXELS];
                for value in bc4::values(ends) {
                    least = lower(&least, &errors(c, component(value), &other));
                }
                sum(&least)
            };
            let choices = |ends: [i32; 2]| {
                let (mut least, mut choices) = ([f32::INFINITY; TEXELS], [0_i32; TEXELS]);
                for (choice, value) in bc4::values(ends).into_iter().enumerate() {
                    let errors = errors(c, component(value), &other);
                    for i in 0..TEXELS {
                        let better = errors[i] < least[i];
                        choices[i] = if better { choice as i32 } else { choices[i] };
                        least[i] = if better { errors[i] } else { least[i] };
                    }
                }
                choices
            };
            let mut ends = channels[c].ends;
            let mut least = error(ends);
            // The squared change of the blended normal by the component, at the exact solution.
            let mut weight = [0.0; TEXELS];
            let mut v = [0.0; TEXELS];
            const H: f32 = 1e-2;
            for i in 0..TEXELS {
                let at = |step: f32| {
                    let (x, y) = (exact[i].x, exact[i].y);
                    let (x, y) = if c == 0 { (x + step, y) } else { (x, y + step) };
                    rnm(normal_from_xy(x, y), detail[i])
                };
                weight[i] = ((at(H) - at(-H)) / (2.0 * H)).length_squared() * goal.inside[i];
                v[i] = ((exact[i][c] * 0.5 + 0.5) * 254.0 + 1.0) / 255.0;
            }
            let fitted = bc4::fit(&choices(ends), &v, &weight);
            let fitted_error = error(fitted);
            if fitted_error < least {
                (ends, least) = (fitted, fitted_error);
            }
            for (a, b) in STEPS {
                let moved = [ends[0] + a, ends[1] + b];
                if moved[0] <= 255 && moved[1] >= 0 && moved[0] >= moved[1] {
                    let moved_error = error(moved);
                    if moved_error < least {
                        (ends, least) = (moved, moved_error);
                    }
                }
            }
            channels[c] = Channel { ends, choices: choices(ends) };
        }
        if channels.map(|channel| channel.ends) == before {
            break;
        }
    }
    for (block, channel) in block.chunks_exact_mut(8).zip(channels) {
        bc4::pack(block, channel.ends, &channel.choices);
    }
}
