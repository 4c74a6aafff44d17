//! Meshes that are shown many times: by EXT_mesh_gpu_instancing, or by many nodes.

use glam::{DAffine3, DMat3, DQuat, DVec3, DVec4};
use gltf::json::Index;
use gltf::json::accessor::ComponentType;

use super::accessor::Accessor;
use super::asset::{Asset, Checked};
use super::node::Node;
use super::warnings::Warnings;

/// Where a node shows its mesh: once, or where the extension says. Instances that are scaled to nothing are left out.
pub(super) fn places(
    asset: &Asset,
    node: &Node,
    warnings: &mut Warnings,
) -> Checked<Vec<DAffine3>> {
    const NAME: &str = "EXT_mesh_gpu_instancing";
    let extensions = node.json.extensions.as_ref();
    let Some(json) = extensions.and_then(|all| all.others.get(NAME)) else {
        return Ok(vec![node.world_from_node]);
    };
    let path = format!("{}/extensions/{NAME}/attributes", node.path);
    let mut open = |key: &str, components: usize| {
        let path = format!("{path}/{key}");
        let Some(index) = json.get("attributes").and_then(|all| all.get(key)) else {
            return Ok(None);
        };
        let index = index.as_u64().and_then(|i| u32::try_from(i).ok());
        let index = index.ok_or_else(|| format!("{path}: must be an index"))?;
        let accessor = Accessor::open(asset, Index::new(index), &path, warnings)?;
        if accessor.components != components || accessor.component == ComponentType::U32 {
            return Err(format!(
                "{path}: has a type that the extension does not allow"
            ));
        }
        Ok(Some(accessor))
    };
    let translation = open("TRANSLATION", 3)?;
    let rotation = open("ROTATION", 4)?;
    let scale = open("SCALE", 3)?;
    let mut counts = [&translation, &rotation, &scale].into_iter().flatten();
    let Some(count) = counts.next().map(|accessor| accessor.count) else {
        return Err(format!(
            "{path}: has none of TRANSLATION, ROTATION and SCALE"
        ));
    };
    if counts.any(|accessor| accessor.count != count) {
        return Err(format!("{path}: have different counts"));
    }
    asset.charge(count as u64, &path)?;

    let mut places = Vec::with_capacity(count);
    for i in 0..count {
        let vector = |accessor: &Option<Accessor>| {
            let vector = accessor.as_ref().map(|a| a.vector(i));
            vector.map(|v| DVec4::from(v.map(f64::from)))
        };
        let scale = vector(&scale).map_or(DVec3::ONE, DVec4::truncate);
        // One of length 0 is none, as for nodes.
        let rotation = vector(&rotation).and_then(DVec4::try_normalize);
        let rotation = rotation.map_or(DQuat::IDENTITY, DQuat::from_vec4);
        let translation = vector(&translation).map_or(DVec3::ZERO, DVec4::truncate);
        let node_from_instance =
            DAffine3::from_scale_rotation_translation(scale, rotation, translation);
        let place = node.world_from_node * node_from_instance;
        if !place.is_finite() {
            return Err(format!(
                "{path}: instance {i} has no place: a number is not finite"
            ));
        }
        if place.matrix3 != DMat3::ZERO {
            places.push(place);
        }
    }
    Ok(places)
}

/// A mesh is stored once where that spares so many triangles (about 30 MB), and those that a place costs: below, memory
/// is no matter, and rays find their way through one tree faster than through two (benches/README.md).
const SPARED_TRIANGLES: usize = 1 << 18;
const TRIANGLES_A_PLACE: usize = 16;
/// How much more a place may stretch a mesh in one direction than in another, so that positions in the mesh's space are as
/// exact as those in the world; and how much larger or smaller a place may be than the first.
const MAX_STRETCH: f64 = 10.0;
const MAX_SIZE: f64 = 100.0;

/// Where a mesh is shown, and the paths of the nodes that do.
pub(super) type Places<'a> = Vec<(&'a str, DAffine3)>;

/// Takes out of `places` those at which a mesh of so many triangles is worth being stored once: for each handedness, as
/// no place of a stored mesh mirrors.
pub(super) fn take_instances<'a>(places: &mut Places<'a>, triangles: usize) -> Vec<Places<'a>> {
    let mut taken = Vec::new();
    for sign in [1.0, -1.0] {
        // A mesh flattened by its place has no inverse: its norm is no number, or beyond all bounds.
        let candidate =
            |m: &DMat3| m.determinant() * sign > 0.0 && norm(m) * norm(&m.inverse()) <= MAX_STRETCH;
        let first = places.iter().find(|(_, place)| candidate(&place.matrix3));
        let Some(first) = first.map(|(_, place)| norm(&place.matrix3)) else {
            continue;
        };
        let sizes = first / MAX_SIZE..=first * MAX_SIZE;
        let fits = |m: &DMat3| candidate(m) && sizes.contains(&norm(m));
        let count = places.iter().filter(|(_, p)| fits(&p.matrix3)).count();
        let spared = count.saturating_sub(1).saturating_mul(triangles);
        if spared >= SPARED_TRIANGLES + count.saturating_mul(TRIANGLES_A_PLACE) {
            let (these, others) = places.drain(..).partition(|(_, p)| fits(&p.matrix3));
            *places = others;
            taken.push(these);
        }
    }
    taken
}

/// The largest number in it.
fn norm(matrix: &DMat3) -> f64 {
    let numbers = matrix.to_cols_array().into_iter();
    numbers.fold(0.0, |max: f64, x| max.max(x.abs()))
}
