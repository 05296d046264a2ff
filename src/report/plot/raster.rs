//! Images of pixels: downsampling, and encoding as PNG.

use super::PlotError;

/// An RGB image, row by row from the top, one byte for each channel.
pub(super) struct Raster {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<u8>,
}

impl Raster {
    /// A black image.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, pixels: vec![0; width as usize * height as usize * 3] }
    }

    /// The image with one pixel for the mean of `side` x `side` pixels.
    pub fn downsampled(&self, side: u32) -> Self {
        let (wide, side) = (self.width as usize, side as usize);
        let (width, height) = (wide / side, self.height as usize / side);
        let mut pixels = Vec::with_capacity(width * height * 3);
        for rows in self.pixels.chunks_exact(wide * 3 * side) {
            for column in 0..width {
                let mut sums = [0; 3];
                for row in rows.chunks_exact(wide * 3) {
                    for pixel in row[column * side * 3..][..side * 3].as_chunks::<3>().0 {
                        (0..3).for_each(|channel| sums[channel] += u32::from(pixel[channel]));
                    }
                }
                pixels.extend(sums.map(|sum| (sum / (side * side) as u32) as u8));
            }
        }
        Self { width: width as u32, height: height as u32, pixels }
    }

    /// Encodes the image as a PNG file.
    ///
    /// # Errors
    /// When it has no pixels.
    pub fn png(&self) -> Result<Vec<u8>, PlotError> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        // The smaller files of the default take four to seven times as long.
        encoder.set_compression(png::Compression::Fast);
        let mut writer = encoder.write_header().map_err(PlotError::drawing)?;
        writer.write_image_data(&self.pixels).map_err(PlotError::drawing)?;
        writer.finish().map_err(PlotError::drawing)?;
        Ok(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image in which each pixel is another colour.
    fn image(width: u32, height: u32) -> Raster {
        let pixels = (0..width * height).flat_map(|k| [k as u8, (k / 7) as u8, (3 * k) as u8]).collect();
        Raster { width, height, pixels }
    }

    #[test]
    fn a_png_decodes_to_the_pixels() {
        for (width, height) in [(1, 1), (3, 2), (61, 47), (300, 1)] {
            let image = image(width, height);
            let file = image.png().unwrap();
            let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut pixels).unwrap();
            assert_eq!((info.width, info.height, info.color_type), (width, height, png::ColorType::Rgb));
            assert!(pixels == image.pixels);
        }
        assert!(Raster::new(0, 1).png().is_err());
    }

    #[test]
    fn downsampling_takes_the_mean() {
        let mut image = Raster::new(5, 3);
        image.pixels[0] = 40; // column 0, row 0, red
        image.pixels[(5 + 3) * 3 + 1] = 101; // column 3, row 1, green
        let half = image.downsampled(2);
        assert_eq!((half.width, half.height), (2, 1));
        assert_eq!(half.pixels, [10, 0, 0, 0, 25, 0]);
    }
}
