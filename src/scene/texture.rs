//! Textures, samplers and images, decoded within limits.

use std::collections::HashMap;

use glam::Vec3;
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::texture::{Info, MagFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked::Valid;
use gltf::json::{self, Index};

use super::asset::{Asset, Checked, get, valid};
use super::picture::{self, MAX_IMAGES_BYTES};
use super::resources::Resources;
use super::warnings::Warnings;
use super::{Image, Texture, TextureRef, Wrap};

/// Loads each texture once for each meaning (colour or data), each image once.
pub(super) struct Textures<'a, 'b> {
    asset: &'b Asset<'a>,
    resources: &'b mut Resources,
    pub textures: Vec<Texture>,
    pub images: Vec<Image>,
    texture_index: HashMap<(usize, bool), Option<u32>>,
    image_index: HashMap<usize, Option<u32>>,
    bytes_left: u64,
}

impl<'a, 'b> Textures<'a, 'b> {
    pub fn new(asset: &'b Asset<'a>, resources: &'b mut Resources) -> Self {
        Self {
            asset,
            resources,
            textures: Vec::new(),
            images: Vec::new(),
            texture_index: HashMap::new(),
            image_index: HashMap::new(),
            bytes_left: MAX_IMAGES_BYTES,
        }
    }

    /// The reference `info`, member `key` of the object at `path`. `None` where there is none, and,
    /// with a warning, where its image cannot be had: that equals a white texture, or a flat normal
    /// map.
    pub fn texture(
        &mut self,
        info: &Option<Info>,
        path: &str,
        key: &str,
        srgb: bool,
        warnings: &mut Warnings,
    ) -> Checked<Option<TextureRef>> {
        let Some(info) = info else {
            return Ok(None);
        };
        let (root, at) = (self.asset.root, format_args!("{path}/{key}/index"));
        let json = get(root, info.index, at)?;
        let extensions = info.extensions.as_ref();
        let transform = extensions.and_then(|all| all.texture_transform.as_ref());
        let moved = transform.and_then(|transform| transform.tex_coord);
        let mut uv_set = moved.unwrap_or(info.tex_coord);
        if uv_set > 1 {
            let what = "uses a TEXCOORD beyond 1, which is not supported: TEXCOORD_0 is used";
            warnings.add(format_args!("{path}/{key}"), what);
            uv_set = 0;
        }
        let key = (info.index.value(), srgb);
        let loaded = match self.texture_index.get(&key) {
            Some(loaded) => *loaded,
            None => {
                let path = format!("/textures/{}", info.index);
                let loaded = self.load(json, &path, srgb, warnings)?;
                self.texture_index.insert(key, loaded);
                loaded
            }
        };
        Ok(loaded.map(|texture| TextureRef {
            texture,
            uv_set,
            transform: transform.map_or([Vec3::X, Vec3::Y], uv_transform),
        }))
    }

    fn load(
        &mut self,
        json: &json::Texture,
        path: &str,
        srgb: bool,
        warnings: &mut Warnings,
    ) -> Checked<Option<u32>> {
        let root = self.asset.root;
        let Some((index, at)) = source(json, path)? else {
            warnings.add(path, "has no image that can be read: left out");
            return Ok(None);
        };
        let image = get(root, index, at)?;
        let (wrap, nearest) = match json.sampler {
            Some(index) => {
                let sampler = get(root, index, format_args!("{path}/sampler"))?;
                sampler_of(sampler, &format!("/samplers/{index}"))?
            }
            None => ([Wrap::Repeat; 2], false),
        };
        let loaded = match self.image_index.get(&index.value()) {
            Some(loaded) => *loaded,
            None => {
                let path = format!("/images/{index}");
                let loaded = match self.image(image, &path, warnings) {
                    Ok(image) => {
                        self.images.push(image);
                        Some(self.images.len() as u32 - 1)
                    }
                    Err(fault) => {
                        warnings.breach(path, format_args!("texture left out: {fault}"));
                        None
                    }
                };
                self.image_index.insert(index.value(), loaded);
                loaded
            }
        };
        Ok(loaded.map(|image| {
            self.textures.push(Texture {
                image,
                wrap,
                nearest,
                srgb,
            });
            self.textures.len() as u32 - 1
        }))
    }

    fn image(&mut self, json: &json::Image, path: &str, warnings: &mut Warnings) -> Checked<Image> {
        let bytes = match (&json.uri, json.buffer_view) {
            (Some(uri), _) => self.resources.fetch(uri, path, warnings)?,
            (None, Some(view)) => self.asset.view(view, path, warnings)?.1.into(),
            (None, None) => return Err("has neither uri nor bufferView".into()),
        };
        let (image, damage) = picture::decode(&bytes, self.bytes_left)?;
        if let Some(damage) = damage {
            warnings.breach(
                path,
                format_args!("damaged, read as far as possible: {damage}"),
            );
        }
        self.bytes_left -= image.rgba.len() as u64;
        Ok(image)
    }
}

/// The image of a texture and where it is named: EXT_texture_webp's, which the crate does not know,
/// else the texture's own. The crate gives `u32::MAX` where there is none.
fn source(texture: &json::Texture, path: &str) -> Checked<Option<(Index<json::Image>, String)>> {
    let extensions = texture.extensions.as_ref();
    let webp = extensions.and_then(|all| all.others.get("EXT_texture_webp")?.get("source"));
    if let Some(webp) = webp {
        let path = format!("{path}/extensions/EXT_texture_webp/source");
        let index = webp.as_u64().and_then(|i| u32::try_from(i).ok());
        let index = index.ok_or_else(|| format!("{path}: must be an index"))?;
        return Ok(Some((Index::new(index), path)));
    }
    let none = texture.source.value() == u32::MAX as usize;
    Ok((!none).then(|| (texture.source, format!("{path}/source"))))
}

/// KHR_texture_transform: offset · rotation · scale, counter-clockwise on the image, whose v points
/// down. The direction follows the extension's example "lower left quadrant, rotated clockwise".
fn uv_transform(json: &TextureTransform) -> [Vec3; 2] {
    // A number in the file may exceed f32; infinities would become NaN.
    let finite = |x: f32| f64::from(x.clamp(f32::MIN, f32::MAX));
    let [u, v] = json.offset.0.map(finite);
    let [su, sv] = json.scale.0.map(finite);
    let (sin, cos) = finite(json.rotation.0).sin_cos();
    // Beyond this a texture coordinate in f32 has no fraction left.
    let row = |row: [f64; 3]| Vec3::from(row.map(|x| x.clamp(-1e6, 1e6) as f32));
    [row([cos * su, sin * sv, u]), row([-sin * su, cos * sv, v])]
}

fn sampler_of(json: &Sampler, path: &str) -> Checked<([Wrap; 2], bool)> {
    let wrap = |mode, key| {
        Checked::Ok(match valid(mode, format_args!("{path}/{key}"))? {
            WrappingMode::Repeat => Wrap::Repeat,
            WrappingMode::ClampToEdge => Wrap::Clamp,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
        })
    };
    Ok((
        [wrap(json.wrap_s, "wrapS")?, wrap(json.wrap_t, "wrapT")?],
        json.mag_filter == Some(Valid(MagFilter::Nearest)),
    ))
}
