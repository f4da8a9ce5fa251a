//! The figures on the parts of Crysis' method that have no switch, and on the border of the picture (ShaderX7 6.1). The
//! float64 twin computes what the method would find without a part.

use super::picture::{detail, grey};
use crate::report::figure::{Figure, Picture};
use crate::report::lab::{Lab, Seen};
use crate::report::scenes::{self, BOARDS};
use crate::report::subject::Subject;
use hbao::image::Image;
use hbao::measure::table::Table;
use hbao::reference::{self, TwinInputs, anatomy::Anatomy, blur};
use hbao::settings::Method;
use hbao::{Error, Pipeline, Request, Settings, rotation_tile, size_limit};

/// Computes a picture by a twin, at the pixels from `corner` on. Background is 1.
fn drawn(twin: &Anatomy, corner: (usize, usize), (width, height): (usize, usize)) -> Image<f64> {
    let pixels: Vec<_> = (0..width * height).map(|i| (corner.0 + i % width, corner.1 + i / width)).collect();
    let texels = twin.visibilities(&pixels).into_iter().map(|a| a.unwrap_or(1.0)).collect();
    Image { width, height, texels }
}

fn single(image: &Image<f64>) -> Image<f32> {
    image.map(|a| a as f32)
}

/// Returns `ssao` with its blur, without the depth range check and with it.
fn ranges(seen: &Seen, settings: &Settings) -> Result<[Image<f64>; 2], Error> {
    let inputs = seen.inputs();
    let size = (seen.depth.width, seen.depth.height);
    let image = |twin: Anatomy| blur::blur(&drawn(&twin, (0, 0), size), &seen.depth, &[], seen.projection, settings);
    let twin = || Anatomy::new(&inputs, settings);
    Ok([image(twin()?.without_range_check())?, image(twin()?)?])
}

/// What a board far in front of a wall does to the visibility of the wall, by `ssao`.
pub(in crate::report) struct Halo {
    /// The mean change of the wall's visibility without the depth range check, and with it. The mean is over the pixels
    /// that change without it.
    pub(in crate::report) change: [f64; 2],
    /// The number of these pixels.
    pub(in crate::report) pixels: usize,
    /// The images, without the check and with it.
    images: [Image<f64>; 2],
}

/// Measures the halo that a board makes on a wall that is `1 / nearness` times as far away.
pub(in crate::report) fn halo(lab: &Lab, nearness: f64) -> Result<Halo, Error> {
    let size = lab.small();
    let [with, without] = [Some(nearness), None].map(|board| scenes::wall_behind(board, size));
    let (with, without) = (with?, without?);
    let settings = with.exact(Method::Ssao);
    let [seen, alone] = [&with, &without].map(|subject| lab.see(subject, size, &settings));
    let (seen, alone) = (seen?, alone?);
    let (images, [_, wall]) = (ranges(&seen, &settings)?, ranges(&alone, &settings)?);
    // The blur does not cross from the wall to the board, because their depths differ by more than its sigma.
    let on_wall = |i: usize| (seen.depth.texels[i] - alone.depth.texels[i]).abs() <= 1e-3 * alone.depth.texels[i];
    let change = |image: &Image<f64>, i: usize| (image.texels[i] - wall.texels[i]).abs();
    let changed: Vec<usize> = (0..wall.texels.len()).filter(|&i| on_wall(i) && change(&images[0], i) > 1e-9).collect();
    let mean =
        |image: &Image<f64>| changed.iter().map(|&i| change(image, i)).sum::<f64>() / changed.len().max(1) as f64;
    Ok(Halo { change: [mean(&images[0]), mean(&images[1])], pixels: changed.len(), images })
}

fn whole(image: &Image<f64>, file: &str, caption: &str) -> Result<Picture, Error> {
    let image = single(image);
    detail(&grey(&image), (0, 0), (image.width, image.height), 1, file, caption)
}

pub(super) fn range_check(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["sponza", "sibenik"]);
    let settings = subject.exact(Method::Ssao);
    let [without, with] = ranges(&lab.see(subject, lab.small(), &settings)?, &settings)?;
    let name = &subject.name;
    let mut pictures = vec![
        whole(&without, "range-without", &format!("{name}, without the range check"))?,
        whole(&with, "range-with", &format!("{name}, with it"))?,
    ];
    let mut rows = Vec::new();
    for (nearness, words) in BOARDS {
        let halo = halo(lab, nearness)?;
        if pictures.len() == 2 {
            let [without, with] = &halo.images;
            pictures.push(whole(without, "range-board-without", &format!("board {words}, without the range check"))?);
            pictures.push(whole(with, "range-board-with", &format!("board {words}, with it"))?);
        }
        rows.push(vec![format!("board {words}"), format!("{:.4}", halo.change[0]), format!("{:.4}", halo.change[1])]);
    }
    Ok(Figure {
        id: "range-check".into(),
        title: "The depth range check".into(),
        text: "Crysis' method knows nothing of what lies behind a near object, and would take all of it for solid: near \
               objects make dark halos on what is far behind them. The range check fades such samples to half open. The \
               method has no switch for it, so the float64 twin computes both pictures."
            .into(),
        pictures,
        tables: vec![
            Table::headed(["scene", "without the check", "with it"])
                .captioned("Mean change of a wall's visibility around a board in front of it")
                .filled(rows),
        ],
        ..Figure::default()
    })
}

/// The errors of the 4x4 blur of `ssao` against the mean over all turns of its kernel, which has no noise. All are root
/// mean squares.
pub(in crate::report) struct Mixing {
    /// Beside discontinuities of depth, where the 4x4 pixels show several surfaces: unblurred, with a blur that ignores
    /// depth, and with the method's own.
    pub(in crate::report) beside: [f64; 3],
    /// On single surfaces: unblurred, and with the method's own blur.
    pub(in crate::report) inside: [f64; 2],
    /// How many pixels are beside discontinuities.
    pub(in crate::report) pixels: usize,
}

/// Measures what the 4x4 blur of `ssao` does to a scene.
pub(in crate::report) fn mixing(lab: &Lab, subject: &Subject) -> Result<Mixing, Error> {
    let settings = subject.exact(Method::Ssao);
    let seen = lab.see(subject, lab.small(), &settings)?;
    let tile = rotation_tile(&settings);
    // Each pixel meets every texel of the tile if the tile is shifted by all of its texels in turn.
    let mut ideal = seen.depth.map(|_| 0.0);
    for i in 0..16 {
        let shifted = Image::from_fn(4, 4, |x, y| tile.at((x + i % 4) % 4, (y + i / 4) % 4));
        let turned = reference::visibility(&TwinInputs { tile: &shifted, ..seen.inputs() }, &settings)?;
        ideal.texels.iter_mut().zip(&turned.texels).for_each(|(sum, a)| *sum += a / 16.0);
    }
    let raw = reference::visibility(&seen.inputs(), &settings)?;
    let own = blur::blur(&raw, &seen.depth, &[], seen.projection, &settings)?;
    // A depth sigma beyond all depths takes the mean of the 4x4 pixels, but for background.
    let everything = Settings { blur_depth_sigma: Some(1e9), ..settings.clone() };
    let simple = blur::blur(&raw, &seen.depth, &[], seen.projection, &everything)?;
    let sigma = settings.depth_sigma(seen.projection)?;
    let (width, height) = (raw.width, raw.height);
    let span = |x: usize, y: usize| {
        // The blur covers the pixels x - 2 to x + 1.
        let of = |v: usize, size: usize| v.saturating_sub(2)..(v + 2).min(size);
        let depths = of(y, height).flat_map(|y| of(x, width).map(move |x| (x, y)));
        let depths = depths.map(|(x, y)| f64::from(seen.depth.at(x, y))).filter(|z| z.is_finite());
        depths.fold((f64::INFINITY, 0.0f64), |(near, far), z| (near.min(z), far.max(z)))
    };
    let (mut beside, mut inside) = (Vec::new(), Vec::new());
    for i in (0..width * height).filter(|&i| seen.depth.texels[i].is_finite()) {
        let (near, far) = span(i % width, i / width);
        // Twice the sigma is beyond the blur of each of the two surfaces.
        if far - near > 2.0 * sigma.at(near) {
            beside.push(i);
        } else if far - near <= sigma.at(near) {
            inside.push(i);
        }
    }
    let rms = |image: &Image<f64>, pixels: &[usize]| {
        let squares: f64 = pixels.iter().map(|&i| (image.texels[i] - ideal.texels[i]).powi(2)).sum();
        (squares / pixels.len().max(1) as f64).sqrt()
    };
    Ok(Mixing {
        beside: [rms(&raw, &beside), rms(&simple, &beside), rms(&own, &beside)],
        inside: [rms(&raw, &inside), rms(&own, &inside)],
        pixels: beside.len(),
    })
}

/// Visibility by `ssao` in a picture, by what is known of the scene beyond its border. All images have the picture's
/// size and the method's blur.
pub(in crate::report) struct Border {
    /// What a wider picture shows is known.
    pub(in crate::report) known: Image<f64>,
    /// The depths at the border stand for those beyond it, as the method has it.
    pub(in crate::report) clamped: Image<f64>,
    /// Nothing is there.
    pub(in crate::report) missing: Image<f64>,
    pub(in crate::report) covered: Image<bool>,
}

/// Computes `ssao` at the border of a picture. Returns `None` if the driver has no image that is wide enough.
pub(in crate::report) fn border(lab: &Lab, subject: &Subject) -> Result<Option<Border>, Error> {
    /// The margin as a share of the picture. It is longer than the longest offset of `ssao`.
    const MARGIN: f64 = 0.1;
    let size = lab.small();
    let (width, height) = (size.0 as usize, size.1 as usize);
    // Margins of whole rotation tiles keep the tile of each pixel.
    let margin = |side: usize| (side as f64 * MARGIN / 4.0).ceil() as usize * 4;
    let corner = (margin(width), margin(height));
    let wide = (size.0 + 2 * corner.0 as u32, size.1 + 2 * corner.1 as u32);
    if wide.0.max(wide.1) > size_limit(lab.gl) {
        return Ok(None);
    }
    let settings = subject.exact(Method::Ssao);
    let mut camera = subject.camera(size)?;
    if !camera.projection.is_perspective() {
        return Ok(None);
    }
    camera.projection = camera.projection.part(size, (-(corner.0 as i64), -(corner.1 as i64)), wide);
    let request = Request { gbuffer_only: true, ..Request::default() };
    let mut pipeline = Pipeline::new(lab.gl, wide, &settings, request)?;
    pipeline.render(&subject.mesh, &camera)?;
    let (depth, normals) = (pipeline.depth()?, pipeline.normals()?);
    let within = |v: usize, from: usize, size: usize| v.clamp(from, from + size - 1);
    let at_border = |x: usize, y: usize| (within(x, corner.0, width), within(y, corner.1, height));
    let clamped = Image::from_fn(depth.width, depth.height, |x, y| {
        let (x, y) = at_border(x, y);
        depth.at(x, y)
    });
    let missing = Image::from_fn(depth.width, depth.height, |x, y| {
        if at_border(x, y) == (x, y) { depth.at(x, y) } else { f32::INFINITY }
    });
    let inner = Image::from_fn(width, height, |x, y| depth.at(corner.0 + x, corner.1 + y));
    let tile = rotation_tile(&settings);
    let image = |depth: &Image<f32>| {
        let inputs =
            TwinInputs { depth, normals: &normals, tile: &tile, projection: camera.projection, near: camera.near };
        let twin = Anatomy::new(&inputs, &settings)?.with_offsets_of((width, height));
        blur::blur(&drawn(&twin, corner, (width, height)), &inner, &[], camera.projection, &settings)
    };
    Ok(Some(Border {
        known: image(&depth)?,
        clamped: image(&clamped)?,
        missing: image(&missing)?,
        covered: inner.map(f32::is_finite),
    }))
}

pub(super) fn at_the_border(lab: &Lab) -> Result<Figure, Error> {
    let subject = lab.first_of(&["sponza", "sibenik"]);
    let mut pictures = Vec::new();
    if let Some(border) = border(lab, subject)? {
        for (image, file, words) in [
            (&border.missing, "border-missing", "with nothing beyond the border"),
            (&border.clamped, "border-clamped", "with the border's depths beyond it, as the method has it"),
            (&border.known, "border-known", "with the true depths beyond it, from a wider picture"),
        ] {
            pictures.push(whole(image, file, &format!("{}, {words}", subject.name))?);
        }
    }
    Ok(Figure {
        id: "ssao-border".into(),
        title: "Crysis' method at the border of the picture".into(),
        text: "What lies outside the picture casts no occlusion, so that its border is too light. The paper answers that depths \
               beyond the border are mostly like those at it, which is what a texture clamped to its edge returns. The claim \
               on the border counts how many pixels this mends. All three pictures are computed by the float64 twin."
            .into(),
        pictures,
        ..Figure::default()
    })
}
