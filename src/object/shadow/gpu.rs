//! Light of a body by two face maps on the GPU: the twin of `raster.rs`, for many epochs at once.
//!
//! For each epoch the device draws the face map of the Sun and that of the observer, and sums the light of the faces over
//! tiles of the observer's map in f32; the sums of the tiles are added on the CPU in f64. Positions are f32 in units of the
//! bounding radius. Error: that of `raster.rs`, and pixels on edges that fall to the other side.

use super::body::Body;
use super::frame::{Frame, Scaled, Scene};
use super::gpu_device::Device;
pub use super::gpu_device::{Adapter, GpuError, Kind, adapters};
use super::gpu_pipelines::{Maps, Pipelines, Store};
use glam::DVec3;

/// Largest side of a map \[px\], also on devices that draw larger ones: its three textures hold 200 MB.
pub const LARGEST_SIDE: u32 = 4096;

/// Pixels of one submission: seconds on a CPU, far below the time after which a system resets its GPU.
const BATCH_PIXELS: usize = 1 << 26;

/// Bytes of glows in one submission.
const BATCH_BYTES: usize = 1 << 25;

/// Epochs of one submission.
const BATCH_EPOCHS: usize = 4096;

/// Side of the tiles of one sum \[px\], as in `face_light.wgsl`.
const TILE: u32 = 64;

/// Bytes between frames: the largest offset step that a device may ask for.
const STRIDE: usize = 256;

/// Where Sun and observer stand, and the light of the faces.
#[derive(Debug, Clone, Copy)]
pub struct Epoch<'a> {
    /// Towards the Sun, body axes.
    pub sun: DVec3,
    /// Towards the observer, body axes.
    pub observer: DVec3,
    /// Light per area of each face, with both cosines.
    pub weight: &'a [f64],
}

/// An open device with its shaders.
#[derive(Debug)]
pub struct Gpu {
    device: Device,
    pipelines: Pipelines,
    store: Store,
    maps: Option<Maps>,
    scaled: Scaled,
}

/// A frame as the shaders read it.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct GpuFrame {
    vectors: [[f32; 4]; 5],
    counts: [u32; 4],
}

/// What a batch draws: epochs that have light, by their place among all.
#[derive(Default)]
struct Batch {
    frames: Vec<u8>,
    glows: Vec<f32>,
    /// Epoch, and what its sums are to be multiplied with.
    epochs: Vec<(usize, f64)>,
}

impl Gpu {
    /// Opens the fastest device of a kind.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] without such a device, [`GpuError::NoDevice`] if it does not open, and its faults.
    pub fn open(kind: Kind) -> Result<Self, GpuError> {
        let device = Device::open(kind)?;
        let pipelines = Pipelines::new(&device.device);
        device.check()?;
        Ok(Self { device, pipelines, store: Store::default(), maps: None, scaled: Scaled::default() })
    }

    /// Name of the device.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.device.adapter.name
    }

    /// Driver and its version.
    #[must_use]
    pub fn driver(&self) -> &str {
        &self.device.adapter.driver
    }

    /// Whether the device draws on the CPU.
    #[must_use]
    pub fn is_software(&self) -> bool {
        self.device.adapter.software
    }

    /// Largest side of a map \[px\].
    #[must_use]
    pub fn largest_side(&self) -> u32 {
        self.device.adapter.largest_side.min(LARGEST_SIDE)
    }

    /// Light of `body` at each epoch, as [`flux`](super::raster::flux) gives it \[unit of weight m^2\].
    ///
    /// # Errors
    /// [`GpuError::Side`] and [`GpuError::Faces`] for more than the device holds; [`GpuError::Memory`],
    /// [`GpuError::Lost`] and [`GpuError::Failed`] for its faults.
    pub fn flux(&mut self, body: &Body, epochs: &[Epoch], side: u32) -> Result<Vec<f64>, GpuError> {
        let flux = self.try_flux(body, epochs, side);
        if flux.is_err() {
            // buffers and maps without memory behind them do not stay
            (self.store, self.maps) = (Store::default(), None);
        }
        flux
    }

    fn try_flux(&mut self, body: &Body, epochs: &[Epoch], side: u32) -> Result<Vec<f64>, GpuError> {
        self.device.check()?;
        if side == 0 || side > self.largest_side() {
            return Err(GpuError::Side { side, most: self.largest_side() });
        }
        let count = body.faces.len();
        let limits = self.device.device.limits();
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) as usize;
        let most = (binding / size_of::<[[f32; 4]; 4]>()).min(u32::MAX as usize / 4);
        if count > most {
            return Err(GpuError::Faces { faces: count, most });
        }
        let mut flux = vec![0.0; epochs.len()];
        if count == 0 || !self.scaled.set(body) {
            return Ok(flux);
        }
        let Device { device, queue, .. } = &self.device;
        self.store.faces.write(device, queue, bytemuck::cast_slice(&faces(body, &self.scaled)));
        if self.maps.as_ref().is_none_or(|maps| maps.side != side) {
            // the old maps go before the new ones come
            self.maps = None;
            self.maps = Some(Maps::new(device, side));
            self.device.check()?;
        }
        let pixels = side as usize * side as usize;
        let room = (BATCH_PIXELS / pixels).min(BATCH_BYTES / (4 * count.max(1))).clamp(1, BATCH_EPOCHS);
        let mut batch = Batch::default();
        for (index, epoch) in epochs.iter().enumerate() {
            batch.add(body, &self.scaled, index, epoch, side);
            if batch.epochs.len() == room {
                self.draw(&batch, count, side, &mut flux)?;
                batch.clear();
            }
        }
        if !batch.epochs.is_empty() {
            self.draw(&batch, count, side, &mut flux)?;
        }
        Ok(flux)
    }

    /// Draws a batch and stores its light.
    fn draw(&mut self, batch: &Batch, faces: usize, side: u32, flux: &mut [f64]) -> Result<(), GpuError> {
        let Device { device, queue, .. } = &self.device;
        let tiles = side.div_ceil(TILE);
        let per_epoch = tiles as usize * tiles as usize;
        let size = (per_epoch * batch.epochs.len() * 4) as u64;
        self.store.frames.write(device, queue, &batch.frames);
        self.store.glows.write(device, queue, bytemuck::cast_slice(&batch.glows));
        self.store.sums.reserve(device, size);
        self.store.answer.reserve(device, size);
        self.device.check()?;
        let Some(maps) = &self.maps else { return Ok(()) };
        let groups = self.pipelines.bind(device, &self.store, maps, size_of::<GpuFrame>() as u64);
        let (Some(groups), Some(answer)) = (groups, self.store.answer.get()) else { return Ok(()) };
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for epoch in 0..batch.epochs.len() {
            let [sun, view] = [2 * epoch, 2 * epoch + 1].map(|frame| (frame * STRIDE) as u32);
            self.pipelines.draw(&mut encoder, &groups, maps, [sun, view], faces as u32, tiles);
        }
        if let Some(sums) = self.store.sums.get() {
            encoder.copy_buffer_to_buffer(sums, 0, answer, 0, size);
        }
        let bytes = self.device.read(encoder.finish(), answer, size)?;
        for ((index, scale), sums) in batch.epochs.iter().zip(bytes.chunks_exact(4 * per_epoch)) {
            let sum: f64 = sums.as_chunks().0.iter().map(|b| f64::from(f32::from_ne_bytes(*b))).sum();
            if let Some(flux) = flux.get_mut(*index).filter(|_| (sum * scale).is_finite()) {
                *flux = sum * scale;
            }
        }
        Ok(())
    }
}

impl Batch {
    /// Adds an epoch, unless it has no light.
    fn add(&mut self, body: &Body, scaled: &Scaled, index: usize, epoch: &Epoch, side: u32) {
        let (Some(sun), Some(observer)) = (epoch.sun.try_normalize(), epoch.observer.try_normalize()) else {
            return;
        };
        let (sun, view) = (Frame::fitted(scaled, sun, side), Frame::fitted(scaled, observer, side));
        let scene = Scene { body, scaled, sun, view };
        let count = body.faces.len();
        let glow = |i| scene.glow(i, epoch.weight);
        let brightest = (0..count).map(glow).fold(0.0, f64::max);
        if brightest == 0.0 {
            return;
        }
        let tiles = side.div_ceil(TILE);
        let first = [self.glows.len() as u32, self.epochs.len() as u32 * tiles * tiles];
        for frame in [&sun, &view] {
            self.frames.extend_from_slice(bytemuck::bytes_of(&gpu_frame(frame, first)));
            self.frames.resize(self.frames.len().next_multiple_of(STRIDE), 0);
        }
        // 0 to 1 whatever the unit, for f32
        self.glows.extend((0..count).map(|i| (glow(i) / brightest) as f32));
        self.epochs.push((index, brightest * view.pixel_area() * scaled.radius.powi(2)));
    }

    fn clear(&mut self) {
        self.frames.clear();
        self.glows.clear();
        self.epochs.clear();
    }
}

fn with(v: DVec3, w: f64) -> [f32; 4] {
    let [x, y, z] = v.as_vec3().to_array();
    [x, y, z, w as f32]
}

fn gpu_frame(frame: &Frame, [glow, sum]: [u32; 2]) -> GpuFrame {
    let Frame { eye, step, gradient, origin, side } = *frame;
    let vectors = [
        with(gradient[0], origin.x),
        with(gradient[1], origin.y),
        with(step[0], 0.0),
        with(step[1], 0.0),
        with(eye, 0.0),
    ];
    GpuFrame { vectors, counts: [side, glow, sum, 0] }
}

/// Faces as the shaders read them; those that cannot be drawn are points without a normal.
fn faces(body: &Body, scaled: &Scaled) -> Vec<[[f32; 4]; 4]> {
    let face = |i: usize| {
        let normal = body.normals.get(i)?;
        let offset = scaled.offset.get(i).filter(|offset| offset.is_finite())?;
        let sheet = body.sheet.get(i).copied().unwrap_or(false);
        let sunk = scaled.sunk.get(i).copied().unwrap_or(0.0);
        let [a, b, c] = scaled.corners(body, i)?;
        let flag = f64::from(u8::from(sheet));
        Some([with(a, f64::from(sunk)), with(b, flag), with(c, 0.0), with(*normal, *offset)])
    };
    (0..body.faces.len()).map(|i| face(i).unwrap_or_default()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_device_is_an_error() {
        let Ok(mut gpu) = Gpu::open(Kind::Any) else { return };
        let body = super::super::fixtures::satellite();
        let weight = vec![1.0; body.faces.len()];
        let epoch = [Epoch { sun: DVec3::X, observer: DVec3::ONE, weight: &weight }];
        assert!(gpu.flux(&body, &epoch, 64).unwrap()[0] > 0.0);
        // a buffer that no memory holds is a fault of one call
        let _ = gpu.device.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::MAX / 2,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        assert!(gpu.flux(&body, &epoch, 64).is_err());
        assert!(gpu.flux(&body, &epoch, 64).unwrap()[0] > 0.0);
        gpu.device.device.destroy();
        for _ in 0..2 {
            let error = gpu.flux(&body, &epoch, 64).unwrap_err();
            assert!(matches!(error, GpuError::Lost { .. } | GpuError::Failed { .. }), "{error}");
        }
    }
}
