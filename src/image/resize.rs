//! Images at other sizes, for comparisons.

use super::Rgb;

/// The mean of each block of `factor` × `factor` pixels: as box-filtered pixels are means themselves, what a renderer of that
/// size would converge to. Rows and columns that fill no block are left out.
pub fn reduce(image: &Rgb, factor: u32) -> Rgb {
    let factor = factor.max(1);
    let size = image.size.map(|edge| edge / factor);
    let weight = 1.0 / f64::from(factor * factor);
    let pixel = |x: u32, y: u32, c: usize| {
        let block = (0..factor * factor).map(|i| {
            let (x, y) = (x * factor + i % factor, y * factor + i / factor);
            let at = (y as usize * image.size[0] as usize + x as usize) * 3 + c;
            f64::from(image.pixels.get(at).copied().unwrap_or(f32::NAN))
        });
        (block.sum::<f64>() * weight) as f32
    };
    each(size, pixel)
}

/// `image` at another size, linear between the centres of its pixels and level beyond the outermost.
pub fn resample(image: &Rgb, size: [u32; 2]) -> Rgb {
    // Per axis: the two pixels around a centre, and the second one's weight.
    let around = |i: u32, axis: usize| {
        let edge = image.size[axis];
        let last = edge.saturating_sub(1);
        let at = (f64::from(i) + 0.5) * f64::from(edge) / f64::from(size[axis]) - 0.5;
        let at = at.clamp(0.0, f64::from(last));
        let low = at.floor();
        (low as u32, (low as u32 + 1).min(last), (at - low) as f32)
    };
    let of = |x: u32, y: u32, c: usize| {
        let at = (y as usize * image.size[0] as usize + x as usize) * 3 + c;
        image.pixels.get(at).copied().unwrap_or(f32::NAN)
    };
    let mix = |a: f32, b: f32, t: f32| if t == 0.0 { a } else { a + t * (b - a) };
    let pixel = |x: u32, y: u32, c: usize| {
        let ((x0, x1, tx), (y0, y1, ty)) = (around(x, 0), around(y, 1));
        let row = |y| mix(of(x0, y, c), of(x1, y, c), tx);
        mix(row(y0), row(y1), ty)
    };
    each(size, pixel)
}

fn each(size: [u32; 2], pixel: impl Fn(u32, u32, usize) -> f32) -> Rgb {
    let [width, height] = size;
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    Rgb {
        size,
        pixels: places
            .flat_map(|(x, y)| [0, 1, 2].map(|c| pixel(x, y, c)))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(size: [u32; 2]) -> Rgb {
        each(size, |x, y, c| {
            let (x, y) = (x as f32 + 0.5, y as f32 + 0.5);
            x / size[0] as f32 + 2.0 * y / size[1] as f32 + c as f32
        })
    }

    /// Means of blocks of a ramp are the smaller ramp; between centres a ramp stays one.
    #[test]
    fn ramps_stay_ramps() {
        let close = |a: &Rgb, b: &Rgb, margin: u32| {
            let [width, height] = a.size;
            assert_eq!(a.size, b.size);
            let inside = |i: usize| {
                let (x, y) = (i as u32 / 3 % width, i as u32 / 3 / width);
                (margin..width - margin).contains(&x) && (margin..height - margin).contains(&y)
            };
            let pairs = a.pixels.iter().zip(&b.pixels).enumerate();
            let (mut compared, mut worst) = (0, 0.0f32);
            for (_, (a, b)) in pairs.filter(|p| inside(p.0)) {
                compared += 1;
                worst = worst.max((a - b).abs());
            }
            assert!(compared > 0 && worst < 1e-5, "{worst}");
        };
        close(&reduce(&ramp([8, 6]), 2), &ramp([4, 3]), 0);
        // Beyond the outermost centres there is nothing to go by.
        close(&resample(&ramp([8, 6]), [16, 12]), &ramp([16, 12]), 1);
        close(&resample(&ramp([8, 6]), [8, 6]), &ramp([8, 6]), 0);
    }

    /// A bright dot stays as bright in sum, whether it is spread or averaged.
    #[test]
    fn light_is_kept() {
        let dot = each([8, 8], |x, y, _| if (x, y) == (3, 4) { 64.0 } else { 0.0 });
        let mean = |image: &Rgb| image.pixels.iter().sum::<f32>() / image.pixels.len() as f32;
        assert_eq!(mean(&dot), 1.0);
        assert_eq!(mean(&reduce(&dot, 4)), 1.0);
        assert!((mean(&resample(&dot, [16, 16])) - 1.0).abs() < 1e-6);
    }
}
