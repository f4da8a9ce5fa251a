//! What the last images cost.

use super::worker::Drawn;
use hbao::PassTime;
use std::collections::VecDeque;

/// The number of frames that are kept.
pub(super) const FRAMES: usize = 100;

/// The last frames, and how they are shown.
#[derive(Default)]
pub(super) struct Costs {
    pub(super) frames: VecDeque<Frame>,
    /// The passes so far, each with a colour of its own.
    pub(super) passes: Vec<&'static str>,
    /// Whether times are those of the driver's timer, where it has one.
    pub(super) by_gpu: bool,
}

/// What one image took.
pub(super) struct Frame {
    /// The passes of each side, by the number of the side.
    pub(super) sides: Vec<(usize, Vec<PassTime>)>,
    /// All of it, reading back included, in milliseconds; without that if shaders were compiled.
    pub(super) ms: f64,
    /// By how much its width and height were divided.
    pub(super) divisor: u32,
}

impl Costs {
    /// Notes what an image took. `tab` is the side that was shown, if it was one.
    pub(super) fn note(&mut self, drawn: &Drawn, tab: usize) {
        let side = |at: usize| if drawn.sides.len() == 1 { tab } else { at };
        let sides: Vec<_> = drawn.sides.iter().enumerate().map(|(at, shown)| (side(at), shown.times.clone())).collect();
        for time in sides.iter().flat_map(|(_, times)| times) {
            if !self.passes.contains(&time.name) {
                self.passes.push(time.name);
            }
        }
        if sides.iter().all(|(_, times)| times.is_empty()) {
            return;
        }
        // What compiling takes would leave the other frames without height. It is no time of a pass.
        let passes = || sides.iter().flat_map(|(_, times)| times).map(|time| time.wall_ms).sum();
        let ms = if drawn.compiled { passes() } else { 1e3 * drawn.seconds };
        if self.frames.len() == FRAMES {
            self.frames.pop_front();
        }
        self.frames.push_back(Frame { sides, ms, divisor: drawn.job.divisor });
    }

    /// Returns the number of frames in the graph, for the log.
    pub(super) fn count(&self) -> usize {
        self.frames.len()
    }

    /// Returns the time of a pass that is shown.
    pub(super) fn ms(&self, time: &PassTime) -> f64 {
        time.gpu_ms.filter(|_| self.by_gpu).unwrap_or(time.wall_ms)
    }
}

/// A number of bytes in words.
pub(super) fn bytes(count: u64) -> String {
    match count as f64 {
        count if count < 1e3 => format!("{count} B"),
        count if count < 1e6 => format!("{:.1} kB", count / 1e3),
        count => format!("{:.1} MB", count / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_written_in_the_unit_that_fits() {
        assert_eq!([0, 999, 1000, 123_456, 12_345_678].map(bytes), ["0 B", "999 B", "1.0 kB", "123.5 kB", "12.3 MB"]);
    }
}
