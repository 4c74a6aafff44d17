//! How far a picture is from the truth, bias included, without knowing the truth.
//!
//! Errors are relative: the root mean square over the pixels of (x − r) / √(r² + (m / 10)²), where x
//! and r are the luminances of picture and truth, and m is the mean of r. Where what was gathered
//! within half the radius is known well, that is r, since beside a bright caustic most of the rest may
//! be blur; elsewhere r is the median of the neighbourhood, since a value that a few bright outliers
//! make is no truth. Two things make errors:
//!
//! * Noise: the variance over the iterations, divided by their number.
//! * Bias: B(ρ), what a density estimate of radius ρ blurs. Each iteration gathers twice from the same
//!   photons, within ρ and within ρ / 2, and B(ρ) − B(ρ / 2) is what the film averages. Where light
//!   varies smoothly B grows with ρ², and B(ρ) is 4/3 of that difference; at a step, such as the edge
//!   of a shadow or a caustic, the root mean square of B about it is 2.08 of the difference's.
//!   [`BIAS_PER_DIFFERENCE`] is for steps. (Hachisuka, Jarosz & Jensen 2010 take B from derivatives of
//!   the kernel, which presumes the first case.)

use crate::film::radiance;
use crate::image::luminance;
use crate::shared::FilmPixel;

/// See above.
const BIAS_PER_DIFFERENCE: f64 = 2.0;
/// Of a normal distribution: below this many standard deviations above the mean lie 95 %.
const SIGMAS: f64 = 1.645;
/// What a pixel gathers is known where the standard errors, of its value and of how that differs
/// within half the radius, are together below this share of it.
const KNOWN: f64 = 0.25;
/// Pixels along the edge of a block at most; further apart, errors hardly depend on each other.
const BLOCK: usize = 16;
/// Blocks across an image at least, where it has so many pixels.
const BLOCKS: usize = 8;

/// Estimated relative errors of a picture: root mean squares over the pixels of (x − r) / √(r² + (m
/// / 10)²), for luminances x of r of a mean of m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Noise and bias together.
    pub error: f64,
    /// The error is below this with a confidence of 95 %: what is not known of the error itself is
    /// taken from how it differs from one part of the picture to another.
    pub error_95: f64,
    pub noise: f64,
    pub bias: f64,
    /// What these numbers say nothing of.
    pub unknown: Option<Unknown>,
}

/// Light that is there, of which too little was found to know how much it varies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknown {
    Caustics,
    Indirect,
    /// What the technique does not see at all.
    Unseen,
}

impl Unknown {
    /// As messages have it.
    pub fn text(self) -> &'static str {
        match self {
            Self::Caustics => {
                "unknown: specular surfaces are lit, and hardly a photon of them is found"
            }
            Self::Unseen => {
                "unknown: this technique does not see lamps without area by way of mirrors and glass"
            }
            Self::Indirect => "unknown: surfaces are lit, and hardly a photon from them is found",
        }
    }
}

impl Accuracy {
    /// The error is known, and below this with a confidence of 95 %.
    pub fn reaches(&self, target: f64) -> bool {
        self.unknown.is_none() && self.error_95 <= target
    }
}

/// Iterations at which to look at the error again, for who waits for it to fall below a limit:
/// first after 16, since fewer do not tell how much they vary, then an eighth more each time, since
/// a limit tested often is passed by chance too early.
pub fn next_look(iterations: u64) -> u64 {
    (iterations * 9 / 8).max(16)
}

/// Of the means in `pixels`, row by row, after so many iterations; 1, all of it noise, where
/// nothing is known yet.
pub fn accuracy(pixels: &[FilmPixel], width: u32, iterations: u64) -> Accuracy {
    let width = (width as usize).max(1);
    let luminances: Vec<f64> = pixels
        .iter()
        .map(|p| luminance(radiance(p)).into())
        .collect();
    let mean = luminances.iter().sum::<f64>() / luminances.len().max(1) as f64;
    if iterations < 2 || mean.is_nan() || mean <= 0.0 {
        return Accuracy {
            error: 1.0,
            error_95: 1.0,
            noise: 1.0,
            bias: 0.0,
            unknown: None,
        };
    }
    let of_mean = 1.0 / (iterations - 1) as f64;
    let height = pixels.len() / width;
    let block = (width.min(height) / BLOCKS).clamp(1, BLOCK);
    let across = width.div_ceil(block);
    // Of each block: noise², bias², pixels.
    let mut blocks = vec![[0.0; 3]; across * height.div_ceil(block)];
    for (i, p) in pixels.iter().enumerate() {
        let (x, y) = (i % width, i / width);
        let noise2 = f64::from(p.variance.max(0.0)) * of_mean;
        let bias_noise2 = f64::from(p.bias_variance) * of_mean;
        let truth = match luminances.get(i) {
            Some(&own) if noise2 + bias_noise2 < KNOWN.powi(2) * own * own => {
                (own - f64::from(p.bias)).max(0.0)
            }
            _ => median_around(&luminances, width, x, y),
        };
        let weight = 1.0 / (truth * truth + 0.01 * mean * mean);
        // The square of a noisy mean is too large by its variance.
        let difference2 = f64::from(p.bias).powi(2) - bias_noise2;
        if let Some(sums) = blocks.get_mut(y / block * across + x / block) {
            sums[0] += weight * noise2;
            sums[1] += weight * BIAS_PER_DIFFERENCE.powi(2) * difference2;
            sums[2] += 1.0;
        }
    }
    let total = |part: usize| blocks.iter().map(|b| b[part]).sum::<f64>();
    let n = total(2);
    let [noise2, bias2] = [total(0) / n, (total(1) / n).max(0.0)];
    let error2 = noise2 + bias2;
    let deviations = blocks.iter().map(|b| b[0] + b[1] - b[2] * error2);
    let count = blocks.len() as f64;
    let variance = deviations.map(|d| d * d).sum::<f64>() * count / (count - 1.0).max(1.0);
    Accuracy {
        error: error2.sqrt(),
        error_95: (error2 + SIGMAS * variance.sqrt() / n).sqrt(),
        noise: noise2.sqrt(),
        bias: bias2.sqrt(),
        unknown: None,
    }
}

/// Of the 3 × 3 pixels about one.
fn median_around(luminances: &[f64], width: usize, x: usize, y: usize) -> f64 {
    let mut near = Vec::with_capacity(9);
    for row in y.saturating_sub(1)..=y + 1 {
        for column in x.saturating_sub(1)..=(x + 1).min(width - 1) {
            near.extend(luminances.get(row * width + column));
        }
    }
    near.sort_unstable_by(f64::total_cmp);
    near.get(near.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grey pixels of 32 × 32.
    fn pixels(pixel: impl Fn(usize) -> FilmPixel) -> Vec<FilmPixel> {
        (0..1024).map(pixel).collect()
    }

    fn grey(value: f32) -> FilmPixel {
        FilmPixel {
            global: [value; 3],
            ..FilmPixel::default()
        }
    }

    #[test]
    fn noise_alone() {
        // Variance 0.04 an iteration, 101 iterations: 0.02 of 1.
        let found = accuracy(
            &pixels(|_| FilmPixel {
                variance: 0.04,
                ..grey(1.0)
            }),
            32,
            101,
        );
        let expected = 0.02 / 1.01_f64.sqrt();
        assert!((found.error / expected - 1.0).abs() < 1e-6, "{found:?}");
        // Every block alike: nothing more to fear.
        assert!((found.error_95 / expected - 1.0).abs() < 1e-6, "{found:?}");
        assert_eq!(found.bias, 0.0);
    }

    #[test]
    fn noise_is_no_bias() {
        // Differences of ±0.1 as their own variance explains; and the same without a variance.
        let differs = |i: usize, variance| FilmPixel {
            bias: if i.is_multiple_of(2) { 0.1 } else { -0.1 },
            bias_variance: variance,
            ..grey(1.0)
        };
        let by_noise = accuracy(&pixels(|i| differs(i, 1.0)), 32, 101);
        assert!(by_noise.bias < 1e-3, "{by_noise:?}");
        let bias = accuracy(&pixels(|i| differs(i, 0.0)), 32, 101).bias;
        // Relative to what half the radius shows: 0.9 and 1.1.
        let weight = (1.0 / (0.9f64.powi(2) + 0.01) + 1.0 / (1.1f64.powi(2) + 0.01)) / 2.0;
        assert!((bias - 0.2 * weight.sqrt()).abs() < 1e-6, "{bias}");
    }

    #[test]
    fn one_noisy_block_widens_the_bound() {
        let found = accuracy(
            &pixels(|i| FilmPixel {
                variance: if i == 0 { 40.0 } else { 0.04 },
                ..grey(1.0)
            }),
            32,
            101,
        );
        assert!(found.error_95 > 1.3 * found.error, "{found:?}");
    }

    #[test]
    fn a_bright_pixel_is_judged_by_its_own_value() {
        // As noisy as the others: 0.02 of its value, which is 100 times theirs.
        let found = accuracy(
            &pixels(|i| match i {
                500 => FilmPixel {
                    variance: 400.0,
                    ..grey(100.0)
                },
                _ => FilmPixel {
                    variance: 0.04,
                    ..grey(1.0)
                },
            }),
            32,
            101,
        );
        assert!((found.noise - 0.02).abs() < 2e-4, "{found:?}");
    }

    #[test]
    fn blur_is_relative_to_what_it_covers() {
        // Half of what is seen is gone within half the radius.
        let blurred = FilmPixel {
            bias: 0.5,
            ..grey(1.0)
        };
        let found = accuracy(&pixels(|_| blurred), 32, 101);
        let expected = 2.0 * 0.5 / (0.25f64 + 0.01).sqrt();
        assert!((found.bias / expected - 1.0).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn nothing_is_known_of_nothing() {
        for (pixels, width, iterations) in [
            (pixels(|_| grey(1.0)), 32, 1),
            (pixels(|_| grey(0.0)), 32, 10),
            (vec![], 0, 10),
        ] {
            assert_eq!(accuracy(&pixels, width, iterations).error_95, 1.0);
        }
        assert!(accuracy(&[grey(1.0)], 1, 10).error_95.is_finite());
    }
}
