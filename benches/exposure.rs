//! Times of the noise stage and of every step of the detector, one core: `cargo bench --bench exposure`.
//!
//! The noise stage (counts, read noise, rounding) is compared with `benches/peers/noise_limit.c`; the steps with a chip that has none, so
//! that what a step costs, and that an absent one costs nothing, is seen in one run.

use nightglass::base::poisson::draw_poisson;
use nightglass::base::random::{Address, Stage};
use nightglass::base::sample::add_normal;
use nightglass::base::simd::{self, Path};
use nightglass::camera::chip::{Chip, Incident};
use nightglass::camera::detector::convert::Converter;
use nightglass::camera::expose;
use nightglass::camera::region::Region;
use nightglass::scene::{Options, Scene, load};
use std::convert::Infallible;
use std::hint::black_box;
use std::ops::Range;
use std::time::Instant;

const SIDE: usize = 2048;

struct Even(f64);

impl Incident for Even {
    fn add(&self, _region: &Region, out: &mut [f64]) {
        out.iter_mut().for_each(|value| *value += self.0);
    }

    fn bright_columns(&self, _level_e: f64) -> Vec<Range<usize>> {
        Vec::new()
    }
}

fn scene(more: &[(&str, &str)]) -> Scene {
    let size = SIDE.to_string();
    let base =
        [("detector.size_px", size.as_str()), ("detector.dark_e_per_s", "0.0"), ("detector.full_well_e", "1e5")];
    let sets = base.iter().chain(more).map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
    load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene")
}

/// Best of nine, per pixel \[ns\].
fn time(pixels: usize, mut work: impl FnMut()) -> f64 {
    let one = |_| {
        let began = Instant::now();
        work();
        began.elapsed().as_secs_f64()
    };
    (0..9).map(one).fold(f64::INFINITY, f64::min) * 1e9 / pixels as f64
}

fn noise() {
    let converter = Converter::of(&scene(&[]).detector);
    println!("noise stage, one core, ns a pixel (counts, read noise, rounding to 16 bits):");
    println!("{:>12} {:>10} {:>10} {:>10} {:>10}", "mean, e-", "counts", "normals", "all", "path");
    for (number, path) in Path::all().iter().enumerate() {
        simd::hold_to(number + 1);
        for mean in [0.0, 0.3, 3.0, 9.0, 30.0, 300.0, 1500.0, 1e5] {
            let address = |stage| Address { seed: 1, frame: 0, stage };
            let mut row = vec![0.0; 4096];
            let mut adu = vec![0u16; 4096];
            let rows = 256;
            let counts = time(4096 * rows, || {
                for y in 0..rows as u64 {
                    row.fill(mean);
                    draw_poisson(&address(Stage::Shot), y * 4096, &mut row);
                }
            });
            let normals = time(4096 * rows, || {
                for y in 0..rows as u64 {
                    add_normal(&address(Stage::Read), y * 4096, 10.0, &mut row);
                }
            });
            let all = time(4096 * rows, || {
                for y in 0..rows as u64 {
                    row.fill(mean);
                    draw_poisson(&address(Stage::Shot), y * 4096, &mut row);
                    add_normal(&address(Stage::Read), y * 4096, 10.0, &mut row);
                    path.run(
                        #[inline(always)]
                        || converter.apply(&row, &mut adu),
                    );
                }
            });
            black_box(&adu);
            let name = format!("{path:?}");
            let name = name.split('(').next().unwrap_or_default();
            println!("{mean:>12} {counts:>10.2} {normals:>10.2} {all:>10.2} {name:>10}");
        }
    }
    simd::hold_to(usize::MAX);
}

fn steps() {
    let steps: [(&str, &[(&str, &str)]); 16] = [
        ("none beyond counts, read noise, converter", &[]),
        ("vignetting", &[("telescope.vignetting", "0.3")]),
        ("iris shutter", &[("detector.shutter_s", "0.01")]),
        ("prnu", &[("detector.prnu", "0.01")]),
        ("frame transfer smear", &[("detector.frame_transfer_s", "0.01")]),
        ("dark", &[("detector.dark_e_per_s", "0.05")]),
        ("dsnu", &[("detector.dark_e_per_s", "0.05"), ("detector.dsnu", "0.1")]),
        ("hot pixels", &[("detector.dark_e_per_s", "0.05"), ("detector.hot_pixel_fraction", "0.001")]),
        ("cosmic rays", &[("detector.cosmic_rays_per_cm2_s", "0.02")]),
        ("blooming, no pixel full", &[("detector.blooming", "true")]),
        ("transfer losses 1e-5", &[("detector.cti", "1e-5")]),
        ("non-linearity", &[("detector.nonlinearity", "0.01")]),
        ("bias structure", &[("detector.bias_structure_adu", "2.0")]),
        ("overscan, 32 columns", &[("detector.overscan_px", "32")]),
        ("cmos", &[("detector.kind", "cmos")]),
        ("32 bits", &[("detector.bits", "32")]),
    ];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    println!("\nsteps of the detector, {SIDE} x {SIDE} pixels of 300 e-, one core, ns a pixel:");
    let mut none = 0.0;
    for (name, sets) in steps {
        let scene = scene(sets);
        let [width, height] = scene.detector.stored_px();
        let region = Region { x0: 0, y0: 0, width, height };
        let took = pool.install(|| {
            time(region.len(), || {
                let chip = Chip::new(&scene, &Even(300.0), 0, 5.0, &region);
                let Ok(()) = expose::expose(&chip, scene.detector.bits, &region, |_, rows| {
                    black_box(rows);
                    Ok::<(), Infallible>(())
                });
            })
        });
        if none == 0.0 {
            none = took;
        }
        println!("{name:44} {took:7.2}   {:+.2}", took - none);
    }
}

fn main() {
    noise();
    steps();
}
