//! A tile of an atlas of artificial sky brightness, in ESRI ASCII grid form.
//!
//! The form that GIS programs write (`gdal_translate -of AAIGrid atlas.tif tile.asc`): a head of `ncols`, `nrows`,
//! `xllcorner` (or `xllcenter`), `yllcorner` (or `yllcenter`), `cellsize` \[deg\] and perhaps `nodata_value`, then rows from north
//! to south. Values are the artificial zenith luminance \[mcd/m^2\], as in Falchi et al. 2016 (Sci. Adv. 2, e1600377); between
//! the middles of cells they are bilinear.

use std::path::Path;

/// What can be wrong with a tile.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AtlasError {
    /// It cannot be read.
    #[error("{path}: {reason}")]
    Unreadable {
        /// The file.
        path: String,
        /// What is wrong.
        reason: String,
    },
    /// The station is not on it.
    #[error(
        "{path}: latitude {latitude} deg, longitude {longitude} deg lies outside it, or beside cells without a value in 0..1e6 mcd/m^2"
    )]
    Outside {
        /// The file.
        path: String,
        /// Latitude \[deg\].
        latitude: f64,
        /// Longitude \[deg\].
        longitude: f64,
    },
}

/// A tile.
#[derive(Debug, Clone)]
struct Tile {
    columns: usize,
    /// Longitude and latitude of the middle of the south-western cell \[deg\].
    first: [f64; 2],
    cell: f64,
    /// By rows from north to south.
    values: Vec<f64>,
    nodata: f64,
}

/// Artificial zenith luminance \[mcd/m^2\] of the tile in file `path` at a place \[deg\].
///
/// # Errors
/// [`AtlasError`] for a file that is no such grid, and for a place that is not on it.
pub fn luminance(path: &Path, latitude: f64, longitude: f64) -> Result<f64, AtlasError> {
    let name = path.display().to_string();
    let unreadable = |reason: String| AtlasError::Unreadable { path: name.clone(), reason };
    let text = std::fs::read_to_string(path).map_err(|e| unreadable(e.to_string()))?;
    let tile = Tile::parse(&text).map_err(unreadable)?;
    tile.at(latitude, longitude).ok_or(AtlasError::Outside { path: name, latitude, longitude })
}

impl Tile {
    fn parse(text: &str) -> Result<Self, String> {
        let mut words = text.split_whitespace().peekable();
        let (mut columns, mut rows, mut cell, mut nodata) = (None, None, None, f64::NAN);
        let (mut first, mut corner) = ([None, None], [0.0, 0.0]);
        let is_head = |w: &&str| w.starts_with(|c: char| c.is_ascii_alphabetic()) && w.parse::<f64>().is_err();
        while words.peek().is_some_and(is_head) {
            let key = words.next().unwrap_or_default().to_ascii_lowercase();
            let word = words.next().unwrap_or_default();
            let value = word
                .parse::<f64>()
                .map_err(|_| format!("{} {:?} is no number", shortened(&key), shortened(word)))?;
            match key.as_str() {
                "ncols" => columns = Some(value),
                "nrows" => rows = Some(value),
                "cellsize" => cell = Some(value),
                "nodata_value" => nodata = value,
                "xllcenter" => first[0] = Some(value),
                "yllcenter" => first[1] = Some(value),
                "xllcorner" => (first[0], corner[0]) = (Some(value), 0.5),
                "yllcorner" => (first[1], corner[1]) = (Some(value), 0.5),
                "dx" | "dy" => return Err(format!("{key} = {value}: cells must be square, with one cellsize")),
                _ => return Err(format!("unknown line {:?} in its head", shortened(&key))),
            }
        }
        let head = |value: Option<f64>, key: &str| value.ok_or(format!("no {key} in its head"));
        let whole = |value: f64, key: &str| {
            let good = (2.0..=100_000.0).contains(&value) && value.fract() == 0.0;
            if good {
                Ok(value as usize)
            } else {
                Err(format!("{key} = {value}: must be an integer in 2..100000"))
            }
        };
        let (columns, rows) = (whole(head(columns, "ncols")?, "ncols")?, whole(head(rows, "nrows")?, "nrows")?);
        let cell = head(cell, "cellsize")?;
        if !(cell > 0.0 && cell <= 10.0) {
            return Err(format!("cellsize = {cell}: must lie in 0..10 deg, 0 excluded"));
        }
        let first =
            [head(first[0], "xllcorner")? + corner[0] * cell, head(first[1], "yllcorner")? + corner[1] * cell];
        let number = |(k, word): (usize, &str)| {
            word.parse::<f64>()
                .map_err(|_| format!("value {} of the grid, {:?}, is no number", k + 1, shortened(word)))
        };
        let values = words.enumerate().map(number).collect::<Result<Vec<_>, _>>()?;
        if values.len() != columns * rows {
            return Err(format!("{} values where the head announces {columns} x {rows}", values.len()));
        }
        Ok(Self { columns, first, cell, values, nodata })
    }

    /// Bilinear, held in the outer half of the outermost cells; none outside them or beside a cell without data. A tile
    /// around the Earth has no edge in longitude.
    fn at(&self, latitude: f64, longitude: f64) -> Option<f64> {
        let rows = self.values.len() / self.columns;
        let around = (self.columns as f64 * self.cell - 360.0).abs() < 1e-6;
        // from the western edge, so that the outer half of the first cell lies inside
        let x = (longitude - self.first[0] + 0.5 * self.cell).rem_euclid(360.0) / self.cell - 0.5;
        let y = (rows - 1) as f64 - (latitude - self.first[1]) / self.cell;
        let inside = |at: f64, count: usize| (-0.5..=count as f64 - 0.5).contains(&at);
        if !(inside(x, self.columns) && inside(y, rows)) {
            return None;
        }
        let x = if around { x } else { x.clamp(0.0, (self.columns - 1) as f64) };
        let y = y.clamp(0.0, (rows - 1) as f64);
        let (i, j) = (x.floor(), (y as usize).min(rows - 2));
        let (fx, fy) = (x - i, y - j as f64);
        let mut sum = 0.0;
        for (di, wi) in [(0, 1.0 - fx), (1, fx)] {
            for (dj, wj) in [(0, 1.0 - fy), (1, fy)] {
                if wi * wj <= 0.0 {
                    continue;
                }
                let column = (i as i64 + di).rem_euclid(self.columns as i64) as usize;
                let value = self.values[(j + dj) * self.columns + column];
                if value == self.nodata || !(0.0..=1e6).contains(&value) {
                    return None;
                }
                sum += wi * wj * value;
            }
        }
        Some(sum)
    }
}

/// The beginning of a word of the file, fit for a message.
fn shortened(word: &str) -> String {
    word.chars().take(20).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TILE: &str = "ncols 3\nnrows 2\nxllcorner -106\nyllcorner 32\ncellsize 0.5\nNODATA_value -9\n\
                        0.1 0.2 0.3\n0.5 0.6 -9\n";

    #[test]
    fn values_in_the_middle_of_cells_and_between_them() {
        let tile = Tile::parse(TILE).expect("a tile");
        assert_eq!(tile.at(32.75, -105.75), Some(0.1));
        assert_eq!(tile.at(32.25, -105.25), Some(0.6));
        let middle = tile.at(32.5, 254.5).expect("inside");
        assert!((middle - 0.35).abs() < 1e-12);
        assert_eq!(tile.at(32.5, -105.0), None, "beside a cell without data");
        assert_eq!(tile.at(32.9, -105.9), Some(0.1), "the outer half of a corner cell");
        assert_eq!(tile.at(33.1, -105.5), None);
        assert_eq!(tile.at(f64::NAN, -105.5), None);
    }

    #[test]
    fn a_tile_around_the_earth_has_no_edge_in_longitude() {
        let mut text =
            "ncols 36\nnrows 2\nxllcorner -180\nyllcorner 0\ncellsize 10\nnodata_value nan\n".to_owned();
        (0..72).for_each(|k| text += &format!("{} ", k % 36));
        let world = Tile::parse(&text).expect("a tile");
        for (longitude, expected) in [(-175.0, 0.0), (175.0, 35.0), (180.0, 17.5), (-180.0, 17.5), (179.0, 21.0)] {
            assert!((world.at(5.0, longitude).expect("inside") - expected).abs() < 1e-9, "{longitude}");
        }
        let hole = text.replacen(" 1 ", " nan ", 1).replacen("\n0 ", "\nnan ", 1);
        assert_eq!(Tile::parse(&hole).expect("a tile").at(15.0, -175.0), None);
    }

    #[test]
    fn damaged_tiles_are_told() {
        for (text, words) in [
            ("ncols 3\nnrows 2\n1 2 3", "cellsize"),
            (&TILE.replace("0.1 ", ""), "5 values"),
            (&TILE.replace("ncols 3", "ncols -3"), "ncols = -3"),
            (&TILE.replace("0.2", "x"), "value 2 of the grid, \"x\""),
            (&TILE.replace("cellsize 0.5", "dx 0.5\ndy 0.5"), "cells must be square"),
            (&TILE.replace("cellsize 0.5", "cellsize 0"), "cellsize = 0"),
            ("", "ncols"),
        ] {
            let told = Tile::parse(text).expect_err("damaged");
            assert!(told.contains(words), "{told}");
        }
        assert!(luminance(Path::new("/nowhere.asc"), 0.0, 0.0).is_err());
    }
}
