//! How long work tells of its progress, and how it is stopped.

/// The work was stopped by who asked for it: the [`Tick`] that it was given said so.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// What long work calls after each of its bands, from any thread, with the units done since its last call; what a unit is,
/// and how many there are in all, the work says. No units are told where it only asks whether to go on. An `Err` ends the
/// work as soon as each thread has finished its band: it gives [`Cancelled`] back and nothing half-done.
pub type Tick<'a> = dyn Fn(u64) -> Result<(), Cancelled> + Sync + 'a;

/// A [`Tick`] for callers who neither watch nor stop.
///
/// # Errors
/// Never.
pub fn untold(_: u64) -> Result<(), Cancelled> {
    Ok(())
}
