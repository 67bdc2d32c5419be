//! Integrals over an exposure of functions with kinks, jumps of slope and narrow peaks at known places.
//!
//! Adaptive bisection with the Gauss-Kronrod pair of 7 and 15 nodes (Piessens et al. 1983, QUADPACK): the interval of the
//! largest error estimate is halved until the sum of the estimates is small enough.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Nodes of Kronrod's rule on \[0, 1\] from the middle outwards, with its weights and Gauss's (0 where it has no node).
const NODES: [(f64, f64, f64); 8] = [
    (0.0, 0.209_482_141_084_727_8, 0.417_959_183_673_469_4),
    (0.207_784_955_007_898_47, 0.204_432_940_075_298_9, 0.0),
    (0.405_845_151_377_397_2, 0.190_350_578_064_785_4, 0.381_830_050_505_118_9),
    (0.586_087_235_467_691_1, 0.169_004_726_639_267_9, 0.0),
    (0.741_531_185_599_394_4, 0.140_653_259_715_525_92, 0.279_705_391_489_276_64),
    (0.864_864_423_359_769_1, 0.104_790_010_322_250_18, 0.0),
    (0.949_107_912_342_758_5, 0.063_092_092_629_978_55, 0.129_484_966_168_869_7),
    (0.991_455_371_120_812_6, 0.022_935_322_010_529_224, 0.0),
];

/// A function that fills in its values at places.
pub type Integrand<'f, E> = dyn FnMut(&[f64], &mut [f64]) -> Result<(), E> + 'f;

/// An integral.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integral {
    /// Its value.
    pub value: f64,
    /// Estimate of its error, an upper one for smooth functions.
    pub error: f64,
    /// Evaluations made.
    pub evaluations: usize,
}

#[derive(Debug, Clone, Copy)]
struct Piece {
    from: f64,
    to: f64,
    value: f64,
    error: f64,
}

/// The integral of `f` over the pieces between `points` (ascending), to within `relative` of its value, or as near as
/// `most` evaluations allow. `f` fills in its values at several places at once.
///
/// # Errors
/// Whatever `f` says.
pub fn integrate<E>(points: &[f64], relative: f64, most: usize, f: &mut Integrand<E>) -> Result<Integral, E> {
    let pieces = points.windows(2).filter(|pair| pair[1] > pair[0]).map(|pair| piece(pair[0], pair[1], f));
    let mut pieces = pieces.collect::<Result<BinaryHeap<_>, E>>()?;
    let mut evaluations = 15 * pieces.len();
    let sums = |pieces: &BinaryHeap<Piece>| {
        pieces.iter().fold((0.0, 0.0), |(value, error), p| (value + p.value, error + p.error))
    };
    let (mut value, mut error): (f64, f64) = sums(&pieces);
    while error > relative * value.abs() && evaluations + 30 <= most {
        let Some(worst) = pieces.pop() else { break };
        let middle = 0.5 * (worst.from + worst.to);
        (value, error) = (value - worst.value, error - worst.error);
        for half in [piece(worst.from, middle, f)?, piece(middle, worst.to, f)?] {
            (value, error) = (value + half.value, error + half.error);
            pieces.push(half);
        }
        evaluations += 30;
    }
    // running sums lose digits
    let (value, error) = sums(&pieces);
    Ok(Integral { value, error, evaluations })
}

/// The piece of the largest error comes first.
impl Ord for Piece {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error)
    }
}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Piece {}

fn piece<E>(from: f64, to: f64, f: &mut Integrand<E>) -> Result<Piece, E> {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let (mut places, mut values) = ([middle; 15], [0.0; 15]);
    for (k, (node, ..)) in NODES.iter().enumerate().skip(1) {
        (places[2 * k - 1], places[2 * k]) = (middle - half * node, middle + half * node);
    }
    f(&places, &mut values)?;
    let (mut kronrod, mut gauss) = (0.0, 0.0);
    for (k, (_, own, gauss_own)) in NODES.iter().enumerate() {
        let sum = if k == 0 { values[0] } else { values[2 * k - 1] + values[2 * k] };
        kronrod += own * sum;
        gauss += gauss_own * sum;
    }
    Ok(Piece { from, to, value: half * kronrod, error: (half * (kronrod - gauss)).abs() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    fn of(points: &[f64], relative: f64, f: impl Fn(f64) -> f64) -> Integral {
        let Ok(integral) = integrate::<Infallible>(points, relative, 100_000, &mut |t, out| {
            out.iter_mut().zip(t).for_each(|(out, t)| *out = f(*t));
            Ok(())
        });
        integral
    }

    #[test]
    fn polynomials_of_degree_22_need_one_piece() {
        let integral = of(&[0.0, 2.0], 1.0, |t| t.powi(22));
        assert_eq!(integral.evaluations, 15);
        assert!((integral.value / (2f64.powi(23) / 23.0) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn kinks_and_jumps_are_bisected_to_the_tolerance() {
        let kink = of(&[0.0, 1.0], 1e-8, |t| (t - 0.3217).max(0.0));
        assert!((kink.value - 0.5 * 0.6783f64.powi(2)).abs() < 1e-8 * kink.value, "{kink:?}");
        let jump = of(&[0.0, 1.0], 1e-6, |t| if t > 0.3217 { 1.0 } else { 0.0 });
        assert!((jump.value - 0.6783).abs() < 2e-6, "{jump:?}");
    }

    #[test]
    fn a_narrow_peak_at_a_known_place_is_not_missed() {
        let peak = |t: f64| (-0.5 * ((t - 0.612_34) / 1e-4).powi(2)).exp();
        let exact = 1e-4 * (2.0 * std::f64::consts::PI).sqrt();
        let told = of(&[0.0, 0.6118, 0.6129, 1.0], 1e-6, peak);
        assert!((told.value / exact - 1.0).abs() < 1e-6, "{told:?}");
        // nothing is promised of a place not told
        assert!(of(&[0.0, 1.0], 1e-6, peak).value < exact);
    }

    #[test]
    fn evaluations_are_bounded_and_faults_pass_through() {
        let Ok(wild) = integrate::<Infallible>(&[0.0, 1.0], 1e-12, 200, &mut |t, out| {
            out.iter_mut().zip(t).for_each(|(out, t)| *out = (1e5 * t).sin().abs());
            Ok(())
        });
        assert!(wild.evaluations <= 200 && wild.error > 0.0);
        assert_eq!(integrate(&[0.0, 1.0], 1e-3, 100, &mut |_, _| Err("no")), Err("no"));
        assert_eq!(of(&[], 1e-3, |t| t).value, 0.0);
    }
}
