//! Triangle meshes: fronts are counter-clockwise, outsides are fronts.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

/// A mesh with a normal per vertex.
#[derive(Default)]
pub struct Shape {
    pub positions: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    pub triangles: Vec<[u16; 3]>,
}

impl Shape {
    fn vertex(&mut self, position: DVec3, normal: DVec3) -> u16 {
        self.positions.push(position);
        self.normals.push(normal);
        u16::try_from(self.positions.len() - 1).expect("at most 65536 vertices in a shape")
    }

    /// A flat parallelogram in front of `u` × `v`.
    pub fn quad(mut self, corner: DVec3, u: DVec3, v: DVec3) -> Self {
        let normal = u.cross(v).normalize();
        let [a, b, c, d] = [corner, corner + u, corner + u + v, corner + v]
            .map(|position| self.vertex(position, normal));
        self.triangles.extend([[a, b, c], [a, c, d]]);
        self
    }

    /// A box from `low` to `high`; `side` is 1 for fronts outside, −1 for fronts inside.
    pub fn cuboid(self, low: DVec3, high: DVec3, side: f64) -> Self {
        let size = high - low;
        self.block(low, DVec3::AXES.map(|axis| axis * size), side)
    }

    /// The like with any right-handed `edges` from `corner`: leaning slats, doors ajar.
    pub fn block(mut self, corner: DVec3, edges: [DVec3; 3], side: f64) -> Self {
        let [x, y, z] = edges;
        for (u, v, w) in [(x, y, z), (y, z, x), (z, x, y)] {
            let (near, far) = if side > 0.0 {
                (corner, w)
            } else {
                (corner + w, -w)
            };
            self = self.quad(near, v, u).quad(near + far, u, v);
        }
        self
    }

    /// A box from `low` to `high` without `holes`, boxes themselves: a house is one without its
    /// rooms, windows and doors. It comes in pieces that abut, so that no crack leads through it.
    pub fn carved(mut self, mut low: DVec3, mut high: DVec3, holes: &[[DVec3; 2]]) -> Self {
        let Some((&[hole_low, hole_high], others)) = holes.split_first() else {
            return self.cuboid(low, high, 1.0);
        };
        if hole_low.cmpge(high).any() || hole_high.cmple(low).any() {
            return self.carved(low, high, others);
        }
        // What lies before and behind the hole along each axis is cut off in turn.
        for axis in 0..3 {
            if hole_low[axis] > low[axis] {
                let mut end = high;
                end[axis] = hole_low[axis];
                self = self.carved(low, end, others);
                low[axis] = hole_low[axis];
            }
            if hole_high[axis] < high[axis] {
                let mut start = low;
                start[axis] = hole_high[axis];
                self = self.carved(start, high, others);
                high[axis] = hole_high[axis];
            }
        }
        self
    }

    /// Four legs under a top: a box without two crossing tunnels.
    pub fn table(self, low: DVec3, high: DVec3, thickness: f64) -> Self {
        let tunnel = |axis: DVec3| {
            let (side, along) = ((DVec3::X + DVec3::Z - axis) * thickness, axis * thickness);
            [
                low + side - along,
                high - side + along - DVec3::Y * thickness,
            ]
        };
        self.carved(low, high, &[DVec3::X, DVec3::Z].map(tunnel))
    }

    /// A closed volume between (x, z) = `low` and `high`: smooth on top, flat elsewhere.
    /// `height` gives the top (y) and its derivatives by x and z.
    pub fn water(
        low: DVec2,
        high: DVec2,
        bottom: f64,
        cells: [u16; 2],
        height: impl Fn(DVec2) -> [f64; 3],
    ) -> Self {
        let mut shape = Self::default();
        let [columns, rows] = cells;
        let at = |i: u16, j: u16| {
            low + (high - low)
                * DVec2::new(
                    f64::from(i) / f64::from(columns),
                    f64::from(j) / f64::from(rows),
                )
        };
        for j in 0..=rows {
            for i in 0..=columns {
                let p = at(i, j);
                let [y, dx, dz] = height(p);
                shape.vertex(
                    DVec3::new(p.x, y, p.y),
                    DVec3::new(-dx, 1.0, -dz).normalize(),
                );
            }
        }
        let index = |i: u16, j: u16| j * (columns + 1) + i;
        for j in 0..rows {
            for i in 0..columns {
                let [a, b, c, d] = [
                    index(i, j),
                    index(i + 1, j),
                    index(i + 1, j + 1),
                    index(i, j + 1),
                ];
                shape.triangles.extend([[a, c, b], [a, d, c]]);
            }
        }
        // Walls and floor share the rim's points, so that the volume is watertight.
        let walls = [
            ((0..=columns).map(|i| (i, rows)).collect(), DVec3::Z),
            ((0..=rows).rev().map(|j| (columns, j)).collect(), DVec3::X),
            ((0..=columns).rev().map(|i| (i, 0)).collect(), DVec3::NEG_Z),
            ((0..=rows).map(|j| (0, j)).collect(), DVec3::NEG_X),
        ];
        let middle = (low + high) / 2.0;
        let middle = shape.vertex(DVec3::new(middle.x, bottom, middle.y), DVec3::NEG_Y);
        for (rim, normal) in walls {
            let rim: Vec<(u16, u16)> = rim;
            for pair in rim.windows(2) {
                let [a, b] =
                    [pair[0], pair[1]].map(|(i, j)| shape.positions[usize::from(index(i, j))]);
                let [c, d] = [b, a].map(|top| DVec3::new(top.x, bottom, top.z));
                let [p, q, r, s] = [a, d, c, b].map(|position| shape.vertex(position, normal));
                shape.triangles.extend([[p, q, r], [p, r, s]]);
                let [d, c] = [d, c].map(|position| shape.vertex(position, DVec3::NEG_Y));
                shape.triangles.push([d, middle, c]);
            }
        }
        shape
    }

    /// The unit sphere: an icosahedron, each triangle cut in four `levels` times.
    pub fn sphere(levels: u32) -> Self {
        let mut shape = Self::default();
        let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
        for [a, b, c] in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
            for (s, t) in [
                (1.0, golden),
                (-1.0, golden),
                (1.0, -golden),
                (-1.0, -golden),
            ] {
                let mut point = [0.0; 3];
                (point[a], point[b], point[c]) = (0.0, s, t);
                let point = DVec3::from(point).normalize();
                shape.vertex(point, point);
            }
        }
        // Every triple of mutual neighbours is a face.
        let edge = 2.0 / (1.0 + golden * golden).sqrt();
        let near = |points: &[DVec3], i: u16, j: u16| {
            (points[usize::from(i)].distance(points[usize::from(j)]) - edge).abs() < 1e-9
        };
        let points = shape.positions.clone();
        for i in 0..12 {
            for j in i + 1..12 {
                for k in j + 1..12 {
                    if near(&points, i, j) && near(&points, j, k) && near(&points, k, i) {
                        let [a, b, c] = [i, j, k].map(|i| points[usize::from(i)]);
                        let outward = (b - a).cross(c - a).dot(a) > 0.0;
                        shape
                            .triangles
                            .push(if outward { [i, j, k] } else { [i, k, j] });
                    }
                }
            }
        }
        for _ in 0..levels {
            let mut middles = HashMap::new();
            for [a, b, c] in std::mem::take(&mut shape.triangles) {
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                    *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                        let ends = [i, j].map(|i| shape.positions[usize::from(i)]);
                        let point = (ends[0] + ends[1]).normalize();
                        shape.vertex(point, point)
                    })
                });
                shape
                    .triangles
                    .extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
            }
        }
        shape
    }

    /// A profile of points (radius, height), each with its normal, turned about the y axis.
    /// Seen with the axis on the left, the profile's outside lies on its right.
    pub fn lathe(profile: &[(DVec2, DVec2)], segments: u16) -> Self {
        let mut shape = Self::default();
        for segment in 0..segments {
            let (sin, cos) = (TAU * f64::from(segment) / f64::from(segments)).sin_cos();
            let turn = |p: DVec2| DVec3::new(p.x * cos, p.y, -p.x * sin);
            for &(point, normal) in profile {
                shape.vertex(turn(point), turn(normal));
            }
        }
        let length = profile.len() as u16;
        for segment in 0..segments {
            let (left, right) = (segment * length, (segment + 1) % segments * length);
            for (i, pair) in profile.windows(2).enumerate() {
                let i = i as u16;
                let [a, b, c, d] = [left + i, right + i, right + i + 1, left + i + 1];
                // No area where the profile stands on the axis or turns a sharp corner.
                if pair[0].0.x > 0.0 && pair[0].0 != pair[1].0 {
                    shape.triangles.push([a, b, c]);
                }
                if pair[1].0.x > 0.0 && pair[0].0 != pair[1].0 {
                    shape.triangles.push([a, c, d]);
                }
            }
        }
        shape
    }
}

/// What [`Shape::water`] takes: plane waves of direction, wavelength, amplitude and phase about a
/// `level`.
pub fn waves<const N: usize>(
    level: f64,
    waves: [(DVec2, f64, f64, f64); N],
) -> impl Fn(DVec2) -> [f64; 3] {
    move |p| {
        let mut top = [level, 0.0, 0.0];
        for (direction, length, amplitude, phase) in waves {
            let k = direction.normalize() * (TAU / length);
            let (sin, cos) = (k.dot(p) + phase).sin_cos();
            top[0] += amplitude * sin;
            top[1] += amplitude * cos * k.x;
            top[2] += amplitude * cos * k.y;
        }
        top
    }
}

/// A polyline of (radius, height) with rounded corners, as [`Shape::lathe`] takes it.
/// Corners are (point, radius of the rounding); the ends are kept as they are.
pub fn rounded(corners: &[(DVec2, f64)], steps: u16) -> Vec<(DVec2, DVec2)> {
    let right = |direction: DVec2| DVec2::new(direction.y, -direction.x);
    let mut profile = Vec::new();
    for (i, &(corner, radius)) in corners.iter().enumerate() {
        let before = (i > 0).then(|| (corner - corners[i - 1].0).normalize());
        let after = (i + 1 < corners.len()).then(|| (corners[i + 1].0 - corner).normalize());
        let (Some(before), Some(after)) = (before, after) else {
            let only = before.or(after).unwrap_or(DVec2::Y);
            profile.push((corner, right(only)));
            continue;
        };
        let angle = before.angle_to(after);
        let reach = radius * (angle / 2.0).tan().abs();
        let centre = corner - before * reach - right(before) * radius * angle.signum();
        for step in 0..=steps {
            let turn = DVec2::from_angle(angle * f64::from(step) / f64::from(steps));
            let normal = turn.rotate(right(before));
            profile.push((centre + normal * radius * angle.signum(), normal));
        }
    }
    profile
}
