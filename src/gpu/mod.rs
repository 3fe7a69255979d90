//! All that names wgpu: device, shaders, volume upload, march, timers.
