//! World coordinates borrowed from a neighbouring frame.
//!
//! The camera sits on its mount as it did: what turned the neighbour's header into its solution, in the camera's own axes, turns this
//! frame's header likewise. On the sphere, with the headers' turn D from frame to frame, the solved camera is turned by D.

use super::solution::Solution;
use super::{Refusal, checked, fit};
use crate::plan::wcs::{Wcs, east_north};
use glam::DMat3;

/// World coordinates that were not found on the frame itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Borrowed {
    /// World coordinates.
    pub wcs: Wcs,
    /// Angle between both frames by their headers \[rad\].
    pub distance: f64,
    /// Standard error per axis of the reference place \[rad\].
    pub error: f64,
    /// Standard error per axis in a corner \[px\]: that, the lender's own, and the same share of the distance as a turn.
    pub error_in_corner_px: f64,
}

/// The axes of a camera on the sphere: along rows, its direction, and across both.
fn axes(wcs: &Wcs) -> DMat3 {
    let (east, north) = east_north(wcs.centre);
    let along = (east * wcs.cd.x_axis.x + north * wcs.cd.x_axis.y).normalize();
    DMat3::from_cols(along, wcs.centre, along.cross(wcs.centre))
}

/// World coordinates of a frame from those solved for another: `lender_header` and `header` are the a-priori ones of both,
/// `pointing_error` is the standard error per axis of the difference of pointing between the headers \[rad\]. The error adds
/// (in square) the lender's own and the product of the lender's whole correction and the distance, by which
/// errors of the mount change from place to place.
///
/// # Errors
/// Headers that are no finite numbers, mirrored against each other, or of another scale (by more than 1 per cent), or whose reference pixels
/// are 1e5 px apart; a negative `pointing_error`. Frames may be cut out of the chip differently: the reference pixel is the same place of it.
pub fn borrow(
    lender: &Solution,
    lender_header: &Wcs,
    header: &Wcs,
    pointing_error: f64,
) -> Result<Borrowed, Refusal> {
    let ratio = header.cd.determinant() / lender_header.cd.determinant();
    let apart = (header.crpix - lender_header.crpix).length();
    checked(
        "headers of borrower and lender",
        &[
            ("ratio of their pixels' solid angles, negative if mirrored", ratio, [0.98, 1.02]),
            ("distance of reference pixels [px]", apart, [0.0, 1e5]),
            ("error of the pointing difference [rad]", pointing_error, [0.0, 0.1]),
            ("length of the borrower's centre", header.centre.length(), [0.999, 1.001]),
            ("length of the lender's centre", lender_header.centre.length(), [0.999, 1.001]),
        ],
    )?;
    let turn = axes(header) * axes(lender_header).transpose();
    let solved = lender.wcs;
    let centre = (turn * solved.centre).normalize();
    let cd = fit::carried(solved.cd, solved.centre, turn);
    let distance =
        header.centre.cross(lender_header.centre).length().atan2(header.centre.dot(lender_header.centre));
    let scale = solved.pixel_scale();
    let correction = lender.offset + lender.rotation.abs();
    let changed = correction * distance;
    let error = (lender.error_at_reference * scale).hypot(pointing_error).hypot(changed);
    // a frame's far corner lies about as far from the reference pixel as the first one, twice as far if that is off centre
    let arm = 2.0 * solved.crpix.length();
    let error_in_corner_px = (error / scale).hypot(lender.error_in_corner).hypot(changed * arm);
    Ok(Borrowed {
        wcs: fit::about(centre, solved.crpix + header.crpix - lender_header.crpix, cd, solved.sip),
        distance,
        error,
        error_in_corner_px,
    })
}
