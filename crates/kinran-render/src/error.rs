use kinran_image::Cancelled;

/// Why a picture could not be rendered or compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// A setting is outside its range.
    #[error("{name} is {value}: {fix}")]
    Setting {
        /// The setting's name.
        name: &'static str,
        /// Its value.
        value: String,
        /// What it should be.
        fix: &'static str,
    },
    /// The scene cannot be rendered as it is.
    #[error("{0}")]
    Scene(String),
    /// There is no GPU, or it cannot do what is asked of it.
    #[error("{0}")]
    Gpu(String),
    /// A shader does not compile; the compiler's message.
    #[error("{0}")]
    Shader(String),
    /// Two pictures cannot be compared pixel by pixel.
    #[error("the pictures have {a} and {b} pixels; compare pictures of the same size")]
    SizeMismatch {
        /// Pixels of the first.
        a: usize,
        /// Pixels of the second.
        b: usize,
    },
    /// A [`Tick`](kinran_image::Tick) stopped the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
