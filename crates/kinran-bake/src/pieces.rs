//! Units of work whose pieces are others than what is told.

use std::sync::atomic::{AtomicU64, Ordering};

use kinran_image::{Cancelled, Tick};

/// Tells a number of units, in equal parts, over a number of pieces of work.
pub(crate) struct Pieces<'a> {
    tick: &'a Tick<'a>,
    units: u64,
    count: u64,
    done: AtomicU64,
}

impl<'a> Pieces<'a> {
    /// `units` over `count` pieces.
    pub(crate) fn new(tick: &'a Tick<'a>, units: u64, count: usize) -> Self {
        Pieces { tick, units, count: count as u64, done: AtomicU64::new(0) }
    }

    /// One more piece is done; from any thread.
    ///
    /// # Errors
    /// Where the work was stopped.
    pub(crate) fn done(&self) -> Result<(), Cancelled> {
        let before = self.done.fetch_add(1, Ordering::Relaxed);
        let told =
            |pieces: u64| (u128::from(self.units) * u128::from(pieces) / u128::from(self.count)) as u64;
        (self.tick)(told(before + 1) - told(before))
    }
}
