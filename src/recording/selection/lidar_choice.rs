//! Selects the lidar topic.

use super::candidates::{BeamTimes, Candidate, LidarKind};
use super::unused::UnusedTopic;

/// Selects the best of `lidars`, and states why the others are not used.
///
/// `None` if there is none.
///
/// A lidar with returns is preferred, then one that is connected to the IMU, then beam times that each message states, then a
/// planar scan, then the first topic by name.
pub fn choose(
    lidars: &[Candidate],
    is_connected: impl Fn(&Candidate) -> bool,
) -> Option<(&Candidate, LidarKind, Vec<UnusedTopic>)> {
    let rank = |c: &Candidate| (c.is_empty, !is_connected(c), c.times, is_cloud(c));
    let chosen = lidars.iter().min_by_key(|lidar| (rank(lidar), &lidar.topic))?;
    let (best, others) = (rank(chosen), lidars.iter().filter(|lidar| lidar.topic != chosen.topic));
    let unused = others.map(|other| {
        let (is_empty, is_unconnected, times, _) = rank(other);
        let frame = &other.frame;
        let reason = if is_empty && !best.0 {
            "its messages have no returns".to_owned()
        } else if is_unconnected && !best.1 {
            format!("/tf_static does not connect its frame {frame} to the IMU")
        } else if times > best.2 {
            without_times(times).to_owned()
        } else if is_cloud(other) && !best.3 {
            "planar scans are preferred to clouds".to_owned()
        } else {
            let sensor = if other.frame == chosen.frame { "the same sensor" } else { "another sensor" };
            format!("{sensor} (frame {frame}), as suitable; the first topic by name is used")
        };
        UnusedTopic { topic: other.topic.clone(), reason, is_usable: true }
    });
    Some((chosen, chosen.kind?, unused.collect()))
}

fn is_cloud(lidar: &Candidate) -> bool {
    matches!(lidar.kind, Some(LidarKind::Points | LidarKind::Livox))
}

fn without_times(times: BeamTimes) -> &'static str {
    match times {
        BeamTimes::Stated => "its messages state beam times",
        BeamTimes::OtherClock => "its beam times are of another clock than its stamps",
        BeamTimes::Implied => "its beam times are not stated and only follow from the period of a revolution",
        BeamTimes::Unknown => "its beams have no times",
    }
}
