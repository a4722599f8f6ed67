//! Vectors and matrices as shaders lay them out. Uniforms are structs of these; a derive works out where each member lies, and
//! the tests of the layouts compare that with what the shaders' texts say.

use encase::internal::WriteInto;
use encase::{ShaderType, UniformBuffer};
use glam::{Mat3, Mat4, Vec4};

use crate::reference::BoundTexture;

macro_rules! vectors {
    ($($(#[$doc:meta])* $name:ident, $n:literal, $scalar:ty;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub(super) struct $name([$scalar; $n]);

        impl AsRef<[$scalar; $n]> for $name {
            fn as_ref(&self) -> &[$scalar; $n] {
                &self.0
            }
        }

        impl AsMut<[$scalar; $n]> for $name {
            fn as_mut(&mut self) -> &mut [$scalar; $n] {
                &mut self.0
            }
        }

        impl From<[$scalar; $n]> for $name {
            fn from(v: [$scalar; $n]) -> Self {
                Self(v)
            }
        }

        encase::impl_vector!($n, $name, $scalar; using AsRef AsMut From);
    )*};
}

vectors! {
    /// `vec2f`.
    Vec2f, 2, f32;
    /// `vec2u`.
    Vec2u, 2, u32;
    /// `vec4f`.
    Vec4f, 4, f32;
    /// `vec4u`.
    Vec4u, 4, u32;
}

impl From<Vec4> for Vec4f {
    fn from(v: Vec4) -> Self {
        Self(v.to_array())
    }
}

/// `mat4x4f`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Mat4f([[f32; 4]; 4]);

impl AsRef<[[f32; 4]; 4]> for Mat4f {
    fn as_ref(&self) -> &[[f32; 4]; 4] {
        &self.0
    }
}

impl AsMut<[[f32; 4]; 4]> for Mat4f {
    fn as_mut(&mut self) -> &mut [[f32; 4]; 4] {
        &mut self.0
    }
}

impl From<[[f32; 4]; 4]> for Mat4f {
    fn from(m: [[f32; 4]; 4]) -> Self {
        Self(m)
    }
}

impl From<Mat4> for Mat4f {
    fn from(m: Mat4) -> Self {
        Self(m.to_cols_array_2d())
    }
}

encase::impl_matrix!(4, 4, Mat4f, f32; using AsRef AsMut From);

/// Two rows for each texture: of its transform, and in the first one's w which UV set.
pub(super) fn transforms<const ROWS: usize>(slots: &[&BoundTexture]) -> [Vec4f; ROWS] {
    debug_assert_eq!(2 * slots.len(), ROWS, "two rows a texture");
    std::array::from_fn(|row| {
        let slot = slots[row / 2];
        let Mat3 { x_axis, y_axis, z_axis } = slot.transform;
        if row % 2 == 0 {
            [x_axis.x, y_axis.x, z_axis.x, slot.uv_set as f32].into()
        } else {
            [x_axis.y, y_axis.y, z_axis.y, 0.0].into()
        }
    })
}

/// A uniform's bytes.
pub(super) fn uniform_bytes(uniform: &(impl ShaderType + WriteInto)) -> Vec<u8> {
    let mut buffer = UniformBuffer::new(Vec::new());
    buffer.write(uniform).expect("a vector grows as it must");
    buffer.into_inner()
}
