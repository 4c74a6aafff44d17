//! The scenes. Metres, y up, radiance in nit, intensity in candela.

use glam::{DVec3, dvec2, dvec3};

use super::glb::Glb;
use super::material::{BLACK, GREEN, RED, WHITE, WIDE, dielectric, diffuse, light, metal};
use super::shape::{Shape, rounded, waves};

/// A 2 m box with a mirror sphere and a glass sphere under an area light.
pub fn cornell() -> Vec<u8> {
    let mut glb = Glb::default();
    let white = glb.material(diffuse("white", WHITE));
    let red = glb.material(diffuse("red", RED));
    let green = glb.material(diffuse("green", GREEN));
    let mirror = glb.material(metal("mirror", [0.95, 0.95, 0.95]));
    let glass = glb.material(dielectric("glass", 1.5));
    let lamp = glb.material(light("lamp", BLACK, [18.0, 15.5, 11.5]));

    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0);
    let corner = dvec3(-1.0, 0.0, -1.0);
    let shell = Shape::default()
        .quad(corner, z, x)
        .quad(corner + y, x, z)
        .quad(corner, x, y);
    glb.put("floor, ceiling, back", &shell, white);
    glb.put("left", &Shape::default().quad(corner, y, z), red);
    glb.put("right", &Shape::default().quad(corner + x, z, y), green);
    let ceiling = dvec3(-0.25, 1.99, -0.25);
    let panel = Shape::default().quad(ceiling, DVec3::X * 0.5, DVec3::Z * 0.5);
    glb.put("lamp", &panel, lamp);
    let sphere = glb.geometry(&Shape::sphere(5));
    glb.place(
        "mirror sphere",
        sphere,
        mirror,
        0.4,
        dvec3(-0.42, 0.4, -0.4),
    );
    glb.place("glass sphere", sphere, glass, 0.4, dvec3(0.45, 0.4, 0.3));
    glb.camera(dvec3(0.0, 1.0, 4.35), dvec3(0.0, 1.0, 0.0), 0.62, 1.0);
    glb.finish()
}

/// A golden bracelet on a table under a spot light: the cusp inside it is the classic caustic.
pub fn ring_caustic() -> Vec<u8> {
    let mut glb = Glb::default();
    let table = glb.material(diffuse("table", [0.7, 0.7, 0.7]));
    let gold = glb.material(metal("gold", [1.0, 0.77, 0.34]));
    let plane = Shape::default().quad(dvec3(-1.0, 0.0, -1.0), DVec3::Z * 2.0, DVec3::X * 2.0);
    glb.put("table", &plane, table);
    glb.put("ring", &ring(), gold);
    glb.spot(dvec3(-0.72, 0.41, -0.36), DVec3::ZERO, 2.8, [0.24, 0.34]);
    glb.camera(dvec3(0.0, 0.42, 0.3), dvec3(0.0, 0.01, 0.0), 0.55, WIDE);
    glb.finish()
}

/// Inner radius 10 cm, 5 cm high, lifted by 0.1 mm so that nothing touches.
pub fn ring() -> Shape {
    let (inner, outer, low, high, round) = (0.1, 0.106, 0.0001, 0.05, 0.002);
    let start = dvec2(inner, (low + high) / 2.0);
    let corners = [
        (start, 0.0),
        (dvec2(inner, low), round),
        (dvec2(outer, low), round),
        (dvec2(outer, high), round),
        (dvec2(inner, high), round),
        (start, 0.0),
    ];
    Shape::lathe(&rounded(&corners, 4), 256)
}

/// A basin of water: the caustics on its floor are seen through the surface.
pub fn water_basin() -> Vec<u8> {
    let mut glb = Glb::default();
    let ground = glb.material(diffuse("ground", [0.5, 0.48, 0.45]));
    let tiles = glb.material(diffuse("tiles", [0.55, 0.75, 0.8]));
    let water_ = glb.material(dielectric("water", 1.33));
    let lamp = glb.material(light("lamp", BLACK, [900.0, 860.0, 780.0]));

    let plane = Shape::default().quad(dvec3(-3.0, 0.0, -3.0), DVec3::Z * 6.0, DVec3::X * 6.0);
    glb.put("ground", &plane, ground);
    // Walls 6 cm thick around 1 m × 0.7 m × 0.4 m; the floor lies 2 cm above the ground. They abut:
    // where faces coincide, it is chance which one a ray meets.
    let wall = |low, high| Shape::default().cuboid(low, high, 1.0);
    let top = 0.42;
    for (name, low, high) in [
        ("floor", dvec3(-0.5, 0.005, -0.35), dvec3(0.5, 0.02, 0.35)),
        ("back", dvec3(-0.5, 0.005, -0.41), dvec3(0.5, top, -0.35)),
        ("front", dvec3(-0.5, 0.005, 0.35), dvec3(0.5, top, 0.41)),
        ("left", dvec3(-0.56, 0.005, -0.41), dvec3(-0.5, top, 0.41)),
        ("right", dvec3(0.5, 0.005, -0.41), dvec3(0.56, top, 0.41)),
    ] {
        glb.put(name, &wall(low, high), tiles);
    }
    glb.put("water", &water(), water_);
    let corner = dvec3(0.25, 1.6, -0.3);
    let panel = Shape::default().quad(corner, DVec3::X * 0.08, DVec3::Z * 0.08);
    glb.put("lamp", &panel, lamp);
    glb.camera(dvec3(0.0, 1.35, 1.15), dvec3(0.0, 0.18, 0.02), 0.6, WIDE);
    glb.finish()
}

/// Its sides and bottom end inside the basin's walls: no gap of air, no coincident faces.
pub fn water() -> Shape {
    let height = waves(
        0.33,
        [
            (dvec2(0.8, 0.6), 0.21, 0.0042, 0.3),
            (dvec2(-0.5, 0.87), 0.17, 0.0032, 1.9),
            (dvec2(0.95, -0.3), 0.13, 0.0019, 4.1),
            (dvec2(0.1, 1.0), 0.27, 0.0045, 2.6),
        ],
    );
    Shape::water(
        dvec2(-0.53, -0.38),
        dvec2(0.53, 0.38),
        0.012,
        [88, 64],
        height,
    )
}

/// A tumbler and a ball before a mirror. A card hides their caustics from the camera: only the
/// mirror shows them.
pub fn glass_mirror() -> Vec<u8> {
    let mut glb = Glb::default();
    let plaster = glb.material(diffuse("plaster", WHITE));
    let wood = glb.material(diffuse("table", [0.55, 0.42, 0.3]));
    let paper = glb.material(diffuse("card", [0.2, 0.35, 0.6]));
    let silver = glb.material(metal("mirror", [0.95, 0.95, 0.95]));
    let glass = glb.material(dielectric("glass", 1.5));
    let lamp = glb.material(light("lamp", BLACK, [1100.0, 950.0, 700.0]));

    let room = Shape::default().cuboid(dvec3(-1.2, -0.01, -0.6), dvec3(1.2, 1.5, 1.8), -1.0);
    glb.put("room", &room, plaster);
    let top = Shape::default().quad(dvec3(-1.0, 0.0, -0.58), DVec3::Z * 1.5, DVec3::X * 2.0);
    glb.put("table", &top, wood);
    let sheet = Shape::default().quad(dvec3(-0.45, 0.002, -0.5), DVec3::X * 0.9, DVec3::Y * 0.5);
    glb.put("mirror", &sheet, silver);
    let card = Shape::default().cuboid(dvec3(-0.3, 0.001, 0.25), dvec3(0.3, 0.2, 0.255), 1.0);
    glb.put("card", &card, paper);
    glb.put("tumbler", &tumbler(), glass);
    let ball = glb.geometry(&Shape::sphere(4));
    glb.place("ball", ball, glass, 0.04, dvec3(-0.11, 0.0401, -0.06));
    // 5 cm wide, turned towards the glass from the side, out of sight.
    let position = dvec3(0.45, 0.45, -0.2);
    let forward = (dvec3(-0.05, 0.05, 0.0) - position).normalize();
    let side = forward.cross(DVec3::Y).normalize() * 0.05;
    let up = side.cross(forward);
    let panel = Shape::default().quad(position - (side + up) / 2.0, up, side);
    glb.put("lamp", &panel, lamp);
    glb.camera(dvec3(0.0, 0.5, 1.4), dvec3(0.0, 0.07, -1.0), 0.26, 1.0);
    glb.finish()
}

/// 8 cm wide, 11 cm high, heavy: a 3.5 cm base, lifted by 0.1 mm so that nothing touches.
pub fn tumbler() -> Shape {
    let low = 0.0001;
    let corners = [
        (dvec2(0.0, low), 0.0),
        (dvec2(0.036, low), 0.006),
        (dvec2(0.04, 0.11), 0.0015),
        (dvec2(0.036, 0.11), 0.0015),
        (dvec2(0.0315, 0.035), 0.012),
        (dvec2(0.0, 0.035), 0.0),
    ];
    Shape::lathe(&rounded(&corners, 6), 160)
}

/// A closed diffuse room with two blocks: nothing here is specular.
pub fn room() -> Vec<u8> {
    let mut glb = Glb::default();
    let white = glb.material(diffuse("white", WHITE));
    let red = glb.material(diffuse("red", RED));
    let green = glb.material(diffuse("green", GREEN));
    let lamp = glb.material(light("lamp", BLACK, [13.0, 12.0, 10.0]));

    let (x, y, z) = (DVec3::X * 4.0, DVec3::Y * 2.6, DVec3::Z * 5.0);
    let corner = dvec3(-2.0, 0.0, -2.5);
    let shell = Shape::default()
        .quad(corner, z, x)
        .quad(corner + y, x, z)
        .quad(corner, x, y)
        .quad(corner + z, y, x);
    glb.put("floor, ceiling, back, front", &shell, white);
    glb.put("left", &Shape::default().quad(corner, y, z), red);
    glb.put("right", &Shape::default().quad(corner + x, z, y), green);
    let blocks = Shape::default()
        .cuboid(dvec3(-1.3, 0.001, -1.6), dvec3(-0.4, 1.5, -0.8), 1.0)
        .cuboid(dvec3(0.3, 0.001, -0.6), dvec3(1.1, 0.7, 0.2), 1.0);
    glb.put("blocks", &blocks, white);
    let ceiling = dvec3(-0.5, 2.59, -0.7);
    let panel = Shape::default().quad(ceiling, DVec3::X, DVec3::Z * 0.8);
    glb.put("lamp", &panel, lamp);
    glb.camera(dvec3(0.0, 1.3, 2.4), dvec3(0.0, 1.15, -1.0), 0.8, WIDE);
    glb.finish()
}

/// Albedo ½ and emission ½ everywhere: radiance is ½ / (1 − ½) = 1 in every direction.
pub fn furnace() -> Vec<u8> {
    let mut glb = Glb::default();
    let wall = glb.material(light("wall", [0.5; 3], [0.5; 3]));
    let shape = Shape::default().cuboid(DVec3::NEG_ONE, DVec3::ONE, -1.0);
    glb.put("furnace", &shape, wall);
    glb.camera(dvec3(0.3, 0.1, 0.6), dvec3(-0.2, -0.1, -1.0), 1.2, 1.0);
    glb.finish()
}
