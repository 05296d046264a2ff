//! Serialised messages: written as CDR (ROS 2), read as CDR and as ROS 1.
//!
//! CDR aligns numbers to their size; strings and sequences start with their length (OMG DDSI-RTPS 2.5, section 10; OMG
//! CORBA 3.4, part 2, section 9.3). ROS 1 has the same numbers without alignment, always little-endian.
//!
//! The code is written by hand for speed: a scan has thousands of numbers, which are copied as blocks into a buffer
//! that is reused for the next message.

mod decoder;
mod encoder;

pub use decoder::{DecodeError, Decoder, Payload, WireFormat};
pub use encoder::Encoder;

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Serialize;
    use zsim_base::geometry::Vector;
    use zsim_base::time::{NANOS_PER_SECOND, Stamp};

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
        // Seven bytes of a previous message in the batch: alignment must not count them.
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
    fn bytes_match_another_cdr_implementation() {
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
            let other = cdr::serialize::<_, _, cdr::CdrLe>(&mixed, cdr::Infinite).unwrap();
            assert_eq!(written(frame, numbers), other, "{frame}");
            let big = cdr::serialize::<_, _, cdr::CdrBe>(&mixed, cdr::Infinite).unwrap();
            let mut input = Decoder::new(Payload::cdr(&big)).unwrap();
            assert_eq!(input.header().unwrap(), (Stamp::from_nanos(-1), frame));
            assert_eq!(input.u8().unwrap(), 9);
            assert_eq!(input.vector().unwrap(), Vector::new(1.0, -2.0, f64::MIN_POSITIVE));
            assert_eq!(input.f32_sequence().unwrap(), numbers);
        }
    }

    #[test]
    fn a_truncated_message_is_an_error_and_a_false_length_allocates_nothing() {
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
    fn a_stamp_after_2038_is_rejected() {
        let mut bytes = Vec::new();
        let error = Encoder::new(&mut bytes).time(Stamp::from_nanos((1 << 31) * NANOS_PER_SECOND)).unwrap_err();
        assert_eq!(error.to_string(), "a stamp is 2147483648000000000 ns, but ROS 2 stamps end 2^31 s after 1970");
    }
}
