//! A tree over the lights, by which rays choose one as it matters where they are (Conty & Kulla 2018, without their
//! cones and with one choice for each ray; see `glsl/lib/light_tree.glsl`).

use crate::shared::{Light, LightNode, NONE};
use glam::Vec3;

/// A light as the tree sees it.
#[derive(Debug, Clone, Copy)]
pub struct Emitter {
    /// The box that holds it (m).
    pub min_w: Vec3,
    pub max_w: Vec3,
    /// Irradiance (lx) is at most about this (cd) over the square of the distance…
    pub intensity: f64,
    /// …and this, where the light is infinitely far away.
    pub irradiance: f64,
}

/// Bits of [`Light::trail`].
const LEVELS: usize = 32;
/// Where a box can be split along its longest axis.
const BINS: usize = 16;

/// The nodes, two children always side by side; sets each light's trail.
pub fn build(emitters: &[Emitter], lights: &mut [Light]) -> Vec<LightNode> {
    let mut nodes = vec![LightNode::default()];
    let mut todo = vec![(0, 0, 0_u32, (0..emitters.len() as u32).collect::<Vec<_>>())];
    while let Some((node, level, trail, mut members)) = todo.pop() {
        let whole = union(emitters, &members);
        let extent = whole.max_w - whole.min_w;
        let mut made = LightNode {
            center_w: (0.5 * (whole.min_w + whole.max_w)).into(),
            radius2: 0.25 * extent.length_squared(),
            intensity: whole.intensity as f32,
            irradiance: whole.irradiance as f32,
            child: NONE,
            light: NONE,
        };
        if let [light] = members[..] {
            made.light = light;
            lights[light as usize].trail = trail;
        } else {
            let middle = split(emitters, &mut members, level);
            made.child = nodes.len() as u32;
            nodes.extend([LightNode::default(); 2]);
            let right = members.split_off(middle);
            let child = made.child as usize;
            todo.push((child, level + 1, trail, members));
            todo.push((child + 1, level + 1, trail | 1 << level, right));
        }
        nodes[node] = made;
    }
    nodes
}

fn union(emitters: &[Emitter], members: &[u32]) -> Emitter {
    let empty = Emitter {
        min_w: Vec3::INFINITY,
        max_w: Vec3::NEG_INFINITY,
        intensity: 0.0,
        irradiance: 0.0,
    };
    members
        .iter()
        .fold(empty, |sum, &member| add(sum, &emitters[member as usize]))
}

fn add(sum: Emitter, emitter: &Emitter) -> Emitter {
    Emitter {
        min_w: sum.min_w.min(emitter.min_w),
        max_w: sum.max_w.max(emitter.max_w),
        intensity: sum.intensity + emitter.intensity,
        irradiance: sum.irradiance + emitter.irradiance,
    }
}

/// Brings two groups in order and says where the second begins: those that cost least, in intensity times the square of
/// a group's extent; in halves where nothing tells lights apart, or the levels come to an end.
fn split(emitters: &[Emitter], members: &mut [u32], level: usize) -> usize {
    let center = |member: u32| {
        let e = &emitters[member as usize];
        0.5 * (e.min_w + e.max_w)
    };
    let (low, high) = members
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &m| {
            (low.min(center(m)), high.max(center(m)))
        });
    let axis = (high - low).max_position();
    let bin = |member: u32| {
        let share = (center(member)[axis] - low[axis]) / (high[axis] - low[axis]);
        ((share * BINS as f32) as usize).min(BINS - 1)
    };
    let halves_left = usize::BITS as usize - members.len().leading_zeros() as usize;
    if high[axis] > low[axis] && level + 1 + halves_left < LEVELS {
        members.sort_by_key(|&member| bin(member));
        let ends = (1..BINS).map(|b| members.partition_point(|&member| bin(member) < b));
        let cost = |part: &[u32]| {
            let group = union(emitters, part);
            (group.intensity + group.irradiance)
                * f64::from((group.max_w - group.min_w).length_squared())
        };
        let splits = ends.filter(|&end| end > 0 && end < members.len());
        let costs = splits.map(|end| (cost(&members[..end]) + cost(&members[end..]), end));
        if let Some((_, end)) = costs.min_by(|a, b| a.0.total_cmp(&b.0)) {
            return end;
        }
    }
    members.len() / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever their places, each light is found by its trail, and the root is as bright as all together.
    #[test]
    fn trails_lead_to_lights() {
        let row = |n: u32, place: fn(u32) -> f32| -> Vec<Emitter> {
            let at = |i| Vec3::new(place(i), 0.0, 1.0);
            let emitter = |i| Emitter {
                min_w: at(i),
                max_w: at(i) + 0.1,
                intensity: 1.0,
                irradiance: 0.5,
            };
            (0..n).map(emitter).collect()
        };
        for emitters in [
            row(1, |_| 0.0),
            row(1000, |_| 0.0),
            row(777, |i| i as f32),
            // Binned splits alone would make a list of this.
            row(100, |i| 1.3_f32.powi(i as i32)),
        ] {
            let mut lights = vec![Light::default(); emitters.len()];
            let nodes = build(&emitters, &mut lights);
            assert_eq!(nodes.len(), 2 * lights.len() - 1);
            assert_eq!(nodes[0].intensity, lights.len() as f32);
            for (i, light) in lights.iter().enumerate() {
                let mut node = nodes[0];
                let mut trail = light.trail;
                while node.child != NONE {
                    node = nodes[(node.child + (trail & 1)) as usize];
                    trail >>= 1;
                }
                assert_eq!(node.light, i as u32);
            }
        }
    }
}
