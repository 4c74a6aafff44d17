//! Children's boxes in bytes: a node of four children takes less memory than two boxes of floats, and what a CPU device's
//! traversal takes is loads.

use crate::shared::BvhNode;
use glam::Vec3;

/// Cells that boxes are widened by, on top of whole ones: where `glsl/lib/trace.glsl` finds a plane within a node, rounding moves it
/// by a few times 2⁻²⁴ of the node's size, far less than this part of a cell, which is at least 2⁻⁸ of it.
const PADDING: f64 = 1.0 / 16.0;

/// A node with these boxes, at most four (Ylitie, Karras & Laine 2017, section 3.2). Its children are set later.
pub fn node_around(boxes: &[(Vec3, Vec3)]) -> BvhNode {
    let mut node = BvhNode {
        exponents: (boxes.len() as u32) << 24,
        ..BvhNode::default()
    };
    for axis in 0..3 {
        let ranges: Vec<_> = boxes
            .iter()
            .map(|(low, high)| [low[axis], high[axis]].map(f64::from))
            .collect();
        let cells = Cells::around(&ranges);
        node.min_w[axis] = cells.corner;
        node.exponents |= cells.exponent << (8 * axis);
        for (child, &range) in ranges.iter().enumerate() {
            let [low, high] = cells.of(range);
            node.low[axis] |= low << (8 * child);
            node.high[axis] |= high << (8 * child);
        }
    }
    node
}

/// Along one axis: cells of edge 2^(exponent - 127) from `corner` on.
struct Cells {
    corner: f32,
    exponent: u32,
}

impl Cells {
    /// The smallest of which 255 hold all ranges.
    fn around(ranges: &[[f64; 2]]) -> Self {
        let (min, max) = ranges
            .iter()
            .fold((f64::MAX, f64::MIN), |(min, max), [low, high]| {
                (min.min(*low), max.max(*high))
            });
        // Not below what floats there tell apart.
        let extent = (max - min).max(min.abs().max(max.abs()) * 2f64.powi(-24));
        let mut exponent = (extent / 255.0).log2().clamp(-126.0, 127.0) as i32 + 127;
        exponent = exponent.max(1);
        loop {
            let cells = Self {
                corner: below(min - PADDING * edge(exponent as u32)),
                exponent: exponent as u32,
            };
            if exponent >= 254 || cells.of([max, max])[1] <= 255 {
                return cells;
            }
            exponent += 1;
        }
    }

    /// Where a widened range begins and ends.
    fn of(&self, [low, high]: [f64; 2]) -> [u32; 2] {
        let cells = |place: f64| (place - f64::from(self.corner)) / edge(self.exponent);
        [
            (cells(low) - PADDING).floor() as u32,
            (cells(high) + PADDING).ceil() as u32,
        ]
    }
}

fn edge(exponent: u32) -> f64 {
    2f64.powi(exponent as i32 - 127)
}

/// The largest float that is not above.
fn below(x: f64) -> f32 {
    let float = x.max(f64::from(f32::MIN)) as f32;
    if f64::from(float) > x {
        float.next_down()
    } else {
        float
    }
}

/// Boxes of a node's children, as wide as they became: for tests.
#[cfg(test)]
pub fn boxes_of(node: &BvhNode) -> Vec<[[f64; 3]; 2]> {
    let plane = |cells: [u32; 3], child: u32| {
        [0, 1, 2].map(|axis| {
            let exponent = node.exponents >> (8 * axis) & 255;
            f64::from(node.min_w[axis])
                + f64::from(cells[axis] >> (8 * child) & 255) * edge(exponent)
        })
    };
    (0..node.exponents >> 24)
        .map(|child| [plane(node.low, child), plane(node.high, child)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Flat ones, tiny ones far away, huge ones: all inside theirs, with room to spare, and not in much wider ones.
    #[test]
    fn boxes_hold_what_they_are_around() {
        let unit = [
            (Vec3::ZERO, Vec3::ONE),
            (Vec3::splat(0.3), Vec3::new(0.3, 0.4, 0.5)),
            (Vec3::splat(0.7), Vec3::splat(0.7)),
        ];
        for (scale, shift) in [
            (1.0, 0.0),
            (1e-30, 0.0),
            (1e30, 0.0),
            (1e-3, 1e5),
            (1e6, -1e12),
            (0.0, 7.0),
            (0.0, 0.0),
            (f32::MAX, 0.0),
        ] {
            let boxes = unit.map(|(low, high)| (low * scale + shift, high * scale + shift));
            let node = node_around(&boxes);
            let extent = (f64::from(scale))
                .max(f64::from(shift).abs() * 2f64.powi(-22))
                .max(1e-35);
            for ((low, high), [wide_low, wide_high]) in boxes.iter().zip(boxes_of(&node)) {
                for axis in 0..3 {
                    let (low, high) = (f64::from(low[axis]), f64::from(high[axis]));
                    let least = edge(node.exponents >> (8 * axis) & 255) * 0.06;
                    assert!(
                        low - wide_low[axis] >= least,
                        "{scale} {shift}: {low} {wide_low:?}"
                    );
                    assert!(
                        wide_high[axis] - high >= least,
                        "{scale} {shift}: {high} {wide_high:?}"
                    );
                    let most = extent * 0.02;
                    assert!(
                        low - wide_low[axis] < most && wide_high[axis] - high < most,
                        "{scale} {shift}"
                    );
                }
            }
        }
    }
}
