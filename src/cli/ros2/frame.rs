//! The messages between zsim and `zsim-ros2`, over the pipes of the latter's standard input and output.
//!
//! A frame is its length without itself (u32), its kind (one byte), and the fields in order; all integers are
//! little-endian, strings and messages have their length (u32) before them. The package `ros2` includes this file.

use std::io::{Error, ErrorKind, Read, Result, Write};

/// Maximum length of a frame, bytes: more than any message of a lidar.
const MAX_LENGTH: u32 = 256 << 20;

/// Number of a topic, which zsim chooses.
pub type TopicId = u32;

/// A topic as ROS 2 names it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct RosTopic {
    /// Name, `/scan`.
    pub name: String,
    /// Type, `sensor_msgs/msg/LaserScan`.
    pub type_name: String,
}

/// What a publisher offers, or a subscriber requires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quality {
    /// Lost messages are sent again; `false`: best effort.
    pub reliable: bool,
    /// A late subscriber gets the last messages; `false`: volatile.
    pub transient_local: bool,
    /// Messages that are kept: by a publisher for subscribers that have not acknowledged them, by a subscriber until they
    /// are read. 0 where it is not known.
    pub depth: u32,
}

/// A message to or from `zsim-ros2`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Frame {
    /// To it: publish this topic from now on.
    Advertise(TopicId, RosTopic, Quality),
    /// To it: publish a message, serialised as CDR with its encapsulation header.
    Publish(TopicId, Vec<u8>),
    /// To it: subscribe to this topic, or change the quality of the subscription.
    Subscribe(TopicId, RosTopic, Quality),
    /// To it: end the subscription.
    Unsubscribe(TopicId),
    /// From it: another program publishes this topic.
    Discovered(RosTopic, Quality),
    /// From it: a message that arrived at this time, ns since 1970; serialised as in `Publish`.
    Received(TopicId, i64, Vec<u8>),
    /// From it: the number of subscribers of a topic that is published.
    Subscribers(TopicId, u32),
}

impl Frame {
    /// Writes the frame.
    ///
    /// # Errors
    /// When it is too long, or cannot be written.
    pub fn write(&self, out: &mut impl Write) -> Result<()> {
        let mut body = Vec::new();
        match self {
            Self::Advertise(id, topic, quality) => put_topic(&mut body, b'A', Some(*id), topic, *quality),
            Self::Subscribe(id, topic, quality) => put_topic(&mut body, b'S', Some(*id), topic, *quality),
            Self::Discovered(topic, quality) => put_topic(&mut body, b'D', None, topic, *quality),
            Self::Publish(id, message) => {
                body.push(b'P');
                body.extend(id.to_le_bytes());
                put_bytes(&mut body, message);
            }
            Self::Unsubscribe(id) => {
                body.push(b'U');
                body.extend(id.to_le_bytes());
            }
            Self::Received(id, arrival_ns, message) => {
                body.push(b'R');
                body.extend(id.to_le_bytes());
                body.extend(arrival_ns.to_le_bytes());
                put_bytes(&mut body, message);
            }
            Self::Subscribers(id, count) => {
                body.push(b'C');
                body.extend(id.to_le_bytes());
                body.extend(count.to_le_bytes());
            }
        }
        let length = u32::try_from(body.len()).ok().filter(|length| *length <= MAX_LENGTH);
        let length = length.ok_or_else(|| Error::new(ErrorKind::InvalidInput, "a message of more than 256 MiB"))?;
        out.write_all(&length.to_le_bytes())?;
        out.write_all(&body)?;
        out.flush()
    }

    /// Reads the next frame; `None` at the end of the input.
    ///
    /// # Errors
    /// When the input cannot be read, or is not a frame.
    pub fn read(input: &mut impl Read) -> Result<Option<Self>> {
        let mut length = [0; 4];
        match input.read_exact(&mut length) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(None),
            read => read?,
        }
        let length = u32::from_le_bytes(length);
        if length > MAX_LENGTH {
            return Err(malformed());
        }
        let mut body = Vec::new();
        input.take(u64::from(length)).read_to_end(&mut body)?;
        if body.len() != length as usize {
            return Err(malformed());
        }
        Fields(&body).frame().map(Some).ok_or_else(malformed)
    }
}

fn malformed() -> Error {
    Error::new(ErrorKind::InvalidData, "not a message between zsim and zsim-ros2: are both of one version?")
}

fn put_bytes(body: &mut Vec<u8>, bytes: &[u8]) {
    // A longer one makes the frame too long, which `Frame::write` reports.
    body.extend(u32::try_from(bytes.len()).unwrap_or(u32::MAX).to_le_bytes());
    body.extend(bytes);
}

fn put_topic(body: &mut Vec<u8>, kind: u8, id: Option<TopicId>, topic: &RosTopic, quality: Quality) {
    body.push(kind);
    body.extend(id.into_iter().flat_map(u32::to_le_bytes));
    body.push(u8::from(quality.reliable) | u8::from(quality.transient_local) << 1);
    body.extend(quality.depth.to_le_bytes());
    put_bytes(body, topic.name.as_bytes());
    put_bytes(body, topic.type_name.as_bytes());
}

/// The remaining fields of a frame.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn frame(&mut self) -> Option<Frame> {
        let frame = match self.byte()? {
            b'A' => {
                let (id, quality) = (self.u32()?, self.quality()?);
                Frame::Advertise(id, self.topic()?, quality)
            }
            b'S' => {
                let (id, quality) = (self.u32()?, self.quality()?);
                Frame::Subscribe(id, self.topic()?, quality)
            }
            b'D' => {
                let quality = self.quality()?;
                Frame::Discovered(self.topic()?, quality)
            }
            b'P' => Frame::Publish(self.u32()?, self.bytes()?.to_vec()),
            b'U' => Frame::Unsubscribe(self.u32()?),
            b'R' => Frame::Received(self.u32()?, i64::from_le_bytes(self.array()?), self.bytes()?.to_vec()),
            b'C' => Frame::Subscribers(self.u32()?, self.u32()?),
            _ => return None,
        };
        self.0.is_empty().then_some(frame)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*first)
    }

    fn byte(&mut self) -> Option<u8> {
        self.array().map(u8::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn bytes(&mut self) -> Option<&[u8]> {
        let length = self.u32()? as usize;
        let (bytes, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(bytes)
    }

    fn string(&mut self) -> Option<String> {
        String::from_utf8(self.bytes()?.to_vec()).ok()
    }

    fn quality(&mut self) -> Option<Quality> {
        let bits = self.byte()?;
        Some(Quality { reliable: bits & 1 != 0, transient_local: bits & 2 != 0, depth: self.u32()? })
    }

    fn topic(&mut self) -> Option<RosTopic> {
        Some(RosTopic { name: self.string()?, type_name: self.string()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic() -> RosTopic {
        RosTopic { name: "/scan".to_owned(), type_name: "sensor_msgs/msg/LaserScan".to_owned() }
    }

    fn frames() -> Vec<Frame> {
        let quality = Quality { reliable: true, transient_local: false, depth: 7 };
        vec![
            Frame::Advertise(1, topic(), quality),
            Frame::Publish(2, vec![0, 1, 0, 0, 9]),
            Frame::Subscribe(3, topic(), Quality { transient_local: true, ..quality }),
            Frame::Unsubscribe(4),
            Frame::Discovered(topic(), Quality { reliable: false, ..quality }),
            Frame::Received(5, -1, Vec::new()),
            Frame::Subscribers(6, 2),
        ]
    }

    #[test]
    fn frames_survive_the_pipe() {
        let mut bytes = Vec::new();
        frames().iter().for_each(|frame| frame.write(&mut bytes).unwrap());
        let mut input = bytes.as_slice();
        let read: Vec<Frame> = std::iter::from_fn(|| Frame::read(&mut input).unwrap()).collect();
        assert_eq!(read, frames());
    }

    #[test]
    fn what_is_no_frame_is_an_error_without_a_large_allocation() {
        for frame in frames() {
            let mut bytes = Vec::new();
            frame.write(&mut bytes).unwrap();
            for end in 5..bytes.len() {
                assert!(Frame::read(&mut &bytes[..end]).is_err(), "{frame:?} of {end} bytes");
            }
            // A longer frame than its fields need.
            bytes.push(0);
            bytes[0] += 1;
            assert!(Frame::read(&mut bytes.as_slice()).is_err());
        }
        assert!(Frame::read(&mut [255; 64].as_slice()).is_err());
        assert_eq!(Frame::read(&mut [].as_slice()).unwrap(), None);
    }
}
