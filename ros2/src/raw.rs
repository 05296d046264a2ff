//! Messages as serialised bytes: zsim itself encodes and decodes them.

use bytes::Bytes;
use rustdds::RepresentationIdentifier;
use rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter};
use std::convert::Infallible;

/// A message with its encapsulation header of four bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message(pub Vec<u8>);

/// Length of the encapsulation header: identifier of the encoding, and options.
const HEADER_LENGTH: usize = 4;

/// The encodings that zsim reads: plain CDR, version 1.
const ENCODINGS: [RepresentationIdentifier; 2] = [RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE];

/// Passes bytes through.
#[derive(Debug, Clone)]
pub struct Raw;

impl SerializerAdapter<Message> for Raw {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(message: &Message) -> Result<Bytes, Infallible> {
        Ok(Bytes::copy_from_slice(message.0.get(HEADER_LENGTH..).unwrap_or_default()))
    }
}

impl DeserializerAdapter<Message> for Raw {
    type Error = Infallible;
    type Decoded = Message;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &ENCODINGS
    }

    fn transform_decoded(decoded: Message) -> Message {
        decoded
    }
}

impl DefaultDecoder<Message> for Raw {
    type Decoder = Self;
    const DECODER: Self = Self;
}

impl Decode<'_, Message> for Raw {
    type Error = Infallible;

    fn decode_bytes(self, bytes: &[u8], encoding: RepresentationIdentifier) -> Result<Message, Infallible> {
        let order = u8::from(encoding == RepresentationIdentifier::CDR_LE);
        Ok(Message([&[0, order, 0, 0], bytes].concat()))
    }
}
