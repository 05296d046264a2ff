use super::Problem;
use super::header::{self, Element, Header, PlyFormat, PropertyKind, Scalar};
use super::lines::Lines;
use std::io::{BufRead, BufReader, ErrorKind, Read};

/// Maximum number of items of a list: the corners of a face.
pub const MAX_LIST_ITEMS: usize = 10_000;

/// Maximum length of a line of numbers, bytes: a list with 25 characters for each item.
const MAX_LINE_BYTES: usize = 25 * MAX_LIST_ITEMS;

/// Reads the header and the elements of a file sequentially.
pub struct PlyReader<R: Read> {
    lines: Lines<BufReader<R>>,
    header: Header,
}

/// Numbers of one element. Reused for all, so that reading does not allocate.
#[derive(Debug, Default)]
pub struct Row {
    numbers: Vec<f64>,
    /// For each property, the end of its numbers.
    ends: Vec<usize>,
}

impl Row {
    /// Numbers of the property with this index: one, or the items of a list.
    pub fn property(&self, index: usize) -> &[f64] {
        let start = index.checked_sub(1).and_then(|before| self.ends.get(before)).map_or(0, |end| *end);
        self.ends.get(index).and_then(|end| self.numbers.get(start..*end)).unwrap_or_default()
    }

    /// The number of the property with this index; NaN if there is none.
    pub fn number(&self, index: usize) -> f64 {
        self.property(index).first().copied().unwrap_or(f64::NAN)
    }

    fn end_property(&mut self) {
        self.ends.push(self.numbers.len());
    }
}

/// Why an element cannot be read.
#[derive(Debug, PartialEq, Eq)]
pub enum Failure {
    /// The file ends before the element does.
    End,
    /// Another problem.
    Problem(String),
}

impl<R: Read> PlyReader<R> {
    /// Reads the header of `input`.
    ///
    /// # Errors
    /// Line and problem, if it is not the header of a PLY file.
    pub fn new(input: R) -> Result<Self, Problem> {
        let mut lines = Lines::start(BufReader::with_capacity(1 << 16, input))?;
        let header = header::read(&mut lines)?;
        Ok(Self { lines, header })
    }

    /// The header.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Number of the last line that was read, from 1; that of the header's end in a binary file.
    pub fn line(&self) -> usize {
        self.lines.count
    }

    /// The input after the elements that were read.
    pub fn input(&mut self) -> &mut BufReader<R> {
        &mut self.lines.input
    }

    /// Reads the next element, of the kind `element`, into `row`.
    ///
    /// # Errors
    /// If the file ends, a word is not a number, or a list has more than [`MAX_LIST_ITEMS`] items.
    pub fn read(&mut self, element: &Element, row: &mut Row) -> Result<(), Failure> {
        row.numbers.clear();
        row.ends.clear();
        match self.header.format {
            PlyFormat::Ascii => self.read_line(element, row),
            PlyFormat::LittleEndian => self.read_binary(element, row, false),
            PlyFormat::BigEndian => self.read_binary(element, row, true),
        }
    }

    fn read_binary(&mut self, element: &Element, row: &mut Row, is_big_endian: bool) -> Result<(), Failure> {
        for property in &element.properties {
            match property.kind {
                PropertyKind::Number(scalar) => row.numbers.push(number(&mut self.lines.input, scalar, is_big_endian)?),
                PropertyKind::List { count, item } => {
                    let count = list_length(number(&mut self.lines.input, count, is_big_endian)?)?;
                    for _ in 0..count {
                        row.numbers.push(number(&mut self.lines.input, item, is_big_endian)?);
                    }
                }
            }
            row.end_property();
        }
        Ok(())
    }

    fn read_line(&mut self, element: &Element, row: &mut Row) -> Result<(), Failure> {
        let text = loop {
            let line = self.lines.next(MAX_LINE_BYTES).map_err(|(_, problem)| Failure::Problem(problem))?;
            let line = line.ok_or(Failure::End)?;
            if !line.trim().is_empty() || element.properties.is_empty() {
                break line;
            }
        };
        let mut words = text.split_whitespace();
        let mut number = || {
            let word = words.next().ok_or_else(|| too_short(element, &text))?;
            word.parse::<f64>().map_err(|_| Failure::Problem(format!("`{}` is not a number", shortened(word))))
        };
        for property in &element.properties {
            match property.kind {
                PropertyKind::Number(_) => row.numbers.push(number()?),
                PropertyKind::List { .. } => {
                    for _ in 0..list_length(number()?)? {
                        row.numbers.push(number()?);
                    }
                }
            }
            row.end_property();
        }
        Ok(())
    }
}

fn too_short(element: &Element, line: &str) -> Failure {
    let found = line.split_whitespace().count();
    let is_list = |kind: &PropertyKind| matches!(kind, PropertyKind::List { .. });
    let needed = match element.properties.iter().any(|property| is_list(&property.kind)) {
        true => format!("more than {found} numbers"),
        false => format!("{} numbers", element.properties.len()),
    };
    Failure::Problem(format!("a `{}` needs {needed}, but the line has {found}", element.name))
}

fn shortened(word: &str) -> String {
    word.chars().take(40).collect()
}

fn list_length(count: f64) -> Result<usize, Failure> {
    if (0.0..=MAX_LIST_ITEMS as f64).contains(&count) {
        Ok(count as usize)
    } else {
        Err(Failure::Problem(format!("a list has {count} items; the maximum is {MAX_LIST_ITEMS}")))
    }
}

fn number(input: &mut impl BufRead, scalar: Scalar, is_big_endian: bool) -> Result<f64, Failure> {
    let mut word = [0; 8];
    let bytes = &mut word[..scalar.size()];
    input.read_exact(bytes).map_err(|error| match error.kind() {
        ErrorKind::UnexpectedEof => Failure::End,
        _ => Failure::Problem(error.to_string()),
    })?;
    if is_big_endian {
        bytes.reverse();
    }
    Ok(scalar.number(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "ply\nformat ascii 1.0\ncomment B\u{fc}ro\nelement vertex 2\nproperty float x\nelement face 1\n\
                          property list uchar int vertex_indices\nproperty uchar red\nend_header\n";

    /// The numbers of all elements of a file.
    fn read(bytes: &[u8]) -> Result<Vec<Vec<f64>>, String> {
        let mut reader = PlyReader::new(bytes).map_err(|(line, problem)| format!("{line}: {problem}"))?;
        let (mut row, mut all) = (Row::default(), Vec::new());
        for element in reader.header().elements.clone() {
            for _ in 0..element.count {
                reader.read(&element, &mut row).map_err(|failure| format!("{}: {failure:?}", reader.line()))?;
                all.push((0..element.properties.len()).flat_map(|k| row.property(k).to_vec()).collect());
            }
        }
        Ok(all)
    }

    #[test]
    fn all_encodings_and_line_ends_give_the_same_numbers() {
        let expected = [vec![1.5], vec![10.0], vec![0.0, 1.0, 200.0]];
        let text = format!("{HEADER}1.5\n\n10\n2 0 1 200\n");
        let mut files: Vec<Vec<u8>> =
            ["\n", "\r\n", "\r"].iter().map(|end| text.replace('\n', end).into_bytes()).collect();
        files.push(format!("\u{feff}{text}").into_bytes());
        files.push(text.chars().map(|c| c as u8).collect());
        // 10 is 0x41200000, so with big-endian floats the first bytes after CR are no line feed; with 0x0a... they are.
        for (format, is_big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
            for end in ["\n", "\r\n", "\r"] {
                let mut bytes = HEADER.replace("ascii", format).replace('\n', end).into_bytes();
                let order = |word: [u8; 4]| if is_big { word.into_iter().rev().collect() } else { word.to_vec() };
                [1.5_f32, 10.0].iter().for_each(|x| bytes.extend(order(x.to_le_bytes())));
                bytes.push(2);
                [0_i32, 1].iter().for_each(|k| bytes.extend(order(k.to_le_bytes())));
                bytes.push(200);
                files.push(bytes);
            }
        }
        for file in files {
            assert_eq!(read(&file).unwrap(), expected, "{}", String::from_utf8_lossy(&file));
        }
    }

    #[test]
    fn a_binary_element_can_start_with_the_byte_of_a_line_feed() {
        let header = "ply\rformat binary_little_endian 1.0\relement vertex 1\rproperty uchar x\rend_header\r";
        assert_eq!(read(&[header.as_bytes(), b"\n"].concat()).unwrap(), [[10.0]]);
    }

    #[test]
    fn a_declared_number_reserves_no_memory() {
        let faces = "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint uchar vertex_indices\nend_header\n";
        let long = [faces.as_bytes(), &60_000_000_u32.to_le_bytes(), &[0; 100]].concat();
        assert!(read(&long).unwrap_err().contains("a list has 60000000 items; the maximum is 10000"));
        let many =
            [faces.replace("face 1", "face 18446744073709551615").as_bytes(), &3_u32.to_le_bytes(), &[0; 3]].concat();
        assert_eq!(read(&many).unwrap_err(), "5: End");
        let negative = faces.replace("uint uchar", "char uchar");
        assert!(read(&[negative.as_bytes(), &[0x80]].concat()).unwrap_err().contains("a list has -128 items"));
    }

    #[test]
    fn an_error_has_its_line() {
        let message = |from: &str, to: &str| {
            read(format!("{HEADER}1\n2\n2 0 1 9\n").replacen(from, to, 1).as_bytes()).unwrap_err()
        };
        assert!(message("ply\n", "plyx\n").starts_with("1: this is not a PLY file"));
        assert_eq!(message("1.0", "2.0"), "2: this line is not part of a PLY header");
        assert_eq!(message("vertex 2", "vertex two"), "4: `two` is not a number of elements");
        assert_eq!(message("float x", "quad x"), "5: unknown property type");
        assert_eq!(message("end_header\n1\n2\n2 0 1 9\n", ""), "9: the header does not end");
        assert_eq!(message("1 9\n", "\n"), "12: Problem(\"a `face` needs more than 2 numbers, but the line has 2\")");
        assert_eq!(message("2 0 1 9\n", ""), "12: End");
    }
}
