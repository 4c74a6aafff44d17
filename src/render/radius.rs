//! How the photon radii shrink; where they start is for [`super::pilot`] to find.

/// r² of iteration `i` (from 0): r²_1 Γ(n + α) / (Γ(1 + α) Γ(n + 1)) with n = i + 1, the closed form
/// of r²_{n+1} = r²_n (n + α) / (n + 1) (Knaus & Zwicker 2011), so that any iteration can be rendered
/// anywhere.
pub fn shrink(first_radius2: f64, alpha: f64, iteration: u64) -> f64 {
    let n = iteration as f64 + 1.0;
    first_radius2 * (ln_gamma_ratio(n, alpha) - ln_gamma_ratio(1.0, alpha)).exp()
}

/// ln Γ(n + α) − ln Γ(n + 1), by Stirling's series above 16 and the recurrence below, which avoids
/// the difference of two large numbers.
fn ln_gamma_ratio(n: f64, alpha: f64) -> f64 {
    const LARGE: f64 = 16.0;
    if n < LARGE {
        return ln_gamma_ratio(n + 1.0, alpha) - ((n + alpha) / (n + 1.0)).ln();
    }
    let series = |z: f64| {
        1.0 / (12.0 * z) - 1.0 / (360.0 * z.powi(3)) + 1.0 / (1260.0 * z.powi(5))
            - 1.0 / (1680.0 * z.powi(7))
    };
    let (a, b) = (n + alpha, n + 1.0);
    // (a - 1/2) ln a - (b - 1/2) ln b - (a - b), with ln a = ln b + ln(1 + (a - b)/b).
    (a - b) * b.ln() + (a - 0.5) * ((a - b) / b).ln_1p() - (a - b) + series(a) - series(b)
}
