//! SVG to PNG with a font of our own, so that the picture does not depend on the machine.

use super::Picture;
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};
use std::sync::{Arc, LazyLock};
use taut::error::{Error, Result};

/// Pixels of a PNG for each of the SVG's: sharp on paper and on dense screens.
const SCALE: f32 = 2.0;

/// Noto Sans, regular and bold (SIL Open Font Licence 1.1), from the crate `notosans`.
static FONTS: LazyLock<Arc<fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = fontdb::Database::new();
    for font in [notosans::REGULAR_TTF, notosans::BOLD_TTF] {
        fonts.load_font_source(fontdb::Source::Binary(Arc::new(font)));
    }
    for set in [
        fontdb::Database::set_sans_serif_family,
        fontdb::Database::set_serif_family,
        fontdb::Database::set_monospace_family,
    ] {
        set(&mut fonts, "Noto Sans");
    }
    Arc::new(fonts)
});

impl Picture {
    /// The picture as a PNG, at twice the size on white.
    ///
    /// # Errors
    ///
    /// A picture of more than 16384 pixels to a side.
    pub fn png(&self) -> Result<Vec<u8>> {
        png(&self.svg(), SCALE)
    }
}

/// Rasterises `svg` on white, `scale` pixels per SVG pixel, at most 16384 pixels a side.
pub fn png(svg: &str, scale: f32) -> Result<Vec<u8>> {
    let options = Options { fontdb: FONTS.clone(), font_family: "Noto Sans".into(), ..Options::default() };
    let tree = Tree::from_str(svg, &options).map_err(|e| Error::new(format!("this SVG cannot be drawn: {e}")))?;
    let side = |length: f32| (length * scale).ceil();
    let (width, height) = (side(tree.size().width()), side(tree.size().height()));
    if !(1.0..=16384.0).contains(&width) || !(1.0..=16384.0).contains(&height) {
        return Err(Error::new(format!("a picture of {width} by {height} pixels cannot be made"))
            .allowed("1 to 16384 pixels a side")
            .next("choose another scale"));
    }
    let mut pixels = Pixmap::new(width as u32, height as u32).expect("the size was checked");
    pixels.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixels.as_mut());
    encode(&pixels).map_err(|e| Error::new(format!("this picture cannot be encoded: {e}")))
}

/// Nothing is transparent after the white, so three channels do; and plots compress well with little effort.
fn encode(pixels: &Pixmap) -> std::result::Result<Vec<u8>, png::EncodingError> {
    let rgb: Vec<u8> = pixels.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, pixels.width(), pixels.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&rgb)?;
    writer.finish()?;
    Ok(out)
}
