//! Computes what one case of [`super::bench`] costs relative to another, together with the ratio that follows from the
//! papers' figures.

use super::bench::Measurement;
use super::median;
use super::published::{COLUMNS, CRYSIS_SMALL_DEPTH, Cost, EIGHT, FIGURE_1, TABLE_6_2_1, ULTRA, table_mpixels_per_s};
use crate::settings::Method;

/// The time of one case divided by that of another, as measured here and in the papers.
#[derive(Clone, Debug, PartialEq)]
pub struct Ratio {
    /// The names of the two cases: 'AO at 4x over 1x, 8/8' is the first time divided by the second.
    pub what: &'static str,
    /// The ratio of the measured medians.
    pub ours: f64,
    /// The papers' ratios, each with its graphics card or its source; empty if no paper gives one.
    pub papers: Vec<(&'static str, f64)>,
}

/// A figure from the table: the kind of cost, the mode, and the column in [`COLUMNS`].
type Cell = (Cost, &'static str, usize);

/// The ratios that follow from Table 6.2.1. Each is the first figure divided by the second.
const OF_THE_TABLE: [(&str, Cell, Cell); 11] = [
    ("AO 4/4 over 8/8, half resolution", (Cost::Ao, "half", 2), (Cost::Ao, "half", EIGHT)),
    ("AO 4/4 over 8/8, 1x", (Cost::Ao, "msaa1", 2), (Cost::Ao, "msaa1", EIGHT)),
    ("AO 4/4 over 8/8, 4x", (Cost::Ao, "msaa4", 2), (Cost::Ao, "msaa4", EIGHT)),
    ("AO 16/16 over 8/8, half resolution", (Cost::Ao, "half", 4), (Cost::Ao, "half", EIGHT)),
    ("AO 16/16 over 8/8, 1x", (Cost::Ao, "msaa1", 4), (Cost::Ao, "msaa1", EIGHT)),
    ("AO 16/16 over 8/8, 4x", (Cost::Ao, "msaa4", 4), (Cost::Ao, "msaa4", EIGHT)),
    ("AO at half over full resolution, 8/8", (Cost::Ao, "half", EIGHT), (Cost::Ao, "msaa1", EIGHT)),
    ("AO at 4x over 1x, 8/8", (Cost::Ao, "msaa4", EIGHT), (Cost::Ao, "msaa1", EIGHT)),
    ("frame at 4x over 1x, 8/8", (Cost::Frame, "msaa4", EIGHT), (Cost::Frame, "msaa1", EIGHT)),
    ("frame at half over full resolution, 8/8", (Cost::Frame, "half", EIGHT), (Cost::Frame, "msaa1", EIGHT)),
    ("blur over AO, 8/8, 1x", (Cost::Blur, "msaa1", EIGHT), (Cost::Ao, "msaa1", EIGHT)),
];

/// Returns the ratios whose two cases were both measured.
pub fn ratios(measured: &[Measurement]) -> Vec<Ratio> {
    let ours = |cost: Cost, mode: &str, column: &str| {
        let is = |one: &&Measurement| one.case.mode == mode && one.case.column == column;
        // If the driver gave fewer samples than the case asks for, the measurement does not count.
        let found = measured.iter().find(is).filter(|one| one.samples == one.case.settings.msaa);
        found.map_or(f64::NAN, |one| {
            median(match cost {
                Cost::Frame => &one.frame_ms,
                Cost::Ao => &one.ao_ms,
                Cost::Blur => &one.blur_ms,
            })
        })
    };
    let of_the_table = OF_THE_TABLE.iter().map(|&(what, over, under)| {
        let here = |(cost, mode, column): Cell| ours(cost, mode, COLUMNS[column]);
        let cards = TABLE_6_2_1.iter().filter(|row| row.mode == over.1);
        let papers = cards.filter_map(|row| {
            let other = TABLE_6_2_1.iter().find(|other| other.mode == under.1 && other.card == row.card)?;
            Some((row.card, row.ms(over.0, over.2) / other.ms(under.0, under.2)))
        });
        Ratio { what, ours: here(over) / here(under), papers: papers.collect() }
    });
    let alone =
        |over: Method, under: Method| ours(Cost::Ao, "figure1", over.name()) / ours(Cost::Ao, "figure1", under.name());
    let [(talk, talk_mpixels_per_s), (rays, rays_mpixels_per_s)] = FIGURE_1;
    let between = talk_mpixels_per_s / table_mpixels_per_s();
    let crysis = |column: &str| ours(Cost::Ao, "crysis", column);
    let others = [
        ("ray-march over hbao-talk", alone(rays, talk), vec![(ULTRA, talk_mpixels_per_s / rays_mpixels_per_s)]),
        ("hbao over hbao-talk", alone(Method::Hbao, talk), vec![("between the papers", between)]),
        ("ray-march over hbao", alone(rays, Method::Hbao), Vec::new()),
        (
            "full-size depth over half-size",
            crysis("full depth") / crysis("half-size depth"),
            vec![("Crysis", CRYSIS_SMALL_DEPTH)],
        ),
        ("matrix over mirror", crysis("full depth") / crysis("mirror"), Vec::new()),
    ];
    let others = others.into_iter().map(|(what, ours, papers)| Ratio { what, ours, papers });
    of_the_table.chain(others).filter(|ratio| !ratio.ours.is_nan()).collect()
}
