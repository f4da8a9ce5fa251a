//! `hbao bench` measures and reports; how fast anything is, no test asserts.

use std::process::{Command, Output};

fn bench(folder: &std::path::Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hbao"))
        .current_dir(folder)
        .arg("bench")
        .args(arguments.split_whitespace())
        .output()
        .unwrap()
}

#[test]
fn it_prints_a_table_and_writes_the_contracts_fields() {
    let folder = tempfile::tempdir().unwrap();
    for (method, fetches) in
        [("hbao", 64), ("hbao-talk", 64), ("ray-march", 256), ("microsphere", 64), ("crease", 64), ("ssao", 16)]
    {
        let output = bench(folder.path(), &format!("--size 96x72 --runs 3 --method {method} --json b.json"));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let table = String::from_utf8(output.stdout).unwrap();
        for row in ["frame", "ao", "floor", "blur", "ao / floor"] {
            assert!(table.lines().any(|line| line.starts_with(row)), "{row} is not in\n{table}");
        }
        let text = std::fs::read_to_string(folder.path().join("b.json")).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert!(report["renderer"].is_string());
        let row = &report["rows"][0];
        assert_eq!((&row["mode"], &row["method"]), (&"msaa4".into(), &method.into()));
        assert_eq!([&row["directions"], &row["steps"], &row["msaa"], &row["blur"]], [8, 8, 4, 9]);
        for figure in ["frame_ms", "ao_ms", "floor_ms", "blur_ms", "fps", "mpixels_per_s"] {
            assert!(row[figure].as_f64().is_some_and(|x| x > 0.0), "{figure}: {row}");
        }
        assert_eq!(row["fetches_per_pixel"], fetches);
        // The frame holds the passes that it is made of.
        let ms = |name: &str| row[name].as_f64().unwrap();
        assert!(ms("frame_ms") > ms("ao_ms"));
    }
}

#[test]
fn what_cannot_be_measured_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, part) in [
        ("--runs 0", "--runs: '0' is no whole number from 1 to 1000"),
        ("--runs many", "--runs: 'many'"),
        ("--method none", "no pass to time"),
        ("--json b.txt", "must end in .json"),
        ("--json none/b.json", "the folder none does not exist"),
    ] {
        let output = bench(folder.path(), arguments);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(matches!(output.status.code(), Some(1 | 2)), "{arguments}: {stderr}");
        assert!(stderr.contains(part) && stderr.lines().count() == 1, "{arguments}: {stderr}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
