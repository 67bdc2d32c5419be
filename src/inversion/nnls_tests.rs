use super::*;
use crate::inversion::sphere::fibonacci;
use crate::inversion::synthetic::{Stream, directions};
use crate::object::convex::Epochs;
use crate::object::matter::Material;

fn random(rows: usize, columns: usize, seed: u64, low: f64) -> Columns {
    let mut stream = Stream::new(seed);
    let column = |_| (0..rows).map(|_| low + (1.0 - low) * stream.uniform()).collect();
    Columns::new(rows, (0..columns).map(column).collect::<Vec<_>>())
}

/// Columns of facets at random attitudes, and a cube's noisy curve.
fn light(rows: usize, columns: usize, noise: f64) -> (Columns, Vec<f64>) {
    let mut stream = Stream::new(5);
    let epochs = Epochs::new(directions(rows, &mut stream));
    let material = Material::lambert(1.0);
    let column = |n| epochs.column(n, &material, 0.0);
    let matrix = Columns::new(rows, fibonacci(columns).map(column));
    let mut y = vec![0.0; rows];
    for axis in glam::DVec3::AXES {
        for n in [axis, -axis] {
            y.iter_mut().zip(column(n)).for_each(|(y, g)| *y += g);
        }
    }
    y.iter_mut().for_each(|y| *y += noise * stream.normal());
    (matrix, y)
}

/// Every support of a small problem, by brute force: the slow twin.
fn reference(matrix: &Columns, y: &[f64]) -> f64 {
    let mut best = 0.5 * dot(y, y);
    for mask in 1u32..1 << matrix.len() {
        let set: Vec<usize> = (0..matrix.len()).filter(|j| mask >> j & 1 == 1).collect();
        let gram = |i: usize, j: usize| dot(matrix.column(set[i]), matrix.column(set[j]));
        let Some(factor) = Cholesky::of(set.len(), 1e-14, gram) else { continue };
        let x = factor.solve(set.iter().map(|&j| dot(matrix.column(j), y)).collect());
        if x.iter().all(|&x| x >= 0.0) {
            let mut r = y.to_vec();
            for (&j, x) in set.iter().zip(&x) {
                r.iter_mut().zip(matrix.column(j)).for_each(|(r, g)| *r -= x * g);
            }
            best = best.min(0.5 * dot(&r, &r));
        }
    }
    best
}

#[test]
fn the_objective_is_the_least_of_all_supports() {
    for seed in 0..40 {
        let matrix = random(6, 10, seed, -1.0);
        let mut stream = Stream::new(1000 + seed);
        let y: Vec<f64> = (0..6).map(|_| stream.normal()).collect();
        let solution = solve(&matrix, &y, &[]).unwrap();
        let least = reference(&matrix, &y);
        assert!((solution.objective - least).abs() <= 1e-12 * dot(&y, &y), "{} {least}", solution.objective);
        assert!(solution.kkt <= 1e-12, "{}", solution.kkt);
    }
}

#[test]
fn light_curves_have_their_certificate_at_every_noise() {
    for noise in [0.0, 1e-6, 1e-2, 1.0] {
        let (matrix, y) = light(300, 2000, noise);
        let cold = solve(&matrix, &y, &[]).unwrap();
        assert!(cold.kkt <= 1e-12, "noise {noise}: {}", cold.kkt);
        let warm = solve(&matrix, &y, &cold.support).unwrap();
        assert!((warm.objective - cold.objective).abs() <= 1e-12 * dot(&y, &y) && warm.passes <= cold.passes);
    }
}

#[test]
fn any_warm_start_ends_at_the_same_objective() {
    let (matrix, y) = light(200, 500, 0.05);
    let cold = solve(&matrix, &y, &[]).unwrap();
    for support in [vec![3, 3, 499, 7_000_000], (0..500).collect(), (100..180).collect()] {
        let warm = solve(&matrix, &y, &support).unwrap();
        assert!((warm.objective / cold.objective - 1.0).abs() < 1e-12 && warm.kkt <= 1e-12, "{}", warm.kkt);
    }
}

#[test]
fn zero_and_duplicate_columns_neither_enter_nor_hurt() {
    let y = vec![1.0, 2.0, 3.0];
    let column = vec![1.0, 1.0, 1.0];
    let zero = vec![0.0; 3];
    let matrix = Columns::new(3, [zero.clone(), column.clone(), column.clone(), zero, column]);
    let solution = solve(&matrix, &y, &[0, 1, 2]).unwrap();
    assert!((solution.x.iter().sum::<f64>() - 2.0).abs() < 1e-15 && (solution.objective - 1.0).abs() < 1e-15);
    assert!(solution.x[0] == 0.0 && solution.x[3] == 0.0 && solution.support.len() == 1 && solution.kkt <= 1e-15);
}

#[test]
fn fewer_data_than_columns() {
    let matrix = random(5, 400, 3, 0.0);
    let solution = solve(&matrix, &[1.0, 0.8, 1.2, 0.9, 1.1], &[]).unwrap();
    assert!(solution.support.len() <= 5 && solution.kkt <= 1e-12);
}

#[test]
fn no_light_and_negative_light_give_no_facets() {
    let matrix = random(20, 30, 9, 0.0);
    for y in [0.0, -1.0] {
        let solution = solve(&matrix, &[y; 20], &[4, 5]).unwrap();
        assert!(solution.support.is_empty() && solution.x.iter().all(|&x| x == 0.0) && solution.kkt == 0.0);
    }
    assert_eq!(solve(&Columns::default(), &[], &[]).unwrap().x, Vec::<f64>::new());
}

#[test]
fn what_is_not_finite_is_refused_with_its_place() {
    let mut matrix = random(4, 3, 1, 0.0);
    let tell = |e: Result<Nnls, NnlsError>| e.unwrap_err().to_string();
    assert_eq!(tell(solve(&matrix, &[1.0, f64::NAN, 0.0, 0.0], &[])), "datum 1 = NaN is not finite");
    assert_eq!(tell(solve(&matrix, &[1.0; 3], &[])), "3 data for a matrix of 4 rows");
    matrix.data[9] = f64::INFINITY;
    assert_eq!(tell(solve(&matrix, &[1.0; 4], &[])), "matrix element inf in row 1, column 2 is not finite");
}

#[test]
fn columns_of_any_length_from_1e_minus_100_to_1e_100() {
    let (plain, y) = light(100, 200, 0.01);
    let scaled = Columns::new(
        100,
        (0..200).map(|j| {
            let factor = 10f64.powi((j as i32 % 5 - 2) * 50);
            plain.column(j).iter().map(|g| g * factor).collect()
        }),
    );
    let (a, b) = (solve(&plain, &y, &[]).unwrap(), solve(&scaled, &y, &[]).unwrap());
    assert!((a.objective / b.objective - 1.0).abs() < 1e-12);
}
