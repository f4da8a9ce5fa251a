//! Limits on the number of processes, which Linux counts per user and with their threads. Root has no limit, so that
//! the command runs as another user, a new one each time.

use super::*;
use hbao::context::{Backend, Context};
use std::os::unix::fs::PermissionsExt as _;
use std::sync::atomic::{AtomicU32, Ordering};

/// Returns the number of a user that has no processes.
fn new_user() -> u32 {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    20_000 + (std::process::id() * 64 + COUNT.fetch_add(1, Ordering::Relaxed)) % 40_000
}

/// Sets the largest number of threads that the user of this process may have.
fn limit(threads: u64) -> io::Result<()> {
    let limit = libc::rlimit { rlim_cur: threads, rlim_max: threads };
    // SAFETY: the call reads the structure, which outlives it.
    match unsafe { libc::setrlimit(libc::RLIMIT_NPROC, &limit) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// A copy of the command in a folder that all users may read and write.
struct Copy(tempfile::TempDir);

impl Copy {
    fn new() -> Copy {
        let folder = tempfile::tempdir().unwrap();
        fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o777)).unwrap();
        // If this process wrote the file itself, another test's command might inherit the open file for a moment, and a
        // program that is open for writing cannot run.
        assert!(Command::new("cp").arg(HBAO).arg(folder.path().join("hbao")).status().unwrap().success());
        Copy(folder)
    }

    /// Runs the command as a user who may have so many threads, the command's first included. Returns `None` if this
    /// process may not run a program as another user.
    fn run(&self, threads: u64, environment: &[(&str, &str)], arguments: &str) -> Option<Output> {
        let mut limited = with_pipes(by(self.0.path().join("hbao").to_str().unwrap(), self.0.path()));
        let user = new_user();
        limited.args(arguments.split_whitespace()).uid(user).gid(user).env_remove("LP_NUM_THREADS");
        limited.env("MESA_SHADER_CACHE_DIR", self.0.path().join("cache")).envs(environment.iter().copied());
        // SAFETY: between fork and exec only one call of the system is made, which is safe there.
        unsafe { limited.pre_exec(move || limit(threads)) };
        match limited.output() {
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
                process::not_permitted("a program to run as another user");
                None
            }
            output => Some(output.unwrap()),
        }
    }

    fn file(&self, name: &str) -> Vec<u8> {
        fs::read(self.0.path().join(name)).unwrap()
    }
}

/// Enough threads for everything.
const MANY: u64 = 1000;

#[test]
fn that_are_few_change_no_ray_traced_image() {
    let copy = Copy::new();
    // As on a machine of four processors.
    let environment = [("RAYON_NUM_THREADS", "4")];
    let arguments = "truth cornell-box --size 24x18 --truth-rays 4 -o out.exr";
    let Some(output) = copy.run(MANY, &environment, arguments) else { return };
    assert!(output.status.success(), "{:?}", said(&output));
    let expected = copy.file("out.exr");
    for threads in 1..=6 {
        fs::remove_file(copy.0.path().join("out.exr")).unwrap();
        let output = copy.run(threads, &environment, arguments).unwrap();
        assert!(output.status.success(), "{threads}: {} {:?}", output.status, said(&output));
        assert!(copy.file("out.exr") == expected, "{threads}");
    }
}

/// llvmpipe would wait for ever, in the first frame, for threads that it could not start.
#[test]
fn that_are_few_change_no_rendered_image() {
    let copy = Copy::new();
    let environment = [("LP_NUM_THREADS", "4")];
    for (backend, limits) in [("egl", 1..=10), ("osmesa", 1..=3)] {
        let arguments = format!("render cornell-box --size 24x18 -o out.png --backend {backend}");
        let Some(output) = copy.run(MANY, &environment, &arguments) else { return };
        assert!(output.status.success() && said(&output).is_empty(), "{:?}", said(&output));
        let expected = copy.file("out.png");
        for threads in limits {
            fs::remove_file(copy.0.path().join("out.png")).unwrap();
            let output = copy.run(threads, &environment, &arguments).unwrap();
            let lines = said(&output);
            assert!(output.status.success(), "{threads}: {} {lines:?}", output.status);
            assert!(copy.file("out.png") == expected, "{threads}");
            // Each thread that draws comes with one that computes. One more is for the shader cache, and one is the
            // command's own.
            match threads.saturating_sub(2) / 2 {
                4 => assert!(lines.is_empty(), "{lines:?}"),
                used => {
                    let notice = format!("LP_NUM_THREADS={used} is used");
                    assert!(lines.len() == 1 && lines[0].ends_with(&notice), "{threads}: {lines:?}");
                }
            }
        }
    }
}

#[test]
fn that_are_few_stop_no_verb() {
    let copy = Copy::new();
    for verb in [
        "info",
        "tune nave --size 24x18 --max-error 0.5 --method ssao --truth-rays 2 --runs 1 -o t.toml",
        "bench cornell-box --size 8x6 --runs 1 --only figure1",
    ] {
        // llvmpipe could start one of its threads.
        let Some(output) = copy.run(2, &[("LP_NUM_THREADS", "2")], verb) else { return };
        assert!(output.status.success(), "{verb}: {} {:?}", output.status, said(&output));
    }
}

/// The library does not change its process's environment.
#[test]
fn that_llvmpipe_cannot_have_are_an_error_of_the_library() {
    let environment = [("LP_NUM_THREADS", "2"), ("MESA_SHADER_CACHE_DISABLE", "true")]
        .map(|(name, value)| (name, std::ffi::OsStr::new(value)));
    process::in_own_process("that_llvmpipe_cannot_have_are_an_error_of_the_library", &environment, || {
        let user = new_user();
        // SAFETY: this changes numbers of this process only, of all of its threads.
        if unsafe { libc::setgid(user) != 0 || libc::setuid(user) != 0 } {
            return process::not_permitted("a program to run as another user");
        }
        let own = fs::read_dir("/proc/self/task").unwrap().count() as u64;
        for more in (0..5).rev() {
            limit(own + more).unwrap();
            for backend in [Backend::Egl, Backend::Osmesa, Backend::Auto] {
                let error = Context::open(backend).unwrap_err().to_string();
                for part in ["llvmpipe cannot start all of its threads", "ulimit -u", "set LP_NUM_THREADS="] {
                    assert!(error.contains(part), "no {part:?} in {error:?}");
                }
            }
        }
    });
}
