//! Progress on standard error, with an ETA, where a person is looking; and Ctrl-C.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use crumple::Watch;
use indicatif::{ProgressBar, ProgressStyle};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// One bar at a time, one a stage.
pub(crate) struct Terminal {
    hidden: bool,
    bar: Mutex<Option<(&'static str, ProgressBar)>>,
}

impl Terminal {
    /// Listens to Ctrl-C from now on: the first asks for a clean end, the second ends at once.
    pub(crate) fn new(hidden: bool) -> Self {
        let listening = ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                std::process::exit(130);
            }
        });
        // Without a handler Ctrl-C still ends the program, only less cleanly.
        drop(listening);
        Self { hidden, bar: Mutex::new(None) }
    }

    /// Clears the bar that is drawn last.
    pub(crate) fn finish(&self) {
        if let Ok(mut bar) = self.bar.lock()
            && let Some((_, bar)) = bar.take()
        {
            bar.finish_and_clear();
        }
    }
}

impl Watch for Terminal {
    fn step(&self, stage: &'static str, done: usize, total: usize) {
        if self.hidden {
            return;
        }
        let Ok(mut bar) = self.bar.lock() else { return };
        let same = bar.as_ref().is_some_and(|(shown, _)| *shown == stage);
        if !same {
            if let Some((_, old)) = bar.take() {
                old.finish_and_clear();
            }
            let fresh = ProgressBar::new(total as u64);
            if let Ok(style) = ProgressStyle::with_template("{prefix:>24} {wide_bar} {pos}/{len}{msg}, {eta} left") {
                fresh.set_style(style);
            }
            fresh.set_prefix(stage);
            *bar = Some((stage, fresh));
        }
        if let Some((_, bar)) = bar.as_ref() {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
        }
    }

    fn slices(&self, done: usize, expected: usize) {
        // Eigenpairs come a slice at a time, so their bar moves in steps: this says how many steps there are.
        if let Ok(bar) = self.bar.lock()
            && let Some((_, bar)) = bar.as_ref()
        {
            bar.set_message(format!(", slice {done} of {expected}"));
        }
    }

    fn stopped(&self) -> bool {
        INTERRUPTED.load(Ordering::SeqCst)
    }
}
