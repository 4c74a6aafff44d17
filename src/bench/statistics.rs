//! Medians and how far they can be trusted.

/// A number with its 95 % confidence interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    pub value: f64,
    /// `None` where there was one sample only.
    pub interval: Option<[f64; 2]>,
}

/// Of an even count, the mean of the middle two; NaN of nothing.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_unstable_by(f64::total_cmp);
    let n = values.len();
    match n {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}

const RESAMPLES: usize = 2000;

/// `statistic` of all samples 0..n, and its expanded percentile bootstrap interval: percentiles are taken further out the fewer the
/// samples are, which makes up for the plain one's being too narrow (Hesterberg 2015, *What Teachers Should Know about the
/// Bootstrap*, section 5.2). Below six samples that reaches the smallest and the largest, and even those hold less than
/// 95 %. Samples that follow each other alike, such as times of iterations, are drawn in runs of `block`.
pub fn bootstrap(n: usize, block: usize, statistic: impl Fn(&[usize]) -> f64) -> Estimate {
    let all: Vec<usize> = (0..n).collect();
    let value = statistic(&all);
    if n < 2 {
        return Estimate {
            value,
            interval: None,
        };
    }
    let mut random = SplitMix(n as u64);
    let mut drawn = Vec::with_capacity(n + block);
    let mut found: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            drawn.clear();
            while drawn.len() < n {
                let first = random.below(n);
                drawn.extend((first..first + block.max(1)).map(|i| i % n));
            }
            drawn.truncate(n);
            statistic(&drawn)
        })
        .collect();
    found.sort_unstable_by(f64::total_cmp);
    let tail = tail(n.div_ceil(block.max(1)).max(2)) * RESAMPLES as f64;
    let low = (tail as usize).min(RESAMPLES / 2);
    Estimate {
        value,
        interval: Some([found[low], found[RESAMPLES - 1 - low]]),
    }
}

/// The median of `values` with its interval over them.
pub fn median_of(values: &[f64]) -> Estimate {
    bootstrap(values.len(), 1, |drawn| {
        median(drawn.iter().map(|&i| values[i]))
    })
}

/// The median of the ratios of pairs, with its interval over the pairs.
pub fn median_ratio(pairs: &[[f64; 2]]) -> Estimate {
    bootstrap(pairs.len(), 1, |drawn| {
        median(drawn.iter().map(|&i| (pairs[i][0] / pairs[i][1]).ln())).exp()
    })
}

/// The ratio of the medians of two series that ran side by side, with its interval over runs of them.
pub fn ratio_of_medians(a: &[f64], b: &[f64]) -> Estimate {
    let n = a.len().min(b.len());
    let block = (n as f64).cbrt().ceil() as usize;
    bootstrap(n, block, |drawn| {
        let of = |series: &[f64]| median(drawn.iter().map(|&i| series[i]));
        of(a) / of(b)
    })
}

/// The least-squares slope of y over x; NaN of fewer than two points.
pub fn slope(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let mean = |i: usize| points.iter().map(|p| p[i]).sum::<f64>() / n;
    let (mx, my) = (mean(0), mean(1));
    let xy: f64 = points.iter().map(|p| (p[0] - mx) * (p[1] - my)).sum();
    let xx: f64 = points.iter().map(|p| (p[0] - mx).powi(2)).sum();
    xy / xx
}

/// Share of the bootstrap distribution that is cut off at either end.
fn tail(n: usize) -> f64 {
    let n_f = n as f64;
    normal_cdf(-(n_f / (n_f - 1.0)).sqrt() * student_t(n - 1))
}

/// The 0.975 quantile.
fn student_t(degrees: usize) -> f64 {
    const T: [f64; 12] = [
        12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179,
    ];
    // Beyond the table, the first terms of its expansion (Abramowitz & Stegun 26.7.5).
    let (z, d) = (1.959964, degrees as f64);
    let expansion = z
        + (z * z * z + z) / (4.0 * d)
        + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * d * d);
    T.get(degrees.wrapping_sub(1)).copied().unwrap_or(expansion)
}

/// Abramowitz & Stegun 26.2.17; within 7.5e-8.
fn normal_cdf(x: f64) -> f64 {
    const B: [f64; 5] = [
        0.319381530,
        -0.356563782,
        1.781477937,
        -1.821255978,
        1.330274429,
    ];
    let t = 1.0 / (1.0 + 0.2316419 * x.abs());
    let sum = B.iter().rev().fold(0.0, |sum, b| (sum + b) * t);
    let upper = (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt() * sum;
    if x < 0.0 { upper } else { 1.0 - upper }
}

/// Steele, Lea & Flood 2014: the same draws in each run, so that a report can be made again.
struct SplitMix(u64);

impl SplitMix {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n.max(1) as u64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median([3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median([]).is_nan());
        assert_eq!(
            median_of(&[7.0]),
            Estimate {
                value: 7.0,
                interval: None
            }
        );
    }

    #[test]
    fn known_quantiles() {
        assert!((normal_cdf(-1.959964) - 0.025).abs() < 1e-6);
        assert!((student_t(9) - 2.262).abs() < 1e-3 && (student_t(30) - 2.0423).abs() < 1e-3);
        // Hesterberg 2015, table 3: 0.0010 at each end for n = 5, 0.0145 for 20.
        assert!((tail(5) - 0.0010).abs() < 5e-5, "{}", tail(5));
        assert!((tail(20) - 0.0159).abs() < 5e-4, "{}", tail(20));
    }

    /// The interval of the mean of normal numbers is that of Student's t, and holds the truth as often as it says.
    #[test]
    fn intervals_cover() {
        let mut random = SplitMix(1);
        let mut uniform = move || (random.below(1 << 30) as f64 + 0.5) / f64::from(1 << 30);
        let mut normal =
            move || (-2.0 * uniform().ln()).sqrt() * (2.0 * std::f64::consts::PI * uniform()).cos();
        let (mut covered, mut width, mut expected) = (0, 0.0, 0.0);
        for _ in 0..200 {
            let x: Vec<f64> = (0..20).map(|_| normal()).collect();
            let mean = |drawn: &[usize]| drawn.iter().map(|&i| x[i]).sum::<f64>() / 20.0;
            let Estimate { value, interval } = bootstrap(20, 1, mean);
            let [low, high] = interval.unwrap();
            assert!(low <= value && value <= high);
            covered += u32::from(low < 0.0 && high > 0.0);
            width += high - low;
            let variance = x.iter().map(|x| (x - value).powi(2)).sum::<f64>() / 19.0;
            expected += 2.0 * 2.093 * (variance / 20.0).sqrt();
        }
        assert!((180..=198).contains(&covered), "{covered} of 200");
        assert!((width / expected - 1.0).abs() < 0.05, "{width} {expected}");
    }

    #[test]
    fn ratios_and_slopes() {
        let pairs = [[2.0, 1.0], [4.2, 2.0], [8.0, 4.0], [1.9, 1.0], [2.0, 1.0]];
        let ratio = median_ratio(&pairs);
        let [low, high] = ratio.interval.unwrap();
        assert!((ratio.value - 2.0).abs() < 1e-12 && low >= 1.9 - 1e-12 && high <= 2.1 + 1e-12);
        let half = ratio_of_medians(&[1.0; 30], &[2.0; 30]);
        assert_eq!(
            half,
            Estimate {
                value: 0.5,
                interval: Some([0.5; 2])
            }
        );
        assert!((slope(&[[0.0, 1.0], [1.0, 3.0], [2.0, 5.0]]) - 2.0).abs() < 1e-12);
    }
}
