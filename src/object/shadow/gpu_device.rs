//! Devices that draw: which there are, opening one, and its faults as errors.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Longest wait for one batch \[s\]: a device that hangs is an error, not a wait for ever.
const PATIENCE: u64 = 120;

/// Why the GPU gives no light.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// No device of the wanted kind.
    #[error("no {kind}: {reason}")]
    NoAdapter {
        /// What was wanted.
        kind: Kind,
        /// What there is instead, or why nothing is found.
        reason: String,
    },
    /// A device that cannot be opened.
    #[error("{adapter} does not open: {reason}")]
    NoDevice {
        /// Its name.
        adapter: String,
        /// What the driver says.
        reason: String,
    },
    /// A map larger than the device draws, or without pixels.
    #[error("maps of {side} pixels a side: 1 to {most} on this device")]
    Side {
        /// Wanted \[px\].
        side: u32,
        /// Largest \[px\].
        most: u32,
    },
    /// More faces than the device holds.
    #[error("{faces} faces: at most {most} on this device")]
    Faces {
        /// Of the body.
        faces: usize,
        /// Largest number.
        most: usize,
    },
    /// Not enough memory on the device.
    #[error("the GPU is out of memory: {reason}")]
    Memory {
        /// What the driver says.
        reason: String,
    },
    /// The device is gone. Every later call fails too.
    #[error("the GPU is lost: {reason}")]
    Lost {
        /// What the driver says.
        reason: String,
    },
    /// The device refuses a command or does not answer.
    #[error("the GPU fails: {reason}")]
    Failed {
        /// What the driver says.
        reason: String,
    },
}

/// Kind of device.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Kind {
    /// The fastest there is.
    #[default]
    Any,
    /// Not a driver that draws on the CPU.
    Hardware,
    /// A driver that draws on the CPU.
    Software,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Any => "GPU",
            Self::Hardware => "GPU in hardware",
            Self::Software => "GPU in software",
        })
    }
}

/// A device that could be opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Adapter {
    /// Name of the device.
    pub name: String,
    /// Interface, such as Vulkan.
    pub backend: String,
    /// Driver and its version.
    pub driver: String,
    /// Whether it draws on the CPU.
    pub software: bool,
    /// Largest map \[px a side\].
    pub largest_side: u32,
}

/// The devices of this machine, fastest kind first. Empty without a driver.
#[must_use]
pub fn adapters() -> Vec<Adapter> {
    found(&instance()).iter().map(describe).collect()
}

fn instance() -> wgpu::Instance {
    // no validation layers: wgpu checks each call itself
    let flags = wgpu::InstanceFlags::empty();
    let plain = wgpu::InstanceDescriptor::new_without_display_handle();
    wgpu::Instance::new(wgpu::InstanceDescriptor { flags, ..plain })
}

fn found(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    found.sort_by_key(|adapter| match adapter.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    found
}

fn describe(adapter: &wgpu::Adapter) -> Adapter {
    let info = adapter.get_info();
    Adapter {
        name: info.name,
        backend: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        software: info.device_type == wgpu::DeviceType::Cpu,
        largest_side: adapter.limits().max_texture_dimension_2d,
    }
}

/// An open device and the first fault it met.
#[derive(Debug)]
pub(super) struct Device {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub adapter: Adapter,
    fault: Arc<Mutex<Option<GpuError>>>,
}

impl Device {
    /// Opens the fastest device of a kind.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] and [`GpuError::NoDevice`].
    pub fn open(kind: Kind) -> Result<Self, GpuError> {
        let instance = instance();
        let found = found(&instance);
        let fits = |adapter: &&wgpu::Adapter| {
            let software = adapter.get_info().device_type == wgpu::DeviceType::Cpu;
            kind == Kind::Any || software == (kind == Kind::Software)
        };
        let Some(adapter) = found.iter().find(fits) else {
            return Err(GpuError::NoAdapter { kind, reason: reason(&instance, &found) });
        };
        let known = describe(adapter);
        let descriptor = wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| GpuError::NoDevice { adapter: known.name.clone(), reason: e.to_string() })?;
        // one place for all faults, also those outside of a call; without it wgpu panics
        let fault = Arc::new(Mutex::new(None));
        let (store, lost) = (Arc::clone(&fault), Arc::clone(&fault));
        device.on_uncaptured_error(Arc::new(move |error| record(&store, error.into())));
        device.set_device_lost_callback(move |_, reason| record(&lost, GpuError::Lost { reason }));
        Ok(Self { device, queue, adapter: known, fault })
    }

    /// The fault met since the last call, if any.
    ///
    /// # Errors
    /// That fault.
    pub fn check(&self) -> Result<(), GpuError> {
        let mut fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner);
        match fault.clone() {
            // a lost device stays lost
            Some(error @ GpuError::Lost { .. }) => Err(error),
            Some(error) => {
                *fault = None;
                Err(error)
            }
            None => Ok(()),
        }
    }

    /// Submits `commands` and reads the first `size` bytes of `buffer` when they are done.
    ///
    /// # Errors
    /// Any fault of the device until then.
    pub fn read(
        &self,
        commands: wgpu::CommandBuffer,
        buffer: &wgpu::Buffer,
        size: u64,
    ) -> Result<Vec<u8>, GpuError> {
        let submission = self.queue.submit([commands]);
        self.check()?;
        let slice = buffer.slice(..size);
        let (sender, receiver) = std::sync::mpsc::channel();
        // the other end is gone only if the wait below gave up
        slice.map_async(wgpu::MapMode::Read, move |mapped| drop(sender.send(mapped)));
        let timeout = Some(Duration::from_secs(PATIENCE));
        let waited = self.device.poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout });
        self.check()?;
        waited.map_err(failed)?;
        receiver.try_recv().map_err(failed)?.map_err(failed)?;
        let bytes = slice.get_mapped_range().map_err(failed)?.to_vec();
        buffer.unmap();
        self.check()?;
        Ok(bytes)
    }
}

impl From<wgpu::Error> for GpuError {
    fn from(error: wgpu::Error) -> Self {
        match error {
            wgpu::Error::OutOfMemory { source } => Self::Memory { reason: source.to_string() },
            wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => {
                Self::Failed { reason: description }
            }
        }
    }
}

/// Keeps the first fault, which brings others with it, but for the loss of the device.
fn record(fault: &Mutex<Option<GpuError>>, error: GpuError) {
    let mut fault = fault.lock().unwrap_or_else(PoisonError::into_inner);
    if fault.is_none() || matches!(error, GpuError::Lost { .. }) {
        *fault = Some(error);
    }
}

fn failed(error: impl fmt::Display) -> GpuError {
    GpuError::Failed { reason: error.to_string() }
}

/// Why no device fits.
fn reason(instance: &wgpu::Instance, found: &[wgpu::Adapter]) -> String {
    if found.is_empty() {
        let request = instance.request_adapter(&wgpu::RequestAdapterOptions::default());
        return match pollster::block_on(request) {
            Err(error) => error.to_string(),
            Ok(_) => "no driver lists its devices".to_owned(),
        };
    }
    let names: Vec<String> = found.iter().map(|adapter| adapter.get_info().name).collect();
    format!("there is {}", names.join(", "))
}
