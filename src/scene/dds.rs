//! MSFT_texture_dds: the block formats of Direct3D, and plain RGB.

use ddsfile::{D3DFormat, Dds, DxgiFormat};

use super::Image;
use super::asset::Checked;
use super::guard::guarded;
use super::picture::check_size;

pub(super) const MAGIC: &[u8] = b"DDS ";

/// How texels lie in the file.
#[derive(Clone, Copy)]
enum Layout {
    /// 4 × 4 texels in so many bytes.
    Blocks(usize, fn(&[u8]) -> [[u8; 4]; 16]),
    /// A texel in so many bytes.
    Texels(usize, fn(&[u8]) -> [u8; 4]),
}
use Layout::{Blocks, Texels};

/// The largest level of the first texture in the file.
pub(super) fn decode(bytes: &[u8], bytes_left: u64) -> Checked<Image> {
    let dds = guarded(|| Dds::read(bytes).map_err(|error| format!("DDS: {error}")))?;
    let (width, height) = (dds.get_width(), dds.get_height());
    check_size(width, height, bytes_left)?;
    let layout = layout(&dds).ok_or(
        "DDS: only BC1 to BC5, BC7 and RGB of 8 bits are read; export it anew as PNG or JPEG",
    )?;
    let (width, height) = (width as usize, height as usize);
    let (edge, size) = match layout {
        Blocks(size, _) => (4, size),
        Texels(size, _) => (1, size),
    };
    let row = width.div_ceil(edge) * size;
    let level = dds.data.get(..row * height.div_ceil(edge));
    let level = level.ok_or("DDS: ends before its texels")?;
    let mut rgba = vec![0; width * height * 4];
    for (i, unit) in level.chunks_exact(size).enumerate() {
        let (x, y) = (
            i % width.div_ceil(edge) * edge,
            i / width.div_ceil(edge) * edge,
        );
        let (block, texel);
        let texels: &[[u8; 4]] = match layout {
            Blocks(_, decode) => {
                block = decode(unit);
                &block
            }
            Texels(_, decode) => {
                texel = [decode(unit)];
                &texel
            }
        };
        for (j, color) in texels.iter().enumerate() {
            let (x, y) = (x + j % edge, y + j / edge);
            if x < width && y < height {
                let at = 4 * (y * width + x);
                rgba[at..at + 4].copy_from_slice(color);
            }
        }
    }
    Ok(Image {
        width: width as u32,
        height: height as u32,
        rgba,
    })
}

fn layout(dds: &Dds) -> Option<Layout> {
    if let Some(format) = dds.get_dxgi_format() {
        use DxgiFormat as F;
        return Some(match format {
            F::BC1_UNorm | F::BC1_UNorm_sRGB | F::BC1_Typeless => Blocks(8, bc1),
            F::BC2_UNorm | F::BC2_UNorm_sRGB | F::BC2_Typeless => Blocks(16, bc2),
            F::BC3_UNorm | F::BC3_UNorm_sRGB | F::BC3_Typeless => Blocks(16, bc3),
            F::BC4_UNorm | F::BC4_Typeless => Blocks(8, bc4),
            F::BC5_UNorm | F::BC5_Typeless => Blocks(16, bc5),
            F::BC7_UNorm | F::BC7_UNorm_sRGB | F::BC7_Typeless => Blocks(16, bc7),
            F::R8G8B8A8_UNorm | F::R8G8B8A8_UNorm_sRGB => Texels(4, |t| [t[0], t[1], t[2], t[3]]),
            F::B8G8R8A8_UNorm | F::B8G8R8A8_UNorm_sRGB => Texels(4, |t| [t[2], t[1], t[0], t[3]]),
            F::B8G8R8X8_UNorm | F::B8G8R8X8_UNorm_sRGB => Texels(4, |t| [t[2], t[1], t[0], 255]),
            F::R8_UNorm => Texels(1, |t| [t[0], t[0], t[0], 255]),
            _ => return None,
        });
    }
    use D3DFormat as F;
    Some(match dds.get_d3d_format()? {
        F::DXT1 => Blocks(8, bc1),
        F::DXT2 | F::DXT3 => Blocks(16, bc2),
        F::DXT4 | F::DXT5 => Blocks(16, bc3),
        F::A8R8G8B8 => Texels(4, |t| [t[2], t[1], t[0], t[3]]),
        F::X8R8G8B8 => Texels(4, |t| [t[2], t[1], t[0], 255]),
        F::A8B8G8R8 => Texels(4, |t| [t[0], t[1], t[2], t[3]]),
        F::X8B8G8R8 => Texels(4, |t| [t[0], t[1], t[2], 255]),
        F::R8G8B8 => Texels(3, |t| [t[2], t[1], t[0], 255]),
        F::L8 => Texels(1, |t| [t[0], t[0], t[0], 255]),
        F::A8L8 => Texels(2, |t| [t[0], t[0], t[0], t[1]]),
        _ => return None,
    })
}

fn four_channels(block: &[u8], decode: fn(&[u8], &mut [u8], usize)) -> [[u8; 4]; 16] {
    let mut texels = [[0; 4]; 16];
    decode(block, texels.as_flattened_mut(), 16);
    texels
}

fn bc1(block: &[u8]) -> [[u8; 4]; 16] {
    four_channels(block, bcdec_rs::bc1)
}

fn bc2(block: &[u8]) -> [[u8; 4]; 16] {
    four_channels(block, bcdec_rs::bc2)
}

fn bc3(block: &[u8]) -> [[u8; 4]; 16] {
    four_channels(block, bcdec_rs::bc3)
}

fn bc7(block: &[u8]) -> [[u8; 4]; 16] {
    four_channels(block, bcdec_rs::bc7)
}

fn bc4(block: &[u8]) -> [[u8; 4]; 16] {
    let mut texels = [0; 16];
    bcdec_rs::bc4(block, &mut texels, 4, false);
    texels.map(|grey| [grey, grey, grey, 255])
}

/// The x and y of a normal; its z follows from its length.
fn bc5(block: &[u8]) -> [[u8; 4]; 16] {
    let mut texels = [[0; 2]; 16];
    bcdec_rs::bc5(block, texels.as_flattened_mut(), 8, false);
    texels.map(|[r, g]| {
        let [x, y] = [r, g].map(|c| f32::from(c) / 127.5 - 1.0);
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        [r, g, (127.5 * (z + 1.0)).round() as u8, 255]
    })
}
