//! The fast Fourier transform of radix two (Cooley & Tukey 1965, Math. Comp. 19, 297), in place, with the positive sign:
//! `X_k = sum_j x_j exp(+2 pi i j k / n)`, not normalised. Twiddle factors come from a table, so that the error
//! grows like log2(n) roundings.

use std::f64::consts::TAU;
use std::ops::{Add, AddAssign, Mul, Sub};

/// A complex number.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Complex {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

impl Complex {
    /// exp(2 pi i `turns`).
    pub fn turn(turns: f64) -> Self {
        let (im, re) = (TAU * (turns - turns.floor())).sin_cos();
        Self { re, im }
    }

    /// The number times a real one.
    pub fn scale(self, by: f64) -> Self {
        Self { re: self.re * by, im: self.im * by }
    }

    /// |z|^2.
    pub fn norm2(self) -> f64 {
        self.re * self.re + self.im * self.im
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { re: self.re + o.re, im: self.im + o.im }
    }
}

impl AddAssign for Complex {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl Sub for Complex {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { re: self.re - o.re, im: self.im - o.im }
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { re: self.re * o.re - self.im * o.im, im: self.re * o.im + self.im * o.re }
    }
}

/// Transforms of one length.
#[derive(Debug, Clone)]
pub struct Fft {
    twiddles: Vec<Complex>,
    bits: u32,
}

impl Fft {
    /// Transforms of length 2^`bits`, `bits` from 1 to 30 (clamped).
    pub fn new(bits: u32) -> Self {
        let bits = bits.clamp(1, 30);
        let n = 1usize << bits;
        let twiddles = (0..n / 2).map(|k| Complex::turn(k as f64 / n as f64)).collect();
        Self { twiddles, bits }
    }

    /// Number of points.
    pub fn size(&self) -> usize {
        1 << self.bits
    }

    /// Transform `data` in place; what is beyond [`Fft::size`] stays, and shorter data are left alone.
    pub fn forward(&self, data: &mut [Complex]) {
        let n = self.size();
        let Some(data) = data.get_mut(..n) else { return };
        for i in 0..n {
            let j = i.reverse_bits() >> (usize::BITS - self.bits);
            if i < j {
                data.swap(i, j);
            }
        }
        let mut half = 1;
        while half < n {
            let stride = n / (2 * half);
            for block in data.chunks_exact_mut(2 * half) {
                let (low, high) = block.split_at_mut(half);
                let twiddles = self.twiddles.iter().step_by(stride);
                for ((a, b), w) in low.iter_mut().zip(high).zip(twiddles) {
                    let turned = *b * *w;
                    (*a, *b) = (*a + turned, *a - turned);
                }
            }
            half *= 2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transform_equals_the_sum_and_keeps_parseval() {
        let fft = Fft::new(6);
        let n = fft.size();
        let input =
            (0..n).map(|j| Complex { re: (j * j % 17) as f64 - 8.0, im: (j * 5 % 13) as f64 }).collect::<Vec<_>>();
        let mut output = input.clone();
        fft.forward(&mut output);
        for (k, x) in output.iter().enumerate() {
            let turn = |j: usize| Complex::turn((j * k % n) as f64 / n as f64);
            let sum = input.iter().enumerate().fold(Complex::default(), |s, (j, v)| s + *v * turn(j));
            // sums of 64 terms of size 10: a few hundred roundings of 1e-16 times 10
            assert!((sum - *x).norm2().sqrt() < 1e-11, "{k}: {sum:?} {x:?}");
        }
        let power = |v: &[Complex]| v.iter().map(|z| z.norm2()).sum::<f64>();
        assert!((power(&output) / (n as f64 * power(&input)) - 1.0).abs() < 1e-13);
    }

    #[test]
    fn short_data_are_left_alone() {
        let mut data = [Complex { re: 1.0, im: 2.0 }; 3];
        Fft::new(2).forward(&mut data);
        assert_eq!(data, [Complex { re: 1.0, im: 2.0 }; 3]);
    }
}
