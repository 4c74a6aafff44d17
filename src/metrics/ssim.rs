//! Structural similarity (Wang, Bovik, Sheikh & Simoncelli 2004): an 11 × 11 Gaussian window of σ = 1.5, K₁ = 0.01,
//! K₂ = 0.03, population moments.
//!
//! It was made for images on a screen, so radiance becomes one first: exposed as the reference would be
//! ([`auto_exposure`]), toned ([`Tone::Neutral`]), its luminance sRGB-encoded to [0, 1].

use crate::image::{Tone, auto_exposure, luminance, srgb};

/// Half the window's width (px).
const RADIUS: usize = 5;
const SIGMA: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// 1 − SSIM of each pixel, and whether its whole window lies within the image: only those make the mean.
pub fn dissimilarity(
    size: [usize; 2],
    test: &[[f32; 3]],
    reference: &[[f32; 3]],
) -> (Vec<f32>, Vec<bool>) {
    let scale = auto_exposure(reference.as_flattened()).exp2() as f32;
    let display = |pixels: &[[f32; 3]]| -> Vec<f64> {
        let shown = |p: &[f32; 3]| srgb(luminance(Tone::Neutral.apply(p.map(|x| x * scale))));
        pixels.iter().map(|p| f64::from(shown(p))).collect()
    };
    let (x, y) = (display(test), display(reference));
    let product =
        |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
    let blurred = |image: &[f64]| blur(size, image);
    let (mean_x, mean_y) = (blurred(&x), blurred(&y));
    let (xx, yy, xy) = (
        blurred(&product(&x, &x)),
        blurred(&product(&y, &y)),
        blurred(&product(&x, &y)),
    );
    let map = (0..x.len()).map(|i| {
        let (mx, my) = (mean_x[i], mean_y[i]);
        let (var_x, var_y, cov) = (xx[i] - mx * mx, yy[i] - my * my, xy[i] - mx * my);
        let similarity = (2.0 * mx * my + C1) * (2.0 * cov + C2)
            / ((mx * mx + my * my + C1) * (var_x + var_y + C2));
        (1.0 - similarity) as f32
    });
    let [width, height] = size;
    let inside = |i: usize, n: usize| i >= RADIUS && i + RADIUS < n;
    let inner = (0..x.len()).map(|i| inside(i % width, width) && inside(i / width, height));
    (map.collect(), inner.collect())
}

/// By the Gaussian window; the edge's pixels go on beyond it.
fn blur([width, height]: [usize; 2], image: &[f64]) -> Vec<f64> {
    let mut window = [0.0; 2 * RADIUS + 1];
    for (i, w) in window.iter_mut().enumerate() {
        *w = (-(i as f64 - RADIUS as f64).powi(2) / (2.0 * SIGMA * SIGMA)).exp();
    }
    let sum: f64 = window.iter().sum();
    let at = |i: usize, k: usize, n: usize| (i + k).saturating_sub(RADIUS).min(n - 1);
    let pass = |image: &[f64], index: &dyn Fn(usize, usize) -> usize| -> Vec<f64> {
        let weighted = |i: usize| window.iter().enumerate().map(move |(k, w)| (k, w, i));
        (0..image.len())
            .map(|i| {
                weighted(i)
                    .map(|(k, w, i)| w / sum * image[index(i, k)])
                    .sum()
            })
            .collect()
    };
    let rows = pass(image, &|i, k| i / width * width + at(i % width, k, width));
    pass(&rows, &|i, k| at(i / width, k, height) * width + i % width)
}
