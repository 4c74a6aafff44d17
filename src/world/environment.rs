//! The environment map and the distribution that directions are drawn from (see `glsl/lib/environment.glsl`).

use crate::Result;
use crate::gpu::{Buffer, Gpu};
use crate::image::Rgb;
use crate::scene::{Environment, Scene};
use crate::shared::{self, EnvironmentRow};
use glam::{DVec3, Vec3};
use std::borrow::Cow;
use std::f64::consts::PI;

/// Whether a scene has one that is not black.
pub fn shines(scene: &Scene) -> bool {
    let environment = scene.environment.as_ref();
    environment.is_some_and(|e| e.map.pixels.iter().any(|&value| value > 0.0))
}

/// A scene's, or a black one.
pub fn of(scene: &Scene) -> Cow<'_, Environment> {
    scene.environment.as_ref().map_or_else(
        || {
            Cow::Owned(Environment {
                map: Rgb {
                    size: [1, 1],
                    pixels: vec![0.0; 3],
                },
                rotation: 0.0,
                warnings: Vec::new(),
            })
        },
        Cow::Borrowed,
    )
}

/// Bytes on the device.
pub fn bytes(environment: &Environment) -> u64 {
    let [width, height] = environment.map.size.map(u64::from);
    let rows = (height + 2) * size_of::<EnvironmentRow>() as u64;
    12 * width * height + rows + 4 * (width + 1) * (height + 1)
}

/// What lies on the device, and its addresses.
pub struct Buffers {
    pub environment: shared::Environment,
    _radiance: Buffer<[f32; 3]>,
    _rows: Buffer<EnvironmentRow>,
    _columns: Buffer<f32>,
}

pub fn upload(gpu: &Gpu, environment: &Environment) -> Result<Buffers> {
    let (rows, columns) = distribution(environment);
    let (texels, _) = environment.map.pixels.as_chunks();
    let radiance = gpu.upload("environment", texels)?;
    let rows = gpu.upload("environment rows", &rows)?;
    let columns = gpu.upload("environment columns", &columns)?;
    Ok(Buffers {
        environment: shared::Environment {
            radiance: radiance.ptr(),
            rows: rows.ptr(),
            columns: columns.ptr(),
            size: environment.map.size,
            rotation: environment.rotation / std::f32::consts::TAU,
            unused: 0,
        },
        _radiance: radiance,
        _rows: rows,
        _columns: columns,
    })
}

/// ∫ L dω over the sphere [nit sr].
pub fn irradiation(environment: &Environment) -> Vec3 {
    let rows = (0..=environment.map.size[1]).map(|row| {
        let cells: DVec3 = row_cells(environment, row).sum();
        cells * cell_solid_angle(environment, row)
    });
    rows.sum::<DVec3>().as_vec3()
}

/// Rows with their cumulative probability, and the cells' within each row.
fn distribution(environment: &Environment) -> (Vec<EnvironmentRow>, Vec<f32>) {
    let [width, height] = environment.map.size;
    let mut sums = vec![0.0];
    let mut columns = Vec::with_capacity((width as usize + 1) * (height as usize + 1));
    for row in 0..=height {
        let means = row_cells(environment, row).map(|radiance| radiance.element_sum());
        let mut within = vec![0.0];
        append_sums(&mut within, means);
        let total = within.last().copied().unwrap_or(0.0) * cell_solid_angle(environment, row);
        columns.extend(normalized(&within));
        append_sums(&mut sums, std::iter::once(total));
    }
    let rows = normalized(&sums).zip(0..).map(|(cumulative, row)| {
        let half = 0.5 * upper_edge(height, row);
        EnvironmentRow {
            half_angle2: [half.sin().powi(2) as f32, half.cos().powi(2) as f32],
            cumulative,
            solid_angle: cell_solid_angle(environment, row.min(height)) as f32,
        }
    });
    (rows.collect(), columns)
}

fn append_sums(sums: &mut Vec<f64>, values: impl Iterator<Item = f64>) {
    let mut sum = sums.last().copied().unwrap_or(0.0);
    sums.extend(values.map(|value| {
        sum += value;
        sum
    }));
}

/// Up to 1, which the last of them is; 0 where nothing shines.
fn normalized(sums: &[f64]) -> impl Iterator<Item = f32> {
    let total = sums.last().copied().unwrap_or(0.0);
    let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
    sums.iter().map(move |sum| (sum * scale) as f32)
}

/// The polar angle where a row of cells begins: in the middle of a row of texels, but for the poles.
fn upper_edge(height: u32, row: u32) -> f64 {
    ((f64::from(row) - 0.5) / f64::from(height)).clamp(0.0, 1.0) * PI
}

fn cell_solid_angle(environment: &Environment, row: u32) -> f64 {
    let [width, height] = environment.map.size;
    let [top, bottom] = [row, row + 1].map(|edge| upper_edge(height, edge));
    // cos a - cos b without cancellation at the poles.
    let height = 2.0 * (0.5 * (top + bottom)).sin() * (0.5 * (bottom - top)).sin();
    2.0 * PI / f64::from(width) * height
}

/// Mean radiance of each cell of a row: that of its four corners, which are texels; beyond the poles there are none.
fn row_cells(environment: &Environment, row: u32) -> impl Iterator<Item = DVec3> {
    let [width, height] = environment.map.size.map(|n| n as usize);
    let (texels, _) = environment.map.pixels.as_chunks::<3>();
    let above = (row as usize).saturating_sub(1);
    let below = (row as usize).min(height - 1);
    let at = move |y: usize, x: usize| {
        let texel = texels.get(y * width + x % width);
        texel.map_or(DVec3::ZERO, |t| Vec3::from(*t).as_dvec3())
    };
    (0..width)
        .map(move |x| 0.25 * (at(above, x) + at(above, x + 1) + at(below, x) + at(below, x + 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_sky_shines_from_the_whole_sphere() {
        for size in [[1, 1], [2, 1], [16, 8], [5, 7]] {
            let environment = Environment {
                map: Rgb {
                    size,
                    pixels: [1.0, 2.0, 3.0].repeat((size[0] * size[1]) as usize),
                },
                rotation: 0.0,
                warnings: Vec::new(),
            };
            let all = irradiation(&environment) / (4.0 * std::f32::consts::PI);
            assert!(all.abs_diff_eq(Vec3::new(1.0, 2.0, 3.0), 1e-5), "{all}");
            let (rows, columns) = distribution(&environment);
            assert_eq!(rows.len(), size[1] as usize + 2);
            assert_eq!(
                columns.len(),
                (size[0] as usize + 1) * (size[1] as usize + 1)
            );
            assert_eq!(rows.last().unwrap().cumulative, 1.0);
            assert_eq!(columns.last(), Some(&1.0));
        }
    }
}
