//! A density over primary samples: a k-d tree whose cells are chosen at random in proportion to what light paths from
//! there were found to be worth.

use crate::shared::{GuideCell, GuideNode, NONE};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Numbers of a primary sample: light, place (2), way (2), bounce (2).
pub const AXES: usize = 7;
/// How many numbers an axis has.
const WHOLE: u64 = 1 << 32;
/// A split sends this many of 256 below it at least, and above it: so no cell has less than about that share of the
/// density without a guide, and the surroundings of what matters get more than what is far away.
const SHARES: u32 = 256;
/// Cells at most: with their nodes they take 112 bytes each.
const MAX_CELLS: usize = 1 << 14;
/// A cell of samples that weigh as much as fewer equal ones is not split: there is nothing more to learn.
const LEAST_SAMPLES: f64 = 24.0;
/// Samples that are thought to lie evenly in each cell, beside those that were found.
const PRIOR_SAMPLES: f64 = 2.0;
/// By which the log likelihood of a cell's samples must grow, for a split to be more than chance: about the 1 % bound
/// of the best among a hundred splits of evenly spread samples.
const LEAST_GAIN: f64 = 9.0;
/// Splits that are tried along each axis lie between so many equal shares of the samples, and beside all of them.
const QUANTILES: usize = 16;

/// A primary sample and what it is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    pub at: [u32; AXES],
    pub weight: f32,
}

/// See `glsl/lib/guide.glsl`.
#[derive(Debug, Clone)]
pub struct Tree {
    pub nodes: Vec<GuideNode>,
    pub cells: Vec<GuideCell>,
}

/// Numbers from `first` on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Interval {
    first: u64,
    size: u64,
}

/// A cell under construction.
struct Part {
    node: usize,
    bounds: [Interval; AXES],
    /// That the guide goes there.
    probability: f64,
    samples: Range<usize>,
    split: Split,
}

/// The best way to split a cell.
#[derive(Debug, Clone, Copy)]
struct Split {
    axis: usize,
    at: u64,
    /// Of [`SHARES`], below the split.
    share: u32,
    /// By which the log likelihood of all samples grows.
    gain: f64,
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Part {}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// By what a split would gain; of equals, the one that was made first.
impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_gain = self.split.gain.total_cmp(&other.split.gain);
        by_gain.then_with(|| other.node.cmp(&self.node))
    }
}

impl Tree {
    /// One cell: light paths begin as they would without a guide.
    pub fn even() -> Self {
        Self::learn(&mut [])
    }

    /// Fitted to samples, whose order it changes.
    pub fn learn(samples: &mut [Sample]) -> Self {
        let whole = Interval {
            first: 0,
            size: WHOLE,
        };
        let mut tree = Self {
            nodes: vec![GuideNode::default()],
            cells: Vec::new(),
        };
        let mut open = BinaryHeap::new();
        let mut splits = 0;
        tree.add(&mut open, samples, 0, [whole; AXES], 1.0, 0..samples.len());
        while let Some(part) = open.pop() {
            if splits + 1 == MAX_CELLS {
                tree.close(part.node, &part.bounds, part.probability);
                continue;
            }
            splits += 1;
            let Split {
                axis, at, share, ..
            } = part.split;
            let first = part.samples.start;
            let members = &mut samples[part.samples.clone()];
            let middle = first + partition(members, |s| u64::from(s.at[axis]) < at);
            let child = tree.nodes.len();
            tree.nodes.extend([GuideNode::default(); 2]);
            tree.nodes[part.node] = GuideNode {
                axis: axis as u32,
                child: child as u32,
                threshold: share * (u32::MAX / SHARES + 1),
                scale_below: scale(share),
                scale_above: scale(SHARES - share),
                unused: 0,
            };
            let (mut below, mut above) = (part.bounds, part.bounds);
            below[axis].size = at - below[axis].first;
            above[axis].size -= below[axis].size;
            above[axis].first = at;
            let chance = f64::from(share) / f64::from(SHARES);
            for (node, bounds, chance, range) in [
                (child, below, chance, first..middle),
                (child + 1, above, 1.0 - chance, middle..part.samples.end),
            ] {
                tree.add(
                    &mut open,
                    samples,
                    node,
                    bounds,
                    part.probability * chance,
                    range,
                );
            }
        }
        tree
    }

    /// A cell to be split later, if that gains anything.
    fn add(
        &mut self,
        open: &mut BinaryHeap<Part>,
        samples: &[Sample],
        node: usize,
        bounds: [Interval; AXES],
        probability: f64,
        range: Range<usize>,
    ) {
        match best_split(&samples[range.clone()], &bounds) {
            Some(split) => open.push(Part {
                node,
                bounds,
                probability,
                samples: range,
                split,
            }),
            None => self.close(node, &bounds, probability),
        }
    }

    fn close(&mut self, node: usize, bounds: &[Interval; AXES], probability: f64) {
        self.nodes[node] = GuideNode {
            axis: NONE,
            child: self.cells.len() as u32,
            ..GuideNode::default()
        };
        let volume: f64 = bounds.iter().map(|i| i.size as f64 / WHOLE as f64).product();
        let first = bounds.map(|i| i.first as u32);
        let size = bounds.map(|i| i.size as u32);
        self.cells.push(GuideCell {
            first_light: first[0],
            size_light: size[0],
            first_place: [first[1], first[2]],
            size_place: [size[1], size[2]],
            first_way: [first[3], first[4]],
            size_way: [size[3], size[4]],
            first_bounce: [first[5], first[6]],
            size_bounce: [size[5], size[6]],
            density: (probability / volume) as f32,
            unused: 0,
        });
    }
}

/// So many of [`SHARES`] become all.
fn scale(share: u32) -> u32 {
    ((u64::from(SHARES) << 24) / u64::from(share)).min(u64::from(u32::MAX)) as u32
}

/// Brings those that are `before` to the front; returns how many they are.
fn partition(samples: &mut [Sample], before: impl Fn(&Sample) -> bool) -> usize {
    let mut count = 0;
    for i in 0..samples.len() {
        if before(&samples[i]) {
            samples.swap(i, count);
            count += 1;
        }
    }
    count
}

fn best_split(samples: &[Sample], bounds: &[Interval; AXES]) -> Option<Split> {
    let weight = |s: &Sample| f64::from(s.weight);
    let total: f64 = samples.iter().map(weight).sum();
    let squares: f64 = samples.iter().map(|s| weight(s).powi(2)).sum();
    let count = total * total / squares;
    if count.is_nan() || count < LEAST_SAMPLES {
        return None;
    }
    let splits = (0..AXES).flat_map(|axis| {
        let cuts = cuts(samples, axis, &bounds[axis]);
        let mut masses = vec![0.0; cuts.len() + 1];
        for s in samples {
            masses[cuts.partition_point(|&cut| cut <= u64::from(s.at[axis]))] += weight(s);
        }
        let mut below = 0.0;
        let splits = cuts.into_iter().zip(masses).map(move |(at, mass)| {
            below += mass;
            split(axis, at, &bounds[axis], below / total, count)
        });
        splits.collect::<Vec<_>>()
    });
    let best = splits.max_by(|a, b| a.gain.total_cmp(&b.gain))?;
    (best.gain > LEAST_GAIN).then_some(Split {
        // In shares of all samples, so that cells compare.
        gain: best.gain / count * total,
        ..best
    })
}

/// `below`: share of the weight; `count`: samples. The gain is theirs.
fn split(axis: usize, at: u64, bounds: &Interval, below: f64, count: f64) -> Split {
    let volume = (at - bounds.first) as f64 / bounds.size as f64;
    let wanted = (below * count + PRIOR_SAMPLES * volume) / (count + PRIOR_SAMPLES);
    let share = ((wanted * f64::from(SHARES)).round() as u32).clamp(1, SHARES - 1);
    let chance = f64::from(share) / f64::from(SHARES);
    let gain = below * (chance / volume).ln() + (1.0 - below) * ((1.0 - chance) / (1.0 - volume)).ln();
    Split {
        axis,
        at,
        share,
        gain: gain * count,
    }
}

/// Where to try to split, ascending: between quantiles, and a little beside the first and the last sample.
fn cuts(samples: &[Sample], axis: usize, bounds: &Interval) -> Vec<u64> {
    let at = |s: &Sample| u64::from(s.at[axis]);
    let low = samples.iter().map(at).min().unwrap_or(0);
    let high = samples.iter().map(at).max().unwrap_or(0);
    let step = samples.len().div_ceil(16 * QUANTILES).max(1);
    let mut some: Vec<u64> = samples.iter().step_by(step).map(at).collect();
    some.sort_unstable();
    let quantiles = (1..QUANTILES).filter_map(|i| some.get(i * some.len() / QUANTILES).copied());
    let margin = (high - low) / QUANTILES as u64 + 1;
    let mut cuts: Vec<u64> = quantiles
        .chain([low.saturating_sub(margin), high + margin])
        .filter(|&cut| cut > bounds.first && cut < bounds.first + bounds.size)
        .collect();
    cuts.sort_unstable();
    cuts.dedup();
    cuts
}
