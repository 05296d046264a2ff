//! Conventions of drivers: beams without a return, split IMU messages, clocks, point times, duplicates.

mod imu;
mod layouts;
mod misses;
mod points;
mod wild_times;

use crate::recording::foreign::{self, Foreign, IMU, LaserScan, PointCloud2, PointField, SCAN, header, imu, select};

const START_NS: i64 = 1_700_000_000_000_000_000;
const MS: i64 = 1_000_000;

/// Range of beam `k` in scan `n` of a moving lidar in a room, m; every seventh beam has no return.
fn wall_m(n: usize, k: usize) -> Option<f32> {
    (k % 7 != 3).then(|| 3.0 + 0.01 * n as f32 + 2.0 * (k as f32 * 0.05).sin().abs())
}

fn room(n: usize, range: [f32; 2], miss: f32) -> LaserScan {
    LaserScan {
        header: header(START_NS + n as i64 * 100 * MS, "laser"),
        angles: [0.0, 3.59, 0.01],
        time_increment: 0.0002,
        scan_time: 0.1,
        range,
        ranges: (0..360).map(|k| wall_m(n, k).unwrap_or(miss)).collect(),
        intensities: Vec::new(),
    }
}

/// Fields of a point: name, offset, type.
type Fields<'a> = &'a [(&'a str, u32, u8)];

fn point_cloud(stamp_ns: i64, fields: Fields<'_>, step: u32, points: &[Vec<u8>]) -> PointCloud2 {
    let field = |(name, offset, datatype): &(&str, u32, u8)| PointField {
        name: (*name).to_owned(),
        offset: *offset,
        datatype: *datatype,
        count: 1,
    };
    assert!(points.iter().all(|point| point.len() == step as usize));
    PointCloud2 {
        header: header(stamp_ns, "lidar"),
        height: 1,
        width: points.len() as u32,
        fields: fields.iter().map(field).collect(),
        is_bigendian: false,
        point_step: step,
        row_step: step * points.len() as u32,
        data: points.concat(),
        is_dense: true,
    }
}

/// An IMU sample of a rotating and shaking hand.
fn moving(ns: i64) -> foreign::Imu {
    let t = (ns - START_NS) as f64 * 1e-9;
    foreign::Imu {
        angular_velocity: [0.3 * (3.0 * t).sin() + 0.01, 0.2, 0.4 * (2.0 * t).cos()],
        linear_acceleration: [1.5 * (8.2 * t).sin(), 1.2 * (4.4 * t).cos(), 9.8 + 0.8 * (6.1 * t).sin()],
        ..imu(ns, "imu")
    }
}

#[test]
fn duplicates_are_used_once() {
    let mut foreign = Foreign::new(mcap::WriteOptions::new());
    for k in 0..100_i64 {
        let ns = START_NS + k * 10 * MS;
        for _ in 0..1 + k % 2 {
            foreign.message("/imu", IMU, ns, &moving(ns));
        }
        if k % 10 == 0 {
            let room = room(k as usize / 10, [0.1, 30.0], f32::INFINITY);
            // A duplicate message, and the same ranges published again 50 ms later.
            foreign.message("/scan", SCAN, ns, &room).message("/scan", SCAN, ns, &room);
            let again = LaserScan { header: header(ns + 50 * MS, "laser"), ..room };
            foreign.message("/scan", SCAN, ns + 50 * MS, &again);
        }
    }
    let reader = foreign.reader();
    let selection = select(&reader);
    let mut measurements = reader.measurements(&selection);
    let all: Vec<_> = measurements.by_ref().map(|m| m.unwrap()).collect();
    assert_eq!(all.len(), 100 + 10);
    let loss = measurements.loss();
    assert_eq!((loss.repeated_samples, loss.repeated_scans, loss.is_none()), (50, 20, true));
    assert_eq!(loss.notes(), ["duplicate scans ignored: 20", "duplicate IMU samples ignored: 50"]);
}
