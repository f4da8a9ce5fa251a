//! `hbao paper` writes one page that needs no other file, with every figure, table and claim. It is tested at the size
//! of a quick look, and with the built-in scenes only.

use crate::rig;
use crate::rig::command::cached;
use crate::rig::scenes::Shot;
use hbao::Settings;
use hbao::context::{Backend, Context};
use hbao::image::{Image, png};
use hbao::measure::precision::Comparer;
use hbao::reference::anatomy::Anatomy;
use hbao::scene::{Lens, Scene, View};
use hbao::settings::DepthFormat;
use serde_json::Value;
use std::path::Path;
use std::sync::LazyLock;
use tempfile::TempDir;

/// Returns each part of the text that lies between `from` and `to`.
fn between<'a>(text: &'a str, from: &'a str, to: &'a str) -> impl Iterator<Item = &'a str> {
    text.split(from).skip(1).filter_map(move |rest| rest.split(to).next())
}

const FIGURES: [&str; 32] = [
    "6.1.1",
    "6.1.2",
    "6.1.3",
    "6.1.4",
    "6.1.5",
    "6.1.6",
    "6.1.7",
    "6.2.1",
    "6.2.2",
    "6.2.3",
    "6.2.4",
    "6.2.5",
    "6.2.6",
    "6.2.7",
    "6.2.8",
    "6.2.9",
    "6.2.10",
    "6.2.11",
    "6.2.12",
    "6.2.13",
    "6.2.14",
    "6.2.15",
    "6.2.16",
    "6.2.17",
    "talk-1",
    "talk-2",
    "table-6.2.1",
    "range-check",
    "ssao-border",
    "forms",
    "apply",
    "jitter",
];

/// A report that the command made: its files by their names, and what the command said meanwhile.
pub(crate) struct Made {
    files: Vec<(String, Vec<u8>)>,
    said: String,
}

impl Made {
    /// Returns the page.
    pub(crate) fn page(&self) -> &str {
        let (_, page) = self.files.iter().find(|(name, _)| name == "index.html").unwrap();
        std::str::from_utf8(page).unwrap()
    }

    fn written(&self) -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        self.files.iter().for_each(|(name, bytes)| std::fs::write(folder.path().join(name), bytes).unwrap());
        folder
    }
}

/// Returns the report, which is made once for all tests. It is kept in memory, so that no folder is left.
pub(crate) fn made() -> &'static Made {
    static MADE: LazyLock<Made> = LazyLock::new(|| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("empty-home")).unwrap();
        let arguments = "paper -o report --size 64x48 --runs 1 --truth-rays 16 --models empty-home";
        let output = cached(folder.path(), arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{said}");
        let entries = std::fs::read_dir(folder.path().join("report")).unwrap().map(Result::unwrap);
        let read = |path: &Path| std::fs::read(path).unwrap();
        let files = entries.map(|entry| (entry.file_name().into_string().unwrap(), read(&entry.path()))).collect();
        Made { files, said }
    });
    &MADE
}

#[test]
fn one_page_holds_every_figure_table_and_claim_and_needs_nothing_else() {
    let made = made();
    let (folder, page, said) = (made.written(), made.page(), &made.said);
    let report = folder.path().to_path_buf();

    // The page needs no network, and none of the files beside it.
    for source in between(page, "src=\"", "\"").chain(between(page, "href=\"", "\"")) {
        assert!(source.starts_with("data:image/png;base64,") || source.starts_with('#'), "{source:.60}");
    }
    assert!(!page.contains("<link") && !page.contains("@import") && !page.contains("url("));
    for figure in FIGURES {
        assert!(page.contains(&format!("<section id=\"figure-{figure}\"")), "figure {figure} is missing");
    }
    for anchor in between(page, "href=\"#", "\"") {
        assert!(page.contains(&format!("id=\"{anchor}\"")), "#{anchor} leads nowhere");
    }
    assert!(page.contains("class=\"compare\""), "the page has no pair of pictures to compare");

    // The same pictures are saved as files beside the page, and every file is complete.
    let files: Vec<_> = std::fs::read_dir(&report).unwrap().map(|entry| entry.unwrap().path()).collect();
    let of = |extension: &str| files.iter().filter(|path| path.extension().is_some_and(|e| e == extension)).count();
    assert_eq!(between(page, "src=\"data:", "\"").count(), of("png"));
    assert_eq!(page.matches("<svg").count(), of("svg"));
    assert!(of("png") > 30 && of("svg") > 6);
    assert_eq!(of("tmp"), 0, "a half-written file is left");
    commands_make_the_same_pictures(page, &report);
    what_a_rim_hides_is_open_to_ssao_alone(page);
    // Numbers and their units are joined by spaces that do not break.
    diagrams_have_the_numbers_of_the_twin(&page.replace('\u{a0}', " "));

    let figures: Value = serde_json::from_str(&std::fs::read_to_string(report.join("report.json")).unwrap()).unwrap();
    let claims = figures["claims"].as_array().unwrap();
    assert!(claims.len() >= 18, "{}", claims.len());
    for claim in claims {
        let id = claim["id"].as_str().unwrap();
        let found = claim["found"].as_array().unwrap();
        let verdicts: Vec<_> = found.iter().map(|found| found["verdict"].as_str().unwrap()).collect();
        let all = |verdict: &str| verdicts.iter().all(|&one| one == verdict);
        let expected = match () {
            () if verdicts.is_empty() => "not measured",
            () if all("holds") => "holds",
            () if all("does not hold") => "does not hold",
            () => "holds in part",
        };
        assert_eq!(claim["verdict"], expected, "{id}");
        assert!(claim["rule"].as_str().unwrap().starts_with("holds where") || id == "three-rays", "{id}");
        assert!(page.contains(&format!("<tr id=\"claim-{id}\"")), "{id}");
        assert!(found.iter().all(|found| found["value"].is_number() || id == "three-rays"), "{id}: {found:?}");
    }
    numbers_at_their_extremes(&figures["extremes"]);
    // The tables have all their cells.
    let rows = figures["tables"]["rows"].as_array().unwrap();
    for mode in ["half", "msaa1", "msaa4"] {
        assert_eq!(rows.iter().filter(|row| row["mode"] == mode).count(), 5, "{mode}");
    }

    // Missing models are reported, on the page too.
    for model in ["sibenik.obj", "dragon.obj"] {
        assert!(said.contains(model) && page.contains(&format!("for want of {model}")), "{model}: {said}");
    }
    assert!(!page.contains("Dragon, "), "the page shows a model that is missing");
    assert!(!page.contains("empty-home"), "the page names the folder of the models, which its readers do not have");
}

/// Figure 6.2.4 must show what it says. Seen from the floor, a thin rim and a solid block look the same, so their
/// visibility differs only in a method that counts hidden points as open.
fn what_a_rim_hides_is_open_to_ssao_alone(page: &str) {
    let row = |scene: &str| -> [f64; 4] {
        let cells = between(page, &format!("<th scope=\"row\">{scene}</th>"), "</tr>").next().unwrap().to_string();
        let numbers: Vec<f64> =
            between(&cells, "<td>", "</td>").map(|cell| cell.trim_end_matches(" %").parse().unwrap()).collect();
        numbers.try_into().unwrap()
    };
    let [rim, block] = [row("pit behind a thin rim"), row("hole in a block")];
    let [ssao, hbao, rays, hidden] = [0, 1, 2, 3].map(|i| rim[i] - block[i]);
    assert!(ssao > 0.15 && hidden > 20.0, "{rim:?} {block:?}");
    assert!(hbao.abs() < 0.02 && rays.abs() < 0.02, "{rim:?} {block:?}");
    assert!(block[3] < 1.0 && rim[1] < rim[0] - 0.2, "{rim:?} {block:?}");
}

/// The numbers in the diagrams must be those that the twin finds at their pixel in a view that is rendered again here.
fn diagrams_have_the_numbers_of_the_twin(page: &str) {
    let section = |id: &str| {
        let (_, rest) = page.split_once(&format!("<section id=\"figure-{id}\"")).unwrap();
        rest.split("</section>").next().unwrap()
    };
    let samples = section("6.2.9");
    let numbers_after = |text: &str, count: usize| -> Vec<usize> {
        let rest = samples.split(text).nth(1).unwrap();
        let digits = rest.split(|c: char| !c.is_ascii_digit()).filter(|part| !part.is_empty());
        digits.take(count).map(|part| part.parse().unwrap()).collect()
    };
    let pixel = numbers_after("pixel (", 2);
    let (pixel, k) = ((pixel[0], pixel[1]), numbers_after("direction ", 1)[0] as u32);
    let (size, radius) = (numbers_after("Cornell box at ", 3), numbers_after("R = ", 1)[0] as f64);

    let Scene { mesh, view, .. } = Scene::open("cornell-box").unwrap();
    let shot = Shot::new("cornell-box", mesh, view, radius);
    let settings = rig::float_settings(radius);
    let context = Context::open(Backend::Auto).unwrap();
    let frame = rig::render(context.gl(), &shot, (size[0] as u32, size[1] as u32), &settings);
    let inputs = frame.inputs();
    let twin = Anatomy::new(&inputs, &settings).unwrap();
    let (start, slice) = (twin.start(pixel).unwrap(), twin.slice(pixel, k).unwrap());
    let degrees = |sine: f64| format!("{:.1}°", sine.asin().to_degrees());

    let rows: Vec<Vec<&str>> =
        between(samples, "<th scope=\"row\">", "</tr>").map(|row| between(row, "<td>", "</td>").collect()).collect();
    assert_eq!(rows.len(), slice.samples.len());
    for (row, sample) in rows.iter().zip(&slice.samples) {
        let found = sample.found.unwrap();
        assert_eq!(row[0], format!("{}, {}", sample.taken.x, sample.taken.y));
        assert_eq!(row[1], format!("{:.2}", found.D.length()));
        assert_eq!(row[2..5], [found.sin_phi, found.sin_t, found.sin_before].map(degrees));
        assert_eq!(row[6], format!("{:.4}", sample.contribution));
        assert_eq!(row[7].starts_with("raises"), sample.contribution != 0.0, "{row:?}");
    }
    assert!(samples.contains(&format!("leave A = {:.4}", twin.visibility(pixel).unwrap())), "{samples}");
    let sum: f64 = slice.samples.iter().take(3).map(|sample| sample.contribution).sum();
    for part in
        [format!("h = {}", degrees(slice.samples[0].found.unwrap().sin_phi)), format!("{sum:.4} has been added")]
    {
        assert!(samples.contains(&part), "{part}");
    }
    let angles = [format!("t(θ) = {}", degrees(slice.sin_t)), format!("h(θ) = {}", degrees(slice.sin_h()))];
    assert!(angles.iter().all(|part| section("6.2.8").matches(part.as_str()).count() >= 2), "{angles:?}");
    let lengths = [start.radius_px.y, start.step_px.y].map(|texels| format!("{texels:.2} texels"));
    assert!(lengths.iter().all(|part| section("6.2.11").contains(part)), "{lengths:?}");
    let horizon = slice.horizon_sample().unwrap();
    let adds = format!("H is sample {}, {:.1} from P", horizon.index, horizon.found.unwrap().D.length());
    assert!(section("6.2.7").contains(&adds) && section("6.2.7").contains(&format!("adds {:.4}.", slice.occlusion)));
}

/// What the page says about float32 and the formats must be what the library measures, and within what is promised.
fn numbers_at_their_extremes(extremes: &Value) {
    let rows = extremes["rows"].as_array().unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    let find = |axis: &str, case: &str| {
        let found = rows.iter().find(|row| row["axis"] == axis && row["case"] == case);
        found.unwrap_or_else(|| panic!("{axis}: no {case}"))
    };
    for row in rows.iter().filter(|row| row.get("refused").is_none()) {
        let case = row["case"].as_str().unwrap();
        // An 8-bit ambient occlusion may be off by half a step.
        let limit = if case.contains("R8") { 0.51 / 255.0 } else { 1e-3 };
        assert!(number(&row["arithmetic"]["max"]) <= limit, "{row}");
        let limit = match row["axis"].as_str().unwrap() {
            // The corners of large triangles are rounded. Only the scene with the largest triangles may miss pixels.
            "extent" => 1e-6 + 1e-7 * number(&row["along"]),
            _ if case.starts_with("depth R16F") => 1.1e-3,
            _ => 1e-5,
        };
        assert!(number(&row["depth"]["most"]) < limit, "{row}");
        assert!(row["axis"] != "extent" || case == "1e7" || number(&row["covered"]) == 12288.0, "{row}");
        // Few pixels are ambiguous, except where the steps of R32F are as large as R, or where R reaches just past the
        // border of the picture.
        let along = row["along"].as_f64().unwrap();
        let most = match row["axis"].as_str().unwrap() {
            "distance" if along > 2e5 => 0.15,
            "radius" if along == 10.0 => 0.02,
            _ => 0.005,
        };
        assert!(number(&row["ambiguous"]) <= (most * number(&row["covered"])).max(2.0), "{row}");
        assert!(number(&row["beside"]) < 0.01 * number(&row["covered"]).max(100.0), "{row}");
        // The near and far planes, the offset and the scale must not matter.
        if ["near-far", "offset", "scale"].iter().any(|axis| row["axis"] == *axis) {
            assert!(number(&row["whole"]["most"]) < 1e-3, "{row}");
        }
    }
    for (axis, case, why) in [
        ("offset", "1e15", "past 1e15"),
        ("scale", "1e13", "past 1e15"),
        ("formats", "depth R16F, the scene times 1e-4", "holds depths from 6.1e-5"),
        ("formats", "depth R16F, the scene times 1e-9", "holds depths from 6.1e-5"),
        ("formats", "depth R16F, the scene times 1e2", "holds depths to 60000"),
    ] {
        assert!(find(axis, case)["refused"].as_str().is_some_and(|text| text.contains(why)), "{axis}: {case}");
    }
    for gaps in extremes["told_apart"].as_array().unwrap() {
        assert!(["near", "middle", "far"].iter().all(|at| number(&gaps[at]) < 1e-5), "{gaps}");
    }
    // Formats with fewer bits make a floor occlude itself, and an angle bias removes that.
    let floor = |formats: &str, bias: f64| {
        let floors = extremes["floor"].as_array().unwrap();
        let found = floors.iter().find(|row| row["formats"] == formats && row["bias"] == bias);
        number(&found.unwrap_or_else(|| panic!("{formats} {bias}"))["max"])
    };
    assert!(floor("R32F, RGBA16F", 0.0) < 2e-4);
    for formats in ["R16F, RGBA16F", "R32F, RGBA8_SNORM", "R32F, biased RGBA8"] {
        let bias = if formats.starts_with("R16F") { 5.0 } else { 1.0 };
        assert!(floor(formats, 0.0) > 5e-4 && floor(formats, bias) == 0.0, "{formats}");
    }

    // One row is measured again here.
    let of = |key: &str| {
        let numbers = extremes["view"][key].as_array().unwrap();
        glam::DVec3::new(number(&numbers[0]), number(&numbers[1]), number(&numbers[2]))
    };
    let lens = Some(Lens::FovY(number(&extremes["view"]["fov_y"]).to_radians()));
    let view = View { eye: Some(of("eye")), target: Some(of("target")), lens, ..View::default() };
    let [width, height] = [0, 1].map(|i| extremes["size"][i].as_u64().unwrap() as u32);
    let mesh = Scene::open("cornell-box").unwrap().mesh;
    let camera = view.camera(&mesh, width, height).unwrap().0;
    let radius = number(&extremes["view"]["radius"]);
    let settings = Settings { depth_format: DepthFormat::R16f, ..rig::float_settings(radius) };
    let context = Context::open(Backend::Auto).unwrap();
    let mut comparer = Comparer::new(context.gl(), (width, height), &settings).unwrap();
    let (found, _) = comparer.measure(&mesh, &camera).unwrap();
    let row = find("formats", "depth R16F");
    let printed = ["depth", "normals", "arithmetic", "whole", "shown"].map(|key| number(&row[key]["rmse"]));
    let measured = [found.depth, found.normals, found.arithmetic, found.whole, found.shown].map(|spread| spread.rmse);
    // The numbers lose at most the last digit when they are read from text.
    let same = printed.iter().zip(measured).all(|(printed, measured)| (printed / measured - 1.0).abs() < 1e-12);
    assert!(same, "{printed:?} {measured:?}");
}

/// Captions end with the command that makes the picture. Some of these commands are run here.
fn commands_make_the_same_pictures(page: &str, report: &Path) {
    let folder = tempfile::tempdir().unwrap();
    let commands: Vec<_> = between(page, "<code>hbao ", "</code>").filter(|c| c.starts_with("render")).collect();
    assert!(commands.len() > 15, "{}", commands.len());
    for command in commands.iter().step_by(4) {
        let output = cached(folder.path(), command);
        assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
        let file = command.rsplit(' ').next().unwrap();
        let [theirs, ours] = [report.join(file), folder.path().join(file)];
        if let Ok(grey) = png::read::<u8>(&theirs) {
            let again: Image<u8> = png::read(&ours).unwrap();
            assert!(grey == again, "{command}");
        } else {
            let colour: Image<[u8; 3]> = png::read(&theirs).unwrap();
            assert!(colour == png::read::<[u8; 3]>(&ours).unwrap(), "{command}");
        }
    }
}

#[test]
fn what_cannot_be_written_or_read_is_refused_in_one_line_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("file"), "").unwrap();
    std::fs::create_dir(folder.path().join("broken")).unwrap();
    std::fs::write(folder.path().join("broken/sibenik.obj"), "v 0 0 nonsense\n").unwrap();
    for (arguments, part) in [
        ("paper", "--output"),
        ("paper -o file", "it is a file, where a folder is wanted"),
        ("paper -o none/report", "the folder cannot be made"),
        ("paper -o report --models none", "none: no such folder"),
        ("paper -o report --models broken", "sibenik.obj"),
        ("paper -o report --size 8x8", "at least 64x48"),
        ("paper -o report --size 99999x99999", "this driver takes"),
        ("trade nave --size 99999x99999", "this driver takes"),
        ("truth nave -o t.exr --size 99999x99999", "pixels can be traced"),
        ("paper -o report --truth-rays 3", "--truth-rays"),
        ("paper -o report --runs 0", "--runs"),
    ] {
        let output = cached(folder.path(), arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        let missing = arguments.contains("--models");
        assert!(
            matches!(output.status.code(), Some(1)) || !missing && output.status.code() == Some(2),
            "{arguments}: {said}"
        );
        assert!(said.lines().last().unwrap_or_default().contains(part), "{arguments}: {said}");
        assert!(!folder.path().join("report").exists(), "{arguments}: a folder was left behind");
    }
}
