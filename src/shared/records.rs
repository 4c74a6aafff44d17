//! An iteration and what its paths leave, pixel by pixel and photon by photon.

use super::glsl::{Glsl, Header, shared_structs};
use bytemuck::{Pod, Zeroable};

shared_structs! {
    /// What changes from one iteration to the next.
    struct Frame {
        camera_position_w: [f32; 3],
        /// Camera axes, scaled so that a pixel's direction is forward + x right + y up, x and y in [-1, 1]; of an
        /// orthographic camera its origin is position + x right + y up.
        camera_right_w: [f32; 3],
        camera_up_w: [f32; 3],
        camera_forward_w: [f32; 3],
        /// 1: rays are parallel.
        orthographic: u32,
        size: [u32; 2],
        seed: u32,
        iteration: u32,
        /// Light paths of this iteration.
        paths: u32,
        /// Edges of a path from the eye to the light at most.
        max_depth: u32,
        /// Radii (m) of the caustic and the global map.
        radius: [f32; 2],
        /// Probability that a global photon is not stored.
        reject: f32,
        /// 1: photons outside the culling mask are not stored.
        cull: u32,
        /// Photons that the buffer holds.
        capacity: u32,
    }

    /// Where a view path chose the diffuse lobe (48 bytes in Kern et al. 2023, table 1).
    struct ViewSample {
        position_w: [f32; 3],
        /// The path's throughput × diffuse colour / π / the probability of having chosen diffuse.
        /// All zero: this pixel has no sample.
        weight: [f32; 3],
        /// To the eye; octahedral.
        wo: u32,
        /// Face normal on the eye's side; octahedral.
        normal_g: u32,
        /// Fresnel F0 and F90 of the dielectric layer over the diffuse one, as two halves.
        fresnel: u32,
        /// Edges from the eye to here.
        depth: u32,
        /// Of the pixel at this distance (m).
        footprint: f32,
        /// The two nearest edges where the surface ends or folds: distance (m) and, octahedral, the
        /// direction from the edge to here.
        edge_distance: [f32; 2],
        edge_normal: [u32; 2],
        /// How far rays start above the surface (m): below that positions are not told apart.
        offset: f32,
    }

    /// A photon as emission leaves it. Its power and a box (24 bytes) take 40 (Kern et al. 2023, table 2).
    struct Photon {
        position_w: [f32; 3],
        power: PhotonPower,
        path: u32,
        /// How many photons the path left before this one; the map in the top bit.
        number: u32,
        /// Of the guide where the path began, over that without one.
        density: f32,
    }

    /// What a photon carries.
    struct PhotonPower {
        /// Flux (lm): three 16-bit mantissas and a shared 10-bit exponent; 6 bits of path edges.
        flux: [u32; 2],
        /// Where it came from; octahedral.
        wi: u32,
        /// Face normal on the side that it arrived on; octahedral.
        normal_g: u32,
    }

    /// Counted by emission.
    struct Counters {
        /// Of both maps, those beyond the capacity included.
        photons: u32,
        /// Stored ones of the caustic map.
        caustic_photons: u32,
        culled: u32,
        rejected: u32,
        /// Ends of paths.
        absorbed: u32,
        escaped: u32,
        terminated: u32,
        too_long: u32,
    }

    /// Running means of one pixel over the iterations, each as an unevaluated sum of two floats.
    struct FilmPixel {
        emission: [f32; 3],
        direct: [f32; 3],
        caustic: [f32; 3],
        global: [f32; 3],
        albedo: [f32; 3],
        normal_w: [f32; 3],
        depth: f32,
        /// Variance of one iteration's luminance.
        variance: f32,
        /// Of both maps (see [`FramePixel::bias`]), and the variance of one iteration's.
        bias: f32,
        bias_variance: f32,
        emission_low: [f32; 3],
        direct_low: [f32; 3],
        caustic_low: [f32; 3],
        global_low: [f32; 3],
        albedo_low: [f32; 3],
        normal_w_low: [f32; 3],
        depth_low: f32,
        variance_low: f32,
        bias_low: f32,
        bias_variance_low: f32,
    }

    /// One iteration's values of one pixel.
    struct FramePixel {
        emission: [f32; 3],
        direct: [f32; 3],
        caustic: [f32; 3],
        global: [f32; 3],
        albedo: [f32; 3],
        normal_w: [f32; 3],
        /// Distance from the eye to the first surface (m); 0 where there is none.
        depth: f32,
        /// Luminance (nit) gathered from the caustic and the global map within the radius less that within
        /// half of it: what shrinking it would still change (see `render::accuracy`).
        bias: [f32; 2],
        /// Photons within the radius, of the caustic and the global map; counted only where pixels have radii of their own.
        found: [u32; 2],
        unused: u32,
    }

    /// What `sppm` keeps of a pixel, of the caustic and the global map.
    struct PixelStatistics {
        /// Photons found so far, each iteration's times α.
        kept: [f32; 2],
        /// Of the next iteration (m²).
        radius2: [f32; 2],
    }
}

impl PhotonPower {
    /// In lumen per channel, as `photon_flux` in `photon.glsl` has it.
    pub fn flux(&self) -> [f32; 3] {
        let [low, high] = self.flux;
        let unit = ((high >> 22) as f32 - 256.0 - 16.0).exp2();
        [low & 0xffff, low >> 16, high & 0xffff].map(|mantissa| mantissa as f32 * unit)
    }

    /// From the light to here, as `photon_edges` has it.
    pub fn edges(&self) -> u32 {
        self.flux[1] >> 16 & 63
    }
}
