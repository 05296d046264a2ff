//! The header of a PLY file.

use std::io::{BufRead, Read};

/// Longest line that is read, bytes.
pub const LONGEST_LINE: u64 = 4096;

/// Most lines of a header.
const MOST_LINES: usize = 1000;

/// How the elements are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// As text, an element a line.
    Ascii,
    /// As bytes, the least significant first.
    LittleEndian,
    /// As bytes, the most significant first.
    BigEndian,
}

/// A type of number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    /// A signed integer of so many bytes.
    Signed(usize),
    /// An unsigned integer of so many bytes.
    Unsigned(usize),
    /// A float of four bytes.
    Float,
    /// A float of eight bytes.
    Double,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
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

    /// Bytes of it.
    pub fn size(self) -> usize {
        match self {
            Self::Signed(size) | Self::Unsigned(size) => size,
            Self::Float => 4,
            Self::Double => 8,
        }
    }

    /// The number whose bytes, the least significant first, lead `word`; the others are zero.
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

/// A number of each point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Property {
    /// Its name.
    pub name: String,
    /// Its type.
    pub scalar: Scalar,
}

/// What a header says of the points.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// How they are written.
    pub form: Form,
    /// How many there are.
    pub count: u64,
    /// The numbers of each, in order.
    pub properties: Vec<Property>,
    /// What its comments say.
    pub comments: Vec<String>,
    /// Lines of the header.
    pub lines: usize,
}

/// What is wrong, and in which line.
pub type Problem = (usize, String);

/// Reads a header; the points must be the file's first element.
pub fn read(input: &mut impl BufRead) -> Result<Header, Problem> {
    let mut header = Header { form: Form::Ascii, count: 0, properties: Vec::new(), comments: Vec::new(), lines: 0 };
    let (mut form, mut elements) = (None, 0);
    loop {
        let text = next_line(input, &mut header)?;
        let problem = |problem: &str| Err((header.lines, problem.to_owned()));
        let words: Vec<&str> = text.split_whitespace().collect();
        match words.as_slice() {
            ["ply"] if header.lines == 1 => {}
            _ if header.lines == 1 => return problem("this is not a PLY file: it does not begin with `ply`"),
            ["comment", ..] => header.comments.push(text.trim().trim_start_matches("comment").trim().to_owned()),
            ["obj_info", ..] | [] => {}
            ["format", name, "1.0"] => form = form_named(name),
            ["element", "vertex", count] if elements == 0 => {
                elements = 1;
                header.count =
                    count.parse().map_err(|_| (header.lines, format!("`{count}` is no number of points")))?;
            }
            ["element", ..] if elements == 0 => return problem("the first element is not `vertex`"),
            ["element", ..] => elements += 1,
            ["property", ..] if elements != 1 => {}
            ["property", "list", ..] => return problem("a point with a list in it cannot be read"),
            ["property", kind, name] => match Scalar::named(kind) {
                Some(scalar) => header.properties.push(Property { name: (*name).to_owned(), scalar }),
                None => return problem("the property's type is not known"),
            },
            ["end_header"] => break,
            _ => return problem("this line is not part of a PLY header"),
        }
    }
    header.form = form.ok_or((header.lines, "the header names no format that is known".to_owned()))?;
    if elements == 0 {
        return Err((header.lines, "there is no element `vertex`".to_owned()));
    }
    Ok(header)
}

fn form_named(name: &str) -> Option<Form> {
    match name {
        "ascii" => Some(Form::Ascii),
        "binary_little_endian" => Some(Form::LittleEndian),
        "binary_big_endian" => Some(Form::BigEndian),
        _ => None,
    }
}

fn next_line(input: &mut impl BufRead, header: &mut Header) -> Result<String, Problem> {
    header.lines += 1;
    let line = header.lines;
    let mut bytes = Vec::new();
    let read = input.take(LONGEST_LINE).read_until(b'\n', &mut bytes).map_err(|error| (line, error.to_string()))?;
    if read == 0 || line > MOST_LINES {
        return Err((line, "the header does not end".to_owned()));
    }
    String::from_utf8(bytes).map_err(|_| (line, "this is not a PLY file: its header is not text".to_owned()))
}
