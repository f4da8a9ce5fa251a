//! `hbao trade` measures a sweep and writes the files that its documentation promises.

use crate::rig::command::hbao;
use serde_json::Value;
use std::path::Path;
use std::process::Output;

fn trade(folder: &Path, arguments: &str) -> Output {
    hbao(folder, &format!("trade {arguments}")).output().unwrap()
}

#[test]
fn it_prints_a_table_and_writes_rows_a_table_and_a_plot() {
    let folder = tempfile::tempdir().unwrap();
    let output = trade(
        folder.path(),
        "--size 96x72 --runs 1 --truth-rays 64 --json t.json --csv t.csv --plot t.svg --radius 150",
    );
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let report: Value = serde_json::from_str(&text("t.json")).unwrap();
    assert_eq!(report["truth"]["rays"], 64);
    let noise = report["truth"]["noise_rmse"].as_f64().unwrap();
    assert!(noise > 0.0 && noise < 0.03, "{noise}");
    let edges = report["edges"]["pixels"].as_u64().unwrap();
    assert!((50..96 * 72 / 4).contains(&edges), "{edges}");
    let rows = report["rows"].as_array().unwrap();
    for (directions, half) in [(4, false), (8, false), (16, false), (4, true), (8, true), (16, true)] {
        let is = |row: &&Value| {
            row["method"] == "hbao"
                && [&row["directions"], &row["steps"], &row["blur"], &row["msaa"]] == [directions, directions, 9, 1]
                && row["half_res"] == half
        };
        assert!(rows.iter().any(|row| is(&row)), "no row with {directions} directions, half resolution {half}");
    }
    let number = |row: &Value, name: &str| row[name].as_f64().unwrap_or_else(|| panic!("{name}: {row}"));
    for row in rows {
        let [rmse, mae, bias, max, flip] = ["rmse", "mae", "bias", "max", "flip"].map(|name| number(row, name));
        assert!(bias.abs() <= mae + 1e-12 && mae <= rmse + 1e-12 && rmse <= max, "{row}");
        assert!((0.0..=1.0).contains(&flip) && max <= 1.0, "{row}");
        // Edge pixels are a part of the covered pixels and are judged by the same measures.
        let edge = ["edge_rmse", "edge_mae", "edge_bias", "edge_max", "edge_flip"].map(|name| number(row, name));
        assert!(edge[2].abs() <= edge[1] + 1e-12 && edge[1] <= edge[0] + 1e-12 && edge[0] <= edge[3], "{row}");
        assert!(edge[3] <= max && (0.0..=1.0).contains(&edge[4]) && edge[0] != rmse, "{row}");
        let exits = |row: &Value| number(row, "exit_share") > 0.5;
        let beaten = rows
            .iter()
            .any(|other| !exits(other) && number(other, "ms") < number(row, "ms") && number(other, "rmse") < rmse);
        assert_eq!(row["pareto"], !exits(row) && !beaten, "{row}");
        assert!(row["method"] == "none" || number(row, "ms") > 0.0);
        // A row without a blur spends all its time on ambient occlusion itself.
        let (ms, ao_ms) = (number(row, "ms"), number(row, "ao_ms"));
        assert!(ao_ms <= ms && (ao_ms == ms) == (row["blur"] == 0), "{row}");
        // A strength that is not the one in use is better or as good.
        if row["method"] == "none" || row["method"] == "ssao" {
            assert!(row["best_strength"].is_null() && row["rmse_at_best_strength"].is_null(), "{row}");
        } else {
            let (best, left) = (number(row, "best_strength"), number(row, "rmse_at_best_strength"));
            assert!((0.05..20.0).contains(&best) && left <= rmse + 1e-6, "{row}");
        }
    }
    let open = rows.iter().find(|row| row["method"] == "none").unwrap();
    assert!(number(open, "bias") > 0.05 && number(open, "bias") == number(open, "mae"), "A = 1 is too open everywhere");

    let parts = report["decomposition"].as_array().unwrap();
    let chapter: Vec<_> = parts.iter().map(|row| (row["directions"].as_u64(), row["half_res"].as_bool())).collect();
    let expected =
        [4, 8, 16].map(|n| (Some(n), Some(false))).into_iter().chain([4, 8, 16].map(|n| (Some(n), Some(true))));
    assert!(chapter.into_iter().eq(expected), "{parts:?}");
    for row in parts {
        assert_eq!((&row["method"], &row["blur"]), (&"hbao".into(), &9.into()));
        let of = |name: &str| ["model", "sampling", "filtering", "quantisation"].map(|part| number(&row[part], name));
        let total = |name: &str| number(&row["total"], name);
        assert!((of("bias").iter().sum::<f64>() - total("bias")).abs() < 1e-6, "{row}");
        let squares = of("rmse").iter().map(|rmse| rmse * rmse).sum::<f64>() + number(row, "cross");
        assert!((squares - total("rmse").powi(2)).abs() < 1e-9, "{row}");
        assert!(of("max").iter().all(|&max| max <= 1.0) && of("rmse").iter().sum::<f64>() >= total("rmse"), "{row}");
        assert_eq!(row["model"], parts[0]["model"], "all these settings converge to the same result");
        // So small an image is measured at all of its pixels, so the total equals the error of the row.
        let same = |other: &&Value| {
            ["method", "directions", "steps", "half_res", "blur"].iter().all(|key| other[*key] == row[*key])
        };
        let measured = rows.iter().filter(same).any(|other| (number(other, "rmse") - total("rmse")).abs() < 1e-6);
        assert!(measured && row["pixels"].as_u64().unwrap() > 96 * 72 / 3, "{row}");
    }

    let both = String::from_utf8(output.stdout).unwrap();
    let (table, apart) = both.split_once("\n\n").unwrap();
    assert_eq!((table.lines().count(), apart.lines().count()), (rows.len() + 1, parts.len() + 2));
    assert!(table.lines().any(|line| line.starts_with("* ")) && table.lines().any(|line| line.starts_with("  hbao")));
    let csv = text("t.csv");
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(csv.starts_with("method,directions,steps,") && csv.lines().all(|line| line.split(',').count() == columns));
    assert_eq!(csv.lines().count(), rows.len() + 1);
    let svg = text("t.svg");
    for part in ["<svg", "milliseconds", "RMSE against ray-traced visibility", "Pareto front", "ray-march", "</svg>"] {
        assert!(svg.contains(part), "{part}");
    }
}

#[test]
fn a_combination_that_mostly_exits_early_is_never_on_the_front_and_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let rows = |arguments: &str| -> (Vec<Value>, String) {
        let output = trade(folder.path(), &format!("--size 48x36 --runs 1 --truth-rays 2 --json t.json {arguments}"));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read_to_string(folder.path().join("t.json")).unwrap();
        let mut report: Value = serde_json::from_str(&text).unwrap();
        let Value::Array(rows) = report["rows"].take() else { panic!("no rows") };
        (rows, String::from_utf8(output.stderr).unwrap())
    };
    let (all, said) = rows("--radius 150");
    let (exiting, others): (Vec<_>, Vec<_>) = all.iter().partition(|row| row["exit_share"].as_f64().unwrap() > 0.5);
    assert!(exiting.len() > 10 && exiting.iter().all(|row| row["pareto"] == false && row["steps"].as_u64() > Some(2)));
    assert!(others.iter().any(|row| row["pareto"] == true));
    let told = said.lines().find(|line| line.contains("of the surface, exit early with visibility 1")).unwrap();
    assert!(told.contains("give --exit shorten, or a larger --radius or --size"), "{told}");
    let (all, said) = rows("--radius 150 --exit shorten");
    assert!(all.iter().all(|row| row["exit_share"] == 0.0 && row["exit"] == "shorten"), "{all:?}");
    assert!(!said.contains("exit early") && !said.contains("no effect"), "{said}");
}

#[test]
fn where_no_pixel_holds_two_surfaces_errors_on_edges_are_null() {
    let folder = tempfile::tempdir().unwrap();
    let plane = "v -9 0 -9\nv 9 0 -9\nv 9 0 9\nv -9 0 9\nf 1 2 3 4\n";
    std::fs::write(folder.path().join("plane.obj"), plane).unwrap();
    let view = "plane.obj --eye 0,3,0.5 --target 0,0,0 --radius 1 --size 8x6";
    let output = trade(folder.path(), &format!("{view} --runs 1 --truth-rays 2 --json t.json"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = std::fs::read_to_string(folder.path().join("t.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(report["edges"]["pixels"], 0);
    for row in report["rows"].as_array().unwrap() {
        for name in ["edge_rmse", "edge_mae", "edge_bias", "edge_max", "edge_flip"] {
            assert!(row.as_object().unwrap().contains_key(name) && row[name].is_null(), "{name}: {row}");
        }
        assert!(row["rmse"].is_number());
    }
    assert!(
        String::from_utf8(output.stdout)
            .unwrap()
            .lines()
            .skip(1)
            .take_while(|line| !line.is_empty())
            .all(|line| line.ends_with(" -"))
    );
}

#[test]
fn what_cannot_be_measured_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, part) in [
        ("--json t.txt", "--json t.txt: its name must end in .json"),
        ("--csv t.json", "--csv t.json: its name must end in .csv"),
        ("--plot t.png", "--plot t.png: its name must end in .svg"),
        ("--runs 0", "--runs: "),
        ("--truth-rays 5", "--truth-rays: "),
    ] {
        let output = trade(folder.path(), arguments);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments}: {stderr}");
        assert!(stderr.contains(part) && stderr.lines().count() == 1, "{arguments}: {stderr}");
    }
    // A warning is printed if the noise of the truth is so large that it would be taken for an error.
    let output = trade(folder.path(), "--size 8x6 --runs 1 --truth-rays 2 --steps 3");
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(
        stderr.contains("more than a fifth of the least error") && stderr.contains("--steps has no effect"),
        "{stderr}"
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
