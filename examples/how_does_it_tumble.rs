//! EXPERIMENTAL: how a tumbling body turns, from its light alone: bodies of 14 facets without torque, two passes of 150 points, five
//! seconds apart, an hour between them, SNR 50; a turn about the angular momentum takes 100 to 200 s.
//!
//! `cargo run --release --example how_does_it_tumble [near|scan] [seeds] [first seed] [least turn, s] [greatest turn, s] [starts]`: `near` begins at a
//! motion some degrees and one part in 300 off, `scan` at random motions; one seed, the fifth, if nothing is given.
use glam::{DQuat, DVec3};
use nightglass::inversion::egi::{Curve, Options, Scale};
use nightglass::inversion::pole::Spinning;
use nightglass::inversion::sphere::angle;
use nightglass::inversion::synthetic::{Stream, noisy, random_body};
use nightglass::inversion::tumble::{Motion, Scan, scan};
use nightglass::object::convex::Epochs;
use nightglass::object::matter::Material;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, usual: f64| arguments.get(k).map_or(Ok(usual), |v| v.parse::<f64>());
    let near = arguments.first().is_none_or(|what| what != "scan");
    let (seeds, first) = (number(1, 1.0)? as u64, number(2, 5.0)? as u64);
    let turn = (number(3, 100.0)?, number(4, 200.0)?);
    let starts = number(5, Scan::default().starts as f64)? as usize;
    let mut met = 0;
    for seed in first..first + seeds {
        let mut stream = Stream::new(seed);
        let truth = Motion::precessing(
            stream.direction(),
            6.0 * stream.uniform(),
            0.2 + 1.1 * stream.uniform(),
            100.0 + 100.0 * stream.uniform(),
            0.3 + 1.4 * stream.uniform(),
        );
        // moments across the axis within a factor of two of each other
        let square = |k: usize| 0.5 * truth.inertia.element_sum() - truth.inertia[k];
        let share = 0.25 + 0.5 * stream.uniform();
        let (x, y, z) = (2.0 * share * square(0), 2.0 * (1.0 - share) * square(1), square(2));
        let truth = Motion { inertia: DVec3::new(y + z, x + z, x + y), ..truth };
        let (mut times, mut directions) = (Vec::new(), Vec::new());
        for pass in 0..2 {
            let (sun, observer) = (stream.direction(), stream.direction());
            times.extend((0..150).map(|k| f64::from(pass) * 3600.0 + 5.0 * f64::from(k)));
            directions.extend([(sun, observer); 150]);
        }
        let seen = truth.body_axes(&times, &directions).ok_or("a body")?;
        let material = Material::lambert(1.0);
        let clean = Epochs::new(seen).curve(&random_body(14, 0.5, seed), &material, 0.0);
        let (y, sigma) = noisy(&clean, 50.0, &mut stream);
        let curves = vec![Curve { y, sigma, directions, scale: Scale::Fixed(1.0) }];
        let spinning = Spinning { curves, times: vec![times.clone()] };
        let off = DVec3::new(stream.normal(), stream.normal(), stream.normal()) * 0.05;
        let told = Motion {
            attitude: (truth.attitude * DQuat::from_scaled_axis(off)).normalize(),
            rate: truth.rate * (1.0 + stream.normal() / 300.0),
            inertia: truth.inertia,
        };
        let how = match near {
            true => Scan { told: Some(told), ..Scan::default() },
            false => Scan { turn: Some(turn), starts, ..Scan::default() },
        };
        let began = Instant::now();
        let found = scan(&spinning, &material, &how, &Options::default())?;
        let error = |m: &Motion| m.differs(&truth, &times).to_degrees();
        let nearest = found.minima.iter().map(|m| error(&m.motion)).fold(f64::INFINITY, f64::min);
        met += u64::from(nearest < 10.0);
        let Some(best) = found.minima.first() else { continue };
        println!(
            "seed {seed}: {} listed, the nearest turns the body within {nearest:.1} deg of the truth; the best {:.1} deg (told {:.1}), its angular \
             momentum {:.1} deg off, turn {:.3} of {:.3} s, nutation {:.2} of {:.2} s, chi-square {:.2} a degree of freedom, {:.0} s",
            found.minima.len(),
            error(&best.motion),
            error(&told),
            angle(best.motion.momentum(), truth.momentum()).to_degrees(),
            best.motion.periods().map_or(f64::NAN, |p| p.0),
            truth.periods().map_or(f64::NAN, |p| p.0),
            best.motion.periods().map_or(f64::NAN, |p| p.1),
            truth.periods().map_or(f64::NAN, |p| p.1),
            best.solution.reduced(),
            began.elapsed().as_secs_f64()
        );
    }
    println!("of {seeds} seeds a motion within 10 deg is listed in {met}");
    Ok(())
}
