//! Long work in the terminal: a bar while it runs (none where there is no terminal), Ctrl-C stops it.

use crate::progress::Progress;
use anyhow::Result;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, LazyLock};
use std::time::Duration;

/// What Ctrl-C cancels: all work of the program.
static PROGRESS: LazyLock<Arc<Progress>> = LazyLock::new(|| {
    let progress = Arc::new(Progress::new());
    let cancelled = progress.clone();
    // The first Ctrl-C asks the work to stop; the next ends the program, and so does the first where no work runs (the window).
    // Without a handler it always would, which loses nothing either: files are renamed when they are whole.
    let _ = ctrlc::set_handler(move || {
        if WORKING.load(Relaxed) == 0 || cancelled.check().is_err() {
            std::process::exit(130);
        }
        cancelled.cancel();
    });
    progress
});

/// How many pieces of long work run.
static WORKING: AtomicUsize = AtomicUsize::new(0);

/// Runs `work` with a bar that follows its progress.
pub fn with_bar<T, E: Into<anyhow::Error>>(work: impl FnOnce(&Progress) -> Result<T, E>) -> Result<T> {
    let progress = &**PROGRESS;
    let (done, waiting) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
            if let Ok(style) = ProgressStyle::with_template("{msg:>14} {wide_bar} {percent:>3} %") {
                bar.set_style(style);
            }
            // Nothing is drawn for what takes less than a moment.
            while let Err(RecvTimeoutError::Timeout) = waiting.recv_timeout(Duration::from_millis(150)) {
                let (stage, steps, total) = progress.snapshot();
                bar.set_message(stage);
                bar.set_length(total.max(1));
                bar.set_position(steps.min(total));
            }
            bar.finish_and_clear();
        });
        WORKING.fetch_add(1, Relaxed);
        let result = work(progress);
        WORKING.fetch_sub(1, Relaxed);
        drop(done);
        result.map_err(Into::into)
    })
}
