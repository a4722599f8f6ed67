//! The command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    clean_up_when_interrupted();
    kinran_cli::cli::run(std::env::args_os())
}

/// From now on Ctrl-C, and on Unix a polite kill, leave nothing unfinished behind. Where no handler can be had the next
/// run removes it. Exit codes are as shells have them: 128 and the number of the signal.
fn clean_up_when_interrupted() {
    fn end(signal: i32) -> ! {
        kinran_image::remove_unfinished();
        std::process::exit(128 + signal)
    }
    #[cfg(unix)]
    {
        use signal_hook::consts::{SIGINT, SIGTERM};
        if let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) {
            std::thread::spawn(move || {
                if let Some(signal) = signals.forever().next() {
                    end(signal);
                }
            });
        }
    }
    #[cfg(windows)]
    let _ = ctrlc::set_handler(|| end(2));
}
