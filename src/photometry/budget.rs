//! What the error of a flux is made of.

/// Standard deviations of a flux by their cause \[e\]; their squares add up.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Budget {
    /// Photon noise of the source itself.
    pub shot: f64,
    /// Photon noise of the sky, and whatever scatters the background beyond the known causes.
    pub sky: f64,
    /// Photon noise of the dark current.
    pub dark: f64,
    /// Read noise.
    pub read: f64,
    /// Rounding to whole numbers.
    pub rounding: f64,
    /// The background's level, which is estimated.
    pub background: f64,
    /// The share of the light that was collected: the point spread function's doubt.
    pub share: f64,
    /// Response of the pixels that was not flattened out.
    pub flat: f64,
}

impl Budget {
    /// Of a flux that is multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let part = |v: f64| v * factor;
        Self {
            shot: part(self.shot),
            sky: part(self.sky),
            dark: part(self.dark),
            read: part(self.read),
            rounding: part(self.rounding),
            background: part(self.background),
            share: part(self.share),
            flat: part(self.flat),
        }
    }

    /// All causes together \[e\].
    pub fn total(&self) -> f64 {
        self.parts().iter().map(|(_, part)| part * part).sum::<f64>().sqrt()
    }

    /// Columns and values of the causes \[e\].
    pub fn parts(&self) -> [(&'static str, f64); 8] {
        [
            ("err_shot_e", self.shot),
            ("err_sky_e", self.sky),
            ("err_dark_e", self.dark),
            ("err_read_e", self.read),
            ("err_rounding_e", self.rounding),
            ("err_background_e", self.background),
            ("err_share_e", self.share),
            ("err_flat_e", self.flat),
        ]
    }
}

/// Variances of a background pixel by their cause \[e^2\].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PixelNoise {
    /// Sky, and scatter of unknown cause.
    pub sky: f64,
    /// Dark current.
    pub dark: f64,
    /// Read noise.
    pub read: f64,
    /// Rounding.
    pub rounding: f64,
}

impl PixelNoise {
    /// All together.
    pub fn total(&self) -> f64 {
        self.sky + self.dark + self.read + self.rounding
    }

    /// A total `variance` \[e^2\] divided among the known causes; what they leave is the sky's. Causes that exceed it
    /// are scaled down to it.
    pub fn divided(variance: f64, gain_e_adu: f64, read_noise_e: Option<f64>, dark_e: Option<f64>) -> Self {
        let rounding = gain_e_adu * gain_e_adu / 12.0;
        let (dark, read) = (dark_e.unwrap_or(0.0), read_noise_e.map_or(0.0, |r| r * r));
        let known = rounding + dark + read;
        let scale = if known > variance && known > 0.0 { (variance / known).max(0.0) } else { 1.0 };
        Self {
            sky: (variance - known).max(0.0),
            dark: dark * scale,
            read: read * scale,
            rounding: rounding * scale,
        }
    }

    /// The budget of a flux that is a sum of pixels of which `square` is the sum of the squared weights, with the
    /// source's own variance `shot` \[e^2\].
    pub fn weighted(&self, square: f64, shot: f64) -> Budget {
        let part = |v: f64| (v * square).max(0.0).sqrt();
        Budget {
            shot: shot.max(0.0).sqrt(),
            sky: part(self.sky),
            dark: part(self.dark),
            read: part(self.read),
            rounding: part(self.rounding),
            ..Budget::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_add_up_to_the_whole() {
        for variance in [0.5, 40.0, 400.0] {
            let noise = PixelNoise::divided(variance, 1.5, Some(10.0), Some(3.0));
            assert!((noise.total() - variance).abs() < 1e-12 * variance.max(1.0), "{noise:?}");
            let budget = noise.weighted(9.0, 16.0);
            assert!((budget.total().powi(2) - (9.0 * variance + 16.0)).abs() < 1e-9);
        }
    }
}
