//! What the rest of the program relies on in any scene that loads.

use std::path::Path;

use lightfall::scene::{Projection, Scene};

/// Fails where `scene`, from the file `path`, breaks it.
pub fn check(scene: &Scene, path: &Path) {
    let name = path.display();
    assert!(!scene.triangles.is_empty(), "{name}");
    assert!(!scene.cameras.is_empty(), "{name}");
    for triangle in &scene.triangles {
        assert!(
            (triangle.material as usize) < scene.materials.len(),
            "{name}"
        );
        for i in triangle.vertices {
            let vertex = scene.vertices[i as usize];
            assert!(vertex.position_w.is_finite(), "{name}");
            assert!(
                (vertex.normal_w.length() - 1.0).abs() < 1e-3,
                "{name}: {vertex:?}"
            );
            assert!(
                vertex.uv[0].is_finite() && vertex.uv[1].is_finite(),
                "{name}"
            );
            assert!(vertex.color.min_element() >= 0.0 && vertex.color.max_element() <= 1.0);
        }
    }
    for texture in &scene.textures {
        let image = &scene.images[texture.image as usize];
        let texels = image.width as usize * image.height as usize;
        assert!(texels > 0 && image.rgba.len() == texels * 4, "{name}");
    }
    for material in &scene.materials {
        assert!(
            material.emission.is_finite() && material.ior >= 1.0,
            "{name}"
        );
        assert!((0.0..=1.0).contains(&material.roughness), "{name}");
        assert!(
            material.absorption.is_none_or(|sigma| sigma.is_finite()),
            "{name}"
        );
    }
    for camera in &scene.cameras {
        assert!(camera.world_from_camera.is_finite(), "{name}");
        match camera.projection {
            Projection::Perspective { yfov } => {
                assert!(yfov > 0.0 && yfov < std::f32::consts::PI, "{name}");
            }
            Projection::Orthographic { ymag } => assert!(ymag > 0.0 && ymag.is_finite(), "{name}"),
        }
    }
}
