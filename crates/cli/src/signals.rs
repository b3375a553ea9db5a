//! Signals: interrupts, requests to terminate, and the limit of the file size.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::exit::INTERRUPTED;
use crate::tell;

/// Requests a checkpoint on the first interrupt, SIGTERM or SIGHUP, and ends the program on the
/// second.
pub fn watch_for_interrupt(stop: Arc<AtomicBool>) {
    // Without a handler an interrupt ends the program, and the last checkpoint remains.
    let _ = ctrlc::set_handler(move || {
        if stop.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(INTERRUPTED));
        }
        tell!(
            "interrupted: writing a checkpoint after this step (interrupt again to stop immediately)"
        );
    });
}

/// Turns a write beyond the limit of the file size (`ulimit -f`) into an error of that write. By
/// default the signal SIGXFSZ would end the program without a message.
pub fn survive_file_size_limit() {
    #[cfg(unix)]
    {
        // The handler sets a flag that nobody reads; the write then fails. Without a handler the
        // program ends as before.
        let _ = signal_hook::flag::register(libc::SIGXFSZ, Arc::new(AtomicBool::new(false)));
    }
}
