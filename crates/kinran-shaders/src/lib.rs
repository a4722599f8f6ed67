//! The formulas of `kinran-shading` as shader text, without a GPU API.
