//! Layout and data of a cloud.

use super::fields::Field;
use super::time_field::{TIME_NAMES, TimeField};
use crate::topics::shortened;
use crate::wire::{DecodeError, Decoder, Payload};
use zsim_base::time::Stamp;

/// Maximum number of fields of a point.
const MAX_FIELDS: usize = 256;

/// Maximum number of fields in a list for messages.
const MAX_LISTED: usize = 20;

/// Layout and data of a cloud.
pub struct Cloud<'a> {
    pub stamp: Stamp,
    pub big_endian: bool,
    /// Length of a row that the message states, bytes, if it contradicts the data.
    pub wrong_row_step: Option<usize>,
    fields: Vec<Field<'a>>,
    width: usize,
    point_step: usize,
    row_step: usize,
    data: &'a [u8],
}

impl<'a> Cloud<'a> {
    /// Decodes the layout.
    ///
    /// # Errors
    /// When the bytes are not a `PointCloud2`, or the data are shorter than width and height require.
    pub fn decode(message: Payload<'a>) -> Result<Self, DecodeError> {
        let mut input = Decoder::new(message)?;
        let (stamp, _) = input.header()?;
        let (height, width) = (input.u32()? as usize, input.u32()? as usize);
        let count = input.u32()? as usize;
        if count > MAX_FIELDS {
            return Err(DecodeError::Contradiction("a cloud has more than 256 fields"));
        }
        let fields = (0..count).map(|_| decode_field(&mut input)).collect::<Result<Vec<_>, DecodeError>>()?;
        let big_endian = input.u8()? != 0;
        let (point_step, stated_row_step) = (input.u32()? as usize, input.u32()? as usize);
        let data = input.bytes()?;
        let row = width.checked_mul(point_step).ok_or(DecodeError::Short)?;
        let size = |row_step: usize| height.saturating_sub(1).checked_mul(row_step)?.checked_add(row);
        let fits = |row_step: usize| size(row_step).is_some_and(|size| size <= data.len());
        // Some writers omit the length of a row, or write another number. Rows without gaps that fill the data are certain.
        let is_packed = size(row) == Some(data.len());
        let is_valid = height > 1 && !is_packed && stated_row_step >= row && fits(stated_row_step);
        let row_step = if is_valid { stated_row_step } else { row };
        if height > 0 && !fits(row_step) {
            return Err(DecodeError::Contradiction("a cloud has less data than its width and height require"));
        }
        let data = if height > 0 { &data[..size(row_step).unwrap_or(0)] } else { &[] };
        let wrong_row_step = (height > 1 && row_step != stated_row_step).then_some(stated_row_step);
        Ok(Self { stamp, big_endian, wrong_row_step, fields, width, point_step, row_step, data })
    }

    /// Finds a field that can be read.
    pub fn readable_field(&self, name: &str) -> Option<&Field<'a>> {
        self.fields.iter().find(|field| field.name == name && field.check(self.point_step).is_ok())
    }

    /// Whether the cloud has no points.
    pub fn is_empty(&self) -> bool {
        self.data.is_empty() || self.width == 0
    }

    /// Maximum number of points in the data.
    pub fn count(&self) -> usize {
        self.data.len() / self.point_step.max(1)
    }

    /// Finds the coordinates.
    ///
    /// # Errors
    /// When one is missing or cannot be read.
    pub fn coordinates(&self) -> Result<[&Field<'a>; 3], DecodeError> {
        let coordinate = |name: &str| {
            let field = self.fields.iter().find(|field| field.name == name);
            let field = field.ok_or(DecodeError::Contradiction("a cloud has no fields x, y and z"))?;
            field.check(self.point_step).map(|()| field)
        };
        Ok([coordinate("x")?, coordinate("y")?, coordinate("z")?])
    }

    /// Finds the time field of the name number `source`.
    pub fn time_field(&self, source: usize) -> Option<TimeField<'a>> {
        TimeField::find(&self.fields, source, self.point_step, self.big_endian)
    }

    /// Finds the first time field that is not the same in all returns, else the first.
    pub fn time_source(&self) -> Option<usize> {
        let sources = || (0..TIME_NAMES.len()).filter_map(|source| Some((source, self.time_field(source)?)));
        let coordinates = self.coordinates().ok()?;
        let is_return = |point: &&[u8]| {
            let numbers = coordinates.map(|field| field.number(point, self.big_endian));
            numbers.iter().all(|number| number.is_finite()) && numbers.iter().any(|number| *number != 0.0)
        };
        let varies = |(_, field): &(usize, TimeField<'_>)| {
            let mut times = self.points().filter(is_return).map(|point| field.number(point, self.big_endian));
            let first = times.next();
            times.any(|time| Some(time) != first)
        };
        sources().find(varies).or_else(|| sources().next()).map(|(source, _)| source)
    }

    /// Lists the fields with their types.
    pub fn field_list(&self) -> String {
        let field = |field: &Field<'_>| format!("{} ({})", shortened(field.name), field.type_name());
        let mut list: Vec<_> = self.fields.iter().take(MAX_LISTED).map(field).collect();
        if self.fields.len() > MAX_LISTED {
            list.push(format!("and {} more", self.fields.len() - MAX_LISTED));
        }
        if list.is_empty() { "none".to_owned() } else { list.join(", ") }
    }

    /// The bytes of each point.
    pub fn points(&self) -> impl Iterator<Item = &'a [u8]> {
        let (row, step) = (self.width * self.point_step, self.point_step.max(1));
        self.data.chunks(self.row_step.max(1)).flat_map(move |bytes| bytes[..row.min(bytes.len())].chunks_exact(step))
    }
}

fn decode_field<'a>(input: &mut Decoder<'a>) -> Result<Field<'a>, DecodeError> {
    let name = input.string()?;
    let offset = input.u32()? as usize;
    let kind = input.u8()?;
    Ok(Field { name, offset, kind, count: input.u32()? })
}
