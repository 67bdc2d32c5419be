//! Complex numbers by their turns.

use std::f64::consts::TAU;

/// A complex number.
pub type Complex = rustfft::num_complex::Complex64;

/// exp(2 pi i `turns`), of the turns' fraction, so that many turns cost no digits.
pub fn turn(turns: f64) -> Complex {
    let (im, re) = (TAU * (turns - turns.floor())).sin_cos();
    Complex { re, im }
}
