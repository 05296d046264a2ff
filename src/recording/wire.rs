//! Serialised messages: written as CDR (ROS 2), read as CDR and as ROS 1.
//!
//! CDR aligns numbers to their size; strings and sequences begin with their length (OMG DDSI-RTPS 2.5, section 10; OMG
//! CORBA 3.4, part 2, section 9.3). ROS 1 has the same numbers without alignment, always little-endian.
//!
//! Written by hand because a scan is thousands of numbers: whole runs of them are copied at once, into a buffer that is
//! used again for the next message.

mod decoder;
mod encoder;

pub use decoder::{DecodeError, Decoder, Payload, Wire};
pub use encoder::Encoder;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector;
    use crate::time::{NANOS_PER_SECOND, Stamp};
    use serde::Serialize;

    #[derive(Serialize)]
    struct Mixed {
        sec: i32,
        nanosec: u32,
        frame: String,
        flag: u8,
        vector: [f64; 3],
        numbers: Vec<f32>,
        end: u8,
    }

    fn written(frame: &str, numbers: &[f32]) -> Vec<u8> {
        // Seven bytes before, as messages stand one after the other in a batch: alignment must not count them.
        let mut bytes = vec![0xAA; 7];
        let mut out = Encoder::new(&mut bytes);
        out.header(Stamp::from_nanos(-1), frame).unwrap();
        out.byte(9);
        out.vector(&Vector::new(1.0, -2.0, f64::MIN_POSITIVE));
        out.f32_sequence(numbers).unwrap();
        out.byte(3);
        bytes.split_off(7)
    }

    #[test]
    fn bytes_are_those_of_another_implementation() {
        for (frame, numbers) in
            [("", &[][..]), ("a", &[1.0]), ("laser", &[1.0, f32::INFINITY]), ("truth/map", &[0.5; 3])]
        {
            let mixed = Mixed {
                sec: -1,
                nanosec: 999_999_999,
                frame: frame.to_owned(),
                flag: 9,
                vector: [1.0, -2.0, f64::MIN_POSITIVE],
                numbers: numbers.to_vec(),
                end: 3,
            };
            let other = cdr_encoding::to_vec::<_, byteorder::LittleEndian>(&mixed).unwrap();
            assert_eq!(written(frame, numbers)[4..], other, "{frame}");
            let big = cdr_encoding::to_vec::<_, byteorder::BigEndian>(&mixed).unwrap();
            let big = [&[0, 0, 0, 0], big.as_slice()].concat();
            let mut input = Decoder::new(Payload::cdr(&big)).unwrap();
            assert_eq!(input.header().unwrap(), (Stamp::from_nanos(-1), frame));
            assert_eq!(input.u8().unwrap(), 9);
            assert_eq!(input.vector().unwrap(), Vector::new(1.0, -2.0, f64::MIN_POSITIVE));
            assert_eq!(input.f32_sequence().unwrap(), numbers);
        }
    }

    #[test]
    fn a_message_cut_anywhere_is_short_and_a_lying_length_takes_no_memory() {
        let whole = written("laser", &[1.0, 2.0]);
        let read = |bytes: &[u8]| -> Result<u8, DecodeError> {
            let mut input = Decoder::new(Payload::cdr(bytes))?;
            input.header()?;
            input.u8()?;
            input.vector()?;
            input.f32_sequence()?;
            input.u8()
        };
        assert_eq!(read(&whole), Ok(3));
        for cut in 0..whole.len() {
            assert_eq!(read(&whole[..cut]), Err(DecodeError::Short), "cut at {cut}");
        }
        let mut input = Decoder::new(Payload::cdr(&[0, 1, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF])).unwrap();
        assert_eq!(input.f32_sequence(), Err(DecodeError::Short));
        assert_eq!(read(&[0, 3, 0, 0]), Err(DecodeError::Encapsulation));
    }

    #[test]
    fn a_stamp_beyond_2038_is_refused() {
        let mut bytes = Vec::new();
        let error = Encoder::new(&mut bytes).time(Stamp::from_nanos((1 << 31) * NANOS_PER_SECOND)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "a stamp is 2147483648000000000 ns, but a ROS 2 stamp ends 2^31 seconds from 1970"
        );
    }
}
