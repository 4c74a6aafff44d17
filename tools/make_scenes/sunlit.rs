//! Scenes under a sun: most of its light falls where no eye sees it. Illuminance in lux.

use glam::{DVec3, dvec2, dvec3};

use super::glb::Glb;
use super::material::{WHITE, WIDE, WOOD, dielectric, diffuse};
use super::shape::{Shape, waves};

/// What a sun brings to a surface that faces it.
const SUN: f64 = 100.0;
const EARTH: [f64; 3] = [0.42, 0.4, 0.34];

/// A glass ball just above a ground that reaches `half` metres to each side. Whatever that is, the
/// picture is the same but for what is seen in the ball; the share of photons that meet it is not.
/// Eight towers of a `height` stand at the ground's edge; none where it is 0.
pub fn ball(half: f64, height: f64) -> Vec<u8> {
    let mut glb = Glb::default();
    let gray = glb.material(diffuse("ground", [0.5; 3]));
    let glass = glb.material(dielectric("glass", 1.5));

    glb.put("ground", &ground(half), gray);
    if height > 0.0 {
        let size = dvec3(0.1 * half, height, 0.1 * half);
        let tower = Shape::default().cuboid(
            -size * dvec3(0.5, 0.01, 0.5),
            size * dvec3(0.5, 1.0, 0.5),
            1.0,
        );
        let tower = glb.geometry(&tower);
        for n in (0..9).filter(|&n| n != 4) {
            let side = dvec3(f64::from(n % 3 - 1), 0.0, f64::from(n / 3 - 1));
            glb.place("tower", tower, gray, 1.0, side * 0.95 * half);
        }
    }
    let sphere = glb.geometry(&Shape::sphere(3));
    glb.place("ball", sphere, glass, 0.1, dvec3(0.0, 0.14, 0.0));
    glb.sun(dvec3(0.8, -1.0, 0.15), SUN);
    glb.camera(dvec3(0.0, 0.62, 0.5), dvec3(0.06, 0.06, 0.0), 0.62, 1.0);
    glb.finish()
}

/// A room whose only light is the sun between the slats of a blind.
pub fn blinds() -> Vec<u8> {
    let mut glb = Glb::default();
    let plaster = glb.material(diffuse("plaster", WHITE));
    let earth = glb.material(diffuse("earth", EARTH));
    let oak = glb.material(diffuse("oak", WOOD));
    let cloth = glb.material(diffuse("cloth", [0.15, 0.3, 0.5]));

    glb.put("ground", &ground(50.0), earth);
    let (low, high) = (dvec3(-2.0, 0.2, -2.5), dvec3(2.0, 2.8, 2.5));
    let window = [dvec3(-2.5, 1.0, -1.7), dvec3(-1.9, 2.5, 0.1)];
    let house = Shape::default().carved(low - 0.3, high + 0.3, &[[low, high], window]);
    glb.put("house", &house, plaster);
    // Its rim ends inside the walls, so that no light comes in below them.
    let boards = Shape::default().cuboid(low - 0.1, dvec3(2.1, 0.21, 2.6), 1.0);
    glb.put("boards", &boards, oak);
    // Inside the opening: 2 mm thick, 6 cm deep, the outer edge lower.
    let mut slats = Shape::default();
    for slat in 0..15 {
        let corner = dvec3(-2.18, 1.045 + 0.1 * f64::from(slat), -1.69);
        let depth = dvec3(0.058, 0.016, 0.0);
        let thickness = DVec3::Z.cross(depth).normalize() * 0.002;
        slats = slats.block(corner, [depth, thickness, DVec3::Z * 1.78], 1.0);
    }
    glb.put("slats", &slats, plaster);
    let furniture = Shape::default()
        .table(dvec3(0.7, 0.211, -1.3), dvec3(1.5, 0.95, 0.3), 0.05)
        .cuboid(dvec3(0.9, 0.211, -2.49), dvec3(1.9, 2.1, -2.0), 1.0);
    glb.put("table, cupboard", &furniture, oak);
    let bed = Shape::default()
        .cuboid(dvec3(-1.95, 0.211, -2.45), dvec3(0.0, 0.6, -1.6), 1.0)
        .cuboid(dvec3(-1.9, 0.601, -2.4), dvec3(-1.5, 0.72, -1.65), 1.0);
    glb.put("bed", &bed, cloth);
    glb.sun(dvec3(1.0, -0.68, -0.35), SUN);
    glb.camera(dvec3(1.2, 1.7, 2.4), dvec3(-0.3, 1.05, -1.2), 0.95, WIDE);
    glb.finish()
}

/// A small room on the fifth floor in a town of 398 other houses. The sky comes from the command
/// line.
pub fn town() -> Vec<u8> {
    let mut glb = Glb::default();
    let earth = glb.material(diffuse("street", [0.3; 3]));
    let plaster = glb.material(diffuse("plaster", WHITE));
    let oak = glb.material(diffuse("oak", WOOD));
    let houses = [
        (dvec3(11.0, 8.0, 13.0), [0.6, 0.52, 0.4]),
        (dvec3(14.0, 6.0, 10.0), [0.55, 0.3, 0.22]),
        (dvec3(9.0, 12.0, 9.0), [0.5; 3]),
        (dvec3(12.0, 10.0, 12.0), [0.62, 0.58, 0.5]),
        (dvec3(8.0, 14.0, 12.0), [0.35, 0.4, 0.45]),
    ]
    .map(|(size, albedo)| {
        let low = dvec3(-size.x / 2.0, -1.0, -size.z / 2.0);
        let house = Shape::default().cuboid(low, low + size + DVec3::Y, 1.0);
        (glb.geometry(&house), glb.material(diffuse("walls", albedo)))
    });

    glb.put("ground", &ground(200.0), earth);
    // Multiples of the golden ratio look like chance and are the same on every machine; what is
    // rounded to centimetres is short in the file.
    let chance = |n: f64| (n * 0.618034).fract();
    let round = |x: f64| (x * 100.0).round() / 100.0;
    for lot in 0..400_u16 {
        let n = f64::from(lot);
        let (x, z) = (
            f64::from(lot % 20) * 20.0 - 200.0,
            f64::from(lot / 20) * 20.0 - 200.0,
        );
        if x == 0.0 && (z == 0.0 || z == -20.0) {
            continue; // The house with the room, and a square before its window.
        }
        let (house, walls) = houses[(chance(n * 7.0) * 5.0) as usize];
        let aside = dvec3(
            chance(n * 3.0) * 4.0 - 2.0,
            0.0,
            chance(n * 5.0) * 4.0 - 2.0,
        );
        let position = (dvec3(x, 0.0, z) + aside).map(round);
        glb.place(
            "house",
            house,
            walls,
            round(0.8 + 0.4 * chance(n)),
            position,
        );
    }

    let (low, high) = (dvec3(-1.7, 13.0, -4.7), dvec3(1.7, 15.5, -0.4));
    let window = [dvec3(-1.0, 13.8, -5.1), dvec3(0.6, 15.2, -4.6)];
    let (corner, roof) = (dvec3(-5.0, -1.0, -5.0), dvec3(5.0, 16.0, 5.0));
    let own = Shape::default().carved(corner, roof, &[[low, high], window]);
    glb.put("own house", &own, plaster);
    let furniture = Shape::default()
        .cuboid(low - 0.1, dvec3(1.8, 13.01, -0.3), 1.0)
        .table(dvec3(-1.65, 13.011, -4.2), dvec3(-0.95, 13.74, -2.6), 0.05)
        .cuboid(dvec3(1.2, 13.011, -4.69), dvec3(1.69, 14.1, -3.7), 1.0);
    glb.put("boards, table, chest", &furniture, oak);
    glb.sun(dvec3(0.45, -0.6, 0.7), SUN);
    glb.camera(dvec3(-0.3, 14.7, -0.5), dvec3(0.1, 14.1, -4.7), 1.05, WIDE);
    glb.finish()
}

/// A swimming pool in a wide ground. The sky comes from the command line.
pub fn pool() -> Vec<u8> {
    let mut glb = Glb::default();
    let grass = glb.material(diffuse("grass", [0.22, 0.32, 0.12]));
    let stone = glb.material(diffuse("deck", [0.62, 0.56, 0.48]));
    let tiles = glb.material(diffuse("tiles", [0.4, 0.68, 0.75]));
    let water = glb.material(dielectric("water", 1.33));

    // 6 m × 3 m, 1.3 m deep: tiles 10 cm thick, set in a deck that is set in the ground.
    let pit = |margin: f64, bottom: f64| {
        let half = dvec3(3.0 + margin, 0.0, 1.5 + margin);
        [half * -1.0 + DVec3::Y * bottom, half + DVec3::Y * 0.2]
    };
    let [low, high] = [dvec3(-100.0, -2.0, -100.0), dvec3(100.0, 0.0, 100.0)];
    glb.put(
        "ground",
        &Shape::default().carved(low, high, &[pit(0.1, -1.4)]),
        grass,
    );
    let [low, high] = [dvec3(-5.0, -0.1, -3.2), dvec3(5.0, 0.05, 3.2)];
    glb.put(
        "deck",
        &Shape::default().carved(low, high, &[pit(0.1, -1.4)]),
        stone,
    );
    let [low, high] = pit(0.1, -1.4);
    let basin = Shape::default().carved(low, high.with_y(0.06), &[pit(0.0, -1.3)]);
    glb.put("basin", &basin, tiles);
    glb.put("water", &pool_water(), water);
    let bench = Shape::default().table(dvec3(-1.0, 0.051, -2.8), dvec3(1.0, 0.45, -2.3), 0.06);
    glb.put("bench", &bench, stone);
    glb.sun(dvec3(0.5, -1.0, 0.3), SUN);
    glb.camera(dvec3(1.6, 3.4, 6.2), dvec3(0.0, -0.5, 0.0), 0.85, WIDE);
    glb.finish()
}

/// Its sides and bottom end inside the tiles, as those of the water basin do.
pub fn pool_water() -> Shape {
    let height = waves(
        -0.1,
        [
            (dvec2(0.8, 0.6), 0.9, 0.016, 0.3),
            (dvec2(-0.5, 0.87), 0.7, 0.011, 1.9),
            (dvec2(0.95, -0.3), 0.6, 0.008, 4.1),
            (dvec2(0.1, 1.0), 1.3, 0.022, 2.6),
        ],
    );
    let rim = dvec2(3.05, 1.55);
    Shape::water(-rim, rim, -1.35, [52, 26], height)
}

/// At height 0, `half` metres to each side.
fn ground(half: f64) -> Shape {
    let corner = dvec3(-half, 0.0, -half);
    Shape::default().quad(corner, DVec3::Z * 2.0 * half, DVec3::X * 2.0 * half)
}
