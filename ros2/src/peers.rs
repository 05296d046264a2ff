//! Announces a participant to hosts that multicast does not reach.
//!
//! RTPS participants discover each other by announcements (SPDP messages) to a multicast group; RustDDS sends them also to
//! the ports of the first 12 participants of its own host, but to no other host. The [`Relay`] takes the port of one of
//! these 12, and sends the announcements on to the peers, unchanged: they contain the addresses to answer to, so that
//! discovery and data then need no relay. RustDDS sends to the multicast group if a peer offers it: the DDS of a peer must
//! not offer multicast, and so the peer cannot be another `zsim-ros2`, which always does.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, ToSocketAddrs, UdpSocket};

/// Ports of RTPS (specification 2.5, section 9.6.2.3): those of a domain start at `PORT_BASE + DOMAIN_GAIN * domain`, and
/// participant `i` receives announcements `UNICAST_OFFSET + PARTICIPANT_GAIN * i` after it.
const PORT_BASE: u16 = 7400;
const DOMAIN_GAIN: u16 = 250;
const UNICAST_OFFSET: u16 = 10;
const PARTICIPANT_GAIN: u16 = 2;
/// Participants of its own host to which RustDDS 0.15 sends announcements.
const LOCAL_PARTICIPANTS: u16 = 12;
/// Participants of a peer to which the relay sends announcements, as ROS 2 does for `ROS_STATIC_PEERS`.
const PEER_PARTICIPANTS: u16 = 32;
/// Start of an RTPS message, and where the 12 bytes of the sender follow.
const RTPS: &[u8] = b"RTPS";
const SENDER: std::ops::Range<usize> = 8..20;

/// Receives the announcements of this host.
pub struct Relay {
    announcements: UdpSocket,
    peers: Vec<SocketAddr>,
}

impl Relay {
    /// Receives from now on; `peers` are names or IPv4 addresses.
    ///
    /// # Errors
    ///
    /// If a name is unknown, or each of the ports is in use.
    pub fn new(domain: u16, peers: &[String]) -> io::Result<Self> {
        let port = |participant: u16| announcement_port(domain, participant);
        // Participants take the lowest port that is free.
        let bind = |participant: u16| UdpSocket::bind((Ipv4Addr::LOCALHOST, port(participant))).ok();
        let announcements = (0..LOCAL_PARTICIPANTS).rev().find_map(bind).ok_or(io::ErrorKind::AddrInUse)?;
        let mut addresses = Vec::new();
        for peer in peers {
            let address = address_of(peer)?;
            addresses.extend((0..PEER_PARTICIPANTS).map(|i| SocketAddr::new(address, port(i))));
        }
        Ok(Self { announcements, peers: addresses })
    }

    /// Sends the announcements of `sender`, the 12 bytes of its GUID prefix, on to the peers, until the program ends.
    ///
    /// # Errors
    ///
    /// If no socket can be opened.
    pub fn run(self, sender: Vec<u8>) -> io::Result<()> {
        // The socket of the announcements is bound to the loopback, from which nothing reaches another host.
        let out = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
        std::thread::Builder::new().name("peers".to_owned()).spawn(move || {
            let mut buffer = vec![0; usize::from(u16::MAX)];
            while let Ok(length) = self.announcements.recv(&mut buffer) {
                let message = &buffer[..length];
                if message.starts_with(RTPS) && message.get(SENDER) == Some(&sender) {
                    // A peer that cannot be reached now gets the next announcement.
                    self.peers.iter().for_each(|peer| drop(out.send_to(message, peer)));
                }
            }
        })?;
        Ok(())
    }
}

fn announcement_port(domain: u16, participant: u16) -> u16 {
    PORT_BASE + DOMAIN_GAIN * domain + UNICAST_OFFSET + PARTICIPANT_GAIN * participant
}

fn address_of(peer: &str) -> io::Result<std::net::IpAddr> {
    let unknown = |error: io::Error| io::Error::new(error.kind(), format!("peer `{peer}`: {error}"));
    let mut addresses = (peer, 0).to_socket_addrs().map_err(unknown)?.map(|address| address.ip());
    addresses.find(|ip| ip.is_ipv4()).ok_or_else(|| unknown(io::Error::other("it has no IPv4 address")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn the_ports_are_those_of_the_specification() {
        assert_eq!(announcement_port(0, 0), 7410);
        assert_eq!(announcement_port(1, 3), 7666);
        assert!(announcement_port(232, PEER_PARTICIPANTS - 1) < u16::MAX);
    }

    #[test]
    fn only_announcements_of_the_sender_reach_the_peer() {
        // The loopback has 127.0.0.2, too; a domain that no other test uses.
        let (domain, peer) = (171, "127.0.0.2");
        let received = UdpSocket::bind((peer, announcement_port(domain, 5))).unwrap();
        received.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        let relay = Relay::new(domain, &[peer.to_owned()]).unwrap();
        let port = relay.announcements.local_addr().unwrap();
        relay.run(vec![7; 12]).unwrap();
        let message = |sender: u8| [b"RTPS\x02\x05\x01\x12".to_vec(), vec![sender; 12], b"data".to_vec()].concat();
        let source = UdpSocket::bind("127.0.0.1:0").unwrap();
        for bytes in [&b"RTPS"[..], &message(8), b"noise", &message(7)] {
            source.send_to(bytes, port).unwrap();
        }
        let mut buffer = [0; 100];
        let length = received.recv(&mut buffer).unwrap();
        assert_eq!(buffer[..length], message(7));
    }

    #[test]
    fn an_unknown_peer_is_an_error_with_its_name() {
        let error = Relay::new(172, &["no host".to_owned()]).err().unwrap().to_string();
        assert!(error.contains("no host"), "{error}");
    }
}
