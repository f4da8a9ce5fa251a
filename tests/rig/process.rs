//! Runs a test in a process of its own, for tests that depend on the environment or that measure the process.

use std::ffi::OsStr;
use std::io::Write as _;
use std::process::Command;

/// Runs `body` in a child process with `environment` added. The child is this test program again, told to run only
/// `test`, which is the test that calls this function. `test` may be the function's name without its module, but no
/// other test's name may contain it.
pub fn in_own_process(test: &str, environment: &[(&str, &OsStr)], body: impl FnOnce()) {
    const CHILD: &str = "HBAO_TEST_CHILD";
    if std::env::var_os(CHILD).is_some() {
        return body();
    }
    let program = std::env::current_exe().unwrap();
    let mut child = Command::new(program);
    child.args([test, "--nocapture"]).env(CHILD, test).envs(environment.iter().copied());
    let output = child.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    // A filter that matches no test succeeds too, so the harness must report that exactly one passed.
    assert!(output.status.success() && text.contains("ok. 1 passed"), "{test}: {}\n{text}", output.status);
    print!("{text}");
}

/// The environment variable that makes a process compile every shader itself.
pub const WITHOUT_SHADER_CACHE: (&str, &str) = ("MESA_SHADER_CACHE_DISABLE", "true");

/// Reports that a test is skipped because a tool is missing, and names the Debian package that contains the tool. If
/// `HBAO_REQUIRE_TOOLS=1` is set, as it is in continuous integration, the test fails instead.
pub fn skip(what: &str, package: &str) {
    let required = std::env::var_os("HBAO_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    assert!(!required, "HBAO_REQUIRE_TOOLS is set, but {what} is missing: install {package}");
    // The harness would capture what `eprintln!` writes, and nobody would see it.
    let _ = writeln!(std::io::stderr(), "SKIPPED: no {what} (Debian: {package})");
}

/// Reports that a test is skipped because this machine does not permit what it needs. Installing a package would not
/// help.
pub fn not_permitted(what: &str) {
    let _ = writeln!(std::io::stderr(), "SKIPPED: this machine does not permit {what}");
}

/// Returns the process's resident memory in KiB. This works on Linux only.
pub fn resident() -> i64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.trim().strip_suffix(" kB").unwrap().parse().unwrap()
}
