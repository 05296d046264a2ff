//! Surfel maps as PLY, which CloudCompare and Open3D display as points with normals.
//!
//! `docs/guide/maps.md` documents the format.

use super::ply::points;
use crate::RecordingError;
use std::io::{BufRead, BufWriter, ErrorKind, Read, Write};
use std::path::Path;
use zsim_base::files;
use zsim_base::geometry::{Matrix, Vector};
use zsim_base::ply::{Header, PlyFormat, PlyReader, Problem, Property, PropertyKind, Scalar};
use zsim_base::surfel_map::{MapSurfel, SurfelMap, SurfelMapError};

/// Version of the file format.
const VERSION: u32 = 1;
/// Comment that identifies the file, before the version.
const TITLE: &str = "zsim surfel map ";
/// Properties of a surfel of type double.
const PROPERTIES: [&str; 14] =
    ["x", "y", "z", "nx", "ny", "nz", "cxx", "cxy", "cxz", "cyy", "cyz", "czz", "points", "sigma"];
/// Last property of a surfel, of type uchar.
const LEVEL: &str = "level";
/// Size of a surfel, bytes.
const ROW_BYTES: usize = 8 * PROPERTIES.len() + 1;

/// Writes a surfel map.
///
/// # Errors
/// When it cannot be written.
pub fn write_surfel_map(out: impl Write, map: &SurfelMap) -> Result<(), RecordingError> {
    let mut out = BufWriter::new(out);
    let count = map.surfels().len() as u64;
    let mut checksum = start_checksum(map.finest_voxel_m(), map.levels(), count);
    map.surfels().iter().for_each(|surfel| checksum.update(&encode_surfel(surfel)));
    let (voxel_m, levels, checksum) = (map.finest_voxel_m(), map.levels(), checksum.finalize());
    let mut write = || -> std::io::Result<()> {
        write!(
            out,
            "ply\nformat binary_little_endian 1.0\ncomment {TITLE}{VERSION}\ncomment metres; sigma: standard deviation along \
             the normal; c: second moment\ncomment finest_voxel_m {voxel_m}\ncomment levels {levels}\ncomment crc32 {checksum:08x}\n\
             element vertex {count}\n"
        )?;
        for name in PROPERTIES {
            writeln!(out, "property double {name}")?;
        }
        write!(out, "property uchar {LEVEL}\nend_header\n")?;
        for surfel in map.surfels() {
            out.write_all(&encode_surfel(surfel))?;
        }
        out.flush()
    };
    write().map_err(RecordingError::Write)
}

/// Reads the surfel map at `path`.
///
/// # Errors
/// As [`parse_surfel_map`], and when the file cannot be opened.
pub fn read_surfel_map(path: &Path) -> Result<SurfelMap, RecordingError> {
    let file = files::open(path).map_err(|source| RecordingError::File { path: path.to_owned(), source })?;
    parse_surfel_map(&path.display().to_string(), file)
}

/// Reads a surfel map from `input`, called `name` in messages.
///
/// # Errors
/// When it is not a surfel map of zsim, has another version, is truncated or too long, fails its checksum, or contains
/// an invalid surfel.
pub fn parse_surfel_map(name: &str, input: impl Read) -> Result<SurfelMap, RecordingError> {
    read(input).map_err(|(line, problem)| RecordingError::Line { name: name.to_owned(), line, problem })
}

/// Content of the header comments.
struct MapHeader {
    finest_voxel_m: f64,
    levels: usize,
    checksum: u32,
    count: u64,
}

fn read(input: impl Read) -> Result<SurfelMap, Problem> {
    let mut file = PlyReader::new(input)?;
    let map_header = parse_header(file.header())?;
    let (count, end) = (map_header.count, file.header().lines + 1);
    let mut checksum = start_checksum(map_header.finest_voxel_m, map_header.levels, count);
    let mut surfels = Vec::new();
    let input = file.input();
    for index in 0..count {
        let mut row = [0; ROW_BYTES];
        input.read_exact(&mut row).map_err(|error| match error.kind() {
            ErrorKind::UnexpectedEof => (end, format!("the file ends {} surfels early", count - index)),
            _ => (end, error.to_string()),
        })?;
        checksum.update(&row);
        surfels.push(decode_surfel(&row));
    }
    let rest = input.fill_buf().map_err(|error| (end, error.to_string()))?;
    if !rest.is_empty() {
        return Err((end, format!("the file has data after its {count} surfels")));
    }
    if checksum.finalize() != map_header.checksum {
        return Err((end, "the file is damaged: its checksum does not match".to_owned()));
    }
    SurfelMap::new(map_header.finest_voxel_m, map_header.levels, surfels)
        .map_err(|error: SurfelMapError| (end, error.to_string()))
}

fn parse_header(header: &Header) -> Result<MapHeader, Problem> {
    let surfels = points(header)?;
    let problem = |problem: String| (header.lines, problem);
    let find = |key: &str| header.comments.iter().find_map(|comment| comment.strip_prefix(key));
    let Some(version) = find(TITLE) else {
        let missing = format!("this is a PLY file, but not a surfel map of zsim: no comment `{}`", TITLE.trim_end());
        return Err(problem(missing));
    };
    if version.trim() != VERSION.to_string() {
        let version = version.trim();
        return Err(problem(format!("the map has version {version}; this program reads version {VERSION}")));
    }
    let expected = PROPERTIES.iter().map(|name| (*name, Scalar::Double)).chain([(LEVEL, Scalar::Unsigned(1))]);
    let expected: Vec<Property> =
        expected.map(|(name, scalar)| Property { name: name.to_owned(), kind: PropertyKind::Number(scalar) }).collect();
    if header.format != PlyFormat::LittleEndian || surfels.properties != expected {
        return Err(problem("the properties are not those of surfels".to_owned()));
    }
    let number = |key: &str| {
        let text = find(key).map(str::trim);
        text.ok_or_else(|| problem(format!("the comment `{}` is missing", key.trim_end())))
    };
    let invalid = |key: &str, text: &str| problem(format!("`{text}` is not a valid `{}`", key.trim_end()));
    let (voxel, levels, checksum) = (number("finest_voxel_m ")?, number("levels ")?, number("crc32 ")?);
    Ok(MapHeader {
        finest_voxel_m: voxel.parse().map_err(|_| invalid("finest_voxel_m ", voxel))?,
        levels: levels.parse().map_err(|_| invalid("levels ", levels))?,
        checksum: u32::from_str_radix(checksum, 16).map_err(|_| invalid("crc32 ", checksum))?,
        count: surfels.count,
    })
}

/// Starts a checksum (CRC-32 of IEEE 802.3) with the header's content.
///
/// The caller adds the surfels' bytes.
fn start_checksum(finest_voxel_m: f64, levels: usize, count: u64) -> crc32fast::Hasher {
    let mut checksum = crc32fast::Hasher::new();
    checksum.update(format!("{VERSION} {finest_voxel_m} {levels} {count}").as_bytes());
    checksum
}

fn encode_surfel(surfel: &MapSurfel) -> [u8; ROW_BYTES] {
    let (p, n, c) = (&surfel.centre_in_map, &surfel.normal_in_map, &surfel.covariance_in_map);
    let (xx, xy, xz, yy, yz, zz) = (c[(0, 0)], c[(0, 1)], c[(0, 2)], c[(1, 1)], c[(1, 2)], c[(2, 2)]);
    let numbers = [p.x, p.y, p.z, n.x, n.y, n.z, xx, xy, xz, yy, yz, zz, surfel.points, surfel.sigma_m];
    let mut row = [0; ROW_BYTES];
    for (bytes, number) in row.chunks_exact_mut(8).zip(numbers) {
        bytes.copy_from_slice(&number.to_le_bytes());
    }
    // A valid map has at most 6 levels.
    row[ROW_BYTES - 1] = surfel.level as u8;
    row
}

fn decode_surfel(row: &[u8; ROW_BYTES]) -> MapSurfel {
    let mut numbers = [0.0; PROPERTIES.len()];
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
