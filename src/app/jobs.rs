//! Work in the background: a thread, its progress, and a channel of results.

use crate::progress::Progress;
use anyhow::{Result, anyhow};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender, TryRecvError};

/// Work on a thread of its own that gives results of type `T`, one or several. Dropping the job cancels it: the thread ends at the work's
/// next look at its progress, and what it still gives is lost.
pub struct Job<T> {
    progress: Arc<Progress>,
    results: Receiver<T>,
}

/// What [`Job::poll`] finds.
#[derive(Debug, PartialEq)]
pub enum Polled<T> {
    /// The next result.
    Result(T),
    /// Nothing yet.
    Pending,
    /// All results were taken and the thread has ended.
    Ended,
}

/// Hands results to the window and has it drawn anew, also when the work is over.
pub struct Results<T> {
    sender: Option<Sender<T>>,
    window: egui::Context,
}

impl<T> Results<T> {
    /// Hands one result over.
    pub fn give(&self, result: T) {
        // A window that went on to other work takes no result.
        let _ = self.sender.as_ref().map(|sender| sender.send(result));
        self.window.request_repaint();
    }
}

impl<T> Drop for Results<T> {
    fn drop(&mut self) {
        self.sender = None; // the window is to find the channel closed
        self.window.request_repaint();
    }
}

impl<T: Send + 'static> Job<T> {
    /// Starts `work` for a window.
    pub fn start(window: &egui::Context, work: impl FnOnce(&Progress, &Results<T>) + Send + 'static) -> Self {
        let progress = Arc::new(Progress::new());
        let (sender, results) = mpsc::channel();
        let (given, of_work) = (Results { sender: Some(sender), window: window.clone() }, progress.clone());
        std::thread::spawn(move || work(&of_work, &given));
        Job { progress, results }
    }
}

impl<T> Job<T> {
    /// The next result, without waiting.
    pub fn poll(&self) -> Polled<T> {
        match self.results.try_recv() {
            Ok(result) => Polled::Result(result),
            Err(TryRecvError::Empty) => Polled::Pending,
            Err(TryRecvError::Disconnected) => Polled::Ended,
        }
    }

    /// The stage and how much of it is done, in [0, 1]; `None` where the total is not known.
    pub fn progress(&self) -> (&'static str, Option<f32>) {
        let (stage, done, total) = self.progress.snapshot();
        (stage, (total > 0).then(|| (done as f64 / total as f64).min(1.0) as f32))
    }
}

impl<T> Drop for Job<T> {
    fn drop(&mut self) {
        self.progress.cancel();
    }
}

/// Frees what is not needed any more on a thread of its own: much memory is not given back at once.
pub fn discard(value: impl Send + 'static) {
    std::thread::spawn(move || drop(value));
}

/// The one result of a job that has ended.
pub fn outcome<T>(polled: Polled<Result<T>>) -> Result<T> {
    match polled {
        Polled::Result(result) => result,
        Polled::Pending | Polled::Ended => Err(anyhow!("the work in the background broke off, a fault of octetra")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn wait<T>(job: &Job<T>) -> Polled<T> {
        loop {
            match job.poll() {
                Polled::Pending => std::thread::sleep(Duration::from_millis(1)),
                found => return found,
            }
        }
    }

    #[test]
    fn results_come_in_order_and_then_the_end() {
        let job = Job::start(&egui::Context::default(), |progress, results| {
            progress.begin("counting", 4);
            progress.add(1);
            (0..3).for_each(|i| results.give(i));
        });
        assert_eq!((0..3).map(|_| wait(&job)).collect::<Vec<_>>(), [0, 1, 2].map(Polled::Result));
        assert_eq!(wait(&job), Polled::Ended);
        assert_eq!(job.progress(), ("counting", Some(0.25)));
    }

    #[test]
    fn dropping_cancels() {
        let (sender, receiver) = mpsc::channel();
        let job: Job<()> = Job::start(&egui::Context::default(), move |progress, _| {
            while progress.check().is_ok() {
                std::thread::sleep(Duration::from_millis(1));
            }
            let _ = sender.send("stopped");
        });
        drop(job);
        assert_eq!(receiver.recv_timeout(Duration::from_secs(10)), Ok("stopped"));
    }

    #[test]
    fn work_that_panics_ends() {
        let job: Job<()> = Job::start(&egui::Context::default(), |_, _| panic!("meant to be"));
        assert_eq!(wait(&job), Polled::Ended);
    }
}
