use super::*;
use crate::io::curve_file;
use crate::object::surface::mesh::Mesh;

const HEAD: &str =
    "mjd_utc,target,flux_e,flux_err_e,mag_err,zeropoint_mag,range_km,sun_x,sun_y,sun_z,obs_x,obs_y,obs_z,flags\n";

/// Five points of unit flux a minute apart, one cell of the third changed.
fn file(cell: usize, value: &str) -> CurveFile {
    let line = |k: usize| {
        let mjd = format!("{}", 58_000.0 + k as f64 / 1440.0);
        let mut cells = [&mjd, "a", "1.0", "0.01", "", "-26.76", "1000", "1", "0", "0", "0", "1", "0", "0"];
        if k == 2 {
            cells[cell] = value;
        }
        cells.join(",") + "\n"
    };
    let text = HEAD.to_owned() + &(0..5).map(line).collect::<String>();
    curve_file::read("a.csv", &text).expect("a curve")
}

fn read(files: &[&CurveFile]) -> Data {
    let light: Vec<(&CurveFile, usize)> = files.iter().map(|file| (*file, 0)).collect();
    all(&light, None, &Choice::of(None)).expect("data")
}

/// A point that lacks what the others have is left out and counted, and the rest stays what it is.
#[test]
fn a_point_without_what_others_have_is_a_gap() {
    let whole = read(&[&file(2, "1.0")]);
    assert!(whole.absolute && whole.points() == 5 && whole.left_out == LeftOut::default());
    for (cell, value) in [(2, "nan"), (3, "nan"), (5, "nan"), (6, "nan"), (6, "0"), (8, "nan"), (10, "nan")] {
        let data = read(&[&file(cell, value)]);
        assert_eq!((data.absolute, data.points(), data.left_out.gaps), (true, 4, 1), "cell {cell} = {value}");
        assert_eq!(data.curves[0].y[2..], whole.curves[0].y[3..], "cell {cell} = {value}");
    }
    // errors told by magnitudes alone
    let of_magnitudes = |lack: bool| {
        let mut file = file(2, "1.0");
        for (k, row) in file.rows.iter_mut().enumerate() {
            (row.flux_err, row.mag_err) = (f64::NAN, if lack && k == 2 { f64::NAN } else { 0.01 });
        }
        read(&[&file])
    };
    assert_eq!((of_magnitudes(false).points(), of_magnitudes(true).points()), (5, 4));
}

/// Without range the level is free, but zero points still tell how one point compares with the next.
#[test]
fn zero_points_count_where_ranges_are_not_known() {
    let mut file = file(2, "1.0");
    for (k, row) in file.rows.iter_mut().enumerate() {
        row.range_km = f64::NAN;
        row.zeropoint_mag -= 0.5 * k as f64;
    }
    let data = read(&[&file]);
    let y = &data.curves[0].y;
    assert!(!data.absolute && data.curves[0].scale == Scale::Free);
    // the Sun's distance changes by 1e-6 in a minute
    assert!((y[1] / y[0] / 10f64.powf(0.2) - 1.0).abs() < 1e-5, "{y:?}");
}

/// Two points without errors tell nothing of them: they are left out with a word, where they counted as exact.
#[test]
fn a_curve_too_short_to_see_its_errors_is_left_out() {
    let mut short = file(2, "1.0");
    short.rows.truncate(2);
    short.rows.iter_mut().for_each(|row| row.flux_err = f64::NAN);
    let data = read(&[&file(2, "1.0"), &short]);
    assert_eq!((data.curves.len(), data.left_out.gaps), (1, 2));
    assert!(data.told.iter().any(|line| line.contains("errors not told")), "{:?}", data.told);
}

/// Intensities reduced to a unit of their file's own have a free factor beside irradiances.
#[test]
fn reduced_curves_are_free_beside_absolute_ones() {
    let mut reduced = file(2, "1.0");
    reduced.curves[0].reduced = true;
    let alone = read(&[&reduced]);
    assert!(!alone.absolute && alone.curves[0].scale == Scale::Fixed(1.0));
    let both = read(&[&file(2, "1.0"), &reduced]);
    assert!(both.absolute && both.curves[0].scale == Scale::Fixed(1.0) && both.curves[1].scale == Scale::Free);
}

/// Two cubes in one file that reach into each other are a body of their union, as are two that do not touch.
#[test]
fn a_truth_of_parts_is_their_union() {
    use crate::inversion::nonconvex::Part;
    use crate::inversion::nonconvex::metrics::bulk;
    use crate::run::shape_outcome::components;
    use glam::DMat3;
    for (shift, volume) in [(0.5, 12.0), (3.0, 16.0)] {
        let cube = |x: f64| Part { centre: DVec3::X * x, axes: DMat3::IDENTITY, half: DVec3::ONE };
        let triangles = [cube(0.0), cube(2.0 * shift)].map(|part| part.triangles()).concat();
        let corners = (0..24).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]);
        let mesh = Mesh::plain(triangles.concat(), corners);
        let found = bulk(&components(&mesh), 1 << 14).volume;
        // columns at 16,000 places
        assert!((found - volume).abs() < 0.02 * volume, "{shift}: {found}");
    }
}
