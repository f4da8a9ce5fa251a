//! Measures the noise that the 4x4 pattern of the rotation tile leaves in an image.

use hbao::image::Image;

/// Measures the noise that the jitter leaves. The image is divided into windows of 8x8 rotation tiles, of which only
/// tiles on one smooth surface count. In each window the pixels that use the same texel of the tile are averaged, which
/// gives 16 means. The result is the root of the variance of these means, averaged over all windows. Changes within a
/// tile that come from the scene itself average out over a window, except for a slope, which is subtracted. `None` if
/// there are fewer than 10 such windows.
pub(super) fn noise(image: &Image<f32>, depth: &Image<f32>) -> Option<f64> {
    const TILES: usize = 8;
    let smooth = |x: usize, y: usize| {
        let depths = (0..16).map(|i| f64::from(depth.at(x + i % 4, y + i / 4)));
        let (near, far) = depths.fold((f64::INFINITY, 0.0f64), |(near, far), z| (near.min(z), far.max(z)));
        far.is_finite() && far - near <= 0.02 * near
    };
    let (mut sum, mut count) = (0.0, 0usize);
    let window = 4 * TILES;
    for top in (0..(image.height + 1).saturating_sub(window)).step_by(window) {
        for left in (0..(image.width + 1).saturating_sub(window)).step_by(window) {
            let tiles = (0..TILES * TILES).map(|t| (left + 4 * (t % TILES), top + 4 * (t / TILES)));
            let tiles: Vec<_> = tiles.filter(|&(x, y)| smooth(x, y)).collect();
            if tiles.len() < TILES * TILES / 2 {
                continue;
            }
            let residue = |i: usize| {
                let values = tiles.iter().map(|&(x, y)| f64::from(image.at(x + i % 4, y + i / 4)));
                values.sum::<f64>() / tiles.len() as f64
            };
            let residues: Vec<f64> = (0..16).map(residue).collect();
            // A plane is fitted to the 16 means by least squares. This is simple because 1, x and y are orthogonal over
            // the tile.
            let (x, y) = (|i: usize| (i % 4) as f64 - 1.5, |i: usize| (i / 4) as f64 - 1.5);
            let along = |f: &dyn Fn(usize) -> f64| (0..16).map(|i| residues[i] * f(i)).sum::<f64>();
            let (mean, slope_x, slope_y) = (along(&|_| 1.0) / 16.0, along(&x) / 20.0, along(&y) / 20.0);
            let off = |i: usize| residues[i] - mean - slope_x * x(i) - slope_y * y(i);
            sum += (0..16).map(|i| off(i).powi(2)).sum::<f64>() / 16.0;
            count += 1;
        }
    }
    (count >= 10).then(|| (sum / count as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_what_repeats_with_the_tile_and_not_what_the_scene_changes() {
        let flat = Image::filled(128, 128, 2.0f32);
        let of = |a: &dyn Fn(usize, usize) -> f32| noise(&Image::from_fn(128, 128, a), &flat);
        let slope = |x: usize, y: usize| 0.4 + 0.001 * x as f32 + 0.002 * y as f32;
        assert!(of(&slope).unwrap() < 1e-6);
        // One of the 16 means is larger by 0.16. This raises their mean by 0.01 and gives a standard deviation of 0.16
        // sqrt(15)/16. Subtracting the fitted slope reduces the variance by 0.16^2 (2 1.5^2/20)/16.
        let planted = of(&|x, y| slope(x, y) + if (x % 4, y % 4) == (3, 0) { 0.16 } else { 0.0 }).unwrap();
        let expected = 0.16 * (15.0 / 256.0 - 2.0 * 2.25 / 20.0 / 16.0f64).sqrt();
        assert!((planted - expected).abs() < 1e-4, "{planted}, not {expected}");
        // An image without smooth surfaces gives no result.
        let steep = Image::from_fn(128, 128, |x, _| 1.0 + x as f32);
        assert_eq!(noise(&flat, &steep), None);
        assert_eq!(noise(&Image::filled(31, 31, 1.0), &Image::filled(31, 31, 1.0)), None);
    }
}
