//! Eight floats that move together: one output texel a lane.

use std::array::from_fn;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use glam::{Vec3, vec3};

/// Lanes of an [`F8`]: those of an AVX2 vector. Of sixteen, the sums and the frames of a filter do not fit into its
/// sixteen registers.
pub(crate) const LANES: usize = 8;

/// Eight floats; every operation is IEEE-exact per lane and never fused, so that all instruction sets give
/// the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub(crate) struct F8(pub(crate) [f32; LANES]);

impl F8 {
    #[inline(always)]
    pub(crate) fn splat(v: f32) -> Self {
        F8([v; LANES])
    }

    #[inline(always)]
    pub(crate) fn map(self, f: impl Fn(f32) -> f32) -> Self {
        F8(from_fn(|l| f(self.0[l])))
    }

    #[inline(always)]
    pub(crate) fn max(self, o: f32) -> Self {
        self.map(|v| if v > o { v } else { o })
    }

    /// The smaller in each lane.
    #[inline(always)]
    pub(crate) fn min_of(self, o: Self) -> Self {
        F8(from_fn(|l| if self.0[l] < o.0[l] { self.0[l] } else { o.0[l] }))
    }

    /// The larger in each lane.
    #[inline(always)]
    pub(crate) fn max_of(self, o: Self) -> Self {
        F8(from_fn(|l| if self.0[l] > o.0[l] { self.0[l] } else { o.0[l] }))
    }

    #[inline(always)]
    pub(crate) fn recip(self) -> Self {
        self.map(|v| 1.0 / v)
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        self.map(f32::sqrt)
    }

    /// `yes` in lanes that are below zero, `no` in the others.
    #[inline(always)]
    pub(crate) fn where_negative(self, yes: Self, no: Self) -> Self {
        F8(from_fn(|l| if self.0[l] < 0.0 { yes.0[l] } else { no.0[l] }))
    }
}

macro_rules! lane_wise {
    ($($op:ident $method:ident),*) => {$(
        impl $op for F8 {
            type Output = F8;
            #[inline(always)]
            fn $method(self, o: F8) -> F8 {
                F8(from_fn(|l| self.0[l].$method(o.0[l])))
            }
        }
    )*};
}
lane_wise!(Add add, Sub sub, Mul mul, Div div);

impl AddAssign for F8 {
    #[inline(always)]
    fn add_assign(&mut self, o: F8) {
        *self = *self + o;
    }
}

impl Neg for F8 {
    type Output = F8;
    #[inline(always)]
    fn neg(self) -> F8 {
        self.map(|v| -v)
    }
}

/// Eight vectors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct V8 {
    pub(crate) x: F8,
    pub(crate) y: F8,
    pub(crate) z: F8,
}

impl V8 {
    #[inline(always)]
    pub(crate) fn dot(self, o: V8) -> F8 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    pub(crate) fn cross(self, o: V8) -> V8 {
        V8 { x: self.y * o.z - o.y * self.z, y: self.z * o.x - o.z * self.x, z: self.x * o.y - o.x * self.y }
    }

    /// Its components along the columns of a frame.
    #[inline(always)]
    pub(crate) fn in_frame(self, [x, y, z]: &[V8; 3]) -> V8 {
        V8 { x: self.dot(*x), y: self.dot(*y), z: self.dot(*z) }
    }

    #[inline(always)]
    pub(crate) fn lane(self, l: usize) -> Vec3 {
        vec3(self.x.0[l], self.y.0[l], self.z.0[l])
    }
}

impl Add for V8 {
    type Output = V8;
    #[inline(always)]
    fn add(self, o: V8) -> V8 {
        V8 { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl Sub for V8 {
    type Output = V8;
    #[inline(always)]
    fn sub(self, o: V8) -> V8 {
        V8 { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

impl Mul<F8> for V8 {
    type Output = V8;
    #[inline(always)]
    fn mul(self, s: F8) -> V8 {
        V8 { x: self.x * s, y: self.y * s, z: self.z * s }
    }
}
