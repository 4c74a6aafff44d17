//! Textures, samplers and images, decoded within limits.

use std::collections::HashMap;
use std::io::Cursor;

use glam::Vec3;
use image::{DynamicImage, ImageDecoder, ImageReader, Limits};

use super::asset::Asset;
use super::container::Resources;
use super::json::{Checked, Json};
use super::warnings::Warnings;
use super::{Image, Texture, TextureRef, Wrap};

/// Texels a side; what every Vulkan device with ray tracing offers.
const MAX_SIDE: u32 = 16384;
/// Bytes of one decoded image, and of all images of a scene together.
const MAX_IMAGE_BYTES: u64 = 512 << 20;
const MAX_IMAGES_BYTES: u64 = 4 << 30;

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

    /// The textureInfo in member `key` of `owner`. `None` where there is none, and, with a warning,
    /// where its image cannot be had: that equals a white texture, or a flat normal map.
    pub fn texture(
        &mut self,
        owner: &Json<'a>,
        key: &str,
        srgb: bool,
        warnings: &mut Warnings,
    ) -> Checked<Option<TextureRef>> {
        let Some(info) = owner.get(key)? else {
            return Ok(None);
        };
        let (i, texture) = info
            .refer("index", &self.asset.root, "textures")?
            .ok_or_else(|| info.fault("lacks \"index\""))?;
        let transform = info.extension("KHR_texture_transform")?;
        let mut uv_set = info.index("texCoord", 0)?;
        if let Some(transform) = &transform {
            uv_set = transform.index("texCoord", uv_set)?;
        }
        if uv_set > 1 {
            warnings.add(
                info.path(),
                "uses a TEXCOORD beyond 1, which is not supported: TEXCOORD_0 is used",
            );
            uv_set = 0;
        }
        let loaded = match self.texture_index.get(&(i, srgb)) {
            Some(loaded) => *loaded,
            None => {
                let loaded = self.load(&texture, srgb, warnings)?;
                self.texture_index.insert((i, srgb), loaded);
                loaded
            }
        };
        Ok(match loaded {
            Some(texture) => Some(TextureRef {
                texture,
                uv_set: uv_set as u32,
                transform: uv_transform(transform.as_ref())?,
            }),
            None => None,
        })
    }

    fn load(
        &mut self,
        json: &Json<'a>,
        srgb: bool,
        warnings: &mut Warnings,
    ) -> Checked<Option<u32>> {
        let root = &self.asset.root;
        let webp = match json.extension("EXT_texture_webp")? {
            Some(webp) => webp.refer("source", root, "images")?,
            None => None,
        };
        let Some((i, image)) = webp.map_or_else(
            || json.refer("source", root, "images"),
            |webp| Ok(Some(webp)),
        )?
        else {
            warnings.add(json.path(), "has no image that can be read: left out");
            return Ok(None);
        };
        let sampler = match json.refer("sampler", root, "samplers")? {
            Some((_, sampler)) => sampler_of(&sampler)?,
            None => ([Wrap::Repeat; 2], false),
        };
        let index = match self.image_index.get(&i) {
            Some(index) => *index,
            None => {
                let index = match self.image(&image) {
                    Ok(image) => {
                        self.images.push(image);
                        Some(self.images.len() as u32 - 1)
                    }
                    Err(fault) => {
                        // The fault may name the path itself.
                        let prefix = format!("{}/uri: ", image.path());
                        let fault = fault.strip_prefix(&prefix).unwrap_or(&fault);
                        warnings.add(image.path(), &format!("texture left out: {fault}"));
                        None
                    }
                };
                self.image_index.insert(i, index);
                index
            }
        };
        Ok(index.map(|image| {
            let (wrap, nearest) = sampler;
            self.textures.push(Texture {
                image,
                wrap,
                nearest,
                srgb,
            });
            self.textures.len() as u32 - 1
        }))
    }

    fn image(&mut self, json: &Json<'a>) -> Checked<Image> {
        let image = match (json.get("uri")?, self.asset.view(json)?) {
            (Some(uri), _) => decode(&self.resources.fetch(&uri)?, self.bytes_left)?,
            (None, Some((bytes, _))) => decode(bytes, self.bytes_left)?,
            (None, None) => return Err("has neither uri nor bufferView".into()),
        };
        self.bytes_left -= image.rgba.len() as u64;
        Ok(image)
    }
}

/// KHR_texture_transform: offset · rotation · scale, counter-clockwise on the image, whose v points
/// down. The direction follows the extension's example "lower left quadrant, rotated clockwise".
fn uv_transform(json: Option<&Json>) -> Checked<[Vec3; 2]> {
    let Some(json) = json else {
        return Ok([Vec3::X, Vec3::Y]);
    };
    let [u, v] = json.numbers("offset", [0.0; 2])?;
    let [su, sv] = json.numbers("scale", [1.0; 2])?;
    let (sin, cos) = json.number("rotation", 0.0)?.sin_cos();
    // Beyond this a texture coordinate in f32 has no fraction left.
    let row = |row: [f64; 3]| Vec3::from(row.map(|x| x.clamp(-1e6, 1e6) as f32));
    Ok([row([cos * su, sin * sv, u]), row([-sin * su, cos * sv, v])])
}

fn sampler_of(json: &Json) -> Checked<([Wrap; 2], bool)> {
    let wrap = |key| match json.index(key, 10497)? {
        10497 => Ok(Wrap::Repeat),
        33071 => Ok(Wrap::Clamp),
        33648 => Ok(Wrap::Mirror),
        other => Err(json.fault(format_args!("{key} {other} is no wrap mode"))),
    };
    Ok((
        [wrap("wrapS")?, wrap("wrapT")?],
        json.index("magFilter", 9729)? == 9728,
    ))
}

/// Decodes PNG, JPEG or WebP, whatever the file calls itself.
fn decode(bytes: &[u8], bytes_left: u64) -> Checked<Image> {
    let words = |error: image::ImageError| error.to_string();
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| error.to_string())?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_IMAGE_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(words)?;
    let (width, height) = decoder.dimensions();
    // As RGBA it may be larger than what the decoder's own limit counts.
    let size = u64::from(width) * u64::from(height) * 4;
    if width > MAX_SIDE || height > MAX_SIDE || size > MAX_IMAGE_BYTES.min(bytes_left) {
        return Err(format!(
            "{width} × {height} texels are too many: at most {MAX_SIDE} a side, {} MiB an image, \
             {} MiB in all",
            MAX_IMAGE_BYTES >> 20,
            MAX_IMAGES_BYTES >> 20
        ));
    }
    let rgba = DynamicImage::from_decoder(decoder)
        .map_err(words)?
        .into_rgba8()
        .into_raw();
    Ok(Image {
        width,
        height,
        rgba,
    })
}
