//! Messages as they arrive on a running robot, and the recording of them.

use crate::recordings::{in_order, record, run, shared_file};
use std::io::Cursor;
use std::ops::ControlFlow;
use zsim::measurement::Measurement;
use zsim::recording::{Incoming, Reader, ReceivedWriter, RecordedMessage, TopicPreference};
use zsim::time::Stamp;

fn reader(bytes: Vec<u8>) -> Reader {
    Reader::new("recording", Cursor::new(bytes)).unwrap()
}

fn play(reader: &Reader, mut take: impl FnMut(&RecordedMessage<'_>)) {
    let loss = reader
        .play(&reader.cdr_topics(), |message| {
            take(&message);
            ControlFlow::Continue(())
        })
        .unwrap();
    assert!(loss.is_none(), "{loss:?}");
}

/// The measurements, without waiting for others.
fn incoming(reader: &Reader) -> Vec<Measurement> {
    let mut incoming = Incoming::new(&reader.select(&TopicPreference::default()).unwrap());
    let mut all = Vec::new();
    play(reader, |message| all.extend(incoming.message(message.topic, message.cdr)));
    assert!(incoming.loss().is_none());
    all
}

#[test]
fn measurements_are_those_of_the_file() {
    let (bytes, written) = record(run(), 100);
    assert_eq!(in_order(incoming(&reader(bytes))), in_order(written));
}

#[test]
fn what_was_received_is_recorded_unchanged() {
    let (bytes, written) = record(run(), 100);
    let original = reader(bytes);
    let (file, content) = shared_file();
    let mut received = ReceivedWriter::new(file).unwrap();
    let types = original.cdr_topics();
    let mut messages = Vec::new();
    play(&original, |message| {
        received.message(message.topic, &types[message.topic], message.log_time, message.cdr).unwrap();
        messages.push((message.topic.to_owned(), message.log_time, message.cdr.to_vec()));
    });
    received.finish().unwrap();
    let copy = reader(content.take());
    assert_eq!(copy.cdr_topics(), types);
    let mut copied = Vec::new();
    play(&copy, |message| copied.push((message.topic.to_owned(), message.log_time, message.cdr.to_vec())));
    assert_eq!(copied, messages);
    assert_eq!(in_order(incoming(&copy)), in_order(written));
}

#[test]
fn messages_that_cannot_be_used_are_counted() {
    let (bytes, _) = record(run(), 20);
    let reader = reader(bytes);
    let mut incoming = Incoming::new(&reader.select(&TopicPreference::default()).unwrap());
    let mut damaged = 0;
    play(&reader, |message| {
        if message.topic == "/scan" || message.topic == "/imu/data_raw" {
            for end in [0, 3, 4, 20] {
                assert_eq!(incoming.message(message.topic, &message.cdr[..end]), []);
                damaged += 1;
            }
        }
        assert_eq!(incoming.message("/other", message.cdr), []);
    });
    assert!(damaged > 100);
    assert_eq!(incoming.loss().unreadable_messages, damaged);
}

#[test]
fn a_time_before_1970_is_an_error() {
    let (file, _) = shared_file();
    let mut received = ReceivedWriter::new(file).unwrap();
    let error = received.message("/scan", "sensor_msgs/msg/LaserScan", Stamp::from_nanos(-1), &[0, 1, 0, 0]);
    assert!(error.unwrap_err().to_string().contains("-1 ns"));
}
