//! What this crate does if a process may start few threads or none, under a limit on processes (`ulimit -u`, or
//! `pids.max` of a control group) or on memory.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::path::Path;
use std::sync::{LazyLock, Mutex, PoisonError};
use std::thread::{self, Builder};
use std::time::Duration;

/// The size in bytes that a thread's stack has by default on Linux. A thread that Mesa starts has such a stack, which a
/// limit on memory (`ulimit -v`) counts as a whole.
const STACK: usize = 8 << 20;

/// Finds out how many threads this process can start now, in addition to those that it has, by starting them. It tries
/// at most `most`. They have ended when the function returns.
pub(crate) fn startable(most: usize) -> usize {
    let gate = Mutex::new(());
    thread::scope(|scope| {
        let closed = gate.lock().unwrap_or_else(PoisonError::into_inner);
        let wait = || {
            let me = std::fs::read_link("/proc/thread-self");
            drop(gate.lock());
            me
        };
        let started: Vec<_> =
            (0..most).map_while(|_| Builder::new().stack_size(STACK).spawn_scoped(scope, wait).ok()).collect();
        let count = started.len();
        drop(closed);
        for thread in started {
            // Linux counts a thread for a moment after it was joined, until its folder disappears. The number of
            // attempts is bounded in case that the folder means something else.
            let Ok(Ok(me)) = thread.join() else { continue };
            let folder = Path::new("/proc").join(me);
            (0..100).take_while(|_| folder.exists()).for_each(|_| thread::sleep(Duration::from_millis(1)));
        }
        count
    })
}

/// Runs `work`, which uses rayon, on as many threads as can be had. Without this, rayon panics if it cannot start all
/// the threads of its global pool.
///
/// On a thread of a pool, `work` uses that pool. Otherwise it uses rayon's global pool, or, if that cannot be made, a
/// pool of the threads that can be started. If there are none, the calling thread does all the work.
pub(crate) fn on_all_cores<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static POOL: LazyLock<Pool> = LazyLock::new(Pool::new);
    if rayon::current_thread_index().is_some() {
        return work();
    }
    match &*POOL {
        Pool::Global => work(),
        Pool::Smaller(pool) => pool.install(work),
        Pool::None => {
            // The calling thread becomes the only thread of a pool, and stays in it: rayon has no way out again.
            let alone = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
            alone.map_or_else(drop, std::mem::forget);
            work()
        }
    }
}

enum Pool {
    Global,
    Smaller(ThreadPool),
    None,
}

impl Pool {
    fn new() -> Pool {
        match ThreadPoolBuilder::new().build_global() {
            Ok(()) => return Pool::Global,
            // An error without a source says that the pool was there before: the application has made it.
            Err(error) if std::error::Error::source(&error).is_none() => return Pool::Global,
            Err(_) => {}
        }
        match startable(thread::available_parallelism().map_or(1, usize::from)) {
            0 => Pool::None,
            threads => ThreadPoolBuilder::new().num_threads(threads).build().map_or(Pool::None, Pool::Smaller),
        }
    }
}
