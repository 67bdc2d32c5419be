//! The table that compares methods for Minkowski's problem, failures included.

use super::baselines::{self, FirstOrder};
use super::cases::Case;
use super::newton::Limits;
use super::{Fault, Options, area_residual, descend, solve};
use crate::inversion::polytope::Polytope;

/// A method of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Newton's method on the roots of the areas, in the affine frame where the image is round.
    Newton,
    /// The same in the image's own frame.
    NewtonUnwhitened,
    /// Newton's method on the areas, damped so that no facet vanishes, in the affine frame where the image is round.
    NewtonClassical,
    /// From gradients alone.
    FirstOrder(FirstOrder),
}

impl Method {
    /// All methods, the strength of Nicolet's smoothing 10.
    pub const ALL: [Self; 7] = [
        Self::Newton,
        Self::NewtonUnwhitened,
        Self::NewtonClassical,
        Self::FirstOrder(FirstOrder::LogVolume),
        Self::FirstOrder(FirstOrder::Ikeuchi),
        Self::FirstOrder(FirstOrder::IkeuchiNicolet { lambda: 10.0 }),
        Self::FirstOrder(FirstOrder::Little),
    ];

    /// A short name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Newton => "Newton",
            Self::NewtonUnwhitened => "Newton, not whitened",
            Self::NewtonClassical => "Newton, classical",
            Self::FirstOrder(FirstOrder::LogVolume) => "L-BFGS on log V",
            Self::FirstOrder(FirstOrder::Ikeuchi) => "Ikeuchi",
            Self::FirstOrder(FirstOrder::IkeuchiNicolet { .. }) => "Ikeuchi, Nicolet",
            Self::FirstOrder(FirstOrder::Little) => "Little",
        }
    }
}

/// A method on a case.
#[derive(Debug, Clone)]
pub struct Row {
    /// Name of the case.
    pub case: &'static str,
    /// Number of facets.
    pub facets: usize,
    /// Least over largest area.
    pub area_ratio: f64,
    /// The method.
    pub method: Method,
    /// What came out.
    pub outcome: Result<Figures, Fault>,
    /// Time by the caller's clock, if any \[s\].
    pub seconds: Option<f64>,
}

/// How near a method came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figures {
    /// Steps.
    pub iterations: usize,
    /// Bodies measured.
    pub evaluations: usize,
    /// Largest |A - a| over the largest a.
    pub residual: f64,
    /// Facets without area.
    pub lost: usize,
    /// Volume of the body.
    pub volume: f64,
}

/// Runs `methods` on `case`, those from gradients for at most `steps` steps. `clock` gives seconds since any moment.
pub fn compare(case: &Case, methods: &[Method], steps: usize, clock: Option<&dyn Fn() -> f64>) -> Vec<Row> {
    let row = |&method: &Method| {
        let start = clock.map(|now| now());
        let outcome = run(case, method, steps);
        let seconds = clock.zip(start).map(|(now, start)| now() - start);
        Row {
            case: case.name,
            facets: case.normals.len(),
            area_ratio: case.area_ratio(),
            method,
            outcome,
            seconds,
        }
    };
    methods.iter().map(row).collect()
}

fn run(case: &Case, method: Method, steps: usize) -> Result<Figures, Fault> {
    let newton = |whiten: bool| {
        let options = Options { whiten, acceptable: f64::INFINITY, ..Options::default() };
        let solution = solve(&case.normals, &case.areas, &options)?;
        Ok(Figures {
            iterations: solution.iterations,
            evaluations: solution.evaluations,
            residual: solution.residual,
            lost: lost(solution.polytope.areas()),
            volume: solution.polytope.volume(),
        })
    };
    match method {
        Method::Newton => newton(true),
        Method::NewtonUnwhitened => newton(false),
        Method::NewtonClassical => {
            let limits = Limits { iterations: 100, residual: 1e-15, classical: true };
            let found = descend(&case.normals, &case.areas, true, limits)?;
            let polytope = Polytope::from_planes(found.planes)?;
            Ok(Figures {
                iterations: found.iterations,
                evaluations: found.evaluations,
                residual: area_residual(polytope.areas(), &case.areas),
                lost: lost(polytope.areas()),
                volume: polytope.volume(),
            })
        }
        Method::FirstOrder(method) => {
            let end = baselines::run(&case.normals, &case.areas, method, steps)?;
            let (iterations, evaluations) = (end.iterations, end.evaluations);
            Ok(Figures { iterations, evaluations, residual: end.residual, lost: end.lost, volume: end.volume })
        }
    }
}

fn lost(areas: &[f64]) -> usize {
    areas.iter().filter(|area| **area <= 0.0).count()
}
