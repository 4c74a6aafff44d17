//! The Vulkan device. The only room with unsafe code.
