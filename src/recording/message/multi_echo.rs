//! `sensor_msgs/MultiEchoLaserScan`: a planar sweep with several echoes per beam.

use crate::message::scan::{ScanHeader, build_planar};
use crate::wire::{DecodeError, Decoder, Payload};
use zsim_base::measurement::PlanarScan;
use zsim_base::time::Stamp;

/// Decodes a sweep with one echo per beam: the strongest if each has an intensity, else the first.
///
/// # Errors
/// When the bytes are not a `MultiEchoLaserScan`, or its angles or times are unusable.
pub fn decode(message: Payload<'_>) -> Result<(Stamp, PlanarScan), DecodeError> {
    let mut input = Decoder::new(message)?;
    let (stamp, _) = input.header()?;
    let header = ScanHeader::decode(&mut input)?;
    let ranges = echoes(&mut input, message)?;
    let intensities = echoes(&mut input, message)?;
    let has_intensities = !intensities.is_empty()
        && intensities.len() == ranges.len()
        && ranges.iter().zip(&intensities).all(|(ranges, intensities)| ranges.len() == intensities.len());
    let strongest = |k: usize| {
        let of_beam =
            if has_intensities { intensities[k].iter().copied().enumerate() } else { [].iter().copied().enumerate() };
        of_beam.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0))).map_or((0, 0.0), |echo| echo)
    };
    let chosen: Vec<_> = (0..ranges.len()).map(strongest).collect();
    let ranges_m = ranges.iter().zip(&chosen).map(|(echoes, (k, _))| echoes.get(*k).copied().unwrap_or(f32::INFINITY));
    let strengths = if has_intensities { chosen.iter().map(|(_, strength)| *strength).collect() } else { Vec::new() };
    Ok((stamp, build_planar(header, ranges_m.collect(), strengths)?))
}

/// Decodes the echoes of each beam.
fn echoes(input: &mut Decoder<'_>, message: Payload<'_>) -> Result<Vec<Vec<f32>>, DecodeError> {
    let count = input.u32()? as usize;
    if count > message.bytes.len() / 4 {
        return Err(DecodeError::Short);
    }
    (0..count).map(|_| input.f32_sequence()).collect()
}
