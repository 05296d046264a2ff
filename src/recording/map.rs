//! Maps as PLY: surfels with their uncertainty, which CloudCompare and Open3D show as points with normals. The format
//! is told in `docs/guide/maps.md`.

use super::ply::header::{self, Form, Header, Problem, Property, Scalar};
use crate::geometry::{Matrix, Vector};
use crate::recording::RecordingError;
use crate::surfel_map::{MapSurfel, SurfelMap, SurfelMapError};
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, ErrorKind, Read, Write};
use std::path::Path;

/// Version of the format.
const VERSION: u32 = 1;
/// The comment that says what the file is, before the version.
const TITLE: &str = "zsim surfel map ";
/// Numbers of a surfel, all double but the last.
const NUMBERS: [&str; 14] =
    ["x", "y", "z", "nx", "ny", "nz", "cxx", "cxy", "cxz", "cyy", "cyz", "czz", "points", "sigma"];
/// The last one, of one byte.
const LEVEL: &str = "level";
/// Bytes of a surfel.
const ROW_BYTES: usize = 8 * NUMBERS.len() + 1;

/// Writes a map.
///
/// # Errors
/// When it cannot be written.
pub fn write_surfel_map(out: impl Write, map: &SurfelMap) -> Result<(), RecordingError> {
    let mut out = BufWriter::new(out);
    let count = map.surfels().len() as u64;
    let mut sum = checksum_of(map.finest_voxel_m(), map.levels(), count);
    map.surfels().iter().for_each(|surfel| sum.update(&row_of(surfel)));
    let (voxel_m, levels, sum) = (map.finest_voxel_m(), map.levels(), sum.finalize());
    let mut write = || -> std::io::Result<()> {
        write!(
            out,
            "ply\nformat binary_little_endian 1.0\ncomment {TITLE}{VERSION}\ncomment metres; sigma: standard deviation along \
             the normal; c: second moment\ncomment finest_voxel_m {voxel_m}\ncomment levels {levels}\ncomment crc32 {sum:08x}\n\
             element vertex {count}\n"
        )?;
        for name in NUMBERS {
            writeln!(out, "property double {name}")?;
        }
        write!(out, "property uchar {LEVEL}\nend_header\n")?;
        for surfel in map.surfels() {
            out.write_all(&row_of(surfel))?;
        }
        out.flush()
    };
    write().map_err(RecordingError::Write)
}

/// Reads the map at `path`.
///
/// # Errors
/// As [`parse_surfel_map`], and when the file cannot be opened.
pub fn read_surfel_map(path: &Path) -> Result<SurfelMap, RecordingError> {
    let file = File::open(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
    parse_surfel_map(&path.display().to_string(), file)
}

/// Reads a map from `input`, which messages call `name`.
///
/// # Errors
/// When it is no map of ours, of another version, ends early or goes on, is damaged (by its checksum), or holds what is
/// no surfel.
pub fn parse_surfel_map(name: &str, input: impl Read) -> Result<SurfelMap, RecordingError> {
    let mut input = BufReader::with_capacity(1 << 16, input);
    read(&mut input).map_err(|(line, problem)| RecordingError::Line { name: name.to_owned(), line, problem })
}

/// What the header says.
struct About {
    finest_voxel_m: f64,
    levels: usize,
    sum: u32,
}

fn read(input: &mut impl BufRead) -> Result<SurfelMap, Problem> {
    let header = header::read(input)?;
    let about = about(&header)?;
    let mut sum = checksum_of(about.finest_voxel_m, about.levels, header.count);
    let mut surfels = Vec::new();
    let end = header.lines + 1;
    for index in 0..header.count {
        let mut row = [0; ROW_BYTES];
        input.read_exact(&mut row).map_err(|error| match error.kind() {
            ErrorKind::UnexpectedEof => (end, format!("the file ends {} surfels early", header.count - index)),
            _ => (end, error.to_string()),
        })?;
        sum.update(&row);
        surfels.push(surfel_of(&row));
    }
    let rest = input.fill_buf().map_err(|error| (end, error.to_string()))?;
    if !rest.is_empty() {
        return Err((end, format!("the file goes on behind its {} surfels", header.count)));
    }
    if sum.finalize() != about.sum {
        return Err((end, "the file is damaged: its checksum is not that of what it holds".to_owned()));
    }
    SurfelMap::new(about.finest_voxel_m, about.levels, surfels)
        .map_err(|error: SurfelMapError| (end, error.to_string()))
}

fn about(header: &Header) -> Result<About, Problem> {
    let problem = |problem: String| (header.lines, problem);
    let find = |key: &str| header.comments.iter().find_map(|comment| comment.strip_prefix(key));
    let Some(version) = find(TITLE) else {
        let said = format!("this is a PLY file, and no map of ours: no comment says `{}`", TITLE.trim_end());
        return Err(problem(said));
    };
    if version.trim() != VERSION.to_string() {
        let version = version.trim();
        return Err(problem(format!("this is a map of version {version}; this program reads version {VERSION}")));
    }
    let wanted = NUMBERS.iter().map(|name| (*name, Scalar::Double)).chain([(LEVEL, Scalar::Unsigned(1))]);
    let wanted: Vec<Property> = wanted.map(|(name, scalar)| Property { name: name.to_owned(), scalar }).collect();
    if header.form != Form::LittleEndian || header.properties != wanted {
        return Err(problem("a map's surfels have other properties than these".to_owned()));
    }
    let number = |key: &str| {
        let text = find(key).map(str::trim);
        text.ok_or_else(|| problem(format!("there is no comment `{}`", key.trim_end())))
    };
    let wrong = |key: &str, text: &str| problem(format!("`{text}` is no `{}`", key.trim_end()));
    let (voxel, levels, sum) = (number("finest_voxel_m ")?, number("levels ")?, number("crc32 ")?);
    Ok(About {
        finest_voxel_m: voxel.parse().map_err(|_| wrong("finest_voxel_m ", voxel))?,
        levels: levels.parse().map_err(|_| wrong("levels ", levels))?,
        sum: u32::from_str_radix(sum, 16).map_err(|_| wrong("crc32 ", sum))?,
    })
}

/// A checksum (CRC-32 of IEEE 802.3) of what the header says, to which the surfels' bytes come.
fn checksum_of(finest_voxel_m: f64, levels: usize, count: u64) -> crc32fast::Hasher {
    let mut sum = crc32fast::Hasher::new();
    sum.update(format!("{VERSION} {finest_voxel_m} {levels} {count}").as_bytes());
    sum
}

fn row_of(surfel: &MapSurfel) -> [u8; ROW_BYTES] {
    let (p, n, c) = (&surfel.centre_in_map, &surfel.normal_in_map, &surfel.covariance_in_map);
    let (xx, xy, xz, yy, yz, zz) = (c[(0, 0)], c[(0, 1)], c[(0, 2)], c[(1, 1)], c[(1, 2)], c[(2, 2)]);
    let numbers = [p.x, p.y, p.z, n.x, n.y, n.z, xx, xy, xz, yy, yz, zz, surfel.points, surfel.sigma_m];
    let mut row = [0; ROW_BYTES];
    for (bytes, number) in row.chunks_exact_mut(8).zip(numbers) {
        bytes.copy_from_slice(&number.to_le_bytes());
    }
    // A sound map has few levels.
    row[ROW_BYTES - 1] = surfel.level as u8;
    row
}

fn surfel_of(row: &[u8; ROW_BYTES]) -> MapSurfel {
    let mut numbers = [0.0; NUMBERS.len()];
    for (number, bytes) in numbers.iter_mut().zip(row.as_chunks::<8>().0) {
        *number = f64::from_le_bytes(*bytes);
    }
    let [x, y, z, nx, ny, nz, xx, xy, xz, yy, yz, zz, points, sigma_m] = numbers;
    MapSurfel {
        centre_in_map: Vector::new(x, y, z),
        normal_in_map: Vector::new(nx, ny, nz),
        covariance_in_map: Matrix::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
        points,
        sigma_m,
        level: usize::from(row[ROW_BYTES - 1]),
    }
}
