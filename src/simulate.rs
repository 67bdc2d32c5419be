//! From a scene to frames, step by step or all at once.

use crate::base::ledger::Row;
use crate::camera::chip::Chip;
use crate::camera::expose::{self, Rows};
use crate::camera::optics::Optics;
use crate::camera::psf::Psf;
use crate::camera::region::Region;
use crate::camera::scenery::Scenery;
use crate::camera::truth::{self, Truth};
use crate::io::header::Header;
use crate::io::labels;
use crate::light::throughput::{Throughput, ThroughputError};
use crate::object::shadow::card::Graphics;
use crate::object::way::Way;
use crate::plan::PlanError;
use crate::plan::brightness::Means;
use crate::plan::planner::Planner;
use crate::plan::view::View;
use crate::scene::{Brightness, Scene, Table, Target};
use crate::sky::Context;
use crate::sky::response::Response;
use crate::stars::catalogue::{Catalogue, CatalogueError};
use std::convert::Infallible;
use std::sync::{Mutex, PoisonError};

/// What can go wrong while simulating.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// The geometry cannot be computed.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A table of the scene cannot be used.
    #[error(transparent)]
    Throughput(#[from] ThroughputError),
    /// The image of a point cannot be used.
    #[error("telescope.psf: {0}")]
    Psf(String),
    /// The star catalogue cannot be read.
    #[error("stars.catalog: {0}")]
    Catalogue(#[from] CatalogueError),
}

/// A frame as a camera gives it, and what was put into it.
#[derive(Debug, Clone)]
pub struct Frame {
    /// The pixels stored.
    pub region: Region,
    /// Their numbers \[ADU\], by rows.
    pub adu: Vec<u32>,
    /// The header.
    pub header: Header,
    /// Truth of the targets.
    pub truth: Vec<Truth>,
    /// What is in the frame and what is left out.
    pub ledger: Vec<Row>,
}

/// A scene with everything that all its frames share.
pub struct Simulator<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The geometry.
    pub planner: Planner<'a>,
    /// From light to electrons.
    pub response: Response,
    /// Where shadows may be found.
    pub graphics: Graphics,
    optics: Optics,
    catalogue: Catalogue,
    scene_sha: String,
}

impl<'a> Simulator<'a> {
    /// The simulator of a scene.
    ///
    /// # Errors
    /// [`SimulateError`] for elements, tables or catalogues that cannot be used.
    pub fn new(scene: &'a Scene) -> Result<Self, SimulateError> {
        let response = Response::new(scene, Throughput::of(scene)?)?;
        Ok(Self {
            scene,
            planner: Planner::new(scene)?,
            optics: Optics::new(scene, &response.throughput).map_err(SimulateError::Psf)?,
            response,
            graphics: Graphics::default(),
            catalogue: catalogue(scene)?,
            scene_sha: scene.sha256(),
        })
    }

    /// SCENESHA: the hash of all that decides a pixel.
    pub fn scene_sha(&self) -> &str {
        &self.scene_sha
    }

    /// The image of a point at `airmass`.
    pub fn psf(&self, airmass: f64) -> Psf {
        Psf::new(self.optics.profile(self.scene, airmass), self.scene.accuracy.psf)
    }

    /// What the sky's sources of one exposure need.
    pub fn sky_context<'c>(&'c self, view: &'c View) -> Context<'c> {
        Context::of_view(self.scene, view, &self.response)
    }

    /// The means of one exposure.
    ///
    /// # Errors
    /// [`SimulateError`] where a target's attitude is not known.
    pub fn scenery(&self, view: &View) -> Result<Scenery, SimulateError> {
        self.timed_scenery(view, &|| 0.0)
    }

    /// The means of one exposure, with times in its ledger by a `clock` that gives seconds since some moment.
    ///
    /// # Errors
    /// [`SimulateError`] where a target's attitude is not known.
    pub fn timed_scenery(&self, view: &View, clock: &(dyn Fn() -> f64 + Sync)) -> Result<Scenery, SimulateError> {
        let began = clock();
        let lights = self.planner.lights(view, &self.graphics)?;
        let lights_ms = (clock() - began) * 1e3;
        let seen = (view, lights.as_slice());
        let mut scenery = Scenery::new(self.scene, seen, &self.response, &self.optics, &self.catalogue, clock);
        if let Some(row) = scenery.ledger.iter_mut().find(|row| row.name == "target") {
            row.ms = lights_ms;
        }
        Ok(scenery)
    }

    /// The chip in one exposure, ready for the pixels of `region`.
    pub fn chip<'c>(&'c self, view: &View, scenery: &'c Scenery, region: &Region) -> Chip<'c> {
        Chip::new(self.scene, scenery, view.frame, view.exposure_s, region)
    }

    /// The numbers \[ADU\] of the pixels of `region` of one exposure, by rows: counted, read out, converted.
    pub fn pixels(&self, view: &View, scenery: &Scenery, region: &Region) -> Vec<u32> {
        let adu = Mutex::new(vec![0; region.len()]);
        let chip = self.chip(view, scenery, region);
        let taken = expose::expose(&chip, self.scene.detector.bits, region, |first, rows| {
            let mut adu = adu.lock().unwrap_or_else(PoisonError::into_inner);
            let out = adu[first * region.width..].iter_mut();
            match rows {
                Rows::U16(rows) => out.zip(rows).for_each(|(out, v)| *out = u32::from(*v)),
                Rows::U32(rows) => out.zip(rows).for_each(|(out, v)| *out = *v),
            }
            Ok::<(), Infallible>(())
        });
        let Ok(()) = taken;
        adu.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// The header of one exposure.
    pub fn header(&self, view: &View, scenery: &Scenery, region: &Region) -> Header {
        labels::frame(&self.labelled(view, scenery, region))
    }

    /// What the headers of an exposure's planes tell of.
    pub fn labelled<'e>(
        &'e self,
        view: &'e View,
        scenery: &'e Scenery,
        region: &'e Region,
    ) -> labels::Exposure<'e> {
        labels::Exposure {
            scene: self.scene,
            scene_sha: &self.scene_sha,
            site: &self.planner.site,
            view,
            scenery,
            region,
            gpu: self.gpu(),
        }
    }

    /// Name of the graphics processor that finds shadows of this scene's shapes, if one does.
    pub fn gpu(&self) -> Option<&str> {
        let card = self.graphics.card.as_ref()?;
        let drawn = |target: &Target| match &target.brightness {
            Brightness::Shape(shaped) => {
                let means = Means::of(shaped, self.scene.accuracy.brightness, &self.graphics);
                matches!(means.way, Way::Device { .. })
            }
            Brightness::MagV(_) => false,
        };
        self.scene.target.iter().any(drawn).then(|| card.name())
    }

    /// One whole frame.
    ///
    /// # Errors
    /// [`SimulateError`] if its geometry cannot be computed.
    pub fn frame(&self, number: usize) -> Result<Frame, SimulateError> {
        let view = self.planner.view(number)?;
        let scenery = self.scenery(&view)?;
        let region = whole(self.scene);
        Ok(Frame {
            region,
            adu: self.pixels(&view, &scenery, &region),
            header: self.header(&view, &scenery, &region),
            truth: truth::of(self.scene, &view, &scenery, &region),
            ledger: scenery.ledger,
        })
    }
}

/// All pixels of a scene's frames.
pub fn whole(scene: &Scene) -> Region {
    let [width, height] = scene.detector.stored_px();
    Region { x0: 0, y0: 0, width, height }
}

/// The catalogue a scene names.
///
/// # Errors
/// [`CatalogueError`] for a file that cannot be used.
pub fn catalogue(scene: &Scene) -> Result<Catalogue, CatalogueError> {
    match &scene.stars.catalog {
        Table::Named(name) if name == "none" => Ok(Catalogue::empty()),
        Table::Named(_) => Ok(Catalogue::built_in()),
        Table::File(path) => Catalogue::open(path),
    }
}

/// All frames of a scene, one after the other.
///
/// # Errors
/// [`SimulateError`] if the scene cannot be used; each frame may fail by itself.
pub fn simulate(scene: &Scene) -> Result<impl Iterator<Item = Result<Frame, SimulateError>> + '_, SimulateError> {
    let simulator = Simulator::new(scene)?;
    Ok((0..scene.exposures.count).map(move |number| simulator.frame(number)))
}
