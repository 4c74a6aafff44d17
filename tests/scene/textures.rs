//! Images, samplers, normal maps.

use glam::{Vec2, Vec3, Vec4};
use lightfall::scene::Wrap;
use serde_json::json;

use crate::document::{Document, near, png};

#[test]
fn textures_come_with_sampler_and_transform() {
    let mut document = Document::square(true);
    let view = document.view(&png([10, 20, 30, 255]));
    document.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
    document.json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}]);
    document.json["textures"] = json!([{"source": 0, "sampler": 0}]);
    let transform = json!({"KHR_texture_transform": {"offset": [0, 1], "texCoord": 1,
        "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5]}});
    document.material(json!({"pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0, "extensions": transform},
        "metallicRoughnessTexture": {"index": 0}}}));
    let scene = document.load();
    assert_eq!(scene.images.len(), 1);
    assert_eq!((scene.images[0].width, scene.images[0].height), (2, 1));
    assert_eq!(scene.images[0].rgba, [10, 20, 30, 255, 10, 20, 30, 255]);
    assert_eq!(scene.textures.len(), 2, "one as colour, one as data");
    let color = scene.materials[0].base_color_texture.unwrap();
    let data = scene.materials[0].metallic_roughness_texture.unwrap();
    let texture = scene.textures[color.texture as usize];
    assert!(texture.srgb && !scene.textures[data.texture as usize].srgb && texture.nearest);
    assert_eq!(texture.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!((color.uv_set, data.uv_set), (1, 0));
    // The extension's own example: the lower left quadrant of the image, u in [0, ½], v in [½, 1].
    for (uv, expected) in [
        ((0., 0.), (0., 1.)),
        ((1., 0.), (0., 0.5)),
        ((0., 1.), (0.5, 1.)),
    ] {
        let uv = Vec3::new(uv.0, uv.1, 1.0);
        let found = Vec2::from(color.transform.map(|row| row.dot(uv)));
        assert!(found.abs_diff_eq(expected.into(), 1e-6), "{uv}: {found}");
    }
    // TEXCOORD_1 is not there.
    assert_eq!(scene.warnings.len(), 1);
    assert!(
        scene.warnings[0].contains("TEXCOORD_1"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn images_of_few_channels_and_many_bits_become_rgba8() {
    use image::{DynamicImage, GrayAlphaImage, ImageBuffer, Luma, LumaA, Rgb};
    let grey = ImageBuffer::from_pixel(3, 1, Luma([0x8000u16]));
    let deep = ImageBuffer::from_pixel(3, 1, Rgb([0u16, 0xffff, 0x4000]));
    let pale = GrayAlphaImage::from_pixel(3, 1, LumaA([7, 9]));
    for (image, expected) in [
        (DynamicImage::from(grey), [128, 128, 128, 255]),
        (DynamicImage::from(deep), [0, 255, 64, 255]),
        (DynamicImage::from(pale), [7, 7, 7, 9]),
    ] {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        let mut document = Document::square(true);
        let view = document.view(&bytes.into_inner());
        document.json["images"] = json!([{"bufferView": view}]);
        document.json["textures"] = json!([{"source": 0}]);
        document.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
        assert_eq!(document.load().images[0].rgba, expected.repeat(3));
    }
}

#[test]
fn tangents_follow_the_image_where_a_normal_map_needs_them() {
    let mut document = Document::square(false);
    let plain = document.load();
    assert!(plain.vertices.iter().all(|v| v.tangent_w == Vec4::ZERO));

    let view = document.view(&png([128, 128, 255, 255]));
    document.json["images"] = json!([{"bufferView": view}]);
    document.json["textures"] = json!([{"source": 0}]);
    document.material(json!({"normalTexture": {"index": 0, "scale": 2}}));
    // An upright image: u is +x, and its green points up, +y = cross(n, t) · w.
    let scene = document.load();
    assert_eq!(scene.materials[0].normal_scale, 2.0);
    for vertex in &scene.vertices {
        assert!(near(vertex.tangent_w.truncate(), Vec3::X), "{vertex:?}");
        assert_eq!(vertex.tangent_w.w, 1.0);
    }
    // Mirrored: u is −x, +y stays, the front is still +z.
    document.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    for vertex in &document.load().vertices {
        assert!(near(vertex.tangent_w.truncate(), Vec3::NEG_X) && vertex.tangent_w.w == -1.0);
        assert_eq!(vertex.normal_w, Vec3::Z);
    }
    // Those of the file, where it has them, unless it has no normals.
    document.json["nodes"] = json!([{"mesh": 0}]);
    document.attribute("TANGENT", &[[0., 2., 0., -1.]; 4]);
    for vertex in &document.load().vertices {
        assert!(near(vertex.tangent_w.truncate(), Vec3::X), "{vertex:?}");
    }
    document.attribute("NORMAL", &[[0., 0., 1.]; 4]);
    for vertex in &document.load().vertices {
        assert_eq!(vertex.tangent_w, Vec4::new(0., 1., 0., -1.));
    }
}

#[test]
fn a_fan_of_many_triangles_gets_tangents() {
    let mut document = Document::new();
    let rim = 300_000;
    let mut positions = vec![[0f32, 0., 0.]];
    positions.extend((0..rim).map(|i| {
        let angle = i as f32 / rim as f32 * 6.0;
        [angle.cos(), angle.sin(), 0.]
    }));
    let uvs: Vec<[f32; 2]> = positions.iter().map(|p| [p[0], -p[1]]).collect();
    document.attribute("POSITION", &positions);
    document.attribute("TEXCOORD_0", &uvs);
    document.attribute("NORMAL", &vec![[0., 0., 1.]; rim + 1]);
    document.primitive()["mode"] = json!(6);
    let view = document.view(&png([128, 128, 255, 255]));
    document.json["images"] = json!([{"bufferView": view}]);
    document.json["textures"] = json!([{"source": 0}]);
    document.material(json!({"normalTexture": {"index": 0}}));
    let scene = document.load();
    assert!(scene.triangles.len() > rim / 2);
    for triangle in &scene.triangles {
        let vertex = scene.vertices[triangle.vertices[0] as usize];
        assert!(vertex.tangent_w.truncate().dot(Vec3::X) > 0.9, "{vertex:?}");
        assert_eq!(vertex.tangent_w.w, 1.0);
    }
    assert!(scene.warnings[0].contains("MikkTSpace"));
}

#[test]
fn images_that_cannot_be_had_are_left_out_and_named() {
    for image in [
        json!({"uri": "absent.png"}),
        json!({"uri": "data:image/png;base64,AAAA"}),
        json!({}),
        json!({"uri": "../x.png"}),
        json!({"uri": "https://example.com/x.png"}),
    ] {
        let mut document = Document::square(true);
        document.json["images"] = json!([image]);
        document.json["textures"] = json!([{"source": 0}]);
        document.material(json!({"normalTexture": {"index": 0},
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
        let scene = document.load();
        assert_eq!(scene.materials[0].normal_texture, None);
        assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
        assert!(scene.warnings[0].starts_with("/images/0: "));
    }
}

/// An image, and what to call it.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    use image::{DynamicImage, ImageFormat, RgbImage};
    let texel = |x, y| image::Rgb([((x * 7) ^ (y * 13)) as u8, (x * y) as u8, (x + 3 * y) as u8]);
    let image = DynamicImage::from(RgbImage::from_fn(64, 64, texel));
    let formats = [
        ("png", ImageFormat::Png),
        ("jpeg", ImageFormat::Jpeg),
        ("webp", ImageFormat::WebP),
    ];
    formats
        .map(|(name, format)| {
            let mut bytes = std::io::Cursor::new(Vec::new());
            image.write_to(&mut bytes, format).unwrap();
            (name, bytes.into_inner())
        })
        .into()
}

#[test]
fn an_image_that_is_cut_short_says_so() {
    let warnings = |bytes: &[u8]| {
        let mut document = Document::square(true);
        let view = document.view(bytes);
        document.json["images"] = json!([{"bufferView": view}]);
        document.json["textures"] = json!([{"source": 0}]);
        document.material(json!({"emissiveTexture": {"index": 0}}));
        document.load().warnings
    };
    for (name, whole) in files() {
        assert_eq!(warnings(&whole), [] as [String; 0], "{name}");
        for sixteenths in 1..16 {
            let length = whole.len() * sixteenths / 16;
            let said = warnings(&whole[..length]);
            assert_eq!(said.len(), 1, "{name}, {sixteenths}/16: {said:?}");
            assert!(said[0].starts_with("/images/0: "), "{said:?}");
        }
    }
}
