//! The marcher on the CPU: the definition of what the shaders must do, and the fallback without a GPU.
