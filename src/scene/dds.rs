//! MSFT_texture_dds: the block formats of Direct3D, and plain RGB.

use ddsfile::{D3DFormat, Dds, DxgiFormat};

use super::Image;
use super::asset::Checked;
use super::guard::guarded;
use super::picture::check_size;
use super::texels::{
    BC1, BC2, BC3, BC4, BC5, BC7, BGR, BGRA, BGRX, GREY, GREY_ALPHA, Layout, RGBA, RGBX,
};

pub(super) const MAGIC: &[u8] = b"DDS ";

/// The largest level of the first texture in the file.
pub(super) fn decode(bytes: &[u8], bytes_left: u64) -> Checked<Image> {
    let dds = guarded(|| Dds::read(bytes).map_err(|error| format!("DDS: {error}")))?;
    let (width, height) = (dds.get_width(), dds.get_height());
    check_size(width, height, bytes_left)?;
    let layout = layout(&dds).ok_or(
        "DDS: only BC1 to BC5, BC7 and RGB of 8 bits are read; export it anew as PNG or JPEG",
    )?;
    let image = guarded(|| layout.image(width, height, &dds.data));
    image.map_err(|fault| format!("DDS: {fault}"))
}

fn layout(dds: &Dds) -> Option<Layout> {
    if let Some(format) = dds.get_dxgi_format() {
        use DxgiFormat as F;
        return Some(match format {
            F::BC1_UNorm | F::BC1_UNorm_sRGB | F::BC1_Typeless => BC1,
            F::BC2_UNorm | F::BC2_UNorm_sRGB | F::BC2_Typeless => BC2,
            F::BC3_UNorm | F::BC3_UNorm_sRGB | F::BC3_Typeless => BC3,
            F::BC4_UNorm | F::BC4_Typeless => BC4,
            F::BC5_UNorm | F::BC5_Typeless => BC5,
            F::BC7_UNorm | F::BC7_UNorm_sRGB | F::BC7_Typeless => BC7,
            F::R8G8B8A8_UNorm | F::R8G8B8A8_UNorm_sRGB => RGBA,
            F::B8G8R8A8_UNorm | F::B8G8R8A8_UNorm_sRGB => BGRA,
            F::B8G8R8X8_UNorm | F::B8G8R8X8_UNorm_sRGB => BGRX,
            F::R8_UNorm => GREY,
            _ => return None,
        });
    }
    use D3DFormat as F;
    Some(match dds.get_d3d_format()? {
        F::DXT1 => BC1,
        F::DXT2 | F::DXT3 => BC2,
        F::DXT4 | F::DXT5 => BC3,
        F::A8R8G8B8 => BGRA,
        F::X8R8G8B8 => BGRX,
        F::A8B8G8R8 => RGBA,
        F::X8B8G8R8 => RGBX,
        F::R8G8B8 => BGR,
        F::L8 => GREY,
        F::A8L8 => GREY_ALPHA,
        _ => return None,
    })
}
