//! Bias and variance apart, from images of several seeds.

use super::weight;
use crate::image::Rgb;

/// The parts of the relMSE that one image is expected to have, in units of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    /// What more seeds would not cure. Unbiased, so that it may come out below 0 where noise hides it; the
    /// reference's own error is in it.
    pub bias2: f64,
    /// What changes from seed to seed.
    pub variance: f64,
}

/// Of `images`, two or more, finite and of the reference's size; else `None`.
///
/// With the mean m of n images, E\[(m − r)²\] = bias² + variance / n, from which the variance as estimated from the
/// spread of the images is taken off.
pub fn split(images: &[&Rgb], reference: &Rgb) -> Option<Split> {
    let n = images.len() as f64;
    let fits = |image: &&Rgb| image.size == reference.size;
    if n < 2.0 || !images.iter().all(fits) {
        return None;
    }
    let (mut bias2, mut variance) = (0.0, 0.0);
    for (i, &r) in reference.pixels.iter().enumerate() {
        let of = |image: &&Rgb| image.pixels.get(i).map(|x| f64::from(*x));
        let values: Vec<f64> = images.iter().map(of).collect::<Option<_>>()?;
        let mean = values.iter().sum::<f64>() / n;
        let spread: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
        let r = f64::from(r);
        let pixel_variance = spread / (n - 1.0);
        variance += pixel_variance / weight(r);
        bias2 += ((mean - r).powi(2) - pixel_variance / n) / weight(r);
    }
    let count = reference.pixels.len() as f64;
    Some(Split {
        bias2: bias2 / count,
        variance: variance / count,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Images r + b + s·noise have bias² b² and variance s² over the weight, whatever n is.
    #[test]
    fn bias_and_variance_are_told_apart() {
        let size = [64, 64];
        let mut state = 1u64;
        let mut random = move || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1 << 24) as f32
        };
        let grey = |pixels| Rgb { size, pixels };
        let reference = grey(vec![0.7; 64 * 64 * 3]);
        let mut image = || {
            grey(
                (0..64 * 64 * 3)
                    .map(|_| 0.8 + 0.6 * (random() - 0.5))
                    .collect(),
            )
        };
        let images = [image(), image(), image(), image()];
        let found = split(&images.each_ref(), &reference).unwrap();
        let expected = Split {
            bias2: 0.01 / 0.5,
            variance: 0.6 * 0.6 / 12.0 / 0.5,
        };
        assert!(
            (found.bias2 / expected.bias2 - 1.0).abs() < 0.05,
            "{found:?}"
        );
        assert!(
            (found.variance / expected.variance - 1.0).abs() < 0.02,
            "{found:?}"
        );
        assert_eq!(split(&[&images[0]], &reference), None);
    }
}
