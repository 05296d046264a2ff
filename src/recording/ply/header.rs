//! Header of a PLY file.

use std::io::{BufRead, Read};

/// Maximum length of a line, bytes.
pub const MAX_LINE_BYTES: u64 = 4096;

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

/// Numeric property of each point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Property {
    /// Property name.
    pub name: String,
    /// Numeric type.
    pub scalar: Scalar,
}

/// Content of a header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// Encoding of the points.
    pub format: PlyFormat,
    /// Number of points.
    pub count: u64,
    /// Properties of each point, in order.
    pub properties: Vec<Property>,
    /// Comments.
    pub comments: Vec<String>,
    /// Number of lines of the header.
    pub lines: usize,
}

/// Line number and description of a problem.
pub type Problem = (usize, String);

/// Reads a header; the points must be the file's first element.
pub fn read(input: &mut impl BufRead) -> Result<Header, Problem> {
    let mut header =
        Header { format: PlyFormat::Ascii, count: 0, properties: Vec::new(), comments: Vec::new(), lines: 0 };
    let (mut format, mut elements) = (None, 0);
    loop {
        let text = next_line(input, &mut header)?;
        let problem = |problem: &str| Err((header.lines, problem.to_owned()));
        let words: Vec<&str> = text.split_whitespace().collect();
        match words.as_slice() {
            ["ply"] if header.lines == 1 => {}
            _ if header.lines == 1 => return problem("this is not a PLY file: it does not start with `ply`"),
            ["comment", ..] => header.comments.push(text.trim().trim_start_matches("comment").trim().to_owned()),
            ["obj_info", ..] | [] => {}
            ["format", name, "1.0"] => format = parse_format(name),
            ["element", "vertex", count] if elements == 0 => {
                elements = 1;
                header.count =
                    count.parse().map_err(|_| (header.lines, format!("`{count}` is not a number of points")))?;
            }
            ["element", ..] if elements == 0 => return problem("the first element is not `vertex`"),
            ["element", ..] => elements += 1,
            ["property", ..] if elements != 1 => {}
            ["property", "list", ..] => return problem("list properties of points are not supported"),
            ["property", kind, name] => match Scalar::parse(kind) {
                Some(scalar) => header.properties.push(Property { name: (*name).to_owned(), scalar }),
                None => return problem("unknown property type"),
            },
            ["end_header"] => break,
            _ => return problem("this line is not part of a PLY header"),
        }
    }
    header.format = format.ok_or((header.lines, "the header has no known format".to_owned()))?;
    if elements == 0 {
        return Err((header.lines, "there is no element `vertex`".to_owned()));
    }
    Ok(header)
}

fn parse_format(name: &str) -> Option<PlyFormat> {
    match name {
        "ascii" => Some(PlyFormat::Ascii),
        "binary_little_endian" => Some(PlyFormat::LittleEndian),
        "binary_big_endian" => Some(PlyFormat::BigEndian),
        _ => None,
    }
}

fn next_line(input: &mut impl BufRead, header: &mut Header) -> Result<String, Problem> {
    header.lines += 1;
    let line = header.lines;
    let mut bytes = Vec::new();
    let read = input.take(MAX_LINE_BYTES).read_until(b'\n', &mut bytes).map_err(|error| (line, error.to_string()))?;
    if read == 0 || line > MAX_LINES {
        return Err((line, "the header does not end".to_owned()));
    }
    String::from_utf8(bytes).map_err(|_| (line, "this is not a PLY file: its header is not text".to_owned()))
}
