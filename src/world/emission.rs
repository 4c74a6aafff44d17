//! Emissive triangles in parts that shine about evenly, so that light starts where a texture is bright: a triangle is
//! split into four like it, and those again, as far as its texels differ.

use crate::scene::{Image, Scene, TextureRef, Triangle, Wrap};
use crate::shared::PART_LEVELS;
use glam::{IVec2, Vec2, Vec3};
use std::collections::VecDeque;
use std::ops::Range;

/// A triangle like the whole one: from the barycentrics `corner` it goes `edge` along both axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    pub corner: Vec2,
    /// ±2⁻ⁿ.
    pub edge: f32,
    /// The way to it: a digit from 0 to 3 for each split, the first the highest of [`PART_LEVELS`] (see
    /// `part_key` in `glsl/lib/light.glsl`).
    pub key: u32,
    /// Radiance \[nit\] of the texels that reach into it, on average.
    pub mean: Vec3,
}

/// What may be spent on the triangles of a scene.
pub struct Budget {
    /// Parts of each triangle at most.
    parts: usize,
    /// Texels to look at; when they are spent, the rest of the scene is taken to shine evenly.
    texels: u64,
}

impl Budget {
    pub fn new(scene: &Scene) -> Self {
        let textured = scene.triangles.iter().filter(|t| {
            let material = &scene.materials[t.material as usize];
            material.emission_texture.is_some() && material.emission != Vec3::ZERO
        });
        Self {
            parts: (1 << 18) / textured.count().max(1),
            texels: 1 << 28,
        }
    }
}

/// The parts of a triangle that are not dark, in the order of their keys.
pub fn parts(scene: &Scene, triangle: &Triangle, budget: &mut Budget) -> Vec<Part> {
    let material = &scene.materials[triangle.material as usize];
    let whole = Part {
        corner: Vec2::ZERO,
        edge: 1.0,
        key: 0,
        mean: material.emission,
    };
    let Some(reference) = material.emission_texture else {
        return vec![whole];
    };
    let texels = Texels::new(scene, triangle, reference);
    let mut found = Vec::new();
    let mut todo = VecDeque::from([(whole, 0)]);
    while let Some((mut part, level)) = todo.pop_front() {
        let (low, high) = texels.bounds(&part);
        if budget.texels < texels.count(low, high) {
            found.push(part);
            continue;
        }
        budget.texels -= texels.count(low, high);
        let (mean, brightest) = texels.mean_and_max(low, high);
        if brightest == 0.0 {
            continue;
        }
        // Within a texel radiance is bilinear, and even enough.
        let uneven = brightest > 2.0 * mean.max_element() && (high - low).max_element() > 2;
        if uneven && level < PART_LEVELS && found.len() + todo.len() + 4 <= budget.parts {
            todo.extend(children(&part, level).map(|child| (child, level + 1)));
            continue;
        }
        part.mean = material.emission * mean;
        found.push(part);
    }
    found.sort_unstable_by_key(|part| part.key);
    found
}

fn children(part: &Part, level: u32) -> [Part; 4] {
    let half = 0.5 * part.edge;
    let digit = 1 << (2 * (PART_LEVELS - 1 - level));
    // At the three corners, and upside down in the middle.
    let places = [
        (0.0, 0.0, half),
        (half, 0.0, half),
        (0.0, half, half),
        (half, half, -half),
    ];
    let mut key = part.key;
    places.map(|(x, y, edge)| {
        let child = Part {
            corner: part.corner + Vec2::new(x, y),
            edge,
            key,
            ..*part
        };
        key += digit;
        child
    })
}

/// An emissive texture as a triangle sees it.
struct Texels<'a> {
    image: &'a Image,
    wrap: [Wrap; 2],
    /// Linear values of bytes.
    linear: [f32; 256],
    /// In texels, at the triangle's corners.
    places: [Vec2; 3],
}

impl<'a> Texels<'a> {
    fn new(scene: &'a Scene, triangle: &Triangle, reference: TextureRef) -> Self {
        let texture = &scene.textures[reference.texture as usize];
        let image = &scene.images[texture.image as usize];
        let size = Vec2::new(image.width as f32, image.height as f32);
        let linear = |byte: usize| match (texture.srgb, byte as f32 / 255.0) {
            (false, v) => v,
            (true, v) if v <= 0.04045 => v / 12.92,
            (true, v) => ((v + 0.055) / 1.055).powf(2.4),
        };
        Self {
            image,
            wrap: texture.wrap,
            linear: std::array::from_fn(linear),
            places: triangle.vertices.map(|v| {
                let uv = scene.vertices[v as usize].uv[reference.uv_set as usize].extend(1.0);
                size * Vec2::new(
                    reference.transform[0].dot(uv),
                    reference.transform[1].dot(uv),
                )
            }),
        }
    }

    /// The first and the last texel that reach into a part, each from its middle to that of the next.
    fn bounds(&self, part: &Part) -> (IVec2, IVec2) {
        let [a, b, c] = self.places;
        let at = |bary: Vec2| a + bary.x * (b - a) + bary.y * (c - a);
        let corners = [Vec2::ZERO, Vec2::X, Vec2::Y].map(|p| at(part.corner + part.edge * p));
        let low = corners[0].min(corners[1]).min(corners[2]) - 0.5;
        let high = corners[0].max(corners[1]).max(corners[2]) - 0.5;
        (
            low.floor().as_ivec2(),
            high.floor().as_ivec2().saturating_add(IVec2::ONE),
        )
    }

    /// Columns and rows of the image; all where the range goes beyond an edge where the image is repeated.
    fn ranges(&self, low: IVec2, high: IVec2) -> [Range<i32>; 2] {
        let size = [self.image.width as i32, self.image.height as i32];
        [0, 1].map(|axis| {
            let (first, last, size) = (low[axis], high[axis], size[axis]);
            match self.wrap[axis] {
                Wrap::Clamp => first.clamp(0, size - 1)..last.clamp(0, size - 1) + 1,
                _ if i64::from(last) - i64::from(first) + 1 >= i64::from(size) => 0..size,
                _ => first..last + 1,
            }
        })
    }

    fn count(&self, low: IVec2, high: IVec2) -> u64 {
        self.ranges(low, high)
            .iter()
            .map(|range| range.len() as u64)
            .product()
    }

    fn mean_and_max(&self, low: IVec2, high: IVec2) -> (Vec3, f32) {
        let [columns, rows] = self.ranges(low, high);
        let place = |wrap: Wrap, at: i32, size: u32| {
            let size = size as i32;
            match wrap {
                Wrap::Mirror if at.div_euclid(size) % 2 != 0 => size - 1 - at.rem_euclid(size),
                _ => at.rem_euclid(size),
            }
        };
        let (mut sum, mut brightest, mut count) = (Vec3::ZERO, 0.0_f32, 0_u32);
        for row in rows {
            let y = place(self.wrap[1], row, self.image.height);
            for column in columns.clone() {
                let x = place(self.wrap[0], column, self.image.width);
                let first = (y as usize * self.image.width as usize + x as usize) * 4;
                let Some(texel) = self.image.rgba.get(first..first + 3) else {
                    continue;
                };
                let texel = Vec3::from_array([0, 1, 2].map(|c| self.linear[usize::from(texel[c])]));
                sum += texel;
                brightest = brightest.max(texel.max_element());
                count += 1;
            }
        }
        (sum / count.max(1) as f32, brightest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Texture, Vertex};

    /// A triangle over half of an image of 64 × 64 texels, of which one shines; or all.
    fn screen(bright: impl Fn(u32, u32) -> bool) -> Scene {
        let texels = (0..64 * 64).flat_map(|i| [255 * u8::from(bright(i % 64, i / 64)); 4]);
        let corner = |uv| Vertex {
            uv: [uv; 2],
            ..Vertex::default()
        };
        Scene {
            vertices: [Vec2::ZERO, Vec2::X, Vec2::Y].map(corner).into(),
            triangles: vec![Triangle {
                vertices: [0, 1, 2],
                material: 0,
            }],
            materials: vec![Material {
                emission: Vec3::splat(5.0),
                emission_texture: Some(TextureRef {
                    texture: 0,
                    uv_set: 0,
                    transform: [Vec3::X, Vec3::Y],
                }),
                ..Material::default()
            }],
            textures: vec![Texture {
                image: 0,
                wrap: [Wrap::Repeat; 2],
                nearest: false,
                srgb: true,
            }],
            images: vec![Image {
                width: 64,
                height: 64,
                rgba: texels.collect(),
            }],
            ..Scene::default()
        }
    }

    fn parts_of(scene: &Scene) -> Vec<Part> {
        parts(scene, &scene.triangles[0], &mut Budget::new(scene))
    }

    #[test]
    fn an_even_triangle_is_one_part_and_a_dark_one_none() {
        let whole = parts_of(&screen(|_, _| true));
        assert_eq!(whole.len(), 1);
        assert_eq!(whole[0].mean, Vec3::splat(5.0));
        assert_eq!(parts_of(&screen(|_, _| false)), []);
    }

    /// Of one bright texel in the middle of the triangle: all parts lie about it, and cover what it reaches.
    #[test]
    fn parts_gather_about_a_bright_texel() {
        let parts = parts_of(&screen(|x, y| (x, y) == (20, 10)));
        let middle = Vec2::new(20.5, 10.5) / 64.0;
        let reach = 1.0 / 64.0;
        let mut area = 0.0;
        for part in &parts {
            let center = part.corner + part.edge / 3.0;
            assert!(
                (center - middle).abs().max_element() < 4.0 * reach,
                "{part:?}"
            );
            area += part.edge.powi(2) * 0.5;
        }
        assert!(parts.is_sorted_by(|a, b| a.key < b.key));
        assert!((4.0..36.0).contains(&(area / reach.powi(2))), "{area}");
        // In corners of what it reaches, and near its middle.
        for aside in [-Vec2::ONE, Vec2::new(0.1, 0.13), Vec2::X, Vec2::ONE] {
            let place = middle + 0.95 * reach * aside;
            let holds = |part: &&Part| {
                let local = (place - part.corner) / part.edge;
                local.min_element() >= 0.0 && local.element_sum() <= 1.0
            };
            assert_eq!(parts.iter().filter(holds).count(), 1, "{aside}");
        }
    }
}
