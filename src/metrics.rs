//! How far an image is from a reference.
//!
//! | metric | of each pixel | paper |
//! |---|---|---|
//! | [`Metric::RelMse`] | mean over the channels of (x − r)² / (r² + 0.01) | |
//! | [`Metric::RelMseTrimmed`] | the same; its mean leaves out the worst 0.1 % of the pixels | |
//! | [`Metric::Relative`] | (x − r)² / (r² + (m / 10)²) of luminances, where r has the mean m; of the image the root of the mean: what `--target-error` bounds | |
//! | [`Metric::Mse`], [`Metric::Mae`] | mean over the channels of (x − r)², of \|x − r\| | |
//! | [`Metric::Ssim`] | structural similarity of displayed luminance, as 1 − SSIM | Wang et al. 2004 |
//! | [`Metric::Flip`] | HDR-FLIP | Andersson et al. 2020, 2021 |
//!
//! All of them are 0 for equal images and grow with the error. A pixel that is not finite in either image has no
//! error: it is left out of every mean, stands as the reference (or as black) in its neighbours' windows, and is
//! counted in [`Pair::excluded`], which whoever judges an image must look at too.

mod colormap;
mod flip;
mod seeds;
mod ssim;

use crate::image::{Rgb, luminance};
use clap::ValueEnum;

pub use colormap::magma;
pub use seeds::{Split, split};

/// What to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Metric {
    /// Mean of (x − r)² / (r² + 0.01) over pixels and channels
    #[value(name = "relmse")]
    RelMse,
    /// The same without the worst 0.1 % of the pixels
    #[value(name = "relmse-trimmed")]
    RelMseTrimmed,
    /// Root mean square of (x − r) / √(r² + (m / 10)²) of luminances, where r has the mean m
    Relative,
    /// Mean of (x − r)²
    Mse,
    /// Mean of |x − r|
    Mae,
    /// 1 − SSIM of displayed luminance (Wang et al. 2004)
    Ssim,
    /// HDR-FLIP (Andersson et al. 2021)
    Flip,
}

impl Metric {
    /// As on the command line.
    pub fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or_else(String::new, |v| v.get_name().into())
    }

    /// 8-bit sRGB of `map`, black where there is no error and pale yellow where it is large: for FLIP and SSIM linear in
    /// [0, 1], else logarithmic over [`DECADES`], which for MSE and MAE end where the error is as large as the
    /// mean light of `reference`.
    pub fn picture(self, map: &[f32], reference: &Rgb) -> Vec<u8> {
        let power = match self {
            Self::Mse => 2,
            _ => 1,
        };
        let unit = match self {
            Self::Mse | Self::Mae => {
                let lit = reference.pixels.iter().filter(|x| x.is_finite());
                let sum: f64 = lit.map(|x| f64::from(*x).powi(power)).sum();
                sum / reference.pixels.len().max(1) as f64
            }
            _ => 1.0,
        };
        let shade = |e: &f32| match self {
            Self::Flip | Self::Ssim => *e,
            _ => (f64::from(*e) / unit).log10() as f32 / DECADES + 1.0,
        };
        map.iter().flat_map(|e| magma(shade(e))).collect()
    }
}

/// Of 10, from black to white in an error image; white is 1.
pub const DECADES: f32 = 4.0;

/// Share of the pixels, those with the largest errors, that [`Metric::RelMseTrimmed`] leaves out.
const TRIMMED: f64 = 0.001;

/// An error of each pixel, row-major, and of the image.
pub struct Measured {
    /// NaN where no pixel could be compared, or the image is too small for the metric.
    pub value: f64,
    pub map: Vec<f32>,
}

/// Two images of one size, made comparable.
pub struct Pair {
    size: [usize; 2],
    test: Vec<[f32; 3]>,
    reference: Vec<[f32; 3]>,
    counted: Vec<bool>,
    /// Pixels that are not finite in either image.
    pub excluded: usize,
}

impl Pair {
    /// `Err` says how the sizes differ.
    pub fn new(test: &Rgb, reference: &Rgb) -> Result<Self, String> {
        let [[w, h], [rw, rh]] = [test.size, reference.size];
        if test.size != reference.size || test.pixels.len() != reference.pixels.len() {
            return Err(format!(
                "is {w} x {h} pixels, but the reference is {rw} x {rh}: only images of one size compare"
            ));
        }
        let finite = |p: &[f32; 3]| p.iter().all(|x| x.is_finite());
        let pixels = |image: &Rgb| image.pixels.as_chunks().0.to_vec();
        let (mut test, mut reference) = (pixels(test), pixels(reference));
        let mut counted = Vec::with_capacity(test.len());
        for (x, r) in test.iter_mut().zip(&mut reference) {
            counted.push(finite(x) && finite(r));
            if !finite(r) {
                *r = [0.0; 3];
            }
            if !counted.last().unwrap_or(&true) {
                *x = *r;
            }
        }
        Ok(Self {
            size: [w as usize, h as usize],
            excluded: counted.iter().filter(|c| !**c).count(),
            test,
            reference,
            counted,
        })
    }

    /// Leaves out the pixels where `mask` is false, too; they are not [`Pair::excluded`].
    pub fn only(mut self, mask: &[bool]) -> Self {
        for (counted, wanted) in self.counted.iter_mut().zip(mask) {
            *counted &= wanted;
        }
        self
    }

    pub fn measure(&self, metric: Metric) -> Measured {
        let map = match metric {
            Metric::RelMse | Metric::RelMseTrimmed => self.each(|x, r| (x - r).powi(2) / weight(r)),
            Metric::Relative => self.relative(),
            Metric::Mse => self.each(|x, r| (x - r).powi(2)),
            Metric::Mae => self.each(|x, r| (x - r).abs()),
            Metric::Ssim => {
                let (map, inner) = ssim::dissimilarity(self.size, &self.test, &self.reference);
                let value = mean(
                    self.values(&map)
                        .zip(&inner)
                        .filter(|(_, i)| **i)
                        .map(|v| v.0),
                );
                return Measured { value, map };
            }
            Metric::Flip => flip::hdr_flip(self.size, &self.test, &self.reference),
        };
        let value = match metric {
            Metric::RelMseTrimmed => trimmed_mean(self.values(&map).flatten().collect()),
            Metric::Relative => mean(self.values(&map)).sqrt(),
            _ => mean(self.values(&map)),
        };
        Measured { value, map }
    }

    /// The mean over the channels of `error` of image and reference.
    fn each(&self, error: impl Fn(f64, f64) -> f64) -> Vec<f32> {
        let pairs = self.test.iter().zip(&self.reference);
        let of = |(x, r): (&[f32; 3], &[f32; 3])| {
            let sum: f64 = x
                .iter()
                .zip(r)
                .map(|(x, r)| error((*x).into(), (*r).into()))
                .sum();
            (sum / 3.0) as f32
        };
        pairs.map(of).collect()
    }

    /// The squared errors of luminances, those of dark pixels not blown up without bound.
    fn relative(&self) -> Vec<f32> {
        let [test, reference] = [&self.test, &self.reference]
            .map(|pixels| pixels.iter().map(|p| luminance(*p)).collect::<Vec<_>>());
        let floor = 0.1 * mean(self.values(&reference));
        let pairs = test.iter().zip(&reference);
        pairs
            .map(|(x, r)| {
                let (x, r) = (f64::from(*x), f64::from(*r));
                ((x - r).powi(2) / (r * r + floor * floor)) as f32
            })
            .collect()
    }

    /// The pixels' errors, `None` where they do not count.
    fn values(&self, map: &[f32]) -> impl Iterator<Item = Option<f64>> {
        let pairs = map.iter().zip(&self.counted);
        pairs.map(|(e, counted)| counted.then_some(f64::from(*e)))
    }
}

/// What relMSE divides a squared error by: that of dark pixels is not blown up without bound.
pub fn weight(reference: f64) -> f64 {
    reference * reference + 0.01
}

fn mean(values: impl Iterator<Item = Option<f64>>) -> f64 {
    let (sum, count) = values
        .flatten()
        .fold((0.0, 0.0), |(s, n), x| (s + x, n + 1.0));
    sum / count
}

fn trimmed_mean(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.truncate(values.len() - (values.len() as f64 * TRIMMED) as usize);
    mean(values.into_iter().map(Some))
}
