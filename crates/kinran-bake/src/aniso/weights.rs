//! How much each texel of level 0 counts in a filter.

/// Weights of the texels of level 0, from 1 to 65535 in units that do not matter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Weights {
    width: u32,
    of: Vec<u16>,
}

impl Weights {
    /// Weights of a level 0 of this size, row after row; zero counts as one, so that every footprint has an average. `None`
    /// where all are the same, which is to have none.
    ///
    /// # Panics
    /// When there are not as many as texels.
    pub fn new(size: (u32, u32), mut of: Vec<u16>) -> Option<Self> {
        assert_eq!(of.len(), size.0 as usize * size.1 as usize, "a weight for each of {size:?} texels");
        of.iter_mut().for_each(|weight| *weight = (*weight).max(1));
        let first = *of.first()?;
        let varies = of.iter().any(|weight| *weight != first);
        varies.then_some(Weights { width: size.0, of })
    }

    /// Level 0's size.
    pub fn size(&self) -> (u32, u32) {
        (self.width, (self.of.len() / self.width as usize) as u32)
    }

    /// That of the texel in column `x` of row `y`.
    ///
    /// # Panics
    /// When there is no such texel.
    pub fn at(&self, x: u32, y: u32) -> u16 {
        self.row(y, x, 1)[0]
    }

    /// Those of texels `x0 .. x0 + len` of row `y`.
    #[inline(always)]
    pub(crate) fn row(&self, y: u32, x0: u32, len: usize) -> &[u16] {
        &self.of[y as usize * self.width as usize + x0 as usize..][..len]
    }
}

/// A weight as a share of the largest one.
#[inline(always)]
pub(crate) fn share(weight: u16) -> f32 {
    f32::from(weight) * (1.0 / 65535.0)
}
