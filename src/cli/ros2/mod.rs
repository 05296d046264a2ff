//! ROS 2: publish a recording, and estimate from live topics.
//!
//! The program `zsim-ros2` connects to DDS. It is started here, so that zsim builds and runs without a DDS library.

mod bridge;
mod frame;
mod live;
mod play;
mod publisher;
mod session;
mod sources;
mod start;

pub(super) use self::live::{LiveCommand, run as run_live};
pub(super) use self::play::{PlayCommand, run as run_play};

use super::usage::Usage;
use clap::Args;

/// Highest ROS domain whose ports exist.
const MAX_DOMAIN: u16 = 232;

/// Messages of small size that are kept: 2.5 s of an IMU at 400 Hz.
const KEPT_MESSAGES: u32 = 1000;
/// Clouds that are kept: one can have megabytes.
const KEPT_CLOUDS: u32 = 20;

/// How many messages of this type are kept.
fn depth_of(type_name: &str) -> u32 {
    let is_large = ["PointCloud2", "CustomMsg", "Path"].iter().any(|kind| type_name.ends_with(kind));
    if is_large { KEPT_CLOUDS } else { KEPT_MESSAGES }
}

/// Which other programs are discovered.
#[derive(Args)]
struct NetworkArguments {
    /// ROS domain, 0 to 232 [default: ROS_DOMAIN_ID of the environment, else 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=i64::from(MAX_DOMAIN)))]
    domain: Option<u16>,
    /// A host, by name or IPv4 address, that multicast does not reach; its DDS must not offer multicast. May be repeated
    /// [default: ROS_STATIC_PEERS of the environment]
    #[arg(long = "peer", value_name = "HOST")]
    peers: Vec<String>,
}

impl NetworkArguments {
    fn domain(&self) -> Result<u16, Usage> {
        let from_environment =
            || match std::env::var("ROS_DOMAIN_ID") {
                Err(_) => Ok(0),
                Ok(text) if text.is_empty() => Ok(0),
                Ok(text) => text.parse().ok().filter(|domain| *domain <= MAX_DOMAIN).ok_or_else(|| {
                    Usage(format!("ROS_DOMAIN_ID is `{text}`: a domain from 0 to {MAX_DOMAIN} is needed"))
                }),
            };
        self.domain.map_or_else(from_environment, Ok)
    }

    /// What to check when nothing arrives, as the end of a sentence.
    fn hint(&self) -> &'static str {
        if self.peers().is_empty() {
            return "";
        }
        "; the DDS of a peer must not offer multicast (Cyclone DDS: AllowMulticast false, ParticipantIndex auto)"
    }

    /// Hosts to which this program is announced.
    fn peers(&self) -> Vec<String> {
        if !self.peers.is_empty() {
            return self.peers.clone();
        }
        // As in ROS 2: separated by semicolons.
        let text = std::env::var("ROS_STATIC_PEERS").unwrap_or_default();
        text.split(';').map(str::trim).filter(|peer| !peer.is_empty()).map(str::to_owned).collect()
    }
}
