//! The glTF loader: small documents with known answers, damage, and the public scenes.

mod compressed;
mod damage;
mod document;
mod exports;
mod geometry;
mod hierarchy;
mod instances;
mod materials;
mod mutated;
mod public;
mod sound;
mod textures;
