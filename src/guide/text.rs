//! A guide as text, to be saved with a picture: numbers in hexadecimal, the tree from its root on,
//! each split before what lies below and above it.

use super::Focus;
use super::tree::{AXES, SHARES, Shape, Tree};
use glam::Vec3;

/// Deeper trees are none of ours.
const MAX_DEPTH: usize = 1 << 12;

/// `x y z reach` and then for each split its axis, place and share; a dot for each cell.
pub fn write(focus: &Focus, tree: &Tree) -> String {
    let Vec3 { x, y, z } = focus.center_w;
    let numbers = [x, y, z, focus.reach].map(|x| format!("{:08x}", x.to_bits()));
    let shapes = tree.shapes.iter().map(|shape| match shape {
        Shape::Cell => ".".to_string(),
        Shape::Split { axis, at, share } => format!("{axis:x}{at:08x}{share:03x}"),
    });
    let words: Vec<String> = numbers.into_iter().chain(shapes).collect();
    words.join(" ")
}

/// `None` where that is no such text.
pub fn read(text: &str) -> Option<(Focus, Tree)> {
    let mut words = text.split(' ');
    let mut number = || {
        let bits = u32::from_str_radix(words.next()?, 16).ok()?;
        Some(f32::from_bits(bits)).filter(|x| x.is_finite())
    };
    let [x, y, z, reach] = [number()?, number()?, number()?, number()?];
    let shapes: Option<Vec<Shape>> = words.map(shape).collect();
    let focus = Focus {
        center_w: Vec3::new(x, y, z),
        reach,
    };
    Some((focus, Tree::of_shapes(shapes?, MAX_DEPTH)?))
}

fn shape(word: &str) -> Option<Shape> {
    if word == "." {
        return Some(Shape::Cell);
    }
    let digits = |range| u32::from_str_radix(word.get(range)?, 16).ok();
    let (axis, at, share) = (digits(0..1)?, digits(1..9)?, digits(9..12)?);
    let there = word.len() == 12 && axis < AXES as u32 && share > 0 && share < SHARES;
    there.then_some(Shape::Split { axis, at, share })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guide::tree::Sample;

    #[test]
    fn a_tree_comes_back_as_it_was() {
        let at = |i: u32| {
            let x = i.wrapping_mul(0x9e37_79b9);
            [x >> (i % 20), x, 7 << 20, i << 8, x >> 9, x, !x]
        };
        let sample = |i| Sample {
            at: at(i),
            weight: 1.0 + (i % 7) as f32,
            square: 1.0,
        };
        let tree = Tree::learn(&mut (0..5000).map(sample).collect::<Vec<_>>(), &[1 << 20]);
        assert!(tree.cells.len() > 20, "{}", tree.cells.len());
        let focus = Focus {
            center_w: Vec3::new(1.0, -2.5e-7, 3e8),
            reach: 0.1,
        };
        let text = write(&focus, &tree);
        let (focus_back, back) = read(&text).unwrap();
        assert_eq!(focus, focus_back);
        let bytes = |tree: &Tree| {
            let [nodes, cells]: [&[u8]; 2] = [
                bytemuck::cast_slice(&tree.nodes),
                bytemuck::cast_slice(&tree.cells),
            ];
            [nodes, cells].concat()
        };
        assert_eq!(bytes(&tree), bytes(&back));
        for bad in ["", "0 0 0", "0 0 0 0", "0 0 0 0 0", "0 0 0 0 . ."] {
            assert!(read(bad).is_none(), "{bad}");
        }
        for cut in (40..text.len()).step_by(997) {
            assert!(read(&text[..cut]).is_none(), "{cut}");
        }
        assert!(read(&text.replacen(" 0", " 9", 8)).is_none());
    }
}
