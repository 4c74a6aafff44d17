//! Rooms whose lamps send most of their light where no eye sees it.

use glam::{DVec3, dvec2, dvec3};

use super::glb::Glb;
use super::material::{BLACK, GREEN, RED, WHITE, WIDE, WOOD, dielectric, diffuse, light};
use super::shape::{Shape, rounded};

/// A dark room beside a bright one; the door between them is a hand open.
pub fn door_ajar() -> Vec<u8> {
    let mut glb = Glb::default();
    let plaster = glb.material(diffuse("plaster", WHITE));
    let oak = glb.material(diffuse("oak", WOOD));
    let red = glb.material(diffuse("red", RED));
    let green = glb.material(diffuse("green", GREEN));
    let lamp = glb.material(light("lamp", BLACK, [1000.0, 920.0, 780.0]));

    let bright = [dvec3(-3.6, 0.0, -2.0), dvec3(-0.12, 2.6, 2.0)];
    let dark = [dvec3(0.0, 0.0, -2.0), dvec3(3.2, 2.6, 2.0)];
    let doorway = [dvec3(-0.2, 0.0, -0.45), dvec3(0.1, 2.05, 0.45)];
    let (low, high) = (bright[0] - 0.2, dark[1] + 0.2);
    let house = Shape::default().carved(low, high, &[bright, dark, doorway]);
    glb.put("house", &house, plaster);
    let boards = Shape::default().cuboid(low + 0.1, dvec3(3.3, 0.005, 2.1), 1.0);
    glb.put("boards", &boards, oak);
    // Hung on the dark side, 5 mm clear of floor and frame; its free edge has come 0.1 m out.
    let (width, height, gap) = (0.89, 2.035, 0.1_f64);
    let (sin, cos) = (gap / width).asin().sin_cos();
    let leaf = Shape::default().block(
        dvec3(0.0, 0.01, -0.445),
        [
            dvec3(sin, 0.0, cos) * width,
            DVec3::Y * height,
            dvec3(-cos, 0.0, sin) * 0.04,
        ],
        1.0,
    );
    glb.put("door", &leaf, red);
    let panel = Shape::default().quad(dvec3(-2.0, 2.59, -1.3), DVec3::X * 0.6, DVec3::Z * 0.6);
    glb.put("lamp", &panel, lamp);
    let furniture = Shape::default()
        .table(dvec3(1.9, 0.006, 1.1), dvec3(2.7, 0.75, 1.9), 0.06)
        .cuboid(dvec3(0.3, 0.006, 1.4), dvec3(0.8, 0.5, 1.9), 1.0);
    glb.put("table, chest", &furniture, green);
    glb.camera(dvec3(3.0, 1.6, -1.8), dvec3(0.6, 0.95, 0.8), 0.95, WIDE);
    glb.finish()
}

/// A table lamp under an opaque shade, open above and below, and a glass ball in its light.
pub fn lamp_shade() -> Vec<u8> {
    let mut glb = Glb::default();
    let plaster = glb.material(diffuse("plaster", WHITE));
    let oak = glb.material(diffuse("oak", WOOD));
    let brass = glb.material(diffuse("foot", [0.5, 0.4, 0.2]));
    let cloth = glb.material(diffuse("shade", [0.65, 0.2, 0.12]));
    let glass = glb.material(dielectric("glass", 1.5));
    let bulb = glb.material(light("bulb", BLACK, [22000.0, 18500.0, 13000.0]));

    let room = Shape::default().cuboid(dvec3(-2.0, -0.75, -1.2), dvec3(2.0, 1.85, 2.5), -1.0);
    glb.put("room", &room, plaster);
    let table = Shape::default().table(dvec3(-0.9, -0.749, -0.6), dvec3(0.9, 0.0, 0.6), 0.05);
    glb.put("table", &table, oak);
    let foot = [
        (dvec2(0.0, 0.001), 0.0),
        (dvec2(0.08, 0.001), 0.004),
        (dvec2(0.08, 0.015), 0.004),
        (dvec2(0.012, 0.03), 0.01),
        (dvec2(0.012, 0.29), 0.002),
        (dvec2(0.0, 0.29), 0.0),
    ];
    glb.put("foot", &Shape::lathe(&rounded(&foot, 2), 32), brass);
    let sheet = rounded(&[(dvec2(0.18, 0.24), 0.0), (dvec2(0.11, 0.46), 0.0)], 1);
    glb.put("shade", &Shape::lathe(&sheet, 48), cloth);
    let sphere = glb.geometry(&Shape::sphere(2));
    glb.place("bulb", sphere, bulb, 0.03, dvec3(0.0, 0.325, 0.0));
    let sphere = glb.geometry(&Shape::sphere(3));
    glb.place("ball", sphere, glass, 0.05, dvec3(0.2, 0.051, 0.22));
    glb.camera(dvec3(0.35, 0.55, 1.5), dvec3(0.08, 0.18, 0.0), 0.62, 1.0);
    glb.finish()
}

/// A room with one lamp and a glass ball. The hall next door, closed, has 49 lamps of three kinds,
/// each as bright or brighter; they burn or are not there.
pub fn fifty_lamps(others: bool) -> Vec<u8> {
    let mut glb = Glb::default();
    let plaster = glb.material(diffuse("plaster", WHITE));
    let oak = glb.material(diffuse("oak", WOOD));
    let blue = glb.material(diffuse("blue", [0.2, 0.3, 0.55]));
    let glass = glb.material(dielectric("glass", 1.5));
    let lamp = glb.material(light("lamp", BLACK, [16000.0, 14500.0, 11000.0]));

    let room = [dvec3(-1.5, 0.0, -1.5), dvec3(1.5, 2.5, 1.5)];
    let hall = [dvec3(1.7, 0.0, -7.0), dvec3(15.7, 2.5, 7.0)];
    let (low, high) = (dvec3(-1.7, -0.2, -7.2), dvec3(15.9, 2.7, 7.2));
    glb.put(
        "house",
        &Shape::default().carved(low, high, &[room, hall]),
        plaster,
    );
    let table = Shape::default().table(dvec3(-0.7, 0.001, -1.0), dvec3(0.6, 0.72, -0.2), 0.05);
    glb.put("table", &table, oak);
    let chest = Shape::default().cuboid(dvec3(0.8, 0.001, -1.45), dvec3(1.45, 1.1, -0.9), 1.0);
    glb.put("chest", &chest, blue);
    let sphere = glb.geometry(&Shape::sphere(3));
    glb.place("ball", sphere, glass, 0.1, dvec3(0.05, 0.821, -0.6));
    // 0.1 m × 0.1 m, facing down: 460 lm. The hall's lamps send 460 lm to 1000 lm each.
    let square = Shape::default().quad(dvec3(-0.05, 0.0, -0.05), DVec3::X * 0.1, DVec3::Z * 0.1);
    let square = glb.geometry(&square);
    glb.place("lamp", square, lamp, 1.0, dvec3(-0.75, 1.75, -1.2));
    for n in (0..49_u16).filter(|_| others) {
        let position = dvec3(
            f64::from(n % 7) * 2.0 + 2.7,
            2.3,
            f64::from(n / 7) * 2.0 - 6.0,
        );
        match n % 3 {
            0 => glb.point(position, 80.0),
            1 => glb.spot(
                position,
                position + dvec3(0.3, -1.0, 0.2),
                700.0,
                [0.4, 0.6],
            ),
            _ => glb.place("lamp", square, lamp, 1.0, position),
        }
    }
    glb.camera(dvec3(0.4, 1.75, 0.9), dvec3(0.0, 0.75, -0.6), 0.72, 1.0);
    glb.finish()
}
