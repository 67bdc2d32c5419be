//! Peaks of a periodogram, and its thinning for a plot.

use super::scan::{Grid, Spectrum};
use super::types::Periodogram;

/// Indices of the highest `count` local maxima, the highest first, at least `apart` from each other. Heights are those of the
/// parabolas through the maxima and their neighbours, so that the grid does not decide between aliases of like height.
pub fn highest(values: &[f64], count: usize, apart: usize) -> Vec<usize> {
    let at = |i: usize| values.get(i).copied().unwrap_or(f64::NEG_INFINITY);
    let is_peak = |i: &usize| at(*i) >= at(i.wrapping_sub(1)) && at(*i) > at(*i + 1);
    let height = |i: usize| match [at(i.wrapping_sub(1)), at(i), at(i + 1)] {
        [low, here, high] if low.is_finite() && high.is_finite() => {
            here - 0.25 * (low - high) * vertex([low, here, high])
        }
        [_, here, _] => here,
    };
    let mut peaks = (0..values.len()).filter(is_peak).map(|i| (i, height(i))).collect::<Vec<_>>();
    peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut chosen: Vec<usize> = Vec::new();
    for (peak, _) in peaks {
        if chosen.len() == count {
            break;
        }
        if chosen.iter().all(|c| c.abs_diff(peak) >= apart) {
            chosen.push(peak);
        }
    }
    chosen
}

/// The vertex of the parabola through three neighbouring values, in steps from the middle one, -1 to 1.
pub fn vertex([low, here, high]: [f64; 3]) -> f64 {
    let bend = low - 2.0 * here + high;
    if bend < 0.0 { (0.5 * (low - high) / bend).clamp(-1.0, 1.0) } else { 0.0 }
}

/// At most `points` of a spectrum: of each of so many blocks the highest of both powers.
pub fn thin(grid: &Grid, spectrum: &Spectrum, points: usize) -> Periodogram {
    let count = spectrum.single.len();
    let block = if count <= points { 1 } else { count.div_ceil((points / 2).max(1)) };
    let highest_of = |values: &[f64], start: usize| {
        let part = values.iter().enumerate().skip(start).take(block);
        part.max_by(|a, b| a.1.total_cmp(b.1)).map_or(start, |(i, _)| i)
    };
    let mut chosen = Vec::new();
    for start in (0..count).step_by(block) {
        let mut both = [highest_of(&spectrum.single, start), highest_of(&spectrum.multi, start)];
        both.sort_unstable();
        chosen.extend(both);
    }
    chosen.dedup();
    chosen.truncate(points);
    let pick = |values: &[f64]| chosen.iter().filter_map(|i| values.get(*i).copied()).collect();
    Periodogram {
        frequency_hz: chosen.iter().map(|i| grid.frequency(*i)).collect(),
        power_single: pick(&spectrum.single),
        power_multi: pick(&spectrum.multi),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_keep_apart_and_edges_count() {
        let values = [5.0, 1.0, 4.0, 1.0, 1.0, 1.0, 3.0, 2.0, 9.0];
        assert_eq!(highest(&values, 3, 2), [8, 0, 2]);
        assert_eq!(highest(&values, 9, 3), [8, 0]);
        assert!(highest(&[], 3, 1).is_empty());
    }

    #[test]
    fn thinning_keeps_the_peaks() {
        let grid = Grid { first_hz: 1.0, step_hz: 0.5, count: 1000 };
        let mut spectrum = Spectrum { single: vec![0.1; 1000], multi: vec![0.2; 1000], window: vec![0.0; 1000] };
        spectrum.single[777] = 0.9;
        spectrum.multi[123] = 0.8;
        let thin = thin(&grid, &spectrum, 50);
        assert!(thin.frequency_hz.len() <= 50 && thin.frequency_hz.is_sorted());
        assert!(thin.power_single.contains(&0.9) && thin.power_multi.contains(&0.8));
        assert!(thin.frequency_hz.contains(&(1.0 + 0.5 * 777.0)));
    }
}
