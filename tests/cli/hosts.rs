//! `zsim play` and `zsim live` on different hosts: network namespaces, with a cable or a router between them.

use super::ros2::{TOPICS, bridge, json, recording, script, stop};
use crate::skip::{run_or_skip, skip};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Two hosts in different networks.
const ROUTED: [&str; 2] = ["10.77.1.2", "10.77.2.2"];

/// Network namespaces of a test, removed at its end.
struct Hosts(Vec<String>);

impl Hosts {
    /// `names` as namespaces. This and all that follows is `None`, reported as a skipped check, where it is not permitted.
    fn new(test: &str, names: &[&str]) -> Option<Self> {
        let mut hosts = Self(Vec::new());
        for name in names {
            let space = format!("zsim-{test}-{name}-{}", std::process::id());
            set_up(Command::new("ip").args(["netns", "add", &space]))?;
            hosts.0.push(space);
            hosts.ip(hosts.0.len() - 1, "link set lo up")?;
        }
        Some(hosts)
    }

    /// Two hosts at one cable, which passes multicast.
    fn at_a_cable(test: &str) -> Option<Self> {
        let hosts = Self::new(test, &["a", "b"])?;
        hosts.connect((0, "10.77.0.1"), (1, "10.77.0.2"))?;
        Some(hosts)
    }

    /// Two hosts, 0 and 1, with the addresses [`ROUTED`], and a router, which passes no multicast.
    fn with_a_router(test: &str) -> Option<Self> {
        let hosts = Self::new(test, &["a", "b", "router"])?;
        for (host, address, gateway) in [(0, ROUTED[0], "10.77.1.1"), (1, ROUTED[1], "10.77.2.1")] {
            hosts.connect((host, address), (2, gateway))?;
            hosts.ip(host, &format!("route add default via {gateway}"))?;
        }
        set_up(hosts.command(2, "sysctl").args(["-qw", "net.ipv4.ip_forward=1"]))?;
        Some(hosts)
    }

    /// A cable between two namespaces, with the addresses of its ends.
    fn connect(&self, a: (usize, &str), b: (usize, &str)) -> Option<()> {
        let (name_of_a, name_of_b) = (format!("to{}", b.0), format!("to{}", a.0));
        let peer = format!("type veth peer name {name_of_b} netns {}", self.0[b.0]);
        self.ip(a.0, &format!("link add {name_of_a} {peer}"))?;
        for ((host, address), link) in [(a, name_of_a), (b, name_of_b)] {
            self.ip(host, &format!("addr add {address}/24 dev {link}"))?;
            self.ip(host, &format!("link set {link} up"))?;
        }
        Some(())
    }

    fn ip(&self, host: usize, arguments: &str) -> Option<()> {
        set_up(Command::new("ip").args(["-n", &self.0[host]]).args(arguments.split_whitespace()))
    }

    /// A program on a host.
    fn command(&self, host: usize, program: &str) -> Command {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &self.0[host], program]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// `zsim` on a host.
    fn zsim(&self, host: usize, folder: &Path, arguments: &str) -> Command {
        let mut command = self.command(host, env!("CARGO_BIN_EXE_zsim"));
        command.current_dir(folder).args(arguments.split_whitespace());
        command
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        for name in &self.0 {
            let _ = Command::new("ip").args(["netns", "del", name]).status();
        }
    }
}

/// Runs a command that prepares the hosts.
fn set_up(command: &mut Command) -> Option<()> {
    let output = run_or_skip("hosts", command)?;
    if !output.status.success() {
        skip("hosts", error_of(&output).lines().next().unwrap_or_default());
        return None;
    }
    Some(())
}

fn error_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Cyclone DDS without multicast, but not restricted to its own host.
const WITHOUT_MULTICAST: &str = "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General>\
                                 <Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery></Domain></CycloneDDS>";

/// Runs `tests/check_ros2.py` with another DDS on host 1; `None`, reported as a skipped check, if that is not installed.
fn other_dds(hosts: &Hosts, mode: &str, recording: &Path) -> Option<Output> {
    let mut check = hosts.command(1, "python3");
    check.env("CYCLONEDDS_URI", WITHOUT_MULTICAST).arg(script()).args([mode, "0"]).arg(recording);
    let output = run_or_skip("cyclonedds", &mut check)?;
    assert!(output.status.success(), "{}", error_of(&output));
    Some(output)
}

#[test]
fn two_hosts_at_one_cable_discover_each_other() {
    let Some(hosts) = bridge().and_then(|_| Hosts::at_a_cable("cable")) else { return };
    let folder = tempfile::tempdir().unwrap();
    recording(folder.path(), 4);
    let live = "live --idle 4s --duration 60s --out live --json --quiet";
    let live = hosts.zsim(0, folder.path(), live).spawn().unwrap();
    let played = hosts.zsim(1, folder.path(), &format!("play r.mcap --wait --quiet {TOPICS}")).output().unwrap();
    assert!(played.status.success(), "{}", error_of(&played));
    let live = live.wait_with_output().unwrap();
    let result = json(&live);
    assert_eq!((&result["scans"], &result["imu_samples"]), (&160.into(), &400.into()), "{result}");
}

#[test]
fn a_peer_behind_a_router_receives_what_is_played() {
    let Some(hosts) = bridge().and_then(|_| Hosts::with_a_router("play")) else { return };
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path(), 3);
    let mut player = hosts.zsim(0, folder.path(), &format!("play r.mcap --wait --quiet {TOPICS}"));
    let player = player.env("ROS_STATIC_PEERS", format!("{};", ROUTED[1])).spawn().unwrap();
    let Some(output) = other_dds(&hosts, "play", &recording) else { return stop(player) };
    let played = player.wait_with_output().unwrap();
    assert!(played.status.success(), "{}", error_of(&played));
    assert_eq!(json(&output)["/imu/data_raw"], 300);
}

#[test]
fn a_peer_behind_a_router_is_estimated_and_receives_the_poses() {
    let Some(hosts) = bridge().and_then(|_| Hosts::with_a_router("live")) else { return };
    let folder = tempfile::tempdir().unwrap();
    let recording = recording(folder.path(), 8);
    let live = format!("live --peer {} --idle 4s --duration 60s --json --quiet", ROUTED[1]);
    let live = hosts.zsim(0, folder.path(), &live).spawn().unwrap();
    let Some(output) = other_dds(&hosts, "live", &recording) else { return stop(live) };
    let result = json(&live.wait_with_output().unwrap());
    assert_eq!((&result["scans"], &result["imu_samples"]), (&320.into(), &800.into()), "{result}");
    assert!(json(&output)["counts"]["/odom"].as_u64() > Some(600));
}
