//! Polynomials through tabulated points: Lagrange's by Neville's scheme, Hermite's by divided differences.

use super::State;
use glam::DVec3;

/// Value at 0 of the polynomial through the points (Neville).
pub fn neville(x: &[f64], mut values: Vec<DVec3>) -> DVec3 {
    for order in 1..values.len() {
        for i in 0..values.len() - order {
            values[i] = (values[i + 1] * x[i] - values[i] * x[i + order]) / (x[i] - x[i + order]);
        }
    }
    values.first().copied().unwrap_or(DVec3::NAN)
}

/// Value and slope at 0 of the polynomial with the points' positions and velocities, by divided differences.
pub fn hermite(x: &[f64], states: impl Iterator<Item = State>) -> State {
    let (mut nodes, mut table, mut slopes) = (Vec::new(), Vec::new(), Vec::new());
    for (x, state) in x.iter().zip(states) {
        nodes.extend([*x, *x]);
        table.extend([state.position, state.position]);
        slopes.extend([state.velocity, state.velocity]);
    }
    let n = nodes.len();
    for order in 1..n {
        for i in (order..n).rev() {
            table[i] = if nodes[i] == nodes[i - order] {
                slopes[i]
            } else {
                (table[i] - table[i - 1]) / (nodes[i] - nodes[i - order])
            };
        }
    }
    let (mut value, mut slope) = (DVec3::ZERO, DVec3::ZERO);
    for (c, node) in table.iter().zip(&nodes).rev() {
        slope = slope * -*node + value;
        value = value * -*node + *c;
    }
    State { position: value, velocity: slope }
}
