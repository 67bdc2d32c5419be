//! The simplest assembly that the data allow: regularities taken for exact.
//!
//! The data cannot tell a thing that is nearly regular from one that is. Where taking a regularity for exact raises chi^2 by less than it
//! is worth, the simpler assembly is the likelier one, and its other parameters are the surer. It is worth ln T for each parameter that it
//! saves (Schwarz 1978, Ann. Stat. 6, 461), but no more than ln det(1 + F^2 S^-1), S = A C A' the covariance of its violations d with
//! slopes A and F the range where they are sought: what the data hardly know they do not confirm (Lindley 1957, Biometrika 44, 187).
//! Candidates are ranked by the rise that the covariance C predicts, d' S^-1 d; each is then fitted as soft rows with a standard
//! deviation far below what the data resolve, and those that hold are made exact at the end.

use super::fit::{Data, Model, free};
use super::part::{PARAMETERS, Part};
use super::render::Renderer;
use super::tie::{Row, Tie, partner};
use crate::inversion::cholesky::Cholesky;

/// Cosine below which attitudes are not even nearly parallel.
const NEARLY: f64 = 0.94;
/// Violation beyond which no tie is tried, the width of what might be without one: of angles \[rad\], of places in typical half sizes, of log sizes.
pub(super) const FAR: f64 = 0.5;
/// Standard deviation of a violation, in slacks, below which it follows from the ties that hold.
const FOLLOWS: f64 = 10.0;
/// Candidates refitted in a round before the search ends.
const TRIES: usize = 4;
/// Ties at most.
const MOST: usize = 60;
/// Violation of a tie that is exact, and the rounds in which that is reached.
const EXACT: f64 = 1e-12;
const ROUNDS: usize = 8;
/// Share of a violation's variance that keeps ties apart that follow from each other.
const RIDGE: f64 = 1e-9;
/// Rounds of a fit, and the share of chi^2 that ends it.
const FIT: (usize, f64) = (40, 1e-6);

/// Ties that are not far from true.
fn candidates(parts: &[Part], scale: f64) -> Vec<Tie> {
    let mut out = Vec::new();
    for (j, b) in parts.iter().enumerate() {
        for (i, a) in parts.iter().enumerate().take(j) {
            let pairs: Vec<(usize, usize, f64)> = (0..3)
                .map(|k| {
                    let (axis, cosine) = partner(a, b, k);
                    (k, axis, cosine)
                })
                .collect();
            if pairs.iter().all(|(.., cosine)| cosine.abs() > NEARLY) {
                out.push(Tie::Parallel { parts: [i, j] });
            }
            for (k, axis, _) in pairs.into_iter().filter(|(.., cosine)| cosine.abs() > NEARLY) {
                out.push(Tie::Centred { parts: [i, j], axis: k });
                for positive in [[false, false], [false, true], [true, false], [true, true]] {
                    out.push(Tie::Flush { parts: [i, j], axes: [k, axis], positive });
                }
            }
        }
    }
    let sizes: Vec<(usize, usize)> = (0..parts.len()).flat_map(|part| (0..3).map(move |k| (part, k))).collect();
    for (n, &(j, b)) in sizes.iter().enumerate() {
        let equal = |&(i, a): &(usize, usize)| Tie::Equal { parts: [i, j], axes: [a, b] };
        out.extend(sizes.iter().take(n).map(equal));
    }
    out.retain(|tie| tie.rows(parts, scale).iter().all(|row| row.residual.abs() < FAR));
    out
}

/// C times the slopes of violations.
fn spread(rows: &[Row], covariance: &[Vec<f64>], held: usize) -> Vec<Vec<f64>> {
    let times = |row: &Row| covariance.iter().map(|line| product(row, line, held)).collect();
    rows.iter().map(times).collect()
}

pub(super) fn product(row: &Row, line: &[f64], held: usize) -> f64 {
    row.slope.iter().skip(held).zip(line).map(|(s, c)| s * c).sum()
}

/// Ties made exact by the least change in units of the errors.
fn exact(data: &Data, model: Model, renderer: &mut Renderer) -> Model {
    let mut parts = model.parts;
    let Some(covariance) = data.system(&parts, renderer).covariance() else { return Model { parts, ..model } };
    let held = PARAMETERS * parts.len() - free(parts.len());
    for _ in 0..ROUNDS {
        let rows: Vec<Row> = data.ties.iter().flat_map(|tie| tie.rows(&parts, data.scale)).collect();
        if rows.iter().all(|row| row.residual.abs() < EXACT) {
            break;
        }
        let spread = spread(&rows, &covariance, held);
        let ridge = |i: usize, j: usize| if i == j { 1.0 + RIDGE } else { 1.0 };
        let element = |i: usize, j: usize| ridge(i, j) * product(&rows[i], &spread[j], held);
        let Some(factor) = Cholesky::of(rows.len(), 0.0, element) else { break };
        let shares = factor.solve(rows.iter().map(|row| -row.residual).collect());
        let mut step = vec![0.0; covariance.len()];
        for (share, line) in shares.iter().zip(&spread) {
            step.iter_mut().zip(line).for_each(|(s, c)| *s += share * c);
        }
        parts = data.stepped(&parts, &step);
    }
    let chi2 = data.chi2(&parts, f64::INFINITY, renderer);
    Model { parts, chi2 }
}

/// How much chi^2 a tie would cost, and what it may cost at most for all that the data tell of it; none if it follows from those that hold.
fn predicted(rows: &[Row], covariance: &[Vec<f64>], held: usize, slack: f64) -> Option<(f64, f64)> {
    let (cost, own) = violated(rows, covariance, held, slack)?;
    let spread = spread(rows, covariance, held);
    let open = |i: usize, j: usize| product(&rows[i], &spread[j], held) + if i == j { FAR * FAR } else { 0.0 };
    Some((cost, Cholesky::of(rows.len(), 0.0, open)?.log_determinant() - own))
}

/// Violations in units of their covariance S, d' S^-1 d, and ln det S; none if they follow from the ties that hold.
pub(super) fn violated(rows: &[Row], covariance: &[Vec<f64>], held: usize, slack: f64) -> Option<(f64, f64)> {
    let spread = spread(rows, covariance, held);
    let element = |i: usize, j: usize| product(&rows[i], &spread[j], held);
    // a tie whose violation is nearly as sure as the slack follows from others
    if (0..rows.len()).any(|i| element(i, i) < (FOLLOWS * slack).powi(2)) {
        return None;
    }
    let factor = Cholesky::of(rows.len(), 1e-12, element)?;
    let mut violation: Vec<f64> = rows.iter().map(|row| row.residual).collect();
    factor.forward(&mut violation);
    Some((violation.iter().map(|v| v * v).sum(), factor.log_determinant()))
}

/// Ties put on as long as each is worth it; the data come back with the ties that hold. `model` fits the data without ties.
pub(super) fn simplified<'a>(data: &Data<'a>, model: Model, renderer: &mut Renderer) -> (Data<'a>, Model) {
    let (mut data, mut model) = (data.clone(), model);
    let price = libm::log(data.flux.len().max(2) as f64);
    while data.ties.len() < MOST {
        let Some(covariance) = data.system(&model.parts, renderer).covariance() else { break };
        let held = PARAMETERS * model.parts.len() - free(model.parts.len());
        let rise = |tie: Tie| {
            let (cost, told) = predicted(&tie.rows(&model.parts, data.scale), &covariance, held, data.slack)?;
            let worth = told.min(price * tie.saves() as f64);
            (cost < 2.0 * worth).then_some((cost / worth, worth, tie))
        };
        let mut all: Vec<(f64, f64, Tie)> = candidates(&model.parts, data.scale)
            .into_iter()
            .filter(|tie| !data.ties.contains(tie))
            .filter_map(rise)
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let accepted = all.into_iter().take(TRIES).find_map(|(_, worth, tie)| {
            let mut tied = data.clone();
            tied.ties.push(tie);
            let fitted = tied.descend(&model.parts, FIT.0, FIT.1, renderer);
            (fitted.chi2 < model.chi2 + worth).then_some((tied, fitted))
        });
        let Some((tied, fitted)) = accepted else { break };
        (data, model) = (tied, fitted);
    }
    let model = exact(&data, model, renderer);
    (data, model)
}
