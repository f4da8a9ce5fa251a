//! Runs the `hbao` command as its users run it.

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output};

/// The path of the program that Cargo built beside the tests.
pub const HBAO: &str = env!("CARGO_BIN_EXE_hbao");

/// Makes a command that runs `hbao` in a folder. The arguments are separated by spaces.
pub fn hbao(folder: &Path, arguments: &str) -> Command {
    of_arguments(folder, &arguments.split_whitespace().collect::<Vec<_>>())
}

/// Does the same for arguments that may contain spaces or may not be valid UTF-8.
pub fn of_arguments<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Command {
    let mut command = by(HBAO, folder);
    command.args(arguments);
    command
}

/// Makes a command that runs another program in a folder, such as a shell that runs `hbao` under a limit.
pub fn by(program: &str, folder: &Path) -> Command {
    let mut command = Command::new(program);
    command.current_dir(folder);
    command
}

/// Lets a command use Mesa's shader cache even if the environment turns it off, and gives it one thread. This is for
/// verbs that compile hundreds of shaders, many of them repeatedly, and for tests of what happens before or after the
/// rendering. One thread is fastest for their images, which are so small that threads would only wait for each other.
pub fn with_shader_cache(command: &mut Command) -> &mut Command {
    command.env_remove("MESA_SHADER_CACHE_DISABLE").env("MESA_SHADER_CACHE_DIR", env!("CARGO_TARGET_TMPDIR"));
    command.env("LP_NUM_THREADS", "1")
}

/// Runs the command with these arguments and with [`with_shader_cache`].
pub fn cached(folder: &Path, arguments: &str) -> Output {
    with_shader_cache(&mut hbao(folder, arguments)).output().unwrap()
}

/// Returns what a command wrote to stdout and to stderr.
pub fn texts(output: &Output) -> [String; 2] {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8(bytes.clone()).unwrap())
}

/// Returns the lines of stderr except the one that names the backend.
pub fn notices(stderr: &str) -> Vec<&str> {
    let backend = |line: &&str| line.starts_with("hbao: egl: ") || line.starts_with("hbao: osmesa: ");
    stderr.lines().filter(|line| !backend(line)).collect()
}

/// Returns the sorted names of the entries of a folder.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
