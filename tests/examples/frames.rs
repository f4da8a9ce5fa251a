//! The command line of the three applications, by which a check runs them: `--frames N --save FILE.png`.

use hbao::glow::{self, HasContext};
use hbao::image::{Image, Outputs, png};
use std::error::Error;
use std::path::PathBuf;

/// Counts frames. Without arguments there is no end to them, and the user closes the window.
pub struct Frames {
    left: Option<u32>,
    save: Option<PathBuf>,
}

impl Frames {
    pub fn from_arguments() -> Result<Frames, Box<dyn Error>> {
        let mut frames = Frames { left: None, save: None };
        let mut arguments = std::env::args_os().skip(1);
        while let Some(flag) = arguments.next() {
            match (flag.to_str(), arguments.next()) {
                (Some("--frames"), Some(count)) => {
                    frames.left = Some(count.to_string_lossy().parse().map_err(|_| "--frames takes a whole number")?);
                }
                (Some("--save"), Some(file)) => frames.save = Some(file.into()),
                _ => return Err("usage: [--frames N] [--save FILE.png]".into()),
            }
        }
        Ok(frames)
    }

    /// Returns whether frames are counted, so that they must follow each other without an event.
    pub fn counted(&self) -> bool {
        self.left.is_some()
    }

    /// Counts a frame, before the buffers are swapped. After the last frame it saves the picture that stands in this
    /// part of the window, (x, y, width, height) from its lower left corner, and returns true.
    pub fn drawn(&mut self, gl: &glow::Context, [x, y, width, height]: [i32; 4]) -> Result<bool, hbao::Error> {
        let Some(left) = &mut self.left else { return Ok(false) };
        *left = left.saturating_sub(1);
        if *left > 0 {
            return Ok(false);
        }
        if let Some(file) = &self.save {
            let mut rgba = vec![0; (4 * width * height) as usize];
            // SAFETY: the context is current, and the buffer holds every pixel.
            unsafe {
                gl.bind_framebuffer(glow::READ_FRAMEBUFFER, None);
                let pixels = glow::PixelPackData::Slice(Some(&mut rgba));
                gl.read_pixels(x, y, width, height, glow::RGBA, glow::UNSIGNED_BYTE, pixels);
            }
            let texels = rgba.chunks_exact(4).map(|c| [c[0], c[1], c[2]]).collect();
            let image = Image { width: width as usize, height: height as usize, texels };
            let mut outputs = Outputs::new();
            outputs.stage(file, &png::encode(&image, &[])?)?;
            outputs.commit()?;
        }
        Ok(true)
    }
}
