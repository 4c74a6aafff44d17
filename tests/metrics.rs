//! The metrics against other people's implementations, on images made here.

use lightfall::image::Rgb;
use lightfall::metrics::{Metric, Pair};

const SIZE: [u32; 2] = [48, 32];

/// A pattern with a spot of light and a dark strip, under a tenth too dark and with noise of up to a quarter.
fn images() -> [Rgb; 2] {
    let mut state = 1u64;
    let (mut test, mut reference) = (Vec::new(), Vec::new());
    for y in 0..SIZE[1] as i32 {
        for x in 0..SIZE[0] as i32 {
            for c in 0..3 {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                let random = (state >> 40) as f32 / (1 << 24) as f32;
                let mut value = 0.05 + ((x * 7 + y * 3 + c * 11) % 32) as f32 / 16.0;
                if (x - 20).pow(2) + (y - 12).pow(2) < 9 {
                    value = (40 + c) as f32;
                }
                if y >= 24 {
                    value /= 64.0;
                }
                reference.push(value);
                test.push(value * (0.8 + 0.5 * random));
            }
        }
    }
    [test, reference].map(|pixels| Rgb { size: SIZE, pixels })
}

/// Numbers of numpy 2.4.6, scikit-image 0.26.0 (`structural_similarity` with `gaussian_weights`, σ 1.5, population moments, of
/// luminance displayed as in `ssim.rs` by numpy) and NVIDIA's flip-evaluator 1.7 (`HDR`, its defaults), on the same images.
#[test]
fn agree_with_independent_implementations() {
    let [test, reference] = images();
    let pair = Pair::new(&test, &reference).unwrap();
    for (metric, expected, tolerance) in [
        (Metric::RelMse, 0.016694613892494745, 1e-6),
        (Metric::RelMseTrimmed, 0.016654674404526303, 1e-6),
        (Metric::Relative, 0.10648656486683264, 1e-6),
        (Metric::Mse, 0.6160294436668109, 1e-6),
        (Metric::Mae, 0.1838896200793114, 1e-6),
        (Metric::Ssim, 0.019946901382599358, 1e-4),
        (Metric::Flip, 0.10178408026695251, 1e-4),
    ] {
        let found = pair.measure(metric);
        let off = (found.value / expected - 1.0).abs();
        assert!(
            off < tolerance,
            "{metric:?}: {}, not {expected}",
            found.value
        );
        assert_eq!(found.map.len(), 48 * 32);
        assert_eq!(
            Pair::new(&reference, &reference)
                .unwrap()
                .measure(metric)
                .value,
            0.0
        );
    }
    let flip = pair.measure(Metric::Flip).map;
    assert!((flip[5 * 48 + 9] / 0.1147581 - 1.0).abs() < 1e-3);
    let worst = flip.iter().copied().fold(0.0, f32::max);
    assert!((worst / 0.25136214 - 1.0).abs() < 1e-3);
}

#[test]
fn sizes_must_agree() {
    let [test, mut reference] = images();
    reference.size = [32, 48];
    let fault = Pair::new(&test, &reference).err().unwrap();
    assert!(
        fault.contains("48 x 32") && fault.contains("32 x 48"),
        "{fault}"
    );
}

/// A pixel that is no number is counted and changes nothing but itself.
#[test]
fn pixels_that_are_not_finite_are_left_out() {
    let [clean, reference] = images();
    let mut test = clean.clone();
    let at = (20 * 48 + 20) * 3;
    test.pixels[at] = f32::NAN;
    test.pixels[at + 6] = f32::INFINITY;
    let pair = Pair::new(&test, &reference).unwrap();
    assert_eq!(pair.excluded, 2);
    let mut expected = Pair::new(&clean, &reference)
        .unwrap()
        .measure(Metric::Mse)
        .map;
    for pixel in [at / 3, at / 3 + 2] {
        expected.remove(pixel - usize::from(pixel > at / 3));
    }
    let mean = expected.iter().map(|e| f64::from(*e)).sum::<f64>() / expected.len() as f64;
    assert!((pair.measure(Metric::Mse).value / mean - 1.0).abs() < 1e-6);
    for metric in [Metric::RelMse, Metric::Mae, Metric::Ssim, Metric::Flip] {
        let clean = Pair::new(&clean, &reference).unwrap().measure(metric).value;
        let found = pair.measure(metric).value;
        assert!(
            (found / clean - 1.0).abs() < 0.02,
            "{metric:?}: {found}, {clean}"
        );
    }
}

/// No division by the light that is not there, and no window larger than the image.
#[test]
fn black_and_tiny_images() {
    let [test, _] = images();
    let black = Rgb {
        pixels: vec![0.0; test.pixels.len()],
        ..test.clone()
    };
    let lit = Pair::new(&test, &black).unwrap();
    let dark = Pair::new(&black, &black).unwrap();
    for metric in [Metric::RelMse, Metric::Ssim, Metric::Flip] {
        let error = lit.measure(metric).value;
        assert!(error.is_finite() && error > 0.1, "{metric:?}: {error}");
        assert_eq!(dark.measure(metric).value, 0.0, "{metric:?}");
    }
    let dot = Rgb {
        size: [1, 1],
        pixels: vec![1.0, 2.0, 3.0],
    };
    let pair = Pair::new(&dot, &dot).unwrap();
    assert!(pair.measure(Metric::Ssim).value.is_nan());
    assert_eq!(pair.measure(Metric::Flip).value, 0.0);
    // Where most of the reference is black, exposures follow what is lit.
    let mut spot = black.clone();
    spot.pixels[..300].fill(5.0);
    let error = Pair::new(&black, &spot)
        .unwrap()
        .measure(Metric::Flip)
        .value;
    assert!((0.05..0.2).contains(&error), "{error}");
}
