//! Map files: exact round trip, a second PLY reader, and errors for invalid files.

use proptest::prelude::*;
use std::sync::LazyLock;
use zsim::geometry::{Matrix, Vector, from_roll_pitch_yaw};
use zsim::recording::{parse_surfel_map, write_surfel_map};
use zsim::surfel_map::{MapSurfel, SurfelMap};

fn surfel(k: usize) -> MapSurfel {
    let wave = |m: f64| (k as f64 * m + 0.2).sin();
    let turn = from_roll_pitch_yaw(wave(0.3), wave(0.7), wave(1.1)).to_rotation_matrix().into_inner();
    let covariance = turn * Matrix::from_diagonal(&Vector::new(0.02, 0.01, 1e-5)) * turn.transpose();
    MapSurfel {
        centre_in_map: Vector::new(wave(1.3) * 20.0, wave(1.7) * 20.0, wave(1.9)),
        normal_in_map: (turn * Vector::z()).normalize(),
        covariance_in_map: (covariance + covariance.transpose()) * 0.5,
        points: 20.0 + k as f64,
        sigma_m: 0.001 + 0.0005 * wave(2.3).abs(),
        level: k % 4,
    }
}

fn map(count: usize) -> SurfelMap {
    SurfelMap::new(0.5, 4, (0..count).map(surfel).collect()).unwrap()
}

fn written(map: &SurfelMap) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_surfel_map(&mut bytes, map).unwrap();
    bytes
}

fn read(bytes: &[u8]) -> Result<SurfelMap, String> {
    parse_surfel_map("map.ply", bytes).map_err(|error| error.to_string())
}

static FILE: LazyLock<Vec<u8>> = LazyLock::new(|| written(&map(40)));

/// Offset of the first surfel.
fn header_end(file: &[u8]) -> usize {
    file.windows(11).position(|w| w == b"end_header\n").unwrap() + 11
}

/// The file with `from` in its header replaced by `to`.
fn with(from: &str, to: &str) -> Vec<u8> {
    let end = header_end(&FILE);
    let header = String::from_utf8(FILE[..end].to_vec()).unwrap();
    assert!(header.contains(from), "{header}");
    [header.replace(from, to).as_bytes(), &FILE[end..]].concat()
}

/// Replaces the checksum by that of docs/guide/maps.md: of the words `1 0.5 4 <count>` and all bytes after the header.
fn with_checksum(mut file: Vec<u8>, count: usize) -> Vec<u8> {
    let end = header_end(&file);
    let mut sum = crc32fast::Hasher::new();
    sum.update(format!("1 0.5 4 {count}").as_bytes());
    sum.update(&file[end..]);
    let at = file.windows(6).position(|w| w == b"crc32 ").unwrap() + 6;
    file[at..at + 8].copy_from_slice(format!("{:08x}", sum.finalize()).as_bytes());
    file
}

#[test]
fn a_map_is_read_back_bit_for_bit_and_its_checksum_is_as_documented() {
    for count in [0, 1, 1000] {
        let map = map(count);
        let file = written(&map);
        assert_eq!(read(&file).unwrap(), map);
        assert!(with_checksum(file.clone(), count) == file);
    }
}

#[test]
fn another_ply_reader_reads_the_surfels() {
    let parser = ply_rs_bw::parser::Parser::<ply_rs_bw::ply::DefaultElement>::new();
    let ply = parser.read_ply(&mut FILE.as_slice()).unwrap();
    let vertices = &ply.payload["vertex"];
    assert_eq!(vertices.len(), 40);
    let expected = surfel(7);
    for (name, value) in
        [("x", expected.centre_in_map.x), ("nz", expected.normal_in_map.z), ("sigma", expected.sigma_m)]
    {
        assert_eq!(format!("{:?}", vertices[7][name]), format!("Double({value:?})"));
    }
    assert_eq!(format!("{:?}", vertices[7]["level"]), "UChar(3)");
}

#[test]
fn files_that_are_not_a_map_are_errors_of_one_line() {
    let error_of = |file: &[u8]| read(file).unwrap_err();
    assert_eq!(error_of(b"solid x\n"), "map.ply:1: this is not a PLY file: it does not start with `ply`");
    let cloud = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n";
    assert_eq!(
        error_of(cloud),
        "map.ply:5: this is a PLY file, but not a surfel map of zsim: no comment `zsim surfel map`"
    );
    let next = error_of(&with("zsim surfel map 1", "zsim surfel map 2"));
    assert!(next.ends_with("the map has version 2; this program reads version 1"), "{next}");
    assert!(error_of(&with("property double sigma\n", "")).ends_with("the properties are not those of surfels"));
    assert!(error_of(&with("comment levels 4\n", "")).ends_with("the comment `levels` is missing"));
    assert!(error_of(&with("levels 4", "levels many")).ends_with("`many` is not a valid `levels`"));
    assert!(
        error_of(&with("element vertex 40", "element vertex 39")).ends_with("the file has data after its 39 surfels")
    );
    let huge = error_of(&with("element vertex 40", "element vertex 18446744073709551615"));
    assert!(huge.ends_with("the file ends 18446744073709551575 surfels early"), "{huge}");
    assert!(error_of(&FILE[..FILE.len() - 1]).ends_with("the file ends 1 surfels early"));
}

#[test]
fn invalid_surfels_with_a_correct_checksum_are_refused() {
    let end = header_end(&FILE);
    for (at, value, about) in [
        (0, f64::NAN, "one of its numbers is not finite"),
        (3, 5.0, "its normal is not of unit length"),
        (6, -1.0, "its second moment is not that of points"),
        (12, 0.0, "it has fewer than one point"),
        (13, -0.1, "its standard deviation is negative"),
    ] {
        let mut file = FILE.clone();
        // Surfel 2 of 113 bytes each.
        file[end + 2 * 113 + 8 * at..][..8].copy_from_slice(&f64::to_le_bytes(value));
        assert!(read(&file).unwrap_err().contains("its checksum does not match"));
        let error_of = read(&with_checksum(file, 40)).unwrap_err();
        assert!(error_of.ends_with(&format!("surfel 2: {about}")), "{error_of}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_file_cut_anywhere_is_an_error(cut in 0..FILE.len()) {
        prop_assert!(read(&FILE[..cut]).is_err());
    }

    #[test]
    fn a_changed_byte_is_an_error_or_changes_nothing(at in 0..FILE.len(), by in 1..=255_u8) {
        let mut file = FILE.clone();
        file[at] ^= by;
        if let Ok(read) = read(&file) {
            // The byte is in the header comment that describes the columns.
            prop_assert!(read == map(40));
        }
    }

    #[test]
    fn any_bytes_after_a_header_are_an_error_or_a_valid_map(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        let file = [&FILE[..header_end(&FILE)], &bytes].concat();
        prop_assert!(read(&file).is_err());
        prop_assert!(read(&bytes).is_err());
    }
}
