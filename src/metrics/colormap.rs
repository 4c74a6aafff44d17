//! Numbers as colours.

/// Magma, perceptually uniform from black through purple and orange to pale yellow (van der Walt & Smith 2015, CC0):
/// 8-bit sRGB of `t` in [0, 1], by a polynomial that is within 5 of 255 of the table.
pub fn magma(t: f32) -> [u8; 3] {
    // Coefficients of t^0 to t^6, fitted to matplotlib's table.
    const C: [[f32; 3]; 7] = [
        [-0.002136485, -0.000749655, -0.005386128],
        [0.25166055, 0.67752326, 2.4940264],
        [8.353717, -3.5777195, 0.314_467_9],
        [-27.668733, 14.264731, -13.649213],
        [52.17614, -27.943606, 12.944169],
        [-50.768526, 29.046583, 4.234153],
        [18.655705, -11.489774, -5.6019616],
    ];
    // NaN becomes 0.
    let t = if t > 0.0 { t.min(1.0) } else { 0.0 };
    let channel = |i: usize| {
        let x = C.iter().rev().fold(0.0, |sum, c| sum * t + c[i]);
        (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
    };
    [0, 1, 2].map(channel)
}

#[cfg(test)]
mod tests {
    use super::magma;

    /// matplotlib 3.11.2's table at 0, 64, 128, 192 and 255.
    #[test]
    fn is_near_the_table() {
        for (i, expected) in [
            (0, [0, 0, 4]),
            (64, [81, 18, 124]),
            (128, [183, 55, 121]),
            (192, [252, 137, 97]),
            (255, [252, 253, 191]),
        ] {
            let found = magma(i as f32 / 255.0);
            let off = found
                .iter()
                .zip(expected)
                .map(|(a, b): (_, i32)| (i32::from(*a) - b).abs());
            assert!(off.max() <= Some(5), "{i}: {found:?}, not {expected:?}");
        }
        assert_eq!(magma(f32::NAN), magma(0.0));
        assert_eq!(magma(9.0), magma(1.0));
    }
}
