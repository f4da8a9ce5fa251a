//! Keeps compiled programs, so that settings which an application returns to are not compiled again.

use super::{Defines, Program, Source};
use crate::Error;
use std::sync::Arc;

/// How many programs are kept that nothing uses at present. A set of settings has about six.
const KEPT: usize = 32;

/// Compiles programs, each once. The programs that were asked for last are kept when nothing uses them any more.
pub(crate) struct ProgramCache {
    gl: Arc<glow::Context>,
    /// The programs, the one that was asked for last at the end.
    programs: Vec<Kept>,
    compiled: usize,
}

/// A program, and what it was compiled from.
struct Kept {
    defines: Defines,
    files: Vec<&'static str>,
    program: Arc<Program>,
}

impl ProgramCache {
    pub(crate) fn new(gl: &Arc<glow::Context>) -> ProgramCache {
        ProgramCache { gl: gl.clone(), programs: Vec::new(), compiled: 0 }
    }

    /// Returns the context in which the programs are compiled.
    pub(crate) fn gl(&self) -> &Arc<glow::Context> {
        &self.gl
    }

    /// Returns how many programs have been compiled so far.
    pub(crate) fn compiled(&self) -> usize {
        self.compiled
    }

    /// Returns the program of these shaders, as [`Program::new`] makes it.
    pub(crate) fn get(
        &mut self,
        defines: &Defines,
        vertex: Source,
        fragment: &[Source],
    ) -> Result<Arc<Program>, Error> {
        let files = || [vertex].into_iter().chain(fragment.iter().copied()).map(|source| source.name);
        let same = |kept: &Kept| kept.defines == *defines && kept.files.iter().copied().eq(files());
        let kept = match self.programs.iter().position(same) {
            Some(found) => self.programs.remove(found),
            None => {
                let program = Arc::new(Program::new(&self.gl, defines, vertex, fragment)?);
                self.compiled += 1;
                Kept { defines: defines.clone(), files: files().collect(), program }
            }
        };
        let program = kept.program.clone();
        self.programs.push(kept);
        self.drop_unused();
        Ok(program)
    }

    /// Drops the programs that have not been asked for the longest, as far as too many are unused.
    fn drop_unused(&mut self) {
        let unused = |kept: &Kept| Arc::strong_count(&kept.program) == 1;
        let mut surplus = self.programs.iter().filter(|kept| unused(kept)).count().saturating_sub(KEPT);
        self.programs.retain(|kept| {
            let goes = surplus > 0 && unused(kept);
            surplus -= usize::from(goes);
            !goes
        });
    }
}
