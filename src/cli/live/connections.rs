//! The open connections of the live page, and which of them gives way to a new one.

use std::collections::BTreeMap;
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Maximum number of connections; a browser opens up to six.
const MAX_CONNECTIONS: usize = 64;
/// Time after which an answer that is not read gives way; a page on the same machine reads the largest one within it.
const STALLED_AFTER: Duration = Duration::from_secs(1);

/// What a connection is doing. All clients have the same address, so that only this tells which of them matters least.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Phase {
    /// Its request is not complete.
    Idle,
    /// Its answer is being sent.
    Writing,
    /// Its answer is not known yet; this phase is short.
    Answering,
}

#[derive(Debug)]
struct Entry {
    stream: Arc<TcpStream>,
    phase: Phase,
    since: Instant,
}

/// The open connections, by number in order of time.
#[derive(Debug, Default)]
pub(super) struct Connections(Mutex<BTreeMap<u64, Entry>>);

impl Connections {
    /// Makes room for another connection; `false` if all are needed.
    ///
    /// A connection without a request is closed first, then one whose answer is not read; the oldest of each.
    pub(super) fn make_room(&self) -> bool {
        let mut entries = self.entries();
        if entries.len() < MAX_CONNECTIONS {
            return true;
        }
        let gives_way = |entry: &Entry| match entry.phase {
            Phase::Idle => true,
            Phase::Writing => entry.since.elapsed() >= STALLED_AFTER,
            Phase::Answering => false,
        };
        let candidates = entries.iter().filter(|(_, entry)| gives_way(entry));
        let first = candidates.min_by_key(|(_, entry)| (entry.phase, entry.since)).map(|(number, _)| *number);
        let Some(entry) = first.and_then(|number| entries.remove(&number)) else { return false };
        // Its thread ends with an error, unless the connection has closed already.
        let _ = entry.stream.shutdown(Shutdown::Both);
        true
    }

    /// Adds a connection, without a request so far.
    pub(super) fn add(self: &Arc<Self>, stream: TcpStream) -> Connection {
        let stream = Arc::new(stream);
        let mut entries = self.entries();
        let number = entries.last_key_value().map_or(0, |(last, _)| last + 1);
        entries.insert(number, Entry { stream: stream.clone(), phase: Phase::Idle, since: Instant::now() });
        Connection { number, stream, all: self.clone() }
    }

    fn entries(&self) -> MutexGuard<'_, BTreeMap<u64, Entry>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// An open connection; it is closed when it is dropped.
pub(super) struct Connection {
    number: u64,
    stream: Arc<TcpStream>,
    all: Arc<Connections>,
}

impl Connection {
    pub(super) fn stream(&self) -> &TcpStream {
        &self.stream
    }

    /// The request is complete.
    pub(super) fn answers(&self) {
        self.enter(Phase::Answering);
    }

    /// The answer is known.
    pub(super) fn writes(&self) {
        self.enter(Phase::Writing);
    }

    fn enter(&self, phase: Phase) {
        if let Some(entry) = self.all.entries().get_mut(&self.number) {
            (entry.phase, entry.since) = (phase, Instant::now());
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.all.entries().remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::net::TcpListener;

    #[test]
    fn an_idle_connection_gives_way_and_one_that_is_answered_does_not() {
        let listener = TcpListener::bind(("127.0.0.1", 0)).unwrap();
        let all = Arc::new(Connections::default());
        let connect = || {
            let client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
            (client, all.add(listener.accept().unwrap().0))
        };
        let mut open: Vec<_> = (0..MAX_CONNECTIONS).map(|_| connect()).collect();
        open.iter().for_each(|(_, connection)| connection.answers());
        assert!(!all.make_room(), "all are needed");
        open[7].1.writes();
        assert!(!all.make_room(), "an answer has some time");
        open[9].1.enter(Phase::Idle);
        assert!(all.make_room());
        assert_eq!(open[9].0.read(&mut [0]).unwrap(), 0, "the idle one is closed");
        assert!(all.make_room(), "there is room");
        drop(open);
        assert!(all.entries().is_empty());
    }
}
