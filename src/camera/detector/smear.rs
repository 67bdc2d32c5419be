//! Frame-transfer smear: while the charge of a column is moved under the shield it passes under the light of that column's
//! other pixels (Janesick 2001, Scientific CCDs, sect. 3.4): each pixel gains the column's light of one line's time.

/// Charge \[e-\] that each pixel of the columns gains: `light` holds each column's sum of light over an exposure of
/// `exposure_s` \[e-\], moved through `rows` rows in `transfer_s`.
pub fn per_pixel(light: &[f64], rows: usize, transfer_s: f64, exposure_s: f64) -> Vec<f64> {
    let share = if exposure_s > 0.0 { transfer_s / (rows as f64 * exposure_s) } else { 0.0 };
    light.iter().map(|sum| sum * share).collect()
}
