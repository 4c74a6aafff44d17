//! The node hierarchy, flattened to world transforms.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::asset::Asset;
use super::json::{Checked, Json};
use super::warnings::Warnings;

/// World coordinates [m] beyond this cannot be rendered: squared areas leave the range of f32.
pub(super) const MAX_COORDINATE: f64 = 1e9;

/// A node of the chosen scene with its place in the world.
pub(super) struct Node<'a> {
    pub json: Json<'a>,
    pub world_from_node: DAffine3,
}

/// All nodes of the default scene, parents before children, siblings in the file's order. Nodes
/// that are scaled to nothing, and what hangs on them, are left out: glTF's way to hide them.
pub(super) fn nodes<'a>(asset: &Asset<'a>, warnings: &mut Warnings) -> Checked<Vec<Node<'a>>> {
    let root = &asset.root;
    let count = root.items("nodes")?.len();
    let mut seen = vec![false; count];
    let mut nodes = Vec::new();
    // An explicit stack: a chain may be as deep as the file is long.
    let mut stack = Vec::new();
    push(&mut stack, roots(root)?, root, DAffine3::IDENTITY)?;
    while let Some((i, json, world_from_parent)) = stack.pop() {
        if let Some(seen) = seen.get_mut(i)
            && std::mem::replace(seen, true)
        {
            return Err(json.fault("is reached twice: a cycle, or a node with two parents"));
        }
        let world_from_node = world_from_parent * parent_from_node(&json, warnings)?;
        let far = world_from_node.translation.abs().max_element() > MAX_COORDINATE;
        if !world_from_node.is_finite() || far {
            return Err(json.fault(format_args!(
                "its place in the world is beyond {MAX_COORDINATE:e} m"
            )));
        }
        if world_from_node.matrix3 == DMat3::ZERO {
            continue;
        }
        push(&mut stack, json.items("children")?, root, world_from_node)?;
        nodes.push(Node {
            json,
            world_from_node,
        });
    }
    Ok(nodes)
}

type Open<'a> = (usize, Json<'a>, DAffine3);

/// Puts the nodes that `references` name on the stack, the first on top.
fn push<'a>(
    stack: &mut Vec<Open<'a>>,
    references: Vec<Json<'a>>,
    root: &Json<'a>,
    world_from_parent: DAffine3,
) -> Checked<()> {
    for reference in references.iter().rev() {
        let i = reference.as_index()?;
        let node = reference.element_of(i, root, "nodes")?;
        stack.push((i, node, world_from_parent));
    }
    Ok(())
}

/// The references to root nodes of the file's default scene, else of its first.
fn roots<'a>(root: &Json<'a>) -> Checked<Vec<Json<'a>>> {
    let scene = match root.refer("scene", root, "scenes")? {
        Some((_, scene)) => Some(scene),
        None => root.items("scenes")?.into_iter().next(),
    };
    match scene {
        Some(scene) => scene.items("nodes"),
        None => Ok(Vec::new()),
    }
}

fn parent_from_node(json: &Json, warnings: &mut Warnings) -> Checked<DAffine3> {
    const IDENTITY: [f64; 16] = [
        1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.,
    ];
    if let Some(matrix) = json.get("matrix")? {
        let m = json.numbers("matrix", IDENTITY)?;
        if [m[3], m[7], m[11], m[15] - 1.0]
            .iter()
            .any(|x| x.abs() > 1e-3)
        {
            return Err(matrix.fault("its last row must be 0 0 0 1"));
        }
        return Ok(DAffine3::from_cols(
            DVec3::new(m[0], m[1], m[2]),
            DVec3::new(m[4], m[5], m[6]),
            DVec3::new(m[8], m[9], m[10]),
            DVec3::new(m[12], m[13], m[14]),
        ));
    }
    let rotation = DQuat::from_array(json.numbers("rotation", [0., 0., 0., 1.])?);
    let length = rotation.length();
    let rotation = if length.is_normal() {
        rotation / length
    } else {
        let path = format!("{}/rotation", json.path());
        warnings.add(&path, "is no rotation (length 0): not rotated");
        DQuat::IDENTITY
    };
    Ok(DAffine3::from_scale_rotation_translation(
        DVec3::from(json.numbers("scale", [1.0; 3])?),
        rotation,
        DVec3::from(json.numbers("translation", [0.0; 3])?),
    ))
}
