//! Structs shared with GLSL.
