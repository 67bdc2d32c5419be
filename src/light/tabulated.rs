//! Rates of electrons tabulated over the path through the air.
//!
//! Cubics in the logarithm between the nodes; the values at the ends are held.

use crate::base::nodes::bracket;

/// A positive quantity over ascending nodes (four or more).
#[derive(Debug, Clone, PartialEq)]
pub struct Tabulated {
    nodes: &'static [f64],
    log: Vec<f64>,
}

/// Airmasses at which rates are tabulated: closer where they are curved and where telescopes look.
pub const AIRMASSES: [f64; 24] = [
    -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0,
    17.0, 22.0, 30.0, 40.0,
];

impl Tabulated {
    /// The table of `values` at `nodes`.
    pub fn new(nodes: &'static [f64], values: impl IntoIterator<Item = f64>) -> Self {
        let log = values.into_iter().map(|v| v.max(f64::MIN_POSITIVE).ln()).collect();
        Self { nodes, log }
    }

    /// The value at `x`.
    pub fn at(&self, x: f64) -> f64 {
        let (i, share) = bracket(self.nodes, x);
        let x = self.nodes[i] + share * (self.nodes[i + 1] - self.nodes[i]);
        // Lagrange's cubic through the four nearest nodes
        let first = i.saturating_sub(1).min(self.nodes.len() - 4);
        let nodes = first..first + 4;
        let term = |k: usize| {
            let others = nodes.clone().filter(|j| *j != k);
            self.log[k] * others.map(|j| (x - self.nodes[j]) / (self.nodes[k] - self.nodes[j])).product::<f64>()
        };
        nodes.clone().map(term).sum::<f64>().exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponential_is_met_exactly_and_held_at_the_ends() {
        let table = Tabulated::new(&AIRMASSES, AIRMASSES.map(|x| 3.0 * (-0.2 * x).exp()));
        for x in [-0.5, 0.1, 1.13, 5.5, 39.0] {
            assert!((table.at(x) / (3.0 * (-0.2 * x).exp()) - 1.0).abs() < 1e-12, "{x}");
        }
        assert_eq!(table.at(50.0), table.at(40.0));
        assert_eq!(table.at(-2.0), table.at(-0.5));
    }

    #[test]
    fn nothing_stays_nothing() {
        assert!(Tabulated::new(&AIRMASSES, [0.0; 24]).at(1.0) < 1e-300);
    }
}
