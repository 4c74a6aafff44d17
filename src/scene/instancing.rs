//! EXT_mesh_gpu_instancing: a node that shows its mesh many times.

use glam::{DAffine3, DMat3, DQuat, DVec3, DVec4};
use gltf::json::Index;
use gltf::json::accessor::ComponentType;

use super::accessor::Accessor;
use super::asset::{Asset, Checked};
use super::node::Node;

/// Where a node shows its mesh: once, or where the extension says. Instances that are scaled to nothing are left out.
pub(super) fn places(asset: &Asset, node: &Node) -> Checked<Vec<DAffine3>> {
    const NAME: &str = "EXT_mesh_gpu_instancing";
    let extensions = node.json.extensions.as_ref();
    let Some(json) = extensions.and_then(|all| all.others.get(NAME)) else {
        return Ok(vec![node.world_from_node]);
    };
    let path = format!("{}/extensions/{NAME}/attributes", node.path);
    let open = |key: &str, components: usize| {
        let path = format!("{path}/{key}");
        let Some(index) = json.get("attributes").and_then(|all| all.get(key)) else {
            return Ok(None);
        };
        let index = index.as_u64().and_then(|i| u32::try_from(i).ok());
        let index = index.ok_or_else(|| format!("{path}: must be an index"))?;
        let accessor = Accessor::open(asset, Index::new(index), &path)?;
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
