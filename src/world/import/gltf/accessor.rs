//! The numbers in a buffer of a glTF file, with every offset checked against its length.

use super::{MeshError, malformed};
use crate::geometry::Vector;
use gltf::accessor::{Accessor, DataType, Dimensions};

/// Points: three single-precision numbers each.
pub(super) fn positions(accessor: &Accessor<'_>, buffers: &[Vec<u8>]) -> Result<Vec<Vector>, MeshError> {
    if (accessor.data_type(), accessor.dimensions()) != (DataType::F32, Dimensions::Vec3) {
        return Err(malformed("positions are not three floats"));
    }
    let point = |element: &[u8]| {
        let mut numbers = element.chunks_exact(4).map(|word| f32::from_le_bytes([word[0], word[1], word[2], word[3]]));
        let mut next = || numbers.next().map_or(f64::NAN, f64::from);
        Vector::new(next(), next(), next())
    };
    Ok(elements(accessor, 12, buffers)?.map(point).collect())
}

/// Indices of one, two or four bytes.
pub(super) fn indices(accessor: &Accessor<'_>, buffers: &[Vec<u8>]) -> Result<Vec<i64>, MeshError> {
    let size = match (accessor.data_type(), accessor.dimensions()) {
        (DataType::U8, Dimensions::Scalar) => 1,
        (DataType::U16, Dimensions::Scalar) => 2,
        (DataType::U32, Dimensions::Scalar) => 4,
        _ => return Err(malformed("indices are not unsigned integers")),
    };
    let index = |element: &[u8]| element.iter().rev().fold(0, |index, byte| index << 8 | i64::from(*byte));
    Ok(elements(accessor, size, buffers)?.map(index).collect())
}

/// The elements of an accessor, `size` bytes each.
fn elements<'b>(
    accessor: &Accessor<'_>,
    size: usize,
    buffers: &'b [Vec<u8>],
) -> Result<impl Iterator<Item = &'b [u8]>, MeshError> {
    if accessor.sparse().is_some() {
        return Err(malformed("it has sparse accessors, which are not read: export it without"));
    }
    let view = accessor.view().ok_or_else(|| malformed("an accessor has no data"))?;
    let (stride, count) = (view.stride().unwrap_or(size), accessor.count());
    let span = || {
        let buffer = buffers.get(view.buffer().index())?;
        let view_bytes = buffer.get(view.offset()..view.offset().checked_add(view.length())?)?;
        let last = count.checked_sub(1)?.checked_mul(stride)?.checked_add(size)?;
        view_bytes.get(accessor.offset()..accessor.offset().checked_add(last)?)
    };
    let bytes = if count == 0 { Some(&[][..]) } else { span() };
    let bytes = bytes
        .filter(|_| stride >= size)
        .ok_or_else(|| malformed(format!("accessor {} reaches beyond its buffer", accessor.index())))?;
    Ok((0..count).map(move |k| &bytes[k * stride..k * stride + size]))
}

/// Decodes base64 (RFC 4648), padded or not.
pub(super) fn base64(text: &str) -> Option<Vec<u8>> {
    let digits = text.trim_end_matches('=').bytes().map(|byte| match byte {
        b'A'..=b'Z' => Some(byte - b'A'),
        b'a'..=b'z' => Some(byte - b'a' + 26),
        b'0'..=b'9' => Some(byte - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    });
    let digits = digits.collect::<Option<Vec<u8>>>()?;
    let bytes = |group: &[u8]| {
        let bits = group.iter().fold(0_u32, |bits, digit| bits << 6 | u32::from(*digit)) << (6 * (4 - group.len()));
        bits.to_be_bytes()[1..group.len()].to_vec()
    };
    Some(digits.chunks(4).flat_map(bytes).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_agrees_with_the_vectors_of_its_standard() {
        // RFC 4648, section 10.
        for (text, bytes) in
            [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg==", "foob"), ("Zm9vYmE", "fooba")]
        {
            assert_eq!(base64(text).unwrap(), bytes.as_bytes());
        }
        assert!(base64("Zm9*").is_none());
    }
}
