//! HDR-FLIP: Andersson, Nilsson, Shirley & Akenine-Möller, *Visualizing Errors in Rendered High Dynamic Range Images*,
//! 2021, on top of Andersson et al., *FLIP: A Difference Evaluator for Alternating Images*, 2020. Section numbers
//! are those of the latter. Constants are the authors', the tone curve is ACES, the viewer sits 0.7 m from a 4K monitor that is
//! 0.7 m wide.

use crate::image::luminance;
use std::f32::consts::PI;

type Rgb = [f32; 3];

const PIXELS_PER_DEGREE: f32 = 3840.0 * PI / 180.0;

/// Exponents and bends of the two pipelines (sections 4.1.3, 4.2 and 4.3).
const QC: f32 = 0.7;
const QF: f32 = 0.5;
const PC: f32 = 0.4;
const PT: f32 = 0.95;

/// ACES as a quotient of quadratics (Narkowicz 2016), his pre-exposure of 0.6 taken out.
const TONE: [f32; 5] = [0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14];

/// Error in [0, 1] of each pixel: the largest of FLIP's over exposures from that which just keeps the
/// reference's brightest pixel to that which lifts its median (2021, section 3).
pub fn hdr_flip(size: [usize; 2], test: &[Rgb], reference: &[Rgb]) -> Vec<f32> {
    let filters = Filters::new();
    let mut worst = vec![0.0f32; reference.len()];
    for exposure in exposures(reference) {
        let scale = exposure.exp2();
        let shown = |pixels: &[Rgb]| -> Vec<Rgb> {
            pixels
                .iter()
                .map(|p| opponent(p.map(|x| tone(x * scale))))
                .collect()
        };
        let errors = flip(size, &filters, &shown(test), &shown(reference));
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error);
        }
    }
    worst
}

/// Exposures (EV). Where half the image or more is black, the median is that of the rest: the authors' program divides
/// by 0 there.
fn exposures(reference: &[Rgb]) -> Vec<f32> {
    // The radiance that the curve takes to 0.85.
    let t = 0.85;
    let (a, b, c) = (TONE[0] - t * TONE[2], TONE[1] - t * TONE[3], -t * TONE[4]);
    let bright = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);

    let mut lit: Vec<f32> = reference.iter().map(|p| luminance(*p)).collect();
    lit.sort_unstable_by(f32::total_cmp);
    let mut median = lit.get(lit.len() / 2).copied().unwrap_or(0.0);
    if median <= 0.0 {
        lit.retain(|&y| y > 0.0);
        median = lit.get(lit.len() / 2).copied().unwrap_or(1.0);
    }
    let brightest = lit.last().copied().filter(|&y| y > 0.0).unwrap_or(1.0);
    let (start, stop) = ((bright / brightest).log2(), (bright / median).log2());
    let count = (stop - start).ceil().max(2.0);
    let step = (stop - start) / (count - 1.0);
    (0..count as usize)
        .map(|i| start + i as f32 * step)
        .collect()
}

fn tone(x: f32) -> f32 {
    // Beyond 1e6 the curve has long reached 1; its squares would overflow.
    let x = x.clamp(0.0, 1e6);
    let y = (TONE[0] * x * x + TONE[1] * x) / (TONE[2] * x * x + TONE[3] * x + TONE[4]);
    y.clamp(0.0, 1.0)
}

/// FLIP of images in YCxCz.
fn flip(size: [usize; 2], filters: &Filters, test: &[Rgb], reference: &[Rgb]) -> Vec<f32> {
    let (seen, expected) = (filters.seen(size, test), filters.seen(size, reference));
    let (features, wanted) = (
        filters.features(size, test),
        filters.features(size, reference),
    );
    // The largest distance that there is: from green to blue (section 4.1.3).
    let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(hunt_lab);
    let max = hyab(green, blue).powf(QC);
    let pairs = seen.iter().zip(&expected).zip(features.iter().zip(&wanted));
    pairs
        .map(|((seen, expected), (f, w))| {
            let distance = hyab(*seen, *expected).powf(QC);
            let color = if distance < PC * max {
                PT / (PC * max) * distance
            } else {
                PT + (distance - PC * max) / (max - PC * max) * (1.0 - PT)
            };
            let feature = (f[0] - w[0]).abs().max((f[1] - w[1]).abs());
            color.powf(1.0 - (feature / 2f32.sqrt()).powf(QF))
        })
        .collect()
}

/// HyAB distance in Hunt-adjusted L\*a\*b\* (section 4.1.2).
fn hyab(a: Rgb, b: Rgb) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Kernels of one dimension; the edge's pixels go on beyond it.
struct Filters {
    /// Contrast sensitivity as Gaussians, one each for Y and Cx and two for Cz, with their weights (section 4.1.1).
    sensitivity: [Vec<(f32, Vec<f32>)>; 3],
    /// A Gaussian and its first and second derivative (section 4.2.1).
    feature: [Vec<f32>; 3],
}

impl Filters {
    fn new() -> Self {
        // (a, b) of a √(π/b) exp(−π² x²/b), x in degrees (table 1).
        const GAUSSIANS: [&[(f32, f32)]; 3] = [
            &[(1.0, 0.0047)],
            &[(1.0, 0.0053)],
            &[(34.1, 0.04), (13.5, 0.025)],
        ];
        let widest = (0.04 / (2.0 * PI * PI)).sqrt();
        let radius = (3.0 * widest * PIXELS_PER_DEGREE).ceil() as i32;
        let sensitivity = GAUSSIANS.map(|gaussians| {
            let kernels = gaussians.iter().map(|&(a, b)| {
                let g = |x: i32| (-(PI * x as f32 / PIXELS_PER_DEGREE).powi(2) / b).exp();
                let kernel: Vec<f32> = (-radius..=radius).map(g).collect();
                let sum: f32 = kernel.iter().sum();
                let weight = a * (PI / b).sqrt() * sum * sum;
                (weight, kernel.iter().map(|k| k / sum).collect())
            });
            let mut kernels: Vec<(f32, Vec<f32>)> = kernels.collect();
            let total: f32 = kernels.iter().map(|k| k.0).sum();
            kernels.iter_mut().for_each(|k| k.0 /= total);
            kernels
        });

        let deviation = 0.5 * 0.082 * PIXELS_PER_DEGREE;
        let radius = (3.0 * deviation).ceil() as i32;
        let kernel = |factor: fn(f32) -> f32| -> Vec<f32> {
            let value = |x: i32| {
                let x = x as f32 / deviation;
                factor(x) * (-0.5 * x * x).exp()
            };
            let kernel: Vec<f32> = (-radius..=radius).map(value).collect();
            // Positive weights sum to 1, negative ones to −1.
            let sum = |sign: f32| kernel.iter().map(|k| (k * sign).max(0.0)).sum::<f32>();
            let (positive, negative) = (sum(1.0), sum(-1.0));
            let normalized = |k: &f32| {
                k / if *k > 0.0 {
                    positive
                } else {
                    negative.max(1e-30)
                }
            };
            kernel.iter().map(normalized).collect()
        };
        Self {
            sensitivity,
            feature: [kernel(|_| 1.0), kernel(|x| -x), kernel(|x| x * x - 1.0)],
        }
    }

    /// What the eye makes of an image in YCxCz, as Hunt-adjusted L\*a\*b\*.
    fn seen(&self, size: [usize; 2], image: &[Rgb]) -> Vec<Rgb> {
        let mut filtered = vec![[0.0; 3]; image.len()];
        for (c, gaussians) in self.sensitivity.iter().enumerate() {
            let channel: Vec<f32> = image.iter().map(|p| p[c]).collect();
            for (weight, kernel) in gaussians {
                let blurred = convolve(size, &channel, kernel, kernel);
                for (sum, value) in filtered.iter_mut().zip(blurred) {
                    sum[c] += weight * value;
                }
            }
        }
        let clamped = |p| rgb_of_opponent(p).map(|x| x.clamp(0.0, 1.0));
        filtered.into_iter().map(|p| hunt_lab(clamped(p))).collect()
    }

    /// How much of an edge and of a point each pixel is.
    fn features(&self, size: [usize; 2], image: &[Rgb]) -> Vec<[f32; 2]> {
        let y: Vec<f32> = image.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
        let [gaussian, edge, point] = &self.feature;
        let norm = |kernel: &[f32]| {
            let across = convolve(size, &y, kernel, gaussian);
            let down = convolve(size, &y, gaussian, kernel);
            across.into_iter().zip(down).map(|(x, y)| x.hypot(y))
        };
        norm(edge).zip(norm(point)).map(|(e, p)| [e, p]).collect()
    }
}

/// With `horizontal` along rows, then `vertical` along columns.
fn convolve(
    [width, height]: [usize; 2],
    image: &[f32],
    horizontal: &[f32],
    vertical: &[f32],
) -> Vec<f32> {
    let mut rows = vec![0.0; image.len()];
    for (row, out) in image.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
        let radius = horizontal.len() / 2;
        for (x, out) in out.iter_mut().enumerate() {
            for (k, weight) in horizontal.iter().enumerate() {
                *out += weight * row[(x + k).saturating_sub(radius).min(width - 1)];
            }
        }
    }
    let mut result = vec![0.0; image.len()];
    for (y, out) in result.chunks_exact_mut(width).enumerate() {
        let radius = vertical.len() / 2;
        for (k, weight) in vertical.iter().enumerate() {
            let from = (y + k).saturating_sub(radius).min(height - 1) * width;
            for (out, value) in out.iter_mut().zip(&rows[from..from + width]) {
                *out += weight * value;
            }
        }
    }
    result
}

/// XYZ of linear sRGB and back, D65, to more digits than the standard has (as in the authors' program, so that numbers agree).
const XYZ: [Rgb; 3] = [
    [0.41238656, 0.35759149, 0.18045049],
    [0.21263682, 0.715183, 0.0721802],
    [0.01933062, 0.11919716, 0.9503726],
];
const RGB: [Rgb; 3] = [
    [3.2410033, -1.5373989, -0.49861586],
    [-0.96922433, 1.8759301, 0.041554224],
    [0.055639423, -0.2040112, 1.0571489],
];
const WHITE: Rgb = [0.95042855, 1.0, 1.0889004];

fn multiply(m: [Rgb; 3], v: Rgb) -> Rgb {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// XYZ over white's.
fn relative_xyz(rgb: Rgb) -> Rgb {
    let xyz = multiply(XYZ, rgb);
    [0, 1, 2].map(|i| xyz[i] / WHITE[i])
}

/// Lightness and two colour differences of three responses, as in L\*a\*b\* and YCxCz.
fn differences([x, y, z]: Rgb) -> Rgb {
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// YCxCz of linear sRGB: as L\*a\*b\*, but linear.
fn opponent(rgb: Rgb) -> Rgb {
    differences(relative_xyz(rgb))
}

fn rgb_of_opponent([y, cx, cz]: Rgb) -> Rgb {
    let y = (y + 16.0) / 116.0;
    let relative = [y + cx / 500.0, y, y - cz / 200.0];
    multiply(RGB, [0, 1, 2].map(|i| relative[i] * WHITE[i]))
}

/// L\*a\*b\* of linear sRGB, its colours fading with lightness as they do to the eye (Hunt 1952).
fn hunt_lab(rgb: Rgb) -> Rgb {
    const DELTA: f32 = 6.0 / 29.0;
    let response = |t: f32| match t > DELTA * DELTA * DELTA {
        true => t.cbrt(),
        false => t / (3.0 * DELTA * DELTA) + 4.0 / 29.0,
    };
    let [l, a, b] = differences(relative_xyz(rgb).map(response));
    [l, 0.01 * l * a, 0.01 * l * b]
}
