//! Point clouds as PLY: written in binary little-endian form, read in all three forms of the format.
//!
//! A PLY file is a text header that declares elements and their properties, followed by the elements (Turk 1994).

mod reader;
mod writer;

pub use reader::PlyReader;
pub use writer::PlyWriter;

use zsim_base::ply::{Element, Header, Problem, PropertyKind};

/// Returns the points of a file: its first element, `vertex`, whose properties are numbers.
pub(super) fn points(header: &Header) -> Result<&Element, Problem> {
    let problem = |problem: &str| (header.lines, problem.to_owned());
    let element = header.elements.first().ok_or_else(|| problem("there is no element `vertex`"))?;
    if element.name != "vertex" {
        return Err(problem("the first element is not `vertex`"));
    }
    let is_number = |kind: &PropertyKind| matches!(kind, PropertyKind::Number(_));
    match element.properties.iter().all(|property| is_number(&property.kind)) {
        true => Ok(element),
        false => Err(problem("list properties of points are not supported")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CloudPoint;
    use std::io::Cursor;
    use zsim_base::time::Stamp;

    fn point(k: i64) -> CloudPoint {
        CloudPoint {
            point_in_map: nalgebra::Vector3::new(k as f32, -0.1 * k as f32, 1e-3),
            intensity: 7.0 * k as f32,
            stamp: Stamp::from_nanos(k * 500_000_000),
            error_m: 0.01,
        }
    }

    fn read(bytes: &[u8]) -> Result<Vec<CloudPoint>, String> {
        let points = PlyReader::new("a.ply", bytes).map_err(|error| error.to_string())?;
        points.collect::<Result<_, _>>().map_err(|error| error.to_string())
    }

    fn written(count: i64) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = PlyWriter::new(&mut bytes).unwrap();
        (0..count).for_each(|k| writer.point(&point(k)).unwrap());
        writer.finish().unwrap();
        bytes.into_inner()
    }

    #[test]
    fn a_written_cloud_is_read_bit_for_bit() {
        assert_eq!(read(&written(1000)).unwrap(), (0..1000).map(point).collect::<Vec<_>>());
        assert_eq!(read(&written(0)).unwrap(), []);
    }

    #[test]
    fn another_ply_reader_reads_the_points() {
        let parser = ply_rs_bw::parser::Parser::<ply_rs_bw::ply::DefaultElement>::new();
        let ply = parser.read_ply(&mut written(3).as_slice()).unwrap();
        let vertices = &ply.payload["vertex"];
        assert_eq!(vertices.len(), 3);
        assert_eq!(format!("{:?}", vertices[2]["x"]), "Float(2.0)");
        assert_eq!(format!("{:?}", vertices[2]["time"]), "Double(1.0)");
    }

    #[test]
    fn text_and_big_endian_clouds_are_read() {
        let header = |form: &str| {
            format!(
                "ply\nformat {form} 1.0\nobj_info by another\nelement vertex 2\nproperty double x\nproperty float y\n\
                 property uchar red\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
            )
        };
        let text = header("ascii") + "1.5 2 255 3\n4 5 0 6\n3 0 1 1\n";
        let mut bytes = header("binary_big_endian").into_bytes();
        for (x, y, red, z) in [(1.5_f64, 2_f32, 255_u8, 3_f32), (4.0, 5.0, 0, 6.0)] {
            bytes.extend([&x.to_be_bytes()[..], &y.to_be_bytes(), &[red], &z.to_be_bytes()].concat());
        }
        for file in [text.as_bytes(), &bytes] {
            let points: Vec<_> = read(file).unwrap().into_iter().map(|point| point.point_in_map).collect();
            assert_eq!(points, [nalgebra::Vector3::new(1.5, 2.0, 3.0), nalgebra::Vector3::new(4.0, 5.0, 6.0)]);
        }
    }

    #[test]
    fn an_error_states_file_and_line() {
        let start = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n";
        let message = |text: String| read(text.as_bytes()).unwrap_err();
        assert_eq!(message("solid\n".into()), "a.ply:1: this is not a PLY file: it does not start with `ply`");
        assert_eq!(message(format!("{start}end_header\n")), "a.ply:6: the points have no properties x, y and z");
        assert_eq!(message(start.to_owned()), "a.ply:6: the header does not end");
        let start = format!("{start}property float z\nend_header\n");
        assert_eq!(message(format!("{start}1 2 3\n")), "a.ply:9: the file ends 1 points early");
        assert_eq!(message(format!("{start}1 2\n")), "a.ply:8: a `vertex` needs 3 numbers, but the line has 2");
        assert_eq!(message(format!("{start}1 2 nan\n")), "a.ply:8: the point is not finite");
        let short = &written(2)[..];
        assert!(read(&short[..short.len() - 1]).unwrap_err().ends_with("the file ends 1 points early"));
    }
}
