//! The HTTP server of the live page: on the loopback, with one thread for each connection.
//!
//! A page asks for an update with what it has; the answer waits until there is something new. The server keeps nothing
//! for each page, so that pages can come and go. A connection is closed after one answer.

use super::connections::{Connection, Connections};
use super::request::UpdateRequest;
use super::shared::Shared;
use std::io::{Error, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::thread::{Builder, sleep};
use std::time::{Duration, Instant};

/// Maximum length of the head of a request, bytes, and maximum number of its header fields.
const MAX_HEAD_BYTES: usize = 16 << 10;
const MAX_FIELDS: usize = 64;
/// Time for the head of a request.
const HEAD_TIMEOUT: Duration = Duration::from_secs(30);
/// Time that a page may take to receive an answer.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);
/// Maximum number of bytes that are written at once.
const CHUNK_BYTES: usize = 64 << 10;
/// An answer without news is sent after this time.
const LONGEST_WAIT: Duration = Duration::from_secs(1);
/// Waiting time while all connections are needed, or too many files are open.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);
/// Header fields of all answers: pages of other sites must not embed them.
const FIELDS: &str = "Connection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
                      X-Frame-Options: DENY\r\nCross-Origin-Resource-Policy: same-origin\r\n";

const HTML: &str = "text/html; charset=utf-8";
const JSON: &str = "application/json";
const TEXT: &str = "text/plain; charset=utf-8";

const OK: &str = "200 OK";
const BAD_REQUEST: &str = "400 Bad Request";
const FORBIDDEN: &str = "403 Forbidden";
const NOT_FOUND: &str = "404 Not Found";
const METHOD_NOT_ALLOWED: &str = "405 Method Not Allowed";
const INTERNAL_SERVER_ERROR: &str = "500 Internal Server Error";

/// Opens `port` on 127.0.0.1, or a free one if it is 0, and serves pages until the process ends.
///
/// # Errors
/// When the port cannot be opened or the thread cannot be started.
pub(super) fn start(port: u16, shared: Arc<Shared>) -> std::io::Result<SocketAddr> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
    let address = listener.local_addr()?;
    Builder::new().name("live".to_owned()).spawn(move || serve(&listener, address, &shared))?;
    Ok(address)
}

/// Serves each connection in a thread of its own.
fn serve(listener: &TcpListener, address: SocketAddr, shared: &Arc<Shared>) {
    let connections = Arc::new(Connections::default());
    loop {
        let Ok((stream, _)) = listener.accept() else {
            sleep(ACCEPT_PAUSE);
            continue;
        };
        while !connections.make_room() {
            sleep(ACCEPT_PAUSE);
        }
        let (connection, shared) = (connections.add(stream), shared.clone());
        let answer = move || {
            // A browser may close its connection at any time.
            let _ = answer_request(&connection, address, &shared);
        };
        // Without a thread the connection is closed.
        let _ = Builder::new().name("live page".to_owned()).spawn(answer);
    }
}

fn answer_request(connection: &Connection, address: SocketAddr, shared: &Shared) -> std::io::Result<()> {
    let head = Head::read(connection.stream())?;
    connection.answers();
    let answer = match head {
        Some(head) => head.answer(address, shared),
        None => Answer::new(BAD_REQUEST, TEXT, "the request is not valid, or its head is too long"),
    };
    connection.writes();
    let Answer { status, content, body } = answer;
    let length = body.len();
    let head = format!("HTTP/1.1 {status}\r\nContent-Type: {content}\r\nContent-Length: {length}\r\n{FIELDS}\r\n");
    write_in_time(connection.stream(), &[head.as_bytes(), &body].concat())
}

/// Writes an answer within [`WRITE_TIMEOUT`] in all, also to a page that reads a byte at a time.
fn write_in_time(mut stream: &TcpStream, bytes: &[u8]) -> std::io::Result<()> {
    let end = Instant::now() + WRITE_TIMEOUT;
    for chunk in bytes.chunks(CHUNK_BYTES) {
        stream.set_write_timeout(Some(time_until(end)?))?;
        stream.write_all(chunk)?;
    }
    Ok(())
}

/// The time left.
///
/// # Errors
/// When there is none.
fn time_until(end: Instant) -> std::io::Result<Duration> {
    let left = end.saturating_duration_since(Instant::now());
    if left.is_zero() { Err(Error::from(ErrorKind::TimedOut)) } else { Ok(left) }
}

/// The head of a request.
struct Head {
    method: String,
    path: String,
    query: String,
    host: Vec<u8>,
}

impl Head {
    /// Reads a head; `None` if it is not valid or too long.
    fn read(mut stream: &TcpStream) -> std::io::Result<Option<Self>> {
        let end = Instant::now() + HEAD_TIMEOUT;
        let (mut bytes, mut chunk) = (Vec::new(), [0; 4096]);
        while bytes.len() < MAX_HEAD_BYTES {
            stream.set_read_timeout(Some(time_until(end)?))?;
            match stream.read(&mut chunk)? {
                0 => return Err(Error::from(ErrorKind::UnexpectedEof)),
                count => bytes.extend_from_slice(&chunk[..count]),
            }
            let mut fields = [httparse::EMPTY_HEADER; MAX_FIELDS];
            let mut request = httparse::Request::new(&mut fields);
            match request.parse(&bytes) {
                Ok(httparse::Status::Partial) => {}
                Ok(httparse::Status::Complete(_)) => return Ok(Self::of(&request)),
                Err(_) => return Ok(None),
            }
        }
        Ok(None)
    }

    fn of(request: &httparse::Request<'_, '_>) -> Option<Self> {
        let (path, query) = request.path?.split_once('?').unwrap_or((request.path?, ""));
        let host = request.headers.iter().find(|field| field.name.eq_ignore_ascii_case("host"));
        Some(Self {
            method: request.method?.to_owned(),
            path: path.to_owned(),
            query: query.to_owned(),
            host: host.map_or(Vec::new(), |field| field.value.to_vec()),
        })
    }

    fn answer(&self, address: SocketAddr, shared: &Shared) -> Answer {
        if !self.is_for(address) {
            let sentence = format!("the host must be {address} or localhost:{}", address.port());
            return Answer::new(FORBIDDEN, TEXT, sentence);
        }
        if self.method != "GET" {
            return Answer::new(METHOD_NOT_ALLOWED, TEXT, "only GET is possible");
        }
        match self.path.as_str() {
            "/" => Answer::new(OK, HTML, shared.page.as_str()),
            "/updates" => updates(&self.query, shared),
            "/report.html" => report(shared),
            _ => Answer::new(NOT_FOUND, TEXT, "not found"),
        }
    }

    /// Whether the request names this server. A page of another site could reach it under the other site's name, if that
    /// name is changed to the loopback's address (DNS rebinding).
    fn is_for(&self, address: SocketAddr) -> bool {
        let names = [address.to_string(), format!("localhost:{}", address.port())];
        names.iter().any(|name| name.as_bytes() == self.host)
    }
}

/// An answer to a request.
struct Answer {
    status: &'static str,
    content: &'static str,
    body: Vec<u8>,
}

impl Answer {
    fn new(status: &'static str, content: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Self { status, content, body: body.into() }
    }
}

/// Answers with what the page lacks, as soon as it lacks something.
fn updates(query: &str, shared: &Shared) -> Answer {
    let Some(request) = UpdateRequest::of_query(query) else {
        return Answer::new(BAD_REQUEST, TEXT, "the query is not that of a page");
    };
    if request.leaves {
        shared.viewers().leave(request.viewer);
        return Answer::new(OK, JSON, "null");
    }
    shared.viewers().see(request.viewer);
    let update = shared.update(&request.page, LONGEST_WAIT);
    shared.viewers().see(request.viewer);
    match update {
        Ok(json) => Answer::new(OK, JSON, json),
        Err(error) => Answer::new(INTERNAL_SERVER_ERROR, TEXT, error.to_string()),
    }
}

/// The report, when it is complete.
fn report(shared: &Shared) -> Answer {
    match shared.report().map(std::fs::read) {
        None => Answer::new(NOT_FOUND, TEXT, "there is no report yet"),
        Some(Ok(html)) => Answer::new(OK, HTML, html),
        Some(Err(error)) => Answer::new(INTERNAL_SERVER_ERROR, TEXT, error.to_string()),
    }
}
