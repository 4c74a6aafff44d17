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
use super::{Image, Texture, TextureRef, Wrap, specular_glossiness};

/// What the texels of a texture stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Meaning {
    /// sRGB.
    Color,
    /// Linear.
    Data,
    /// The roughness that follows from glossiness in A times `factor` / 255.
    Glossiness { factor: u8 },
}

/// Loads each texture once for each meaning, each image once.
pub(super) struct Textures<'a, 'b> {
    asset: &'b Asset<'a>,
    resources: &'b mut Resources,
    pub textures: Vec<Texture>,
    pub images: Vec<Image>,
    texture_index: HashMap<(usize, Meaning), Option<u32>>,
    image_index: HashMap<(usize, Option<u8>), Option<u32>>,
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
        meaning: Meaning,
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
        let key = (info.index.value(), meaning);
        let loaded = match self.texture_index.get(&key) {
            Some(loaded) => *loaded,
            None => {
                let path = format!("/textures/{}", info.index);
                let loaded = self.load(json, &path, meaning, warnings)?;
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
        meaning: Meaning,
        warnings: &mut Warnings,
    ) -> Checked<Option<u32>> {
        let root = self.asset.root;
        let (wrap, nearest) = match json.sampler {
            Some(index) => {
                let sampler = get(root, index, format_args!("{path}/sampler"))?;
                sampler_of(sampler, &format!("/samplers/{index}"))?
            }
            None => ([Wrap::Repeat; 2], false),
        };
        let sources = sources(json, path)?;
        if sources.is_empty() {
            warnings.add(path, "has no image that can be read: left out");
        }
        // Where an extension's image cannot be had, the texture's own is for that.
        let mut loaded = None;
        for (index, at) in sources {
            get(root, index, at)?;
            loaded = self.load_image(index, meaning, warnings);
            if loaded.is_some() {
                break;
            }
        }
        Ok(loaded.map(|image| {
            self.textures.push(Texture {
                image,
                wrap,
                nearest,
                srgb: meaning == Meaning::Color,
            });
            self.textures.len() as u32 - 1
        }))
    }

    /// An image for one meaning; colours and data are the same texels.
    fn load_image(
        &mut self,
        index: Index<json::Image>,
        meaning: Meaning,
        warnings: &mut Warnings,
    ) -> Option<u32> {
        let key = match meaning {
            Meaning::Color | Meaning::Data => (index.value(), None),
            Meaning::Glossiness { factor } => (index.value(), Some(factor)),
        };
        if let Some(loaded) = self.image_index.get(&key) {
            return *loaded;
        }
        let path = format!("/images/{index}");
        let image = match meaning {
            Meaning::Color | Meaning::Data => self.image(index, &path, warnings),
            Meaning::Glossiness { factor } => self.roughness(index, factor, warnings),
        };
        let loaded = image.map(|image| {
            self.bytes_left = self.bytes_left.saturating_sub(image.rgba.len() as u64);
            self.images.push(image);
            self.images.len() as u32 - 1
        });
        let loaded = loaded
            .map_err(|fault| warnings.breach(path, format_args!("texture left out: {fault}")))
            .ok();
        self.image_index.insert(key, loaded);
        loaded
    }

    fn roughness(
        &mut self,
        index: Index<json::Image>,
        factor: u8,
        warnings: &mut Warnings,
    ) -> Checked<Image> {
        let image = self.load_image(index, Meaning::Color, warnings);
        let image = image.and_then(|i| self.images.get(i as usize));
        let image = image.ok_or("its glossiness cannot be had")?;
        picture::check_size(image.width, image.height, self.bytes_left)?;
        Ok(specular_glossiness::roughness(image, factor))
    }

    fn image(
        &mut self,
        index: Index<json::Image>,
        path: &str,
        warnings: &mut Warnings,
    ) -> Checked<Image> {
        let json = get(self.asset.root, index, path)?;
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
        Ok(image)
    }
}

/// The extensions that name an image of another format, the likeliest to be good first.
const SOURCES: [&str; 3] = ["EXT_texture_webp", "KHR_texture_basisu", "MSFT_texture_dds"];

/// The images of a texture and where they are named: an extension's, which the crate does not know,
/// and the texture's own. The crate gives `u32::MAX` where there is none.
fn sources(texture: &json::Texture, path: &str) -> Checked<Vec<(Index<json::Image>, String)>> {
    let mut sources = Vec::new();
    let extensions = texture.extensions.as_ref();
    for name in SOURCES {
        let source = extensions.and_then(|all| all.others.get(name)?.get("source"));
        let Some(source) = source else { continue };
        let path = format!("{path}/extensions/{name}/source");
        let index = source.as_u64().and_then(|i| u32::try_from(i).ok());
        let index = index.ok_or_else(|| format!("{path}: must be an index"))?;
        sources.push((Index::new(index), path));
    }
    if texture.source.value() != u32::MAX as usize {
        sources.push((texture.source, format!("{path}/source")));
    }
    Ok(sources)
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
