//! Meshes, flattened to world-space triangles, or stored once where they are shown often.

use std::collections::BTreeMap;

use glam::{BVec3, DAffine3, DMat3, DVec3, Vec3};
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked::Valid;
use gltf::json::{Mesh, Root, Value};

use super::asset::{Asset, Checked, get};
use super::instancing::{self, Places};
use super::node::{MAX_COORDINATE, Node};
use super::primitive::{self, Attributes, Triangles};
use super::tangent::unit;
use super::warnings::Warnings;
use super::{Material, Mesh as SceneMesh, Scene, Triangle, Vertex, normal};

/// A scene that lies more than so many of its own extents from the origin is moved there before its positions
/// become f32: each doubling costs them a bit of 24.
const FAR: f64 = 16.0;

/// See [`Scene::origin`]: by the bounds that the file claims, as only the precision hangs on them. The positions in the
/// file are f32, those in the world f64 until here.
pub(super) fn origin(root: &Root, nodes: &[Node]) -> DVec3 {
    let bounds_o: Vec<_> = root
        .meshes
        .iter()
        .map(|mesh| claimed_bounds(root, mesh))
        .collect();
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for node in nodes {
        let mesh = node.json.mesh.and_then(|mesh| bounds_o.get(mesh.value()));
        let Some(Some((low_o, high_o))) = mesh else {
            continue;
        };
        for corner in 0..8 {
            let corner = BVec3::new(corner & 1 != 0, corner & 2 != 0, corner & 4 != 0);
            let corner_o = DVec3::select(corner, *low_o, *high_o);
            let corner_w = node.world_from_node.transform_point3(corner_o);
            (low, high) = (low.min(corner_w), high.max(corner_w));
        }
    }
    let middle = (low + high) * 0.5;
    let far = middle.abs().max_element() > FAR * (high - low).max_element();
    if far && middle.is_finite() {
        middle
    } else {
        DVec3::ZERO
    }
}

fn claimed_bounds(root: &Root, mesh: &Mesh) -> Option<(DVec3, DVec3)> {
    let bounds = mesh.primitives.iter().filter_map(|primitive| {
        let index = primitive.attributes.get(&Valid(Semantic::Positions))?;
        let accessor = root.accessors.get(index.value())?;
        if accessor.normalized {
            return Some((DVec3::NEG_ONE, DVec3::ONE));
        }
        let corner = |claim: &Option<Value>| {
            let claim = claim.as_ref()?.as_array()?;
            let number = |i: usize| claim.get(i)?.as_f64();
            Some(DVec3::new(number(0)?, number(1)?, number(2)?))
        };
        Some((corner(&accessor.min)?, corner(&accessor.max)?))
    });
    bounds.reduce(|(low, high), (a, b)| (low.min(a), high.max(b)))
}

/// Appends the triangles of every mesh that the nodes show, mesh by mesh.
pub(super) fn add_meshes<'a>(
    asset: &Asset<'a>,
    nodes: &[Node<'a>],
    scene: &mut Scene,
    warnings: &mut Warnings,
) -> Checked<()> {
    let mut instances: BTreeMap<usize, (&Mesh, Places)> = BTreeMap::new();
    for node in nodes {
        let path = &node.path;
        if let Some(index) = node.json.mesh {
            let mesh = get(asset.root, index, format_args!("{path}/mesh"))?;
            let entry = instances.entry(index.value());
            let places = instancing::places(asset, node, warnings)?.into_iter();
            let (_, all) = entry.or_insert((mesh, Vec::new()));
            all.extend(places.map(|place| (path.as_str(), place)));
            if node.json.skin.is_some() {
                let what = "skins are not supported: the mesh as it is bound";
                warnings.add(format_args!("{path}/skin"), what);
            }
        }
    }
    // The whole bill before the first triangle is read.
    let mut meshes = Vec::new();
    for (i, (mesh, places)) in instances {
        let mut primitives = Vec::new();
        for (j, json) in mesh.primitives.iter().enumerate() {
            let path = format!("/meshes/{i}/primitives/{j}");
            if let Some(index) = json.material {
                get(asset.root, index, format_args!("{path}/material"))?;
            }
            if let Some(attributes) = Attributes::open(asset, json, &path, warnings)? {
                let material = json.material.map(|index| index.value());
                primitives.push((path, attributes, material));
            }
        }
        // Each place of a lamp is a lamp of its own.
        let shines = |material: &Option<usize>| {
            let material = material.and_then(|i| scene.materials.get(i));
            material.is_some_and(|m| m.emission != Vec3::ZERO)
        };
        let dark = primitives.iter().filter(|(_, _, m)| !shines(m));
        let corners: usize = dark.map(|(_, attributes, _)| attributes.corners()).sum();
        let mut once = places.clone();
        let often = instancing::take_instances(&mut once, corners / 3);
        for (path, attributes, material) in &primitives {
            let corners = attributes.corners() as u64;
            let copies = match shines(material) {
                true => places.len(),
                false => once.len() + often.len(),
            };
            asset.charge(corners.saturating_mul(copies as u64), path)?;
        }
        meshes.push((primitives, places, once, often));
    }
    let named = scene.materials.len() as u32;
    for (primitives, places, once, often) in meshes {
        let mut stored: Vec<_> = often.iter().map(Stored::new).collect();
        for (path, attributes, material) in primitives {
            let primitive =
                primitive::read(&attributes, material, &path, &scene.materials, warnings)?;
            // The default material comes last, and only where something needs it.
            let material = material.map_or(named, |i| i as u32);
            if material == named && scene.materials.len() as u32 == named {
                scene.materials.push(Material::default());
            }
            let shines = scene.materials[material as usize].emission != Vec3::ZERO;
            let once = if shines { &places } else { &once };
            for (node, place) in once {
                let (vertices, triangles) = (&mut scene.vertices, &mut scene.triangles);
                add(&primitive, material, place, vertices, triangles)
                    .map_err(|fault| format!("{node}: {fault}"))?;
            }
            if !shines {
                for stored in &mut stored {
                    stored.add(&primitive, material)?;
                }
            }
        }
        for stored in stored {
            scene.meshes.extend(stored.finish()?);
        }
    }
    Ok(())
}

/// A mesh that is stored once, under way.
struct Stored<'a> {
    places: &'a Places<'a>,
    /// As its first place has it, about its first vertex: metres, and small numbers.
    mesh_from_object: Option<DAffine3>,
    mesh: SceneMesh,
}

impl<'a> Stored<'a> {
    fn new(places: &'a Places<'a>) -> Self {
        Self {
            places,
            mesh_from_object: None,
            mesh: SceneMesh::default(),
        }
    }

    fn add(&mut self, primitive: &Triangles, material: u32) -> Checked<()> {
        let (Some((node, first)), Some(vertex)) = (self.places.first(), primitive.vertices.first())
        else {
            return Ok(());
        };
        let place = *self.mesh_from_object.get_or_insert_with(|| {
            let middle_o = vertex.position_o.as_dvec3();
            DAffine3 {
                matrix3: first.matrix3,
                translation: -first.transform_vector3(middle_o),
            }
        });
        let mesh = &mut self.mesh;
        add(
            primitive,
            material,
            &place,
            &mut mesh.vertices,
            &mut mesh.triangles,
        )
        .map_err(|fault| format!("{node}: {fault}"))
    }

    /// `None` where nothing of it has an area.
    fn finish(mut self) -> Checked<Option<SceneMesh>> {
        let Some(mesh_from_object) = self.mesh_from_object else {
            return Ok(None);
        };
        if self.mesh.triangles.is_empty() {
            return Ok(None);
        }
        let object_from_mesh = mesh_from_object.inverse();
        let bounds = self.mesh.bounds();
        for (node, world_from_object) in self.places {
            let place = (*world_from_object * object_from_mesh).as_affine3a();
            let (low, high) = super::moved(bounds, &place);
            let inside = f64::from(low.abs().max(high.abs()).max_element()) <= MAX_COORDINATE;
            if !inside {
                return Err(format!("{node}: a vertex is beyond {MAX_COORDINATE:e} m"));
            }
            self.mesh.places.push(place);
        }
        Ok(Some(self.mesh))
    }
}

/// Appends a primitive as it stands at a place.
fn add(
    primitive: &Triangles,
    material: u32,
    world_from_object: &DAffine3,
    vertices: &mut Vec<Vertex>,
    triangles: &mut Vec<Triangle>,
) -> Checked<()> {
    let matrix = world_from_object.matrix3;
    let mirrored = matrix.determinant() < 0.0;
    let sign = if mirrored { -1.0 } else { 1.0 };
    let normals = cofactor(&matrix) * sign;
    let first = vertices.len();
    for vertex in &primitive.vertices {
        let position = world_from_object.transform_point3(vertex.position_o.as_dvec3());
        let inside = position.abs().max_element() <= MAX_COORDINATE;
        if !inside {
            return Err(format!("a vertex is beyond {MAX_COORDINATE:e} m"));
        }
        let normal = (normals * vertex.normal_o.as_dvec3()).try_normalize();
        let normal_w = normal.map_or(Vec3::ZERO, DVec3::as_vec3);
        let mut tangent_w = vertex.tangent_o;
        if tangent_w.w != 0.0 {
            let tangent = (matrix * tangent_w.truncate().as_dvec3()).try_normalize();
            let tangent = tangent.map_or(Vec3::ZERO, DVec3::as_vec3);
            tangent_w = unit(tangent, normal_w).extend(tangent_w.w * sign as f32);
        }
        vertices.push(Vertex {
            position_w: position.as_vec3(),
            normal_w,
            tangent_w,
            uv: vertex.uv,
            color: vertex.color,
        });
    }
    for &[a, b, c] in &primitive.triangles {
        let triangle = if mirrored { [a, c, b] } else { [a, b, c] };
        let triangle = triangle.map(|i| first as u32 + i);
        let corners = triangle.map(|i| vertices[i as usize].position_w);
        if !has_area(corners) {
            continue;
        }
        for i in triangle {
            let vertex = &mut vertices[i as usize];
            // A node that flattens its mesh can flatten normals away.
            if vertex.normal_w == Vec3::ZERO
                && let Some(normal) = normal::face_normal(corners)
            {
                vertex.normal_w = normal;
                if vertex.tangent_w.w != 0.0 {
                    let tangent = normal.any_orthonormal_vector();
                    vertex.tangent_w = tangent.extend(vertex.tangent_w.w);
                }
            }
        }
        triangles.push(Triangle {
            vertices: triangle,
            material,
        });
    }
    Ok(())
}

/// det(M) M⁻ᵀ: what M does to normals (cross products), also where M has no inverse.
fn cofactor(matrix: &DMat3) -> DMat3 {
    // Only directions matter: without the scale, products of three tiny numbers stay above zero.
    let scale = matrix
        .to_cols_array()
        .into_iter()
        .fold(0.0, |max: f64, x| max.max(x.abs()));
    let m = *matrix * (1.0 / scale);
    DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    )
}

/// Whether the normal of the triangle can be had in f32, where the renderer needs it: an area of
/// about 5e-20 m² is the least.
fn has_area([a, b, c]: [Vec3; 3]) -> bool {
    (b - a).cross(c - a).length_squared().is_normal()
}
