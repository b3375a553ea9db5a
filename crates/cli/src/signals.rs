//! Signals: interrupts, requests to terminate, and the limit of the file size.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::exit::INTERRUPTED;
use crate::tell;

/// Whether all that is left to do may be dropped: the results are complete.
static COMPLETE: AtomicBool = AtomicBool::new(false);

/// Requests a checkpoint on the first interrupt, SIGTERM or SIGHUP, and ends the program on the
/// second. Signals that are ignored at the start, such as SIGHUP after `nohup`, stay ignored.
pub fn watch_for_interrupt(stop: Arc<AtomicBool>) {
    let ignored = Ignored::find();
    // Without a handler an interrupt ends the program, and the last checkpoint remains.
    let _ = ctrlc::set_handler(move || {
        if COMPLETE.load(Ordering::Relaxed) {
            stop.store(true, Ordering::Relaxed);
            return;
        }
        if stop.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(INTERRUPTED));
        }
        tell!(
            "interrupted: writing a checkpoint after this step (interrupt again to stop immediately)"
        );
    });
    ignored.restore();
}

/// Says that the results are complete: from now on an interrupt sets the flag alone.
pub fn results_are_complete() {
    COMPLETE.store(true, Ordering::Relaxed);
}

/// Signals that the parent of this process has set to be ignored.
struct Ignored(#[cfg(unix)] Vec<libc::c_int>);

#[cfg(unix)]
impl Ignored {
    fn find() -> Ignored {
        let ignored = |signal: &libc::c_int| {
            // SAFETY: a null pointer changes nothing, and `sigaction` fills `found`, for which all
            // zeros are a valid value.
            unsafe {
                let mut found: libc::sigaction = std::mem::zeroed();
                libc::sigaction(*signal, std::ptr::null(), &raw mut found) == 0
                    && found.sa_sigaction == libc::SIG_IGN
            }
        };
        Ignored([libc::SIGINT, libc::SIGTERM, libc::SIGHUP].into_iter().filter(ignored).collect())
    }

    /// Replaces the handlers that have been set since.
    fn restore(self) {
        for signal in self.0 {
            // SAFETY: a signal that is ignored calls no code of this program.
            unsafe { libc::signal(signal, libc::SIG_IGN) };
        }
    }
}

#[cfg(not(unix))]
impl Ignored {
    fn find() -> Ignored {
        Ignored()
    }
    fn restore(self) {}
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
