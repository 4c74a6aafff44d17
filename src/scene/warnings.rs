//! What the file asks for and does not get.

use std::collections::HashMap;
use std::fmt::Display;

/// Warnings in the order found. A file with a million equal faults gets a few lines and a count.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    lines: Vec<String>,
    counts: HashMap<String, usize>,
}

/// Lines of the same wording, with different paths, before they are only counted.
const SAME: usize = 32;

impl Warnings {
    /// Notes that at JSON path `path`, `what` is the case. Call it once for each path.
    pub fn add(&mut self, path: impl Display, what: impl Display) {
        let what = what.to_string();
        let line = format!("{path}: {what}");
        let count = self.counts.entry(what).or_default();
        *count += 1;
        if *count <= SAME {
            self.lines.push(line);
        }
    }

    pub fn into_lines(self) -> Vec<String> {
        let mut lines = self.lines;
        let mut more: Vec<String> = self
            .counts
            .into_iter()
            .filter(|(_, count)| *count > SAME)
            .map(|(what, count)| format!("{} more places: {what}", count - SAME))
            .collect();
        more.sort();
        lines.extend(more);
        lines
    }
}
