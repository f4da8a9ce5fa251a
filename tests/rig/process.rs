//! A process of a test's own, for what depends on the environment or measures the process.

use std::ffi::OsStr;
use std::io::Write as _;
use std::process::Command;

/// Runs `body` in a process of its own, with `environment`: a child that runs only `test`, the test that calls this.
/// The function's name is enough, without its module: no other test's name may contain it.
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

/// The environment of a process that compiles every shader itself.
pub const WITHOUT_SHADER_CACHE: (&str, &str) = ("MESA_SHADER_CACHE_DISABLE", "true");

/// Says that a test passes without what it needs, of a Debian package; or fails, where `HBAO_REQUIRE_TOOLS=1` is set,
/// as continuous integration does.
pub fn skip(what: &str, package: &str) {
    let required = std::env::var_os("HBAO_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    assert!(!required, "HBAO_REQUIRE_TOOLS is set, and there is no {what}: install {package}");
    // Not by a macro, whose words the harness keeps to itself.
    let _ = writeln!(std::io::stderr(), "SKIPPED: no {what} (Debian: {package})");
}

/// Says that a test passes without what this machine does not permit, and no package would change.
pub fn not_permitted(what: &str) {
    let _ = writeln!(std::io::stderr(), "SKIPPED: this machine does not permit {what}");
}

/// The process's resident memory in KiB, on Linux.
pub fn resident() -> i64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.trim().strip_suffix(" kB").unwrap().parse().unwrap()
}
