//! `zsim-ros2`: passes messages between zsim and ROS 2, which publishes over DDS.
//!
//! `zsim play` and `zsim live` start it, and exchange [frames](frame::Frame) with it over its standard input and output.
//! It knows neither sensors nor estimates: it is a program of its own so that zsim builds without a DDS library.

#[path = "../../src/cli/ros2/frame.rs"]
mod frame;
mod names;
mod node;
mod peers;
mod raw;

use frame::Frame;
use futures::StreamExt;
use futures::channel::mpsc;
use std::io::Write;
use std::process::ExitCode;

/// Frames from zsim that wait: they are few, or slower than DDS.
const WAITING_FRAMES: usize = 64;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let Some(Ok(domain)) = arguments.next().map(|text| text.parse()) else {
        print_error(
            "`zsim play` and `zsim live` start this program; its arguments are a ROS domain, 0 to 232, and peers",
        );
        return ExitCode::from(2);
    };
    match run(domain, &arguments.collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            print_error(&format!("DDS: {error}"));
            ExitCode::FAILURE
        }
    }
}

/// Prints an error to stderr, unless it cannot be written.
fn print_error(text: &str) {
    let _ = writeln!(std::io::stderr(), "error: {text}");
}

fn run(domain: u16, peers: &[String]) -> Result<(), Box<dyn std::error::Error>> {
    let node = node::Node::new(domain, peers)?;
    let (mut sender, receiver) = mpsc::channel(WAITING_FRAMES);
    std::thread::spawn(move || {
        let mut input = std::io::stdin().lock();
        // The end of the input, or input that is no frame, ends the program.
        while let Ok(Some(frame)) = Frame::read(&mut input) {
            if futures::executor::block_on(futures::SinkExt::send(&mut sender, frame)).is_err() {
                break;
            }
        }
    });
    futures::executor::block_on(node.run(receiver.fuse(), &mut std::io::stdout().lock()))
}
