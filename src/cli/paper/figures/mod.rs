//! The papers' figures, rendered again.

pub(super) mod crysis;

use super::drawing::{self, Axes};
use super::lab::{Lab, Subject};
use super::page::{Drawing, Figure, Picture};
use super::scenes;
use crate::cli::picture::{FileFormat, Show, encode};
use hbao::image::{Image, Texel, metadata, png};
use hbao::reference::anatomy::Anatomy;
use hbao::scene::CORNELL_BOX;
use hbao::settings::{Attenuation, Edges, Jitter, KNOBS, Kind, Method, Radius, Snap, Toggle};
use hbao::{Apply, Error, Request, Settings};

/// A figure's maker.
pub(super) type Make = fn(&Lab) -> Result<Figure, Error>;

/// In the papers' order.
pub(super) const ALL: [Make; 16] = [
    crysis::game_scene,
    crysis::scenarios,
    crysis::edges,
    crysis::without_rotation,
    crysis::blur,
    first_picture,
    attenuation,
    hidden_sample,
    snapped_directions,
    low_tessellation,
    angle_bias,
    edge_bleeding,
    sample_counts,
    dragon,
    talk,
    methods,
];

/// Renders one picture of `show`.
fn picture(
    lab: &Lab,
    subject: &Subject,
    size: (u32, u32),
    settings: &Settings,
    show: Show,
    (file, caption): (&str, &str),
) -> Result<Picture, Error> {
    let request = Request {
        composite: (show == Show::Final).then_some(Apply::All),
        raw: show == Show::AoRaw,
        edges: show == Show::Edges,
        ..Request::default()
    };
    let (pipeline, _) = lab.render(subject, size, settings, request)?;
    let file = format!("{file}.png");
    let text = settings.to_toml();
    let show_name = Show::NAMES.iter().find(|&&(_, named)| named == show).map_or("", |&(name, _)| name);
    Ok(Picture {
        caption: caption.into(),
        png: encode(&pipeline, show, FileFormat::Png, &metadata(&text))?,
        size: (size.0 as usize, size.1 as usize),
        enlarged: 1,
        command: subject.arguments.as_ref().map(|arguments| {
            let size = format!("--size {}x{}", size.0, size.1);
            format!("hbao render {arguments} {size} --show {show_name}{} -o {file}", flags(subject, settings))
        }),
        file,
    })
}

/// The flags by which settings differ from what the command takes for this scene.
fn flags(subject: &Subject, settings: &Settings) -> String {
    let default = subject.settings(settings.method);
    let mut flags = String::new();
    for knob in KNOBS {
        let text = knob.text(settings);
        let given = match knob.name {
            "method" => settings.method != Method::default(),
            _ => text != knob.text(&default),
        };
        if given && knob.kind == Kind::Switch {
            flags += &format!(" --{}", knob.name);
        } else if given {
            flags += &format!(" --{} {text}", knob.name);
        }
    }
    flags
}

/// A part of an image as a picture of its own, each pixel `enlarged` times as large.
pub(super) fn detail<T: Texel<Component = u8>>(
    image: &Image<T>,
    (left, bottom): (usize, usize),
    (width, height): (usize, usize),
    enlarged: usize,
    (file, caption): (&str, &str),
) -> Result<Picture, Error> {
    let (width, height) = (width.min(image.width), height.min(image.height));
    let (left, bottom) = (left.min(image.width - width), bottom.min(image.height - height));
    let part = Image::from_fn(width, height, |x, y| image.at(left + x, bottom + y));
    Ok(Picture {
        file: format!("{file}.png"),
        caption: caption.into(),
        png: png::encode(&part, &metadata(""))?,
        size: (width, height),
        enlarged,
        command: None,
    })
}

pub(super) fn grey(image: &Image<f32>) -> Image<u8> {
    image.map(|a| (255.0 * a).round() as u8)
}

fn first_picture(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["sibenik"]);
    let settings = Settings { directions: 16, steps: 16, ..subject.settings(Method::Hbao) };
    let name = &subject.name;
    Ok(Figure {
        id: "6.2.1".into(),
        title: "Horizon-based ambient occlusion".into(),
        text: "The chapter's method: 16 directions of 16 steps, blur 9x9.".into(),
        pictures: vec![
            picture(lab, subject, lab.size, &settings, Show::Final, ("6.2.1", &format!("{name}, times its colours")))?,
            picture(lab, subject, lab.size, &settings, Show::Ao, ("6.2.1-ao", &format!("{name}, visibility")))?,
            picture(lab, subject, lab.size, &settings, Show::Color, ("6.2.1-color", &format!("{name}, without it")))?,
        ],
        ..Figure::default()
    })
}

fn attenuation(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["sibenik"]);
    let with = subject.settings(Method::Hbao);
    let without = Settings { attenuation: Attenuation::None, ..with.clone() };
    Ok(Figure {
        id: "6.2.3".into(),
        title: "With and without attenuation".into(),
        text: "Without W occlusion ends abruptly where occluders come to lie further than R.".into(),
        pictures: vec![
            picture(lab, subject, lab.size, &without, Show::Ao, ("6.2.3-without", "without: W = 1"))?,
            picture(lab, subject, lab.size, &with, Show::Ao, ("6.2.3-with", "with: W = 1 - (r/R)^2"))?,
        ],
        ..Figure::default()
    })
}

fn hidden_sample(lab: &Lab) -> Result<Figure, Error> {
    let pit = scenes::pit()?;
    let size = lab.small();
    let methods = [
        (Method::Ssao, "ssao: points above the rim's far side count as open"),
        (Method::Hbao, "hbao: the horizon stays at the rim"),
    ];
    let pictures = methods
        .map(|(method, caption)| {
            let settings = Settings { ssao_normals: Toggle::On, ..pit.settings(method) };
            picture(lab, &pit, size, &settings, Show::Ao, (&format!("6.2.4-{}", method.name()), caption))
        })
        .into_iter()
        .collect::<Result<_, _>>()?;
    Ok(Figure {
        id: "6.2.4".into(),
        title: "Above the height field, and hidden all the same".into(),
        text: "A floor seen from above, with a square rim upright on it. What lies over the floor outside the rim is in \
               front of the depth image's surface, but the rim hides it from the floor inside. Crysis' method (here with \
               normals, so that flat surfaces are open) finds the floor inside open but next to the rim; the horizon does \
               not. The claim on hidden points counts them."
            .into(),
        pictures,
        ..Figure::default()
    })
}

fn snapped_directions(lab: &Lab) -> Result<Figure, Error> {
    let (size, pixel) = ((160, 120), (80, 60));
    let wall = scenes::fold("wall", "wall", 0.0, size)?;
    let base = Settings { radius: Radius::Units(6.0), directions: 6, steps: 5, ..wall.exact(Method::Hbao) };
    let seen = lab.see(&wall, size, &base)?;
    let inputs = seen.inputs();
    let mut drawings = Vec::new();
    for (snap, caption) in [
        (Snap::Step, "the first offset and the step are rounded: every direction walks by whole texels, and bends off"),
        (Snap::Sample, "each sample is rounded by itself: the directions are kept"),
    ] {
        let settings = Settings { snap, ..base.clone() };
        let twin = Anatomy::new(&inputs, &settings)?;
        let directions: Vec<Vec<(f64, f64)>> = (0..settings.directions)
            .map(|k| twin.offsets(pixel, k).unwrap_or_default().iter().map(|o| (o.x, o.y)).collect())
            .collect();
        let [cos_a, sin_a, _] = hbao::rotation_tile(&settings).at(pixel.0 % 4, pixel.1 % 4).map(f64::from);
        let turn = sin_a.atan2(cos_a);
        drawings.push(Drawing {
            file: format!("6.2.10-{}.svg", snap.name()),
            caption: format!("snap = {}: {caption}", snap.name()),
            svg: drawing::texels(&directions, turn)?,
        });
    }
    Ok(Figure {
        id: "6.2.10".into(),
        title: "Snapped directions".into(),
        text: "The texels that one pixel of a wall reads, 6 directions of 5 steps; lines are the directions meant."
            .into(),
        drawings,
        ..Figure::default()
    })
}

/// The bias of the figures on creases: more than the angle between two facets of the vault.
pub(super) const BIAS_DEGREES: f64 = 30.0;
/// Flat strips of the vault: creases of 18 degrees.
pub(super) const FACETS: u32 = 10;

fn low_tessellation(lab: &Lab) -> Result<Figure, Error> {
    let vault = scenes::vault(FACETS, false)?;
    let settings =
        |bias: f64| Settings { bias: bias.to_radians(), directions: 16, steps: 16, ..vault.settings(Method::Hbao) };
    let biased = format!("bias {BIAS_DEGREES} degrees");
    Ok(Figure {
        id: "6.2.13".into(),
        title: "Creases of low tessellation".into(),
        text: format!("The inside of a round vault of {FACETS} flat strips, which meet at {} degrees.", 180 / FACETS),
        pictures: vec![
            picture(lab, &vault, lab.small(), &settings(0.0), Show::Ao, ("6.2.13-a", "bias 0"))?,
            picture(lab, &vault, lab.small(), &settings(BIAS_DEGREES), Show::Ao, ("6.2.13-b", &biased))?,
        ],
        ..Figure::default()
    })
}

fn angle_bias(lab: &Lab) -> Result<Figure, Error> {
    let (size, beside) = ((320, 240), (161, 120));
    let mut series = Vec::new();
    for bias in [0.0, 15.0, 30.0, 45.0f64] {
        let mut points = Vec::new();
        for degrees in (0..=90).step_by(6) {
            // Both sides rise by half of the angle, so that one rises over the other's plane by the whole.
            let subject = scenes::fold("fold", "fold", -f64::from(degrees).to_radians() / 2.0, size)?;
            let settings = Settings {
                radius: Radius::Units(12.0),
                bias: bias.to_radians(),
                directions: 16,
                steps: 16,
                jitter: Jitter::None,
                blur: 0,
                ..subject.exact(Method::Hbao)
            };
            let image = lab.render(&subject, size, &settings, Request::default())?.0.ao()?;
            points.push((f64::from(degrees), 1.0 - f64::from(image.at(beside.0, beside.1))));
        }
        series.push((format!("bias {bias}\u{b0}"), points));
    }
    let axes = Axes {
        x: "angle by which one face rises over the other's plane, degrees",
        y: "occlusion 1 - A beside the crease",
        logarithmic: false,
    };
    Ok(Figure {
        id: "6.2.14".into(),
        title: "What an angle bias ignores".into(),
        text: "Two faces that meet in a crease: occlusion one pixel beside it, by the angle between them. Directions whose \
               horizon rises over the tangent by less than the bias add nothing, and the others less."
            .into(),
        drawings: vec![Drawing {
            file: "6.2.14.svg".into(),
            caption: "occlusion beside a crease".into(),
            svg: drawing::lines(&series, &axes)?,
        }],
        ..Figure::default()
    })
}

fn edge_bleeding(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["dragon", CORNELL_BOX]);
    let request = Request { composite: Some(Apply::All), edges: true, ..Request::default() };
    let supersampled = subject.settings(Method::Hbao);
    let naive = Settings { edges: Edges::Off, ..supersampled.clone() };
    let (with, _) = lab.render(subject, lab.size, &supersampled, request)?;
    let (without, _) = lab.render(subject, lab.size, &naive, request)?;
    let (Some(with_final), Some(without_final), Some(edges)) = (with.composite()?, without.composite()?, with.edges())
    else {
        return Err(Error::Usage("the final images were not kept".into()));
    };
    // Where the two differ most over a window.
    let side = 96.min(with_final.width).min(with_final.height);
    let difference = with.ao()?.texels.iter().zip(&without.ao()?.texels).map(|(a, b)| (a - b).abs()).collect();
    let difference = Image { width: with_final.width, height: with_final.height, texels: difference };
    let at = largest(&difference, side);
    let window = (side, side);
    let shown = |image: &Image<[u8; 3]>, file: &str, caption: &str| detail(image, at, window, 4, (file, caption));
    let mut pictures = vec![
        shown(&with.colour()?, "6.2.15-a", "colour, no ambient occlusion")?,
        shown(
            &without_final,
            "6.2.15-b",
            "the blur around the resolved depth: what is behind bleeds into silhouettes",
        )?,
        shown(&with_final, "6.2.15-c", "the supersampling blur at edges")?,
    ];
    for (image, file, caption) in
        [(&without, "6.2.15-b-ao", "visibility, plain blur"), (&with, "6.2.15-c-ao", "visibility, supersampling blur")]
    {
        pictures.push(detail(&grey(&image.ao()?), at, window, 4, (file, caption))?);
    }
    let marked = edges.map(|edge| if edge { 255u8 } else { 0 });
    pictures.push(detail(&marked, at, window, 4, ("6.2.15-edges", "which pixels are edges"))?);
    Ok(Figure {
        id: "6.2.15".into(),
        title: "Bleeding at edges, and the supersampling blur".into(),
        text: format!(
            "{}, with {} depth samples a pixel: {side}x{side} pixels where the two blurs differ most, enlarged.",
            subject.name,
            with.samples()
        ),
        pictures,
        ..Figure::default()
    })
}

/// The lower left corner of the window of `side` pixels, on a grid of half its side, with the largest sum.
fn largest(image: &Image<f32>, side: usize) -> (usize, usize) {
    let step = (side / 2).max(1);
    let sum = |(left, bottom): &(usize, usize)| -> f32 {
        (0..side * side).map(|i| image.at(left + i % side, bottom + i / side)).sum()
    };
    let rows = (0..=image.height - side).step_by(step);
    let corners = rows.flat_map(|y| (0..=image.width - side).step_by(step).map(move |x| (x, y)));
    corners.max_by(|a, b| sum(a).total_cmp(&sum(b))).unwrap_or((0, 0))
}

fn sample_counts(lab: &Lab) -> Result<Figure, Error> {
    let views = ["sibenik", "sibenik-choir", "dragon"].map(|key| lab.subject(key));
    let mut views: Vec<&Subject> = views.into_iter().flatten().collect();
    if views.is_empty() {
        views = lab.data_sets();
    }
    let mut pictures = Vec::new();
    for subject in views {
        for (count, blur) in [(4, 21), (8, 15), (16, 9)] {
            let settings = Settings { directions: count, steps: count, blur, ..subject.settings(Method::Hbao) };
            let caption = format!("{}, {count}/{count}, blur {blur}x{blur}", subject.name);
            let file = format!("6.2.16-{}-{count}", subject.key);
            pictures.push(picture(lab, subject, lab.size, &settings, Show::Ao, (&file, &caption))?);
        }
    }
    Ok(Figure {
        id: "6.2.16".into(),
        title: "4/4, 8/8 and 16/16 directions and steps".into(),
        text: "The blur shrinks as the samples grow. Where a step is below a texel, far away and with many steps, the \
               chapter's early exit leaves surfaces open."
            .into(),
        pictures,
        ..Figure::default()
    })
}

fn dragon(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["dragon", CORNELL_BOX]);
    let settings = subject.settings(Method::Hbao);
    Ok(Figure {
        id: "6.2.17".into(),
        title: "Diffuse shading, ambient occlusion, and both".into(),
        text: format!("{}.", subject.name),
        pictures: vec![
            picture(lab, subject, lab.size, &settings, Show::Color, ("6.2.17-diffuse", "diffuse shading"))?,
            picture(lab, subject, lab.size, &settings, Show::Ao, ("6.2.17-ao", "visibility"))?,
            picture(lab, subject, lab.size, &settings, Show::Final, ("6.2.17-final", "both"))?,
        ],
        ..Figure::default()
    })
}

fn talk(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["dragon", "sibenik"]);
    let horizons = subject.settings(Method::HbaoTalk);
    // As the talk has it: the same linear attenuation in both.
    let rays = Settings { attenuation: Attenuation::Linear, ..subject.settings(Method::RayMarch) };
    Ok(Figure {
        id: "talk-1".into(),
        title: "The talk's Figure 1: horizons and ray marching".into(),
        text: "8 directions of 8 steps; ray marching with 4 rays a direction. Their speeds stand under the tables."
            .into(),
        pictures: vec![
            picture(lab, subject, lab.size, &horizons, Show::Ao, ("talk-1-hbao", "horizons (hbao-talk)"))?,
            picture(lab, subject, lab.size, &rays, Show::Ao, ("talk-1-ray-march", "ray marching, 4 rays a direction"))?,
        ],
        ..Figure::default()
    })
}

fn methods(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["sibenik"]);
    let mut pictures = Vec::new();
    for method in [Method::Hbao, Method::HbaoTalk, Method::RayMarch, Method::Ssao, Method::Microsphere, Method::Crease]
    {
        let name = method.name();
        let settings = subject.settings(method);
        pictures.push(picture(lab, subject, lab.small(), &settings, Show::Ao, (&format!("method-{name}"), name))?);
    }
    Ok(Figure {
        id: "methods".into(),
        title: "Every method side by side".into(),
        text: format!("{}, each with its own defaults.", subject.name),
        pictures,
        ..Figure::default()
    })
}
