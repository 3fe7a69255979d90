//! Device, queue and what the adapter can do.

use std::sync::{Arc, Mutex, PoisonError};

/// What went wrong on the GPU.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// No adapter at all, neither hardware nor software.
    #[error("no GPU adapter found (Vulkan, Metal, DX12 or GL); on Linux a software one comes with Mesa: mesa-vulkan-drivers")]
    NoAdapter,
    /// The adapter gives no device.
    #[error("adapter \"{adapter}\" gives no device: {reason}")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// What the driver says.
        reason: String,
    },
    /// More than the adapter takes.
    #[error("{what} needs {need}, but the adapter's limit {limit_name} is {limit}")]
    TooLarge {
        /// What does not fit, with its size in words.
        what: String,
        /// What it needs, in the limit's unit.
        need: u64,
        /// The limit, as WebGPU names it.
        limit_name: &'static str,
        /// Its value.
        limit: u64,
    },
    /// An image for a target of another size.
    #[error("an image of {}x{} pixels for a target of {}x{}", .image[0], .image[1], .target[0], .target[1])]
    TargetSize {
        /// Width and height asked for.
        image: [u32; 2],
        /// Width and height of the target.
        target: [u32; 2],
    },
    /// The device ran out of memory.
    #[error("the GPU is out of memory")]
    OutOfMemory,
    /// Any other error of the device, its loss included.
    #[error("the GPU failed: {0}")]
    Device(String),
}

/// A device and its queue. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Context {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name, backend, driver and kind of the adapter.
    pub info: wgpu::AdapterInfo,
    /// Whether timestamps of passes can be had and trusted: software adapters name the feature but their values are useless.
    pub timestamps: bool,
    uncaptured: Arc<Mutex<Option<GpuError>>>,
}

/// The device that octetra wants of an adapter, in the window and the command alike: all its limits, and timestamps where it has them.
pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
    wgpu::DeviceDescriptor {
        label: Some("octetra"),
        required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
        required_limits: adapter.limits(),
        ..Default::default()
    }
}

impl Context {
    /// The best adapter without a display: discrete before integrated before virtual before software, and among equals a native
    /// backend before GL. The environment variables of wgpu (`WGPU_BACKEND` and so on) are heeded.
    pub fn new() -> Result<Self, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        adapters.sort_by_key(|adapter| rank(&adapter.get_info()));
        let adapter = adapters.first().ok_or(GpuError::NoAdapter)?;
        let (device, queue) = pollster::block_on(adapter.request_device(&device_descriptor(adapter)))
            .map_err(|e| GpuError::NoDevice { adapter: adapter.get_info().name, reason: e.to_string() })?;
        Ok(Self::from_parts(adapter, device, queue))
    }

    /// A context on a device that exists already, the window's. Errors outside of octetra's own calls are kept for
    /// [`Context::take_error`] instead of ending the program.
    pub fn from_parts(adapter: &wgpu::Adapter, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let info = adapter.get_info();
        let timestamps = device.features().contains(wgpu::Features::TIMESTAMP_QUERY) && info.device_type != wgpu::DeviceType::Cpu;
        let uncaptured = Arc::new(Mutex::new(None));
        let kept = uncaptured.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            kept.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error.into());
        }));
        Context { device, queue, info, timestamps, uncaptured }
    }

    /// Whether the adapter computes on the CPU, as Mesa's software one does.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// (name, backend, driver) of the adapter.
    pub fn adapter(&self) -> [String; 3] {
        let info = &self.info;
        [info.name.clone(), info.backend.to_string(), format!("{} {}", info.driver, info.driver_info).trim().to_owned()]
    }

    /// The first error that no call returned, such as a loss of the device between frames.
    pub fn take_error(&self) -> Option<GpuError> {
        self.uncaptured.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Does `work` and gives the first error of the device during it.
    pub(super) fn scoped<T>(&self, work: impl FnOnce() -> T) -> Result<T, GpuError> {
        use wgpu::ErrorFilter::{Internal, OutOfMemory, Validation};
        let scopes = [Internal, OutOfMemory, Validation].map(|filter| self.device.push_error_scope(filter));
        let value = work();
        let errors = scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop()));
        match errors.last() {
            Some(error) => Err(error.into()),
            None => Ok(value),
        }
    }

    /// Waits until the GPU has done all that was submitted.
    pub(super) fn wait(&self) -> Result<(), GpuError> {
        match self.device.poll(wgpu::PollType::wait_indefinitely()) {
            Ok(_) => Ok(()),
            Err(e) => Err(GpuError::Device(e.to_string())),
        }
    }

    /// Waits for the GPU and copies a mappable buffer's content.
    pub(super) fn read(&self, buffer: &wgpu::Buffer) -> Result<Vec<u8>, GpuError> {
        let (sender, receiver) = std::sync::mpsc::channel();
        self.scoped(|| buffer.map_async(wgpu::MapMode::Read, .., move |result| drop(sender.send(result))))?;
        self.wait()?;
        let device_error = |e: &dyn std::fmt::Display| GpuError::Device(format!("reading back: {e}"));
        receiver.recv().map_err(|e| device_error(&e))?.map_err(|e| device_error(&e))?;
        let content = buffer.get_mapped_range(..).map_err(|e| device_error(&e))?.to_vec();
        buffer.unmap();
        Ok(content)
    }

    /// `Err` if `need` is above `limit`.
    pub(super) fn check_limit(
        &self,
        what: impl FnOnce() -> String,
        need: u64,
        limit_name: &'static str,
        limit: u64,
    ) -> Result<(), GpuError> {
        if need <= limit { Ok(()) } else { Err(GpuError::TooLarge { what: what(), need, limit_name, limit }) }
    }
}

impl From<wgpu::Error> for GpuError {
    fn from(error: wgpu::Error) -> Self {
        match error {
            wgpu::Error::OutOfMemory { .. } => GpuError::OutOfMemory,
            other => GpuError::Device(other.to_string()),
        }
    }
}

/// Smaller is better.
fn rank(info: &wgpu::AdapterInfo) -> (u8, bool) {
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    (kind, info.backend == wgpu::Backend::Gl)
}
