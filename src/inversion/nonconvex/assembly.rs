//! The assembly that light curves ask for, with its errors and its rivals.

use super::doubt;
use super::fit::{Data, Model, free};
use super::held_out::held_out;
use super::part::{PARAMETERS, Part, Triangle};
use super::propose::frames;
use super::render::Renderer;
use super::rivals::{Alternative, LAST, NOISE, Spread, compared, exposed, rivals, triangles};
use super::search::{Effort, Search};
use super::simplify::simplified;
use super::tie::Tie;
use super::{NonconvexError, Options};
use crate::inversion::egi::{self, Curve, Problem, Scale};
use crate::object::matter::Material;
use crate::object::surface::mesh::{Face, Mesh};
use glam::{DMat3, DVec3};

/// Fewest data.
const LEAST: usize = 24;
/// Slack of ties: what they may be violated by, in noise over signal.
const SLACK: f64 = 0.02;

/// What is known of a thin part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel {
    /// Unit normal of its large sides, in either sense.
    pub normal: DVec3,
    /// Standard deviation of the normal's direction \[rad\]: root of the sum of both tangent variances.
    pub normal_sd: f64,
    /// Area of one large side \[m^2\].
    pub area: f64,
    /// Standard deviation of the area \[m^2\].
    pub area_sd: f64,
    /// Area of its middle plane outside solid parts, and outside panels before it that it lies on \[m^2\].
    pub exposed: f64,
}

/// A part as far as the data know it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The part.
    pub part: Part,
    /// Standard deviations of its centre along the body axes \[m\]; 0 of the first part, which is held.
    pub centre_sd: DVec3,
    /// Standard deviation of its turns about the body axes \[rad\].
    pub turn_sd: DVec3,
    /// Standard deviations of its half sizes \[m\].
    pub half_sd: DVec3,
    /// Of a thin part, what else is known.
    pub panel: Option<Panel>,
}

/// The best assembly of a number of parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Parts.
    pub parts: Vec<Part>,
    /// chi^2 of all data.
    pub chi2: f64,
    /// chi^2 + parameters ln T.
    pub bic: f64,
    /// chi^2 of the held-out data, fitted without them, over their number.
    pub held_out: f64,
}

/// Boxes that explain light curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Assembly {
    /// The parts.
    pub parts: Vec<Estimate>,
    /// Regularities of the parts, which the data do not contradict; they are in the parts and in their errors.
    pub ties: Vec<Tie>,
    /// chi^2 of all data.
    pub chi2: f64,
    /// Data less parameters.
    pub dof: f64,
    /// For one part, two, and so on.
    pub trials: Vec<Trial>,
    /// Assemblies that chi^2 alone does not tell from the best, that one included: chi^2 no more than three of its own standard
    /// deviations above.
    pub alternatives: Vec<Alternative>,
    /// Of the alternatives.
    pub spread: Spread,
    /// Whether each epoch, gaps left out, was held out to choose the number of parts.
    pub held_out: Vec<bool>,
    /// The parts as fitted without the epochs held out.
    pub tested: Vec<Part>,
    /// Gaps dropped.
    pub dropped: usize,
}

impl Assembly {
    /// Triangles of each part \[m, body axes\].
    pub fn triangles(&self) -> Vec<Vec<Triangle>> {
        triangles(&self.parts.iter().map(|e| e.part).collect::<Vec<_>>())
    }

    /// All parts in one mesh, a group each.
    pub fn mesh(&self) -> Mesh {
        let groups = (1..=self.parts.len()).map(|k| format!("part-{k}")).collect();
        let mut mesh = Mesh { groups, materials: vec![String::new()], ..Mesh::default() };
        for (group, estimate) in (0u16..).zip(&self.parts) {
            let first = 8 * u32::from(group);
            mesh.vertices.extend((0..8).map(|k| estimate.part.corner(k)));
            let face = |face: [usize; 3]| Face { corners: face.map(|k| first + k as u32), group, material: 0 };
            mesh.faces.extend(Part::faces().map(face));
        }
        mesh
    }
}

/// Boxes and panels of one material that explain a light curve of normalised irradiance \[m^2/sr\] with standard deviations `sigma`, taken
/// from the directions (to the Sun, to the observer) in body axes; NaN among `flux` marks a gap. Take 1e-9 of the mean as `sigma`
/// of data without noise.
///
/// # Errors
/// Data, materials and options out of their ranges, fewer than 24 data, no light.
pub fn assemble(
    epochs: &[(DVec3, DVec3)],
    flux: &[f64],
    sigma: &[f64],
    material: &Material,
    options: &Options,
) -> Result<Assembly, NonconvexError> {
    options.check()?;
    let directions = epochs.to_vec();
    let curve = Curve { y: flux.to_vec(), sigma: sigma.to_vec(), directions, scale: Scale::Fixed(1.0) };
    let problem = Problem::new(&[curve])?;
    if problem.len() < LEAST {
        return Err(NonconvexError::Few { data: problem.len(), least: LEAST });
    }
    let open = egi::Options { closure: egi::Closure::Off, ..egi::Options::default() };
    let facets = egi::solve(&problem, material, &open)?.image();
    let area: f64 = facets.iter().map(|f| f.area).sum();
    if !(area > 0.0 && area.is_finite()) {
        return Err(NonconvexError::Dark);
    }
    let weight: Vec<f64> = problem.sigma().iter().map(|s| s.recip()).collect();
    let data = Data {
        directions: (0..problem.len()).map(|t| problem.epochs().at(t)).collect(),
        flux: problem.weighted_data().iter().zip(problem.sigma()).map(|(z, s)| z * s).collect(),
        weight,
        material,
        // a cube of the same area
        scale: (area / 24.0).sqrt(),
        ties: Vec::new(),
        slack: SLACK / problem.snr().max(1.0),
    };
    let frames = frames(&facets, options.attitudes);
    let mut out = concluded(&data, &frames, &facets, options);
    out.dropped = flux.len() - problem.len();
    Ok(out)
}

fn concluded(
    data: &Data,
    frames: &[DMat3],
    facets: &[crate::object::convex::Facet],
    options: &Options,
) -> Assembly {
    let held = held_out(&data.directions, options.held_out);
    let is_held = |k: usize| held.get(k).copied().unwrap_or(false);
    let (training, kept_out) = (data.thinned(|k| !is_held(k)), data.thinned(is_held));
    let effort = Effort { proposals: options.proposals, beam: options.beam, seed: options.seed };
    let search = Search { data: &training, facets, frames, effort };
    let mut renderer = Renderer::default();
    let (mut levels, mut trials): (Vec<Vec<Model>>, Vec<Trial>) = Default::default();
    let mut tested: Vec<Vec<Part>> = Vec::new();
    while levels.len() < options.most {
        let level = search.next(&levels);
        let Some(best) = level.first() else { break };
        let count = kept_out.flux.len().max(1) as f64;
        let held_out = kept_out.chi2(&best.parts, f64::INFINITY, &mut renderer) / count;
        tested.push(best.parts.clone());
        let all = data.descend(&best.parts, LAST.0, LAST.1, &mut renderer);
        let bic = all.chi2 + bic_cost(data, free(all.parts.len()));
        trials.push(Trial { parts: all.parts, chi2: all.chi2, bic, held_out });
        // one level more than enough shows that it is more than enough
        let enough = levels.last().is_some_and(|before| search.is_within_noise(before));
        levels.push(level);
        if enough {
            break;
        }
    }
    let chosen = choice(&trials, kept_out.flux.len());
    let number = chosen.map_or(0, |trial| trial.parts.len());
    let tested = tested.into_iter().find(|parts| parts.len() == number).unwrap_or_default();
    let start = chosen.map_or_else(Vec::new, |trial| trial.parts.clone());
    let start = Model { parts: start, chi2: chosen.map_or(f64::INFINITY, |trial| trial.chi2) };
    let rivals = rivals(data, &start, levels, training.flux.len());
    let (tied, model) = simplified(data, start, &mut renderer);
    let chi2 = data.chi2(&model.parts, f64::INFINITY, &mut renderer);
    let saved: usize = tied.ties.iter().map(Tie::saves).sum();
    let parameters = free(model.parts.len()).saturating_sub(saved);
    let (alternatives, spread) = compared(Model { parts: model.parts.clone(), chi2 }, rivals);
    Assembly {
        parts: estimates(&tied, &model.parts, &mut renderer),
        ties: tied.ties,
        chi2,
        dof: data.flux.len() as f64 - parameters as f64,
        trials,
        alternatives,
        spread,
        held_out: held,
        tested,
        dropped: 0,
    }
}

fn bic_cost(data: &Data, parameters: usize) -> f64 {
    parameters as f64 * libm::log(data.flux.len().max(1) as f64)
}

/// The least BIC among those that predict the held-out data as well as any, but for noise.
fn choice(trials: &[Trial], held: usize) -> Option<&Trial> {
    let best = trials.iter().map(|t| t.held_out).fold(f64::INFINITY, f64::min);
    // the noise of a reduced chi^2
    let noise = NOISE * (2.0 / held.max(1) as f64).sqrt() * best.max(1.0);
    let predicts = |t: &&Trial| t.held_out <= best + noise;
    trials.iter().filter(predicts).min_by(|a, b| a.bic.total_cmp(&b.bic))
}

/// Standard deviations after Laplace: (J'J)^-1 with weights 1/sigma, with ties that may be false in it.
fn estimates(data: &Data, parts: &[Part], renderer: &mut Renderer) -> Vec<Estimate> {
    let covariance = doubt::covariance(data, parts, renderer);
    let held = PARAMETERS * parts.len() - free(parts.len());
    let element = |i: usize, j: usize| match (i.checked_sub(held), j.checked_sub(held)) {
        (Some(i), Some(j)) => covariance.as_ref().and_then(|c| c.get(i)?.get(j).copied()).unwrap_or(f64::INFINITY),
        _ => 0.0,
    };
    let sd = |first: usize| {
        let root = |k: usize| element(first + k, first + k).max(0.0).sqrt();
        DVec3::new(root(0), root(1), root(2))
    };
    let estimate = |(k, part): (usize, &Part)| {
        let first = PARAMETERS * k;
        let (turn, size) = (first + 3, first + 6);
        let panel = part.is_panel().then(|| {
            let (normal, area) = part.side();
            // a turn w moves the normal by w x n: both tangent variances are the trace less n'Cn
            let trace: f64 = (0..3).map(|i| element(turn + i, turn + i)).sum();
            let along: f64 =
                (0..9).map(|m| normal[m / 3] * normal[m % 3] * element(turn + m / 3, turn + m % 3)).sum();
            let axis = part.thin_axis();
            let (u, v) = (size + (axis + 1) % 3, size + (axis + 2) % 3);
            let variance = element(u, u) + element(v, v) + 2.0 * element(u, v);
            Panel {
                normal,
                normal_sd: (trace - along).max(0.0).sqrt(),
                area,
                area_sd: area * variance.max(0.0).sqrt(),
                exposed: exposed(parts, k),
            }
        });
        Estimate { part: *part, centre_sd: sd(first), turn_sd: sd(turn), half_sd: sd(size) * part.half, panel }
    };
    parts.iter().enumerate().map(estimate).collect()
}
