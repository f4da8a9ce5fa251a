//! The `hbao` command, run as its users run it.

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output};

/// The program that Cargo built beside the tests.
pub const HBAO: &str = env!("CARGO_BIN_EXE_hbao");

/// The command in a folder, with arguments that are separated by spaces.
pub fn hbao(folder: &Path, arguments: &str) -> Command {
    of_arguments(folder, &arguments.split_whitespace().collect::<Vec<_>>())
}

/// The same, for arguments that may hold spaces or be no text at all.
pub fn of_arguments<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Command {
    let mut command = by(HBAO, folder);
    command.args(arguments);
    command
}

/// Another program in a folder, such as a shell that runs the command under a limit.
pub fn by(program: &str, folder: &Path) -> Command {
    let mut command = Command::new(program);
    command.current_dir(folder);
    command
}

/// Lets a command take shaders from Mesa's cache even where the environment turns it off, and gives it one thread: for
/// verbs that compile hundreds of shaders, many of them again, and for tests whose subject lies before or after the
/// rendering. On images as small as theirs, threads only wait for each other.
pub fn with_shader_cache(command: &mut Command) -> &mut Command {
    command.env_remove("MESA_SHADER_CACHE_DISABLE").env("MESA_SHADER_CACHE_DIR", env!("CARGO_TARGET_TMPDIR"));
    command.env("LP_NUM_THREADS", "1")
}

/// Runs the command with these arguments by [`with_shader_cache`].
pub fn cached(folder: &Path, arguments: &str) -> Output {
    with_shader_cache(&mut hbao(folder, arguments)).output().unwrap()
}

/// What a command wrote to stdout and to stderr.
pub fn texts(output: &Output) -> [String; 2] {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8(bytes.clone()).unwrap())
}

/// The lines on stderr but for the one that tells the backend.
pub fn notices(stderr: &str) -> Vec<&str> {
    let backend = |line: &&str| line.starts_with("hbao: egl: ") || line.starts_with("hbao: osmesa: ");
    stderr.lines().filter(|line| !backend(line)).collect()
}

/// The names in a folder, in order.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
