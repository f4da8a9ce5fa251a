//! A process of a test's own, for what depends on the environment or measures the process.

use std::ffi::OsStr;
use std::process::Command;

/// Runs `body` in a process of its own, with `environment`: a child that runs only `test`, the test that calls this.
pub fn in_own_process(test: &str, environment: &[(&str, &OsStr)], body: impl FnOnce()) {
    const CHILD: &str = "HBAO_TEST_CHILD";
    if std::env::var_os(CHILD).is_some() {
        return body();
    }
    let program = std::env::current_exe().unwrap();
    let mut child = Command::new(program);
    child.args(["--exact", test, "--nocapture"]).env(CHILD, test).envs(environment.iter().copied());
    let output = child.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    // A filter that matches no test succeeds too, so that one passed must be read.
    assert!(output.status.success() && text.contains("1 passed"), "{test}: {}\n{text}", output.status);
}
