//! Tables over ascending nodes.

/// The interval of ascending `nodes` (two or more) that holds `x`: its index, and the place of `x` in it, held inside 0..1.
pub fn bracket(nodes: &[f64], x: f64) -> (usize, f64) {
    let i = nodes.partition_point(|n| *n <= x).clamp(1, nodes.len() - 1) - 1;
    (i, ((x - nodes[i]) / (nodes[i + 1] - nodes[i])).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_inside_at_and_beyond_the_nodes() {
        let nodes = [0.0, 1.0, 3.0];
        assert_eq!(bracket(&nodes, 2.0), (1, 0.5));
        assert_eq!(bracket(&nodes, 1.0), (1, 0.0));
        assert_eq!(bracket(&nodes, -5.0), (0, 0.0));
        assert_eq!(bracket(&nodes, 9.0), (1, 1.0));
    }
}
