//! How texels lie in the files of graphics interfaces: in blocks, or one by one.

use super::Image;
use super::asset::Checked;

/// A layout in memory.
#[derive(Clone, Copy)]
pub(super) enum Layout {
    /// 4 × 4 texels in so many bytes.
    Blocks(usize, fn(&[u8]) -> [[u8; 4]; 16]),
    /// A texel in so many bytes.
    Texels(usize, fn(&[u8]) -> [u8; 4]),
}
use Layout::{Blocks, Texels};

pub(super) const BC1: Layout = Blocks(8, |block| four_channels(block, bcdec_rs::bc1));
pub(super) const BC2: Layout = Blocks(16, |block| four_channels(block, bcdec_rs::bc2));
pub(super) const BC3: Layout = Blocks(16, |block| four_channels(block, bcdec_rs::bc3));
pub(super) const BC4: Layout = Blocks(8, bc4);
pub(super) const BC5: Layout = Blocks(16, bc5);
pub(super) const BC7: Layout = Blocks(16, |block| four_channels(block, bcdec_rs::bc7));
pub(super) const GREY: Layout = Texels(1, |t| [t[0], t[0], t[0], 255]);
pub(super) const GREY_ALPHA: Layout = Texels(2, |t| [t[0], t[0], t[0], t[1]]);
pub(super) const RG: Layout = Texels(2, |t| [t[0], t[1], 0, 255]);
pub(super) const RGB: Layout = Texels(3, |t| [t[0], t[1], t[2], 255]);
pub(super) const BGR: Layout = Texels(3, |t| [t[2], t[1], t[0], 255]);
pub(super) const RGBX: Layout = Texels(4, |t| [t[0], t[1], t[2], 255]);
pub(super) const BGRX: Layout = Texels(4, |t| [t[2], t[1], t[0], 255]);
pub(super) const RGBA: Layout = Texels(4, |t| [t[0], t[1], t[2], t[3]]);
pub(super) const BGRA: Layout = Texels(4, |t| [t[2], t[1], t[0], t[3]]);

impl Layout {
    /// The edge of a block, in texels, and its bytes.
    fn unit(self) -> (usize, usize) {
        match self {
            Blocks(size, _) => (4, size),
            Texels(size, _) => (1, size),
        }
    }

    /// The bytes of an image without padding.
    pub fn size(self, width: u32, height: u32) -> usize {
        let (edge, size) = self.unit();
        (width as usize).div_ceil(edge) * (height as usize).div_ceil(edge) * size
    }

    /// The image in the first bytes of `level`. Its size was checked.
    pub fn image(self, width: u32, height: u32, level: &[u8]) -> Checked<Image> {
        let level = level.get(..self.size(width, height));
        let level = level.ok_or("ends before its texels")?;
        let (edge, size) = self.unit();
        let (columns, rows) = (width as usize, height as usize);
        let mut rgba = vec![0; columns * rows * 4];
        for (i, unit) in level.chunks_exact(size).enumerate() {
            let across = columns.div_ceil(edge);
            let (left, top) = (i % across * edge, i / across * edge);
            let (block, texel);
            let texels: &[[u8; 4]] = match self {
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
                let (x, y) = (left + j % edge, top + j / edge);
                if x < columns && y < rows {
                    let at = 4 * (y * columns + x);
                    rgba[at..at + 4].copy_from_slice(color);
                }
            }
        }
        Ok(Image {
            width,
            height,
            rgba,
        })
    }
}

fn four_channels(block: &[u8], decode: fn(&[u8], &mut [u8], usize)) -> [[u8; 4]; 16] {
    let mut texels = [[0; 4]; 16];
    decode(block, texels.as_flattened_mut(), 16);
    texels
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
