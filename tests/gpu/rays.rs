//! Ray queries, over boxes and over triangles.

use super::{assert_valid, open};
use bytemuck::{Pod, Zeroable};
use lightfall::gpu::{Gpu, Instance, Ptr, TriangleGeometry};

/// Without ray query there is nothing to test but the error.
fn open_with_ray_query() -> Option<Gpu> {
    let gpu = open();
    if gpu.info().caps.ray_query {
        return Some(gpu);
    }
    println!("{} has no ray query: not tested", gpu.info().name);
    if !gpu.info().caps.traces_structures() {
        let message = gpu.box_blas("photons", 1).err().unwrap().to_string();
        assert!(message.contains("VK_KHR_ray_query"), "{message}");
    }
    assert_valid(&gpu);
    None
}

/// Uniform in [0, 1), repeatable.
fn random(state: &mut u64) -> f32 {
    *state = state
        .wrapping_mul(6364136223846793005)
        .wrapping_add(1442695040888963407);
    (*state >> 40) as f32 / (1u64 << 24) as f32
}

fn instance(blas_address: u64, custom_index: u32, mask: u8) -> Instance {
    Instance {
        blas_address,
        transform: Instance::IDENTITY,
        custom_index,
        mask,
        facing_cull_disable: false,
        front_ccw: false,
    }
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct NearPush {
    tlas: u64,
    points: Ptr<[f32; 3]>,
    boxes: Ptr<[f32; 6]>,
    found: Ptr<[u32; 2]>,
    count: u32,
    mask: u32,
}

#[test]
fn ray_query_finds_the_boxes_around_points() {
    let Some(gpu) = open_with_ray_query() else {
        return;
    };
    let mut state = 1;
    let mut point = || [0; 3].map(|_| random(&mut state));
    let boxes: Vec<[f32; 6]> = (0..2000)
        .map(|_| {
            let ([x, y, z], [a, b, c]) = (point(), point());
            [x, y, z, x + 0.2 * a, y + 0.2 * b, z + 0.2 * c]
        })
        .collect();
    let points: Vec<[f32; 3]> = (0..1000).map(|_| point()).collect();
    let box_buffer = gpu.upload("boxes", &boxes).unwrap();
    let point_buffer = gpu.upload("points", &points).unwrap();
    let found = gpu.buffer::<[u32; 2]>("found", points.len()).unwrap();
    let spirv = include_bytes!("../shaders/near.spv");
    let near = gpu.pass("near", spirv, &[], None).unwrap();

    // Two structures of at most 1500 boxes with their own masks, built twice with differing counts.
    let blas = [(); 2].map(|_| gpu.box_blas("photon boxes", 1500).unwrap());
    let tlas = gpu.tlas("photon maps", 2).unwrap();
    for (counts, mask) in [
        ([1000, 1000], 3),
        ([1000, 0], 3),
        ([0, 700], 3),
        ([1000, 1000], 2),
    ] {
        let mut commands = gpu.commands().unwrap();
        commands.build_boxes(&blas[0], box_buffer.ptr(), counts[0]);
        commands.build_boxes(&blas[1], box_buffer.ptr().offset(1000), counts[1]);
        let places = [
            instance(blas[0].address(), 0, 1),
            instance(blas[1].address(), 1, 2),
        ];
        commands.build_tlas(&tlas, &places);
        let push = NearPush {
            tlas: tlas.address(),
            points: point_buffer.ptr(),
            boxes: box_buffer.ptr(),
            found: found.ptr(),
            count: points.len() as u32,
            mask,
        };
        commands.dispatch(&near, &push, points.len());
        let timings = commands.submit().unwrap();
        let labels: Vec<_> = timings.iter().map(|(label, _)| *label).collect();
        assert_eq!(
            labels,
            ["photon boxes", "photon boxes", "photon maps", "near"]
        );

        let there = |index: usize| match index {
            0..1000 => index < counts[0] && mask & 1 != 0,
            _ => index - 1000 < counts[1] && mask & 2 != 0,
        };
        let expected: Vec<[u32; 2]> = points
            .iter()
            .map(|p| {
                let holds = |b: &[f32; 6]| (0..3).all(|k| b[k] <= p[k] && p[k] <= b[k + 3]);
                let around = boxes
                    .iter()
                    .enumerate()
                    .filter(|(i, b)| there(*i) && holds(b));
                around.fold([0, 0], |[n, sum], (i, _)| [n + 1, sum + i as u32])
            })
            .collect();
        assert!(expected.iter().any(|found| found[0] > 1));
        assert_eq!(gpu.read(&found, 0..points.len()).unwrap(), expected);
    }
    let mut commands = gpu.commands().unwrap();
    commands.build_boxes(&blas[0], box_buffer.ptr(), 1501);
    assert!(
        commands
            .submit()
            .unwrap_err()
            .to_string()
            .contains("holds 1500")
    );
    assert!(gpu.box_blas("photons", usize::MAX).is_err());
    assert_valid(&gpu);
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct ClosestPush {
    tlas: u64,
    rays: Ptr<[[f32; 3]; 2]>,
    hits: Ptr<Hit>,
    count: u32,
    first: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Hit {
    t: f32,
    triangle: i32,
}

/// Möller and Trumbore 1997, in double precision; the distance of a hit.
fn intersect([origin, direction]: [[f32; 3]; 2], triangle: &[[f32; 3]]) -> Option<f64> {
    use glam::DVec3;
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let (o, d) = (vector(origin), vector(direction));
    let a = vector(triangle[0]);
    let (ab, ac) = (vector(triangle[1]) - a, vector(triangle[2]) - a);
    let inverse = ab.dot(d.cross(ac)).recip();
    let u = (o - a).dot(d.cross(ac)) * inverse;
    let v = d.dot((o - a).cross(ab)) * inverse;
    let t = ac.dot((o - a).cross(ab)) * inverse;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

#[test]
fn ray_query_finds_the_closest_triangle() {
    let Some(gpu) = open_with_ray_query() else {
        return;
    };
    let mut state = 2;
    let mut point = || [0; 3].map(|_| random(&mut state));
    // 300 small triangles, two geometries: opaque ones and ones that stop as candidates.
    let positions: Vec<[f32; 3]> = (0..300)
        .flat_map(|_| {
            let [x, y, z] = point();
            [(); 3].map(|_| {
                let [a, b, c] = point();
                [x + 0.3 * a, y + 0.3 * b, z + 0.3 * c]
            })
        })
        .collect();
    let rays: Vec<[[f32; 3]; 2]> = (0..2000)
        .map(|_| [point(), point().map(|x| x - 0.5)])
        .collect();
    let position_buffer = gpu.upload("positions", &positions).unwrap();
    let ray_buffer = gpu.upload("rays", &rays).unwrap();
    let hits = gpu.buffer::<Hit>("hits", rays.len()).unwrap();
    let geometry = |first_triangle, triangles, opaque| TriangleGeometry {
        positions: position_buffer.ptr(),
        first_triangle,
        triangles,
        opaque,
    };
    let geometries = [geometry(0, 100, true), geometry(100, 200, false)];
    let blas = gpu.triangle_blas("triangles", &geometries).unwrap();
    let empty = gpu
        .triangle_blas("nothing", &[geometry(0, 0, true)])
        .unwrap();
    let tlas = gpu.tlas("scene", 2).unwrap();
    let spirv = include_bytes!("../shaders/closest.spv");
    let closest = gpu.pass("closest", spirv, &[], None).unwrap();
    let mut commands = gpu.commands().unwrap();
    let places = [
        instance(blas.address(), 0, 0xff),
        instance(empty.address(), 1, 0xff),
    ];
    commands.build_tlas(&tlas, &places);
    let push = ClosestPush {
        tlas: tlas.address(),
        rays: ray_buffer.ptr(),
        hits: hits.ptr(),
        count: rays.len() as u32,
        first: 100,
    };
    commands.dispatch(&closest, &push, rays.len());
    commands.submit().unwrap();

    let (mut hit, mut unlike) = (0, 0);
    for (Hit { t, triangle }, ray) in gpu
        .read(&hits, 0..rays.len())
        .unwrap()
        .into_iter()
        .zip(&rays)
    {
        let found = positions
            .chunks(3)
            .enumerate()
            .filter_map(|(i, triangle)| Some((intersect(*ray, triangle)?, i)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        hit += i32::from(found.is_some());
        unlike += i32::from(match found {
            Some((expected, i)) => {
                triangle != i as i32 || (f64::from(t) / expected - 1.0).abs() > 1e-3
            }
            None => triangle != -1,
        });
    }
    // A ray through an edge may go either way.
    assert!(hit > 500 && unlike <= 2, "{unlike} of {hit} hits differ");
    assert_valid(&gpu);
}
