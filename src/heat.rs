//! The colours of maps that show how far two pictures differ.

/// The colours: the largest difference that each stands for, in steps of 8 bits.
pub(crate) const HEAT: [(f64, [u8; 3]); 6] = [
    (0.0, [0, 0, 0]),
    (1.0, [0, 0, 160]),
    (4.0, [0, 160, 255]),
    (16.0, [0, 200, 0]),
    (64.0, [255, 230, 0]),
    (f64::MAX, [255, 0, 0]),
];
/// The colour of pixels at which a sample is not finite and differs from that of the other picture.
const NOT_FINITE: [u8; 3] = [255, 0, 255];

/// Returns the colour of a pixel, given its largest difference.
pub(crate) fn colour(difference: f64) -> [u8; 3] {
    let steps = 255.0 * difference * (1.0 - 1e-9);
    HEAT.iter().find(|(most, _)| steps <= *most).map_or(NOT_FINITE, |(_, colour)| *colour)
}
