//! The node hierarchy, flattened to world transforms.

use glam::{DAffine3, DMat3, DQuat, DVec3, Mat4, Vec3, Vec4};
use gltf::json::scene;
use gltf::json::{Index, Root, Value};

use super::asset::{Checked, get};
use super::warnings::Warnings;

/// World coordinates [m] beyond this cannot be rendered: squared areas leave the range of f32.
pub(super) const MAX_COORDINATE: f64 = 1e9;

/// A node of the chosen scene with its place in the world.
pub(super) struct Node<'a> {
    pub json: &'a scene::Node,
    /// JSON path.
    pub path: String,
    pub world_from_node: DAffine3,
}

/// All nodes of the default scene, parents before children, siblings in the file's order. Nodes
/// that are scaled to nothing (glTF's way to hide them) or not visible are left out, with what hangs on them.
pub(super) fn nodes<'a>(
    root: &'a Root,
    center: DVec3,
    warnings: &mut Warnings,
) -> Checked<Vec<Node<'a>>> {
    let mut seen = vec![false; root.nodes.len()];
    let mut nodes = Vec::new();
    // An explicit stack: a chain may be as deep as the file is long.
    let mut stack = Vec::new();
    // The file's default scene, else its first.
    let (i, scene) = match root.scene {
        Some(index) => (index.value(), Some(get(root, index, "/scene")?)),
        None => (0, root.scenes.first()),
    };
    let roots = scene.map_or(&[][..], |scene| &scene.nodes);
    let push = |stack: &mut Vec<_>, list: &[Index<scene::Node>], path: &str, world_from_parent| {
        // The first is to lie on top.
        for (place, &index) in list.iter().enumerate().rev() {
            let json = get(root, index, format_args!("{path}/{place}"))?;
            stack.push((index.value(), json, world_from_parent));
        }
        Checked::Ok(())
    };
    push(
        &mut stack,
        roots,
        &format!("/scenes/{i}/nodes"),
        DAffine3::from_translation(center),
    )?;
    while let Some((i, json, world_from_parent)) = stack.pop() {
        let path = format!("/nodes/{i}");
        if let Some(seen) = seen.get_mut(i)
            && std::mem::replace(seen, true)
        {
            return Err(format!(
                "{path}: is reached twice: a cycle, or a node with two parents"
            ));
        }
        let world_from_node = world_from_parent * parent_from_node(json, &path, warnings)?;
        let far = world_from_node.translation.abs().max_element() > MAX_COORDINATE;
        if !world_from_node.is_finite() || far {
            return Err(format!(
                "{path}: its place in the world is beyond {MAX_COORDINATE:e} m"
            ));
        }
        if world_from_node.matrix3 == DMat3::ZERO || is_hidden(json) {
            continue;
        }
        if let Some(children) = &json.children {
            push(
                &mut stack,
                children,
                &format!("{path}/children"),
                world_from_node,
            )?;
        }
        nodes.push(Node {
            json,
            path,
            world_from_node,
        });
    }
    Ok(nodes)
}

/// CESIUM_RTC: where the model stands, in its own axes; the Earth's middle is then the origin.
pub(super) fn center(json: &Value) -> Checked<DVec3> {
    let Some(rtc) = json.pointer("/extensions/CESIUM_RTC") else {
        return Ok(DVec3::ZERO);
    };
    let numbers = rtc.get("center").and_then(Value::as_array);
    let numbers: Vec<f64> = numbers
        .into_iter()
        .flatten()
        .filter_map(Value::as_f64)
        .collect();
    match numbers[..] {
        [x, y, z] if DVec3::new(x, y, z).is_finite() => Ok(DVec3::new(x, y, z)),
        _ => Err("/extensions/CESIUM_RTC/center: must be three numbers".into()),
    }
}

/// KHR_node_visibility.
fn is_hidden(node: &scene::Node) -> bool {
    let extensions = node.extensions.as_ref();
    let visibility = extensions.and_then(|all| all.others.get("KHR_node_visibility"));
    visibility.and_then(|json| json.get("visible")?.as_bool()) == Some(false)
}

fn parent_from_node(node: &scene::Node, path: &str, warnings: &mut Warnings) -> Checked<DAffine3> {
    if let Some(matrix) = &node.matrix {
        let matrix = Mat4::from_cols_array(matrix);
        if (matrix.row(3) - Vec4::W).abs().max_element() > 1e-3 {
            return Err(format!("{path}/matrix: its last row must be 0 0 0 1"));
        }
        return Ok(DAffine3::from_mat4(matrix.as_dmat4()));
    }
    let vector = |v: [f32; 3]| Vec3::from(v).as_dvec3();
    let rotation = DQuat::from_array(node.rotation.unwrap_or_default().0.map(f64::from));
    let length = rotation.length();
    let rotation = if length.is_normal() {
        rotation / length
    } else {
        let path = format_args!("{path}/rotation");
        warnings.breach(path, "is no rotation (length 0): not rotated");
        DQuat::IDENTITY
    };
    Ok(DAffine3::from_scale_rotation_translation(
        vector(node.scale.unwrap_or([1.0; 3])),
        rotation,
        vector(node.translation.unwrap_or_default()),
    ))
}
