//! Access to the buffers of a glTF file, with checks of every index and offset.

use super::document::{Accessor, Document};
use super::error::malformed;
use crate::import::error::MeshError;
use std::borrow::Cow;
use zsim_base::geometry::Vector;

/// Values of `componentType` in the specification.
const U8: u32 = 5121;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// A document with the bytes of the buffers.
pub(super) struct Data<'a> {
    pub document: Document,
    pub buffers: Vec<Cow<'a, [u8]>>,
}

impl Data<'_> {
    /// The points of an accessor: three single-precision numbers each.
    pub fn positions(&self, index: usize) -> Result<impl ExactSizeIterator<Item = Vector>, MeshError> {
        let accessor = self.accessor(index)?;
        if accessor.component_type != F32 || accessor.shape != "VEC3" {
            return Err(malformed("positions are not three floats"));
        }
        let point = |element: &[u8]| {
            let mut words =
                element.chunks_exact(4).map(|word| f32::from_le_bytes([word[0], word[1], word[2], word[3]]));
            let mut next = || words.next().map_or(f64::NAN, f64::from);
            Vector::new(next(), next(), next())
        };
        Ok(self.elements(index, accessor, 12)?.map(point))
    }

    /// The indices of an accessor: one, two or four bytes each.
    pub fn indices(&self, index: usize) -> Result<impl ExactSizeIterator<Item = i64>, MeshError> {
        let accessor = self.accessor(index)?;
        let size = match (accessor.component_type, accessor.shape.as_str()) {
            (U8, "SCALAR") => 1,
            (U16, "SCALAR") => 2,
            (U32, "SCALAR") => 4,
            _ => return Err(malformed("indices are not unsigned integers")),
        };
        let value = |element: &[u8]| element.iter().rev().fold(0, |value, byte| value << 8 | i64::from(*byte));
        Ok(self.elements(index, accessor, size)?.map(value))
    }

    fn accessor(&self, index: usize) -> Result<&Accessor, MeshError> {
        let accessor = self.document.accessors.0.get(index);
        let accessor =
            accessor.ok_or_else(|| malformed(format!("it refers to accessor {index}, which does not exist")))?;
        if accessor.sparse.is_some() {
            return Err(malformed("it has sparse accessors, which are not supported: export without them"));
        }
        Ok(accessor)
    }

    /// The elements of an accessor, `size` bytes each.
    fn elements(
        &self,
        index: usize,
        accessor: &Accessor,
        size: usize,
    ) -> Result<impl ExactSizeIterator<Item = &[u8]>, MeshError> {
        let span = || {
            let view = self.document.buffer_views.0.get(accessor.buffer_view?)?;
            let stride = view.byte_stride.unwrap_or(size);
            let bytes = self.buffers.get(view.buffer)?;
            let bytes = bytes.get(view.byte_offset..view.byte_offset.checked_add(view.byte_length)?)?;
            let length = match accessor.count.checked_sub(1) {
                Some(before) => before.checked_mul(stride)?.checked_add(size)?,
                None => 0,
            };
            let bytes = bytes.get(accessor.byte_offset..accessor.byte_offset.checked_add(length)?)?;
            (stride >= size).then_some((stride, bytes))
        };
        let (stride, bytes) = span().ok_or_else(|| malformed(format!("accessor {index} extends beyond its buffer")))?;
        Ok((0..accessor.count).map(move |k| &bytes[k * stride..k * stride + size]))
    }
}
