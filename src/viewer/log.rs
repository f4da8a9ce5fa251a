//! Writes a line of JSON for each frame that the window presents. Tests find the window's widgets by it, and it tells
//! how long after an input its effect was seen.

use eframe::egui::Rect;
use hbao::Error;
use serde_json::{Map, Value, json};
use std::fs::File;
use std::io::Write as _;
use std::path::Path;
use std::time::Instant;

/// The file, and the moment from which times count.
pub(super) struct Log {
    file: File,
    start: Instant,
}

impl Log {
    /// Creates the file.
    pub(super) fn create(path: &Path, start: Instant) -> Result<Log, Error> {
        let refused = |error: std::io::Error| Error::Output { path: path.into(), what: error.to_string() };
        Ok(Log { file: File::create(path).map_err(refused)?, start })
    }

    /// Writes the line of a frame that is being presented now. A full disk does not end the program.
    pub(super) fn write(&mut self, mut line: Value) {
        line["presented_ms"] = json!(milliseconds(self.start));
        let _ = self.file.write_all(format!("{line}\n").as_bytes());
    }
}

/// The milliseconds since a moment.
pub(super) fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// Rectangles of widgets by name, [x, y, width, height] in pixels of the window.
pub(super) fn rectangles(widgets: &[(String, Rect)], pixels_per_point: f32) -> Value {
    let rectangle = |rect: &Rect| {
        let scaled = [rect.min.x, rect.min.y, rect.width(), rect.height()].map(|x| x * pixels_per_point);
        json!(scaled.map(f32::round))
    };
    Value::Object(widgets.iter().map(|(name, rect)| (name.clone(), rectangle(rect))).collect::<Map<_, _>>())
}

/// The FNV-1a hash of an image's colours, the top row first as in files, by which a test compares it with a file.
pub(super) fn hash(image: &hbao::image::Image<[u8; 3]>) -> String {
    let rows = image.texels.chunks_exact(image.width.max(1)).rev();
    let hash = rows
        .flatten()
        .flatten()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    format!("{hash:016x}")
}
