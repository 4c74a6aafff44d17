//! How long the device had nothing to do between submissions.

/// Spans that may still lack one between them: the host learns of them in another order than they ran in.
const OPEN: usize = 4;

/// The sum of the gaps between spans of the device's clock (ms).
#[derive(Default)]
pub struct Idle {
    /// The last ones, by their start.
    spans: Vec<[f64; 2]>,
    pub ms: f64,
}

impl Idle {
    /// Counts the gap after the oldest of the last spans, once they are many.
    pub fn add(&mut self, span_ms: Option<[f64; 2]>) {
        self.spans.extend(span_ms);
        self.spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
        if self.spans.len() > OPEN {
            self.count_first();
        }
    }

    /// What comes next does not follow from what came last: the gap between does not count.
    pub fn pause(&mut self) {
        while self.spans.len() > 1 {
            self.count_first();
        }
        self.spans.clear();
    }

    fn count_first(&mut self) {
        let [_, end] = self.spans.remove(0);
        self.ms += (self.spans[0][0] - end).max(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_found_in_any_order() {
        let mut idle = Idle::default();
        // Each ends 1 before the next; every two are told of in reverse.
        for i in [1, 0, 3, 2, 5, 4, 7, 6, 9, 8] {
            let start = f64::from(i) * 10.0;
            idle.add(Some([start, start + 9.0]));
        }
        assert_eq!(idle.ms, 10.0 - OPEN as f64);
        idle.add(None);
        idle.pause();
        assert_eq!(idle.ms, 9.0);
        idle.add(Some([1000.0, 1001.0]));
        idle.pause();
        assert_eq!(idle.ms, 9.0);
    }
}
