//! A density over primary samples: a k-d tree whose cells are chosen at random in proportion to
//! what light paths from there were found to be worth.

use crate::shared::{GuideCell, GuideNode, NONE};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Numbers of a primary sample: light, place (2), way (2), bounce (2).
pub const AXES: usize = 7;
/// How many numbers an axis has.
const WHOLE: u64 = 1 << 32;
/// Splits are in so many shares, and leave one at least on either side.
pub const SHARES: u32 = 1024;
/// This share of light paths begins as without a guide: none carries more than so many times the
/// flux.
const DEFENSIVE: f64 = 0.05;
/// Cells at most: with their nodes they take 112 bytes each.
const MAX_CELLS: usize = 1 << 14;
/// A cell of samples that weigh as much as fewer equal ones is not split: there is nothing more to
/// learn.
const LEAST_SAMPLES: f64 = 16.0;
/// Samples that are thought to lie evenly in each cell, beside those that were found.
const PRIOR_SAMPLES: f64 = 2.0;
/// By which the log likelihood of a cell's samples must grow, for a split to be more than chance.
const LEAST_GAIN: f64 = 7.0;
/// Splits that are tried within the samples along each axis, at most.
const BINS: usize = 64;
/// How much the variance of what paths bring counts against its mean.
const VARIANCE_SHARE: f64 = 0.2;

/// A primary sample and what it is worth.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sample {
    pub at: [u32; AXES],
    /// What the path brought. Of samples with the guide's density, weights add up to the mean.
    pub weight: f32,
    /// The variance of that, likewise; 0 where it is not known.
    pub square: f32,
}

/// See `glsl/lib/guide.glsl`.
#[derive(Debug, Clone)]
pub struct Tree {
    /// From the root on, each split before what lies below and then above it.
    pub shapes: Vec<Shape>,
    pub nodes: Vec<GuideNode>,
    pub cells: Vec<GuideCell>,
}

/// What the tree is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Primary samples whose number on this axis is below `at` get so many of [`SHARES`], the
    /// others the rest.
    Split {
        axis: u32,
        at: u32,
        share: u32,
    },
    Cell,
}

/// Numbers from `first` on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Interval {
    first: u64,
    size: u64,
}

type Bounds = [Interval; AXES];

const WHOLE_BOX: Bounds = [Interval {
    first: 0,
    size: WHOLE,
}; AXES];

/// A box of primary samples, maybe split in two.
struct Part {
    bounds: Bounds,
    samples: Range<usize>,
    /// Samples of equal weight that would say as much.
    count: f64,
    /// Of all light paths that should begin here, before any are spread.
    mass: f64,
    /// Where to split it, if that gains enough.
    best: Option<Split>,
    split: Option<Split>,
    /// The part below the split, beside the one above it.
    child: usize,
}

/// The best way to split a part.
#[derive(Debug, Clone, Copy)]
struct Split {
    axis: usize,
    at: u64,
    /// By which the log likelihood of all samples grows.
    gain: f64,
}

impl Tree {
    /// One cell: light paths begin as they would without a guide.
    pub fn even() -> Self {
        let whole = vec![GuideNode {
            axis: NONE,
            ..GuideNode::default()
        }];
        Self {
            shapes: vec![Shape::Cell],
            nodes: whole,
            cells: vec![cell(&WHOLE_BOX, 1.0)],
        }
    }

    /// Fitted to samples, whose order it changes. Between lights that begin at these numbers, ascending,
    /// it is split whatever that gains: else a lamp that was found once would be lost among others.
    pub fn learn(samples: &mut [Sample], lights: &[u32]) -> Self {
        let mut parts = grow(samples, lights);
        weigh(&mut parts, samples);
        let mut shapes = Vec::with_capacity(parts.len());
        append_shapes(&mut shapes, &parts, 0, 1.0);
        Self::of_shapes(shapes, usize::MAX).unwrap_or_else(Self::even)
    }

    /// `None` where these are of no tree, or of one that is deeper than this.
    pub fn of_shapes(shapes: Vec<Shape>, max_depth: usize) -> Option<Self> {
        let mut nodes = vec![GuideNode::default()];
        let mut cells = Vec::new();
        // What is yet to come: number of the node, its box, its probability and its depth.
        let mut open = vec![(0, WHOLE_BOX, 1.0, 0)];
        for shape in &shapes {
            let (node, bounds, chance, depth) = open.pop()?;
            let Shape::Split { axis, at, share } = *shape else {
                nodes[node] = GuideNode {
                    axis: NONE,
                    child: cells.len() as u32,
                    ..GuideNode::default()
                };
                cells.push(cell(&bounds, chance));
                continue;
            };
            let [below, above] = halves(&bounds, axis as usize, at.into())?;
            let share_below = f64::from(share) / f64::from(SHARES);
            let child = nodes.len();
            nodes.extend([GuideNode::default(); 2]);
            nodes[node] = GuideNode {
                axis,
                child: child as u32,
                threshold: share * (u32::MAX / SHARES + 1),
                scale_below: share_below.recip() as f32,
                scale_above: (1.0 - share_below).recip() as f32,
                unused: 0,
            };
            if depth == max_depth {
                return None;
            }
            open.push((child + 1, above, chance * (1.0 - share_below), depth + 1));
            open.push((child, below, chance * share_below, depth + 1));
        }
        open.is_empty().then_some(Self {
            shapes,
            nodes,
            cells,
        })
    }
}

/// Of a part and those within it; `learned`: its probability by what was learned.
fn append_shapes(shapes: &mut Vec<Shape>, parts: &[Part], index: usize, learned: f64) {
    let part = &parts[index];
    let Some(split) = part.split else {
        shapes.push(Shape::Cell);
        return;
    };
    let children = [&parts[part.child], &parts[part.child + 1]];
    let volume = volume(&part.bounds);
    let volumes = children.map(|child| self::volume(&child.bounds));
    let spread = PRIOR_SAMPLES / part.count;
    let learned = [0, 1].map(|i| {
        let by_volume = volumes[i] / volume;
        if part.mass <= 0.0 || !spread.is_finite() {
            return learned * by_volume;
        }
        learned * (children[i].mass / part.mass + spread * by_volume) / (1.0 + spread)
    });
    let wanted = [0, 1].map(|i| (1.0 - DEFENSIVE) * learned[i] + DEFENSIVE * volumes[i]);
    let below = wanted[0] / (wanted[0] + wanted[1]);
    shapes.push(Shape::Split {
        axis: split.axis as u32,
        at: split.at as u32,
        share: ((below * f64::from(SHARES)).round() as u32).clamp(1, SHARES - 1),
    });
    append_shapes(shapes, parts, part.child, learned[0]);
    append_shapes(shapes, parts, part.child + 1, learned[1]);
}

/// Below and above a place on an axis, which must lie within.
fn halves(bounds: &Bounds, axis: usize, at: u64) -> Option<[Bounds; 2]> {
    let Interval { first, size } = *bounds.get(axis)?;
    let below = at.checked_sub(first).filter(|&b| b > 0 && b < size)?;
    let mut halves = [*bounds; 2];
    halves[0][axis].size = below;
    halves[1][axis] = Interval {
        first: at,
        size: size - below,
    };
    Some(halves)
}

fn cell(bounds: &Bounds, chance: f64) -> GuideCell {
    let first = bounds.map(|i| i.first as u32);
    let size = bounds.map(|i| i.size as u32);
    GuideCell {
        first_light: first[0],
        size_light: size[0],
        first_place: [first[1], first[2]],
        size_place: [size[1], size[2]],
        first_way: [first[3], first[4]],
        size_way: [size[3], size[4]],
        first_bounce: [first[5], first[6]],
        size_bounce: [size[5], size[6]],
        density: (chance / volume(bounds)) as f32,
        unused: 0,
    }
}

fn volume(bounds: &Bounds) -> f64 {
    let shares = bounds.iter().map(|i| i.size as f64 / WHOLE as f64);
    shares.product()
}

/// Splits between lights, and then where that gains most, as long as it gains enough. The whole comes
/// first.
fn grow(samples: &mut [Sample], lights: &[u32]) -> Vec<Part> {
    let mut parts = vec![part_of(samples, WHOLE_BOX, 0..samples.len())];
    let mut open = BinaryHeap::new();
    let mut between = vec![(0, lights)];
    while let Some((part, lights)) = between.pop() {
        let (before, rest) = lights.split_at(lights.len() / 2);
        let Some((&at, after)) = rest.split_first() else {
            open.extend(parts[part].best.map(|split| Candidate { part, split }));
            continue;
        };
        let split = Split {
            axis: 0,
            at: at.into(),
            gain: 0.0,
        };
        if split_part(&mut parts, samples, part, split) {
            let child = parts[part].child;
            between.extend([(child, before), (child + 1, after)]);
        }
    }
    while let Some(Candidate { part, split }) = open.pop()
        && parts.len() < 2 * MAX_CELLS - 1
    {
        if split_part(&mut parts, samples, part, split) {
            for part in [parts[part].child, parts[part].child + 1] {
                open.extend(parts[part].best.map(|split| Candidate { part, split }));
            }
        }
    }
    parts
}

/// Appends both halves; false where the split lies outside.
fn split_part(parts: &mut Vec<Part>, samples: &mut [Sample], part: usize, split: Split) -> bool {
    let Some([below, above]) = halves(&parts[part].bounds, split.axis, split.at) else {
        return false;
    };
    let Range { start, end } = parts[part].samples;
    let members = &mut samples[start..end];
    let middle = start + partition(members, |s| u64::from(s.at[split.axis]) < split.at);
    parts[part].split = Some(split);
    parts[part].child = parts.len();
    parts.push(part_of(samples, below, start..middle));
    parts.push(part_of(samples, above, middle..end));
    true
}

fn part_of(samples: &[Sample], bounds: Bounds, range: Range<usize>) -> Part {
    let (count, best) = best_split(&samples[range.clone()], &bounds);
    Part {
        bounds,
        samples: range,
        count,
        mass: 0.0,
        best,
        split: None,
        child: 0,
    }
}

/// What could be split.
struct Candidate {
    part: usize,
    split: Split,
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// By what a split would gain; of equals, the one that was made first.
impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_gain = self.split.gain.total_cmp(&other.split.gain);
        by_gain.then_with(|| other.part.cmp(&self.part))
    }
}

/// Gives parts their masses. For the least variance a cell wants paths in proportion to the root of
/// the mean square of what they bring, which is far above its mean where few of them bring much;
/// but that root is known less well.
fn weigh(parts: &mut [Part], samples: &[Sample]) {
    let sums = |part: &Part| {
        let samples = &samples[part.samples.clone()];
        let weight: f64 = samples.iter().map(|s| f64::from(s.weight)).sum();
        let square: f64 = samples.iter().map(|s| f64::from(s.square)).sum();
        let known = samples.iter().filter(|s| s.square > 0.0).count() as f64;
        let known = known / (known + 2.0 * PRIOR_SAMPLES);
        [weight, (square * known * volume(&part.bounds)).sqrt()]
    };
    let of_parts: Vec<[f64; 2]> = parts.iter().map(sums).collect();
    let leaves = (0..parts.len()).filter(|&i| parts[i].split.is_none());
    let totals = leaves.fold([0.0; 2], |total, i| {
        [total[0] + of_parts[i][0], total[1] + of_parts[i][1]]
    });
    let variance_share = if totals[1] > 0.0 { VARIANCE_SHARE } else { 0.0 };
    // Children come after their parents.
    for i in (0..parts.len()).rev() {
        parts[i].mass = match parts[i].split {
            Some(_) => parts[parts[i].child].mass + parts[parts[i].child + 1].mass,
            None => {
                (1.0 - variance_share) * of_parts[i][0] / totals[0]
                    + variance_share * of_parts[i][1] / totals[1].max(f64::MIN_POSITIVE)
            }
        };
    }
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

/// How many samples of equal weight would say as much, and the best split, if there is a good one.
fn best_split(samples: &[Sample], bounds: &Bounds) -> (f64, Option<Split>) {
    let weight = |s: &Sample| f64::from(s.weight);
    let total: f64 = samples.iter().map(weight).sum();
    let squares: f64 = samples.iter().map(|s| weight(s).powi(2)).sum();
    let count = total * total / squares;
    if count.is_nan() || count < LEAST_SAMPLES {
        return (count, None);
    }
    let splits = (0..AXES).flat_map(|axis| {
        let bins = Bins::of(samples, axis);
        let mut masses = [0.0; BINS + 2];
        for s in samples {
            masses[bins.of_number(s.at[axis].into())] += weight(s);
        }
        let mut below = 0.0;
        let ends = (0_u64..).zip(masses).map(move |(bin, mass)| {
            below += mass / total;
            (bins.end(bin), below)
        });
        let Interval { first, size } = bounds[axis];
        let within = ends.filter(move |(at, _)| *at > first && *at < first + size);
        within.map(move |(at, below)| Split {
            axis,
            at,
            gain: count * gain(at, &bounds[axis], below, count),
        })
    });
    let best = splits.max_by(|a, b| a.gain.total_cmp(&b.gain));
    let good = best.filter(|split| split.gain > LEAST_GAIN);
    // In shares of all samples, so that parts compare.
    let good = good.map(|split| Split {
        gain: split.gain / count * total,
        ..split
    });
    (count, good)
}

/// By which the mean log likelihood of `count` samples grows, of whose weight the share `below`
/// lies below a split.
fn gain(at: u64, bounds: &Interval, below: f64, count: f64) -> f64 {
    let volume = (at - bounds.first) as f64 / bounds.size as f64;
    let chance = (below * count + PRIOR_SAMPLES * volume) / (count + PRIOR_SAMPLES);
    below * (chance / volume).ln() + (1.0 - below) * ((1.0 - chance) / (1.0 - volume)).ln()
}

/// Where splits are tried along an axis: so many times in the range of the samples, and once on
/// either side. They lie at round numbers, so that a sample more or less seldom moves them.
#[derive(Debug, Clone, Copy)]
struct Bins {
    first: u64,
    width: u64,
}

impl Bins {
    fn of(samples: &[Sample], axis: usize) -> Self {
        let numbers = || samples.iter().map(|s| u64::from(s.at[axis]));
        let low = numbers().min().unwrap_or(0);
        let high = numbers().max().unwrap_or(0);
        let width = ((high - low) / BINS as u64 + 1).next_power_of_two();
        Self {
            first: low / width * width,
            width,
        }
    }

    fn of_number(&self, number: u64) -> usize {
        1 + ((number - self.first) / self.width) as usize
    }

    fn end(&self, bin: u64) -> u64 {
        self.first + bin * self.width
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of a sequence that has nothing to do with the tree's.
    fn random(seed: u32) -> impl Iterator<Item = u32> {
        let mut state = u64::from(seed) << 32 | 1;
        std::iter::repeat_with(move || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 32) as u32
        })
    }

    /// 10⁻⁶ of the extent along two axes, in one of a thousand lights.
    fn needle(n: usize) -> Vec<Sample> {
        let mut numbers = random(7);
        let mut next = || numbers.next().unwrap();
        let sample = |_| Sample {
            at: [
                1_000_000_000 + next() / 1000,
                next(),
                next(),
                3_000_000_000 + next() / 1_000_000,
                20_000 + next() / 1_000_000,
                next(),
                next(),
            ],
            weight: 1.0,
            square: 0.0,
        };
        (0..n).map(sample).collect()
    }

    #[test]
    fn cells_fill_the_whole_and_share_all_paths() {
        let tree = Tree::learn(&mut needle(4000), &[]);
        let size = |size: u32| {
            if size == 0 {
                1.0
            } else {
                f64::from(size) / WHOLE as f64
            }
        };
        let volume = |c: &GuideCell| {
            let sizes = [c.size_place, c.size_way, c.size_bounce].concat();
            size(c.size_light) * sizes.into_iter().map(size).product::<f64>()
        };
        let volumes: f64 = tree.cells.iter().map(volume).sum();
        assert!((volumes - 1.0).abs() < 1e-9, "{volumes}");
        let chances = tree.cells.iter().map(|c| volume(c) * f64::from(c.density));
        let all: f64 = chances.sum();
        assert!((all - 1.0).abs() < 1e-5, "{all}");
        let least = tree.cells.iter().map(|c| c.density).fold(1.0, f32::min);
        assert!(f64::from(least) > 0.7 * DEFENSIVE, "{least}");
    }

    #[test]
    fn what_is_tiny_is_found() {
        let tree = Tree::learn(&mut needle(4000), &[]);
        // By volume one path in 10¹⁵ would begin there.
        let density = tree.cells.iter().map(|c| c.density).fold(0.0, f32::max);
        assert!(density > 1e14, "{density}");
    }

    /// Found once among thousands, a light gets the share of its weight.
    #[test]
    fn a_light_found_once_is_not_lost() {
        let mut samples = needle(4000);
        samples.push(Sample {
            at: [100, 7, 7, 7, 7, 7, 7],
            weight: 200.0,
            square: 0.0,
        });
        let tree = Tree::learn(&mut samples, &[1000]);
        let of_light = tree.cells.iter().filter(|c| c.first_light == 0);
        let volume = 1000.0 / WHOLE as f64;
        let densities: Vec<f32> = of_light.map(|c| c.density).collect();
        assert_eq!(densities.len(), 1);
        let share = f64::from(densities[0]) * volume;
        assert!((0.03..0.06).contains(&share), "{share}");
    }

    #[test]
    fn what_is_even_stays_whole() {
        for (n, seed) in [(0, 1), (10, 2), (20_000, 3)] {
            let mut numbers = random(seed);
            let sample = |_| Sample {
                at: std::array::from_fn(|_| numbers.next().unwrap()),
                weight: 1.0,
                square: 1.0,
            };
            let tree = Tree::learn(&mut (0..n).map(sample).collect::<Vec<_>>(), &[]);
            assert_eq!(tree.cells.len(), 1, "{n}");
            assert_eq!(tree.cells[0].density, 1.0);
        }
    }

    #[test]
    fn rare_bright_paths_count_more_than_their_mean() {
        let mut numbers = random(5);
        let mut next = || numbers.next().unwrap();
        // One half brings three times as much, in a hundredth of the paths.
        let sample = |i: usize| {
            let rare = i.is_multiple_of(101);
            let half = if rare { 1 << 31 } else { 0 };
            Sample {
                at: [
                    next(),
                    next(),
                    next(),
                    half + next() / 2,
                    next(),
                    next(),
                    next(),
                ],
                weight: if rare { 300.0 } else { 1.0 },
                square: if rare { 9e4 } else { 1.0 },
            }
        };
        let tree = Tree::learn(&mut (0..40_000).map(sample).collect::<Vec<_>>(), &[]);
        let Some(Shape::Split { axis: 3, share, .. }) = tree.shapes.first().copied() else {
            panic!("{:?}", tree.shapes);
        };
        // By the root of the mean square, and by the mean.
        let below = f64::from(share) / f64::from(SHARES);
        let wanted = VARIANCE_SHARE / 31.0 + (1.0 - VARIANCE_SHARE) / 4.0;
        assert!((below - wanted).abs() < 0.03, "{below}, not {wanted}");
    }
}
