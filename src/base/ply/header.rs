//! Header of a PLY file.

use super::Problem;
use super::lines::Lines;
use std::io::BufRead;

/// Maximum length of a line of a header, bytes.
const MAX_LINE_BYTES: usize = 4096;

/// Maximum number of lines of a header.
const MAX_LINES: usize = 1000;

/// Encoding of the elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlyFormat {
    /// Text, one element per line.
    Ascii,
    /// Binary, least significant byte first.
    LittleEndian,
    /// Binary, most significant byte first.
    BigEndian,
}

/// Numeric type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    /// Signed integer with this number of bytes.
    Signed(usize),
    /// Unsigned integer with this number of bytes.
    Unsigned(usize),
    /// Float of four bytes.
    Float,
    /// Float of eight bytes.
    Double,
}

impl Scalar {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::Signed(1),
            "uchar" | "uint8" => Self::Unsigned(1),
            "short" | "int16" => Self::Signed(2),
            "ushort" | "uint16" => Self::Unsigned(2),
            "int" | "int32" => Self::Signed(4),
            "uint" | "uint32" => Self::Unsigned(4),
            "float" | "float32" => Self::Float,
            "double" | "float64" => Self::Double,
            _ => return None,
        })
    }

    /// Size, bytes.
    pub fn size(self) -> usize {
        match self {
            Self::Signed(size) | Self::Unsigned(size) => size,
            Self::Float => 4,
            Self::Double => 8,
        }
    }

    /// Value of a number whose bytes are at the start of `word`, least significant first; the others are zero.
    pub fn number(self, word: [u8; 8]) -> f64 {
        let [a, b, c, d, ..] = word;
        match self {
            Self::Signed(1) => f64::from(a.cast_signed()),
            Self::Signed(2) => f64::from(i16::from_le_bytes([a, b])),
            Self::Signed(_) => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::Unsigned(_) => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::Float => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::Double => f64::from_le_bytes(word),
        }
    }
}

/// Type of a property.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PropertyKind {
    /// One number.
    Number(Scalar),
    /// A count and as many numbers.
    List {
        /// Type of the count.
        count: Scalar,
        /// Type of the numbers.
        item: Scalar,
    },
}

/// Property of an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Property {
    /// Property name.
    pub name: String,
    /// Type.
    pub kind: PropertyKind,
}

/// Kind of element, such as vertices or faces.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Element {
    /// Name of the element.
    pub name: String,
    /// Number of elements.
    pub count: u64,
    /// Properties of each, in order.
    pub properties: Vec<Property>,
}

impl Element {
    /// Index of the property with one of these names, in any case; earlier names have precedence.
    pub fn property(&self, names: &[&str]) -> Option<usize> {
        names.iter().find_map(|name| self.properties.iter().position(|p| p.name.eq_ignore_ascii_case(name)))
    }
}

/// Content of a header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// Encoding of the elements.
    pub format: PlyFormat,
    /// The elements, in order.
    pub elements: Vec<Element>,
    /// Comments.
    pub comments: Vec<String>,
    /// Number of lines of the header.
    pub lines: usize,
}

/// Reads the header after its first line.
pub(super) fn read<R: BufRead>(lines: &mut Lines<R>) -> Result<Header, Problem> {
    let (mut format, mut elements, mut comments) = (None, Vec::<Element>::new(), Vec::new());
    loop {
        let text = lines.next(MAX_LINE_BYTES)?.filter(|_| lines.count <= MAX_LINES);
        let line = lines.count;
        let problem = |problem: String| (line, problem);
        let text = text.ok_or_else(|| problem("the header does not end".to_owned()))?;
        let words: Vec<&str> = text.split_whitespace().collect();
        match words.as_slice() {
            ["comment", ..] => comments.push(text.trim().trim_start_matches("comment").trim().to_owned()),
            ["obj_info", ..] | [] => {}
            ["format", name, "1.0"] => format = parse_format(name),
            ["element", name, count] => {
                let count = count.parse().map_err(|_| problem(format!("`{count}` is not a number of elements")))?;
                elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
            }
            ["property", kind @ .., name] => {
                let element = elements.last_mut().ok_or_else(|| problem("a property of no element".to_owned()))?;
                let kind = parse_kind(kind).ok_or_else(|| problem("unknown property type".to_owned()))?;
                element.properties.push(Property { name: (*name).to_owned(), kind });
            }
            ["end_header"] => break,
            _ => return Err(problem("this line is not part of a PLY header".to_owned())),
        }
    }
    let format = format.ok_or((lines.count, "the header has no known format".to_owned()))?;
    Ok(Header { format, elements, comments, lines: lines.count })
}

fn parse_kind(words: &[&str]) -> Option<PropertyKind> {
    match words {
        [kind] => Scalar::parse(kind).map(PropertyKind::Number),
        ["list", count, item] => {
            let count = Scalar::parse(count).filter(|count| !matches!(count, Scalar::Float | Scalar::Double))?;
            Some(PropertyKind::List { count, item: Scalar::parse(item)? })
        }
        _ => None,
    }
}

fn parse_format(name: &str) -> Option<PlyFormat> {
    match name {
        "ascii" => Some(PlyFormat::Ascii),
        "binary_little_endian" => Some(PlyFormat::LittleEndian),
        "binary_big_endian" => Some(PlyFormat::BigEndian),
        _ => None,
    }
}
