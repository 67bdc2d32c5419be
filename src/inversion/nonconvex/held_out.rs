//! Which epochs are held out: a whole phase angle where there are several, else a stretch of each.

use crate::inversion::sphere::angle;
use glam::DVec3;

/// A gap between phase angles that parts them \[rad\].
const GAP: f64 = 0.06;
/// Greatest share that a whole phase angle may have to be held out, in times of the share wanted.
const MOST: f64 = 1.75;

/// Whether each epoch is held out, about `share` of all: of three or more phase angles the whole one whose number of epochs is nearest
/// to that, unless that is too many or too few; else the last epochs of every phase angle, which are a stretch in time.
pub(super) fn held_out(directions: &[(DVec3, DVec3)], share: f64) -> Vec<bool> {
    let mut order: Vec<(f64, usize)> =
        directions.iter().enumerate().map(|(k, (s, o))| (angle(*s, *o), k)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut before = f64::NEG_INFINITY;
    for (phase, epoch) in order {
        match groups.last_mut().filter(|_| phase - before < GAP) {
            Some(group) => group.push(epoch),
            None => groups.push(vec![epoch]),
        }
        before = phase;
    }
    let wanted = share * directions.len() as f64;
    let miss = |group: &Vec<usize>| (group.len() as f64 - wanted).abs();
    let whole = groups.iter().min_by(|a, b| miss(a).total_cmp(&miss(b)));
    let whole = whole.filter(|g| groups.len() > 2 && (wanted / MOST..=wanted * MOST).contains(&(g.len() as f64)));
    let mut out = vec![false; directions.len()];
    let mut hold =
        |epochs: &[usize]| epochs.iter().for_each(|k| out.iter_mut().skip(*k).take(1).for_each(|o| *o = true));
    match whole {
        Some(group) => hold(group),
        None => {
            for group in &mut groups {
                group.sort_unstable();
                let kept = group.len() - (share * group.len() as f64).round() as usize;
                hold(&group[kept.min(group.len())..]);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inversion::synthetic::{Stream, fixed_phase};

    #[test]
    fn a_whole_phase_angle_of_several_else_the_last_of_each() {
        let mut stream = Stream::new(1);
        let mut at = |count: usize, degrees: f64| fixed_phase(count, degrees.to_radians(), &mut stream);
        let three = [at(40, 20.0), at(22, 60.0), at(38, 100.0)].concat();
        let held = held_out(&three, 0.2);
        assert!(held.iter().enumerate().all(|(k, held)| *held == (40..62).contains(&k)));
        let two = [at(50, 50.0), at(50, 90.0)].concat();
        let held: Vec<usize> = (0..100).filter(|k| held_out(&two, 0.2)[*k]).collect();
        assert_eq!(held, (40..50).chain(90..100).collect::<Vec<_>>());
        assert!(held_out(&[], 0.2).is_empty());
    }
}
