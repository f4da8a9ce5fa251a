//! Finds out whether Mesa's software drivers can have their threads. They do not check this themselves. If llvmpipe can
//! start only some of its threads, the first frame waits for the others for ever.

use crate::Error;
use crate::threads::startable;
use std::thread::available_parallelism;

/// The variable that says how many threads llvmpipe has for drawing.
const VARIABLE: &str = "LP_NUM_THREADS";

/// The largest number of threads that llvmpipe has for drawing.
const MOST: usize = 32;

/// The threads that Mesa starts beside those that draw and compute, for its shader cache.
const CACHE: usize = 1;

/// The threads that zink and the Vulkan driver below it start beside those that draw and compute. Mesa 22.3.6 starts
/// 11.
const ZINK: usize = 12;

/// What to do about a limit.
const REMEDY: &str = "allow more processes (ulimit -u, or pids.max of the control group)";

/// Returns the value to which the environment variable `LP_NUM_THREADS` must be set for Mesa's software driver llvmpipe
/// to work, or `None` if it works as it is.
///
/// By default llvmpipe starts two threads per processor, up to 64. If a limit on processes (`ulimit -u`, or `pids.max`
/// of a control group) or on memory leaves it only some of them, it waits for ever in the first frame.
/// [`Context::open`](super::Context::open) returns an error instead. An application that may change its environment can
/// call this function before it opens its first context, and set the variable. With 0 llvmpipe draws on the thread of
/// the context.
///
/// The answer holds for the moment of the call. It takes some 30 microseconds per thread, because the threads are
/// started.
#[must_use]
pub fn fewer_threads() -> Option<usize> {
    let wanted = wanted();
    if wanted == 0 {
        return None;
    }
    // As many threads compute as draw. No shader here is a compute shader, but Mesa starts them all the same.
    let possible = startable(2 * wanted + CACHE).saturating_sub(CACHE) / 2;
    (possible < wanted).then_some(possible)
}

/// Returns the error that llvmpipe cannot have its threads unless it has `fewer`.
pub(super) fn shortage(backend: &str, fewer: usize) -> Error {
    Error::Context(format!(
        "{backend}: llvmpipe cannot start all of its threads, and would wait for them for ever: {REMEDY}, or set \
         {VARIABLE}={fewer}"
    ))
}

/// Refuses zink if it cannot have its threads. It may crash or wait for ever while it opens a context.
pub(super) fn check_zink() -> Result<(), Error> {
    let chosen = |variable: &&str| std::env::var_os(variable).is_some_and(|value| value == "zink");
    let Some(variable) = ["MESA_LOADER_DRIVER_OVERRIDE", "GALLIUM_DRIVER"].into_iter().find(chosen) else {
        return Ok(());
    };
    let all = ZINK + 2 * wanted();
    match startable(all) {
        count if count == all => Ok(()),
        count => Err(Error::Context(format!(
            "egl: zink needs {all} threads, and {count} can be started: {REMEDY}, or unset {variable}"
        ))),
    }
}

/// Returns how many threads llvmpipe would have for drawing, as Mesa reads `LP_NUM_THREADS`.
fn wanted() -> usize {
    match std::env::var(VARIABLE).map(|text| text.trim().parse::<usize>()) {
        Ok(Ok(number)) => number.min(MOST),
        // Mesa ignores what is no number, but reads more kinds of numbers, such as negative ones, which it takes for
        // large ones.
        Ok(Err(_)) => MOST,
        Err(_) => match processors() {
            1 => 0,
            count => count.min(MOST),
        },
    }
}

/// Returns the number of processors that the process may run on. The standard library's number also considers the
/// quota of a control group, which Mesa does not.
fn processors() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed:")).unwrap_or_default();
    match mask.chars().filter_map(|digit| digit.to_digit(16)).map(u32::count_ones).sum::<u32>() {
        0 => available_parallelism().map_or(1, usize::from),
        count => count as usize,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn there_are_at_least_as_many_processors_as_the_standard_library_counts() {
        assert!(processors() >= available_parallelism().unwrap().get());
    }
}
