//! Errors that allow for regularities that are none.
//!
//! A tie may be false, its violations then being of a standard deviation F. Let the data, the others holding, put them at v with the
//! covariance S. The odds that it holds are `b F^n det(S)^(-1/2) exp(-v' S^-1 v / 2)`, b the odds beforehand and n their number (Savage's ratio of
//! densities, Dickey 1971, Ann. Math. Stat. 42, 204). Where it does not the parameters move by d and have the covariance C' in place of C. To first
//! order in what may be false the variance of all is C + sum p (C' - C + d d'), p the probability that a tie is false (Hoeting et al. 1999,
//! Stat. Sci. 14, 382, eq. 3).

use super::fit::{Data, free};
use super::part::{PARAMETERS, Part};
use super::render::Renderer;
use super::simplify::{FAR, product, violated};
use super::tie::Tie;

/// Odds, before the data, that a tie holds which is not far from true: edges of one length are one pair of many.
fn before(tie: &Tie) -> f64 {
    if matches!(tie, Tie::Equal { .. }) { 0.1 } else { 1.0 }
}

/// Covariance of the free parameters of an assembly that fits `data` with its ties.
pub(super) fn covariance(data: &Data, parts: &[Part], renderer: &mut Renderer) -> Option<Vec<Vec<f64>>> {
    let whole = data.system(parts, renderer).covariance()?;
    let held = PARAMETERS * parts.len() - free(parts.len());
    let mut sum = whole.clone();
    for (number, tie) in data.ties.iter().enumerate() {
        let mut fewer = data.clone();
        fewer.ties.remove(number);
        let mut rows = tie.rows(parts, data.scale);
        let system = fewer.system(parts, renderer).with(&rows, FAR);
        let Some((open, step)) = system.covariance().zip(system.step()) else { continue };
        for row in &mut rows {
            row.residual += product(row, &step, held);
        }
        // one that the other ties or the data tell to rounding is in no doubt
        let Some((cost, told)) = violated(&rows, &open, held, data.slack) else { continue };
        let range = 2.0 * rows.len() as f64 * libm::log(FAR);
        let doubt = 1.0 / (1.0 + before(tie) * libm::exp(0.5 * (range - told - cost)));
        for (i, row) in sum.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value += doubt * (open[i][j] - whole[i][j] + step[i] * step[j]);
            }
        }
    }
    Some(sum)
}
