//! What begins before there is a window, and how long it takes until the model is seen.
//!
//! A window with a graphics card takes a good part of a second to open; meanwhile the files named on the command line are
//! read. With `RUST_LOG=patchwright=info` the log says when the window was open, when the files were read, and when the
//! first picture of them was handed to the graphics card and was finished there, all from the start of the program.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use super::files::{Opening, begin};
use crate::work::Jobs;

/// The workers, with the first files on their way.
pub struct Startup {
    /// The workers.
    pub jobs: Jobs,
    /// The files that are being read.
    pub opening: Option<Opening>,
    window: Arc<OnceLock<egui::Context>>,
    clock: Clock,
}

impl Startup {
    /// Starts the workers and has files read, without a window.
    pub fn begin(files: Vec<PathBuf>) -> Self {
        let clock = Clock { start: Instant::now(), stage: Stage::Waiting };
        let window: Arc<OnceLock<egui::Context>> = Arc::default();
        let wake = Arc::clone(&window);
        // Before there is a window its first frame looks for itself.
        let mut jobs = Jobs::new(move || {
            if let Some(ctx) = wake.get() {
                ctx.request_repaint();
            }
        });
        let opening = begin(&mut jobs, files);
        Self { jobs, opening, window, clock }
    }

    /// There is a window to be woken.
    pub fn enter(self, ctx: &egui::Context) -> (Jobs, Option<Opening>, Clock) {
        let _only_once = self.window.set(ctx.clone());
        self.clock.note("the window was open");
        (self.jobs, self.opening, self.clock)
    }
}

/// Times from the start of the program to its first picture of a model.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    start: Instant,
    stage: Stage,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Waiting,
    Read,
    Drawn,
    Over,
}

impl Clock {
    fn note(&self, what: &str) {
        log::info!("{what} after {:.3} s", self.start.elapsed().as_secs_f64());
    }

    /// Whether anybody still wants to know.
    pub fn runs(&self) -> bool {
        self.stage != Stage::Over && log::log_enabled!(log::Level::Info)
    }

    /// Follows the frames: how many entities there are and how many triangles this frame draws.
    pub fn follow(&mut self, entities: usize, triangles: usize, ctx: &egui::Context, gpu: Option<&wgpu::Device>) {
        if self.stage == Stage::Waiting && entities > 0 {
            self.note("the files were read");
            self.stage = Stage::Read;
        }
        match self.stage {
            Stage::Read if triangles > 0 => {
                self.note(&format!("a frame of {triangles} triangles was composed"));
                self.stage = Stage::Drawn;
                ctx.request_repaint();
            }
            Stage::Drawn => {
                self.note("that frame was handed to the graphics card");
                if let Some(device) = gpu {
                    let _timed_out = device.poll(wgpu::PollType::wait_indefinitely());
                }
                self.note("the first picture was finished");
                self.stage = Stage::Over;
            }
            _ => {}
        }
    }
}
