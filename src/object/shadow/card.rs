//! A graphics processor, if there is one and the program was built for it.

use super::body::Body;
use glam::DVec3;

#[cfg(feature = "gpu")]
use super::gpu::{Epoch, Gpu, Kind, adapters};
#[cfg(feature = "gpu")]
use std::sync::{Arc, Mutex, PoisonError};

/// An open graphics processor, shared by all who draw on it.
#[derive(Debug, Clone)]
pub struct Card {
    #[cfg(feature = "gpu")]
    gpu: Arc<Mutex<Gpu>>,
    #[cfg(not(feature = "gpu"))]
    never: std::convert::Infallible,
    name: String,
    software: bool,
}

/// A graphics processor of this machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listed {
    /// Its name.
    pub name: String,
    /// How it is reached.
    pub backend: String,
    /// Its driver.
    pub driver: String,
    /// Whether it draws on the processor.
    pub software: bool,
    /// Largest map \[px\].
    pub largest_side: u32,
}

#[cfg(feature = "gpu")]
impl Card {
    /// The fastest one; `hardware`: none that draws on the processor.
    ///
    /// # Errors
    /// Why there is none, in words.
    pub fn open(hardware: bool) -> Result<Self, String> {
        let gpu = Gpu::open(if hardware { Kind::Hardware } else { Kind::Any }).map_err(|why| why.to_string())?;
        let (name, software) = (gpu.name().to_owned(), gpu.is_software());
        Ok(Self { gpu: Arc::new(Mutex::new(gpu)), name, software })
    }

    /// Those of this machine.
    pub fn all() -> Vec<Listed> {
        let listed = |a: super::gpu::Adapter| Listed {
            name: a.name,
            backend: a.backend.to_string(),
            driver: a.driver,
            software: a.software,
            largest_side: a.largest_side,
        };
        adapters().into_iter().map(listed).collect()
    }

    /// The light of a body at each epoch (directions to Sun and observer, weights), as `raster::flux` gives it.
    ///
    /// # Errors
    /// The device's fault, in words.
    pub fn flux(&self, body: &Body, epochs: &[(DVec3, DVec3, &[f64])], side: u32) -> Result<Vec<f64>, String> {
        let epochs = epochs.iter().map(|(sun, observer, weight)| Epoch { sun: *sun, observer: *observer, weight });
        let epochs = epochs.collect::<Vec<_>>();
        let mut gpu = self.gpu.lock().unwrap_or_else(PoisonError::into_inner);
        let side = side.min(gpu.largest_side());
        gpu.flux(body, &epochs, side).map_err(|why| why.to_string())
    }
}

#[cfg(not(feature = "gpu"))]
impl Card {
    /// None: the program was built without.
    ///
    /// # Errors
    /// Always.
    pub fn open(_hardware: bool) -> Result<Self, String> {
        Err("this program was built without the feature gpu".into())
    }

    /// None: the program was built without.
    pub fn all() -> Vec<Listed> {
        Vec::new()
    }

    /// Never called.
    ///
    /// # Errors
    /// Never.
    pub fn flux(&self, _body: &Body, _epochs: &[(DVec3, DVec3, &[f64])], _side: u32) -> Result<Vec<f64>, String> {
        match self.never {}
    }
}

impl Card {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether it draws on the processor.
    pub fn is_software(&self) -> bool {
        self.software
    }
}

/// Whether shadows may be found on a graphics processor, and on which.
#[derive(Debug, Clone, Default)]
pub struct Graphics {
    /// The processor.
    pub card: Option<Card>,
    /// Whether it must be used.
    pub required: bool,
    /// Why there is none, in words; empty if nobody asked.
    pub why: String,
}
