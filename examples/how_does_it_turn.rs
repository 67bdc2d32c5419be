//! How does it turn? One attitude in every representation, and a body that tumbles without torque: what stays the same in
//! a hundred thousand revolutions, and how the exact solution compares with an integrator.
//!
//! `cargo run --release --example how_does_it_turn`

use glam::DVec3;
use nightglass::astro::rotation::{Dcm, Mrp, Prp, Quaternion, RotationVector, Sequence};
use nightglass::astro::tumble::{Tumble, integrated_reference};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let q = Quaternion::new([0.5, -0.5, 0.1, 0.7]).ok_or("a quaternion without length")?;
    let (Prp { axis, angle }, Dcm(bn)) = (q.into(), q.into());
    println!("quaternion           {:?}", q.components());
    println!("principal axis       {axis}, angle {:.9} rad", angle);
    println!("rotation vector      {}", RotationVector::from(q).0);
    println!("Rodrigues parameters {} (modified)", Mrp::from(q).0);
    for row in 0..3 {
        println!("[BN], row {}           {}", row + 1, bn.row(row));
    }
    for sequence in Sequence::all() {
        let euler = q.euler(sequence);
        println!("Euler {sequence}          {:?}", euler.angles);
    }

    let (inertia, rate) = (DVec3::new(1.0, 1.0001, 2.0), DVec3::new(0.6, 0.7, 0.2));
    let body = Tumble::new(inertia, q, rate)?;
    let momentum = q.to_inertial(inertia * rate);
    let energy = 0.5 * rate.dot(inertia * rate);
    println!(
        "\n{:>10} {:>12} {:>12}   after, s: drift of energy and of the momentum vector, relative",
        "time", "energy", "L"
    );
    for seconds in [1.0, 1e2, 1e4, 6.7e5] {
        let (w, at) = (body.rate(seconds), body.attitude(seconds));
        let drift = 0.5 * w.dot(inertia * w) / energy - 1.0;
        let turned = (at.to_inertial(inertia * w) - momentum).length() / momentum.length();
        println!("{seconds:10.0} {drift:12.1e} {turned:12.1e}");
    }
    let (integrated, _) = integrated_reference(inertia, q, rate, 0.05, 20_000);
    println!(
        "after 1000 s an integrator of order 6 is {:.1e} rad away",
        integrated.angle_to(&body.attitude(1000.0))
    );
    Ok(())
}
