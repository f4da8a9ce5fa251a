//! The tables of `hbao bench`: the papers' tables measured again, and the growth of costs.

use super::cells::{number, percent, samples_of, size_of, spread, with_spread};
use hbao::measure::bench::{Change, InputCost, Measurement, exponent};
use hbao::measure::median;
use hbao::measure::published::{COLUMNS, EIGHT, FIGURE_1, TABLE_6_2_1, ULTRA, figure_1, table_mpixels_per_s};
use hbao::measure::ratios::Ratio;
use hbao::measure::table::{Column, Table};

/// The modes of Table 6.2.1, and their names in tables.
const MODES: [(&str, &str); 3] = [("half", "half resolution"), ("msaa1", "1x MSAA"), ("msaa4", "4x MSAA")];

/// Returns the name of a mode of Table 6.2.1 in tables.
fn mode_in_words(mode: &str) -> &'static str {
    MODES.iter().find(|(known, _)| *known == mode).map_or("", |(_, words)| words)
}

/// Makes the text of a cell from a measurement.
type Cell = fn(&Measurement) -> String;

/// The cell of the frame rate, which Table 6.2.1 shows.
const FRAME_RATE: Cell = |one| number(one.fps(), 2);

/// The times of the parts of a frame: their names, and their cells.
const FRAME_TIMES: [(&str, Cell); 5] = [
    ("frame", |one| with_spread(&one.frame_ms)),
    ("AO", |one| with_spread(&one.ao_ms)),
    ("its fetch floor", |one| with_spread(&one.floor_ms)),
    ("blur", |one| with_spread(&one.blur_ms)),
    ("compiling", |one| number(one.compile_ms, 0)),
];

/// Makes an empty table with the columns of Table 6.2.1.
fn frame_columns() -> Table {
    Table::new([Column::left("", 28)].into_iter().chain(COLUMNS.map(|column| Column::right(column, 16))))
}

/// Makes the row of a mode, with a cell for each column of Table 6.2.1.
fn frame_row(measured: &[Measurement], name: String, mode: &str, cell: Cell) -> Vec<String> {
    let of = |column: &str| measured.iter().find(|one| one.case.mode == mode && one.case.column == column);
    let cells = COLUMNS.iter().map(|column| of(column).map_or("-".into(), cell));
    [name].into_iter().chain(cells).collect()
}

/// Returns the modes of Table 6.2.1 that were measured, and their names in tables.
fn modes(measured: &[Measurement]) -> impl Iterator<Item = (&'static str, &'static str)> {
    MODES.into_iter().filter(|(mode, _)| measured.iter().any(|one| one.case.mode == *mode))
}

/// Makes Table 6.2.1 from measurements: for each mode the frame rate, and below it the times of the parts of a frame.
pub(crate) fn frames(measured: &[Measurement]) -> Table {
    frame_columns().filled(modes(measured).flat_map(|(mode, words)| {
        let rate = frame_row(measured, format!("{words}, frames/s"), mode, FRAME_RATE);
        let times = FRAME_TIMES.map(|(name, cell)| frame_row(measured, format!("  {name}, ms"), mode, cell));
        [rate].into_iter().chain(times).collect::<Vec<_>>()
    }))
}

/// Makes Table 6.2.1 from measurements, with frame rates only.
pub(crate) fn frame_rates(measured: &[Measurement]) -> Table {
    let row = |(mode, words): (_, &str)| frame_row(measured, words.into(), mode, FRAME_RATE);
    frame_columns().filled(modes(measured).map(row))
}

/// Makes the table of the times of the parts of a frame, in the cases of Table 6.2.1.
pub(crate) fn frame_times(measured: &[Measurement]) -> Table {
    frame_columns().filled(modes(measured).flat_map(|(mode, words)| {
        FRAME_TIMES.map(|(name, cell)| frame_row(measured, format!("{words}, {name}"), mode, cell))
    }))
}

/// Makes Table 6.2.1 as it was published.
pub(crate) fn published_frames() -> Table {
    frame_columns().filled(TABLE_6_2_1.iter().map(|row| {
        let name = format!("{}, {}", mode_in_words(row.mode), row.card);
        [name].into_iter().chain(row.fps.iter().map(f64::to_string)).collect()
    }))
}

/// Makes the table of each method's AO pass alone, with the figures of Figure 1 of the talk.
pub(crate) fn methods(measured: &[Measurement]) -> Table {
    let columns = [
        Column::left("method", 14),
        Column::left("samples", 12),
        Column::right("MPixels/s", 10),
        Column::right("2008", 6),
        Column::right("AO, ms", 14),
        Column::right("floor, ms", 14),
        Column::right("AO/floor", 10),
        Column::right("ns/fetch", 10),
        Column::right("compiling, ms", 15),
    ];
    Table::new(columns).filled(measured.iter().filter(|one| one.case.mode == "figure1").map(|one| {
        let method = one.case.method();
        vec![
            method.name().into(),
            samples_of(&one.case),
            number(one.mpixels_per_s(), 2),
            figure_1(method).map_or(String::new(), |then| number(then, 0)),
            with_spread(&one.ao_ms),
            with_spread(&one.floor_ms),
            number(one.ao_to_floor(), 2),
            number(one.ns_per_sample(&one.floor_ms), 2),
            number(one.compile_ms, 0),
        ]
    }))
}

/// Says by how much the two papers disagree about one graphics card.
pub(crate) fn disagreement() -> String {
    format!(
        "The two papers disagree: the talk has {} MPixels/s with 8 directions of 8 steps on an {ULTRA}, and Table 6.2.1, by its \
         frames with {} less those with {} at 1x, {:.1} on the same card.",
        FIGURE_1[0].1,
        COLUMNS[EIGHT],
        COLUMNS[1],
        table_mpixels_per_s()
    )
}

/// Makes the table of the ambient occlusion of Crysis, its blur, and both together, in milliseconds.
pub(crate) fn crysis(measured: &[Measurement]) -> Table {
    let columns = [
        Column::left("", 18),
        Column::right("AO, ms", 14),
        Column::right("blur, ms", 14),
        Column::right("both, ms", 12),
    ];
    Table::new(columns).filled(measured.iter().filter(|one| one.case.mode == "crysis").map(|one| {
        let both = median(&one.ao_ms) + median(&one.blur_ms);
        vec![one.case.column.into(), with_spread(&one.ao_ms), with_spread(&one.blur_ms), number(both, 2)]
    }))
}

/// Makes the table of ratios of times, here and in the papers.
pub(crate) fn ratios(ratios: &[Ratio]) -> Table {
    let columns = [Column::left("ratio of times", 42), Column::right("here", 8), Column::left("2008", 0).after_gap(3)];
    Table::new(columns).filled(ratios.iter().map(|ratio| {
        let papers: Vec<String> = ratio.papers.iter().map(|(card, x)| format!("{card} {x:.2}")).collect();
        vec![ratio.what.into(), number(ratio.ours, 2), papers.join(", ")]
    }))
}

/// Selects one kind of times of a measurement.
pub(crate) type Times = fn(&Measurement) -> &Vec<f64>;

/// The series of the scaling, each with the times to which a power is fitted.
pub(crate) const SERIES: [(&str, [(&str, Times); 2]); 3] = [
    ("pixels", [("ao", |one| &one.ao_ms), ("frame", |one| &one.frame_ms)]),
    ("samples", [("ao", |one| &one.ao_ms), ("floor", |one| &one.floor_ms)]),
    ("triangles", [("ao", |one| &one.ao_ms), ("gbuffer", |one| &one.gbuffer_ms)]),
];

/// Returns the measurements of one series of the scaling.
pub(crate) fn of_series<'a>(measured: &'a [Measurement], series: &'a str) -> impl Iterator<Item = &'a Measurement> {
    measured.iter().filter(move |one| one.case.mode == "scaling" && one.case.column == series)
}

/// Makes the table of one series of the scaling.
pub(crate) fn series(measured: &[Measurement], series: &str) -> Table {
    let columns = [
        Column::left(series, 12),
        Column::left("size", 12),
        Column::right("AO, ms", 16),
        Column::right("ns/sample", 12),
        Column::right("G-buffer, ms", 16),
        Column::right("frame, ms", 16),
    ];
    Table::new(columns).filled(of_series(measured, series).map(|one| {
        vec![
            number(one.along(), 0),
            size_of(&one.case),
            with_spread(&one.ao_ms),
            number(one.ns_per_sample(&one.ao_ms), 3),
            with_spread(&one.gbuffer_ms),
            with_spread(&one.frame_ms),
        ]
    }))
}

/// Makes the table of what changing settings adds to a frame.
pub(crate) fn changes(all: &[Change]) -> Table {
    let columns =
        [Column::left("changes in each frame", 24), Column::right("added, ms", 12), Column::right("farthest, ms", 14)];
    Table::new(columns).filled(all.iter().map(|one| {
        let (low, high) = spread(&one.added_ms);
        let middle = median(&one.added_ms);
        vec![one.setting.into(), number(middle, 4), number((high - middle).max(middle - low), 4)]
    }))
}

/// Makes the table of what the forms of inputs cost.
pub(crate) fn input_costs(all: &[InputCost]) -> Table {
    let columns = [
        Column::left("inputs", 28),
        Column::right("linear_depth, ms", 18),
        Column::right("rebuilt_normals, ms", 21),
        Column::right("AO, ms", 16),
        Column::right("share of AO", 13),
    ];
    Table::new(columns).filled(all.iter().map(|one| {
        vec![
            one.inputs.into(),
            with_spread(&one.linear_depth_ms),
            with_spread(&one.rebuilt_normals_ms),
            with_spread(&one.ao_ms),
            percent(one.share()),
        ]
    }))
}

/// The growth of one kind of times along a series of the scaling.
pub(crate) struct Growth {
    pub(crate) series: &'static str,
    /// The name of the times that grow.
    pub(crate) of: &'static str,
    /// The power of the varied quantity with which the times grow; `None` if no power can be fitted.
    pub(crate) exponent: Option<f64>,
}

/// Fits a power to each kind of times of each series.
pub(crate) fn growths(measured: &[Measurement]) -> Vec<Growth> {
    let fitted = |series: &str, times: Times| {
        exponent(&of_series(measured, series).map(|one| (one.along(), median(times(one)))).collect::<Vec<_>>())
    };
    let all = SERIES.iter().flat_map(|(series, all)| all.iter().map(move |&(of, times)| (*series, of, times)));
    all.map(|(series, of, times)| Growth { series, of, exponent: fitted(series, times) }).collect()
}
