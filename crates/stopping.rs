//! How tests stop work. A test file takes this one in by `#[path = "../../stopping.rs"] mod stopping;`.

use std::fmt::Debug;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use kinran_image::{Cancelled, Tick};

/// Lets work run through, and then stops it at some of its ticks, on one thread and on four. Undisturbed, it must tell of
/// `units`, no more and no less; stopped, it must give an error that `is_cancelled` knows, and no thread may begin another band
/// after its first refusal.
///
/// # Panics
/// Where one of these is not so.
pub(crate) fn assert_stops<T: Send, E: Debug + Send>(
    name: &str,
    units: u64,
    is_cancelled: impl Fn(&E) -> bool,
    work: impl Fn(&Tick<'_>) -> Result<T, E> + Sync,
) {
    for threads in [1, 4] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let stopped_at = |refused: u64| {
            let (ticks, told) = (AtomicU64::new(0), AtomicU64::new(0));
            let tick = |units: u64| {
                told.fetch_add(units, Relaxed);
                if ticks.fetch_add(1, Relaxed) + 1 < refused { Ok(()) } else { Err(Cancelled) }
            };
            let result = pool.install(|| work(&tick));
            (result, ticks.into_inner(), told.into_inner())
        };

        let (result, ticks, told) = stopped_at(u64::MAX);
        assert!(result.is_ok(), "{name}, {threads} threads, undisturbed: {:?}", result.err());
        assert_eq!(told, units, "{name}, {threads} threads: units told in {ticks} ticks");
        assert!(ticks > 1, "{name}: told in one tick, so that nothing can stop it");

        for refused in [1, 2, ticks / 3, ticks / 2, ticks - 1, ticks] {
            let refused = refused.max(1);
            let (result, got, _) = stopped_at(refused);
            let at = format!("{name}, {threads} threads, stopped at tick {refused} of {ticks}");
            match result {
                Ok(_) => panic!("{at}: a result came out"),
                Err(error) => assert!(is_cancelled(&error), "{at}: {error:?}"),
            }
            assert!(got < refused + threads as u64, "{at}: it went on to tick {got}");
        }
    }
}
