//! The HTTP server of the live page: on the loopback, on one thread of its own.
//!
//! A page asks for an update with what it has; the answer waits until there is something new. The server keeps nothing
//! for each page, so that pages can come and go.

use super::request::UpdateRequest;
use super::shared::Shared;
use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{
    CACHE_CONTROL, CONTENT_TYPE, HOST, HeaderName, HeaderValue, X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use std::convert::Infallible;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Semaphore;
use tokio::time::{Instant, sleep, timeout_at};

/// Maximum number of connections; a browser opens up to six.
const MAX_CONNECTIONS: usize = 64;
/// Time for the head of a request.
const HEAD_TIMEOUT: Duration = Duration::from_secs(30);
/// An answer without news is sent after this time.
const LONGEST_WAIT: Duration = Duration::from_secs(1);
/// Waiting time after a connection could not be accepted, for example because there are too many open files.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);
/// Pages of other sites must not embed the answers.
const RESOURCE_POLICY: HeaderName = HeaderName::from_static("cross-origin-resource-policy");

const HTML: &str = "text/html; charset=utf-8";
const JSON: &str = "application/json";
const TEXT: &str = "text/plain; charset=utf-8";

/// Opens `port` on 127.0.0.1, or a free one if it is 0, and serves pages until the process ends.
///
/// # Errors
/// When the port cannot be opened or the thread cannot be started.
pub(super) fn start(port: u16, shared: Arc<Shared>) -> std::io::Result<SocketAddr> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
    listener.set_nonblocking(true)?;
    let address = listener.local_addr()?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
    let serve = move || runtime.block_on(serve(listener, address, shared));
    std::thread::Builder::new().name("live".to_owned()).spawn(serve)?;
    Ok(address)
}

/// Serves each connection in a task of its own.
async fn serve(listener: TcpListener, address: SocketAddr, shared: Arc<Shared>) {
    let Ok(listener) = tokio::net::TcpListener::from_std(listener) else { return };
    let connections = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    loop {
        let Ok(permit) = connections.clone().acquire_owned().await else { return };
        let Ok((stream, _)) = listener.accept().await else {
            sleep(ACCEPT_PAUSE).await;
            continue;
        };
        let shared = shared.clone();
        tokio::spawn(async move {
            let answer = service_fn(move |request| answer(request, address, shared.clone()));
            let mut connection = http1::Builder::new();
            connection.timer(TokioTimer::new()).header_read_timeout(HEAD_TIMEOUT);
            // A browser may close its connection at any time.
            let _ = connection.serve_connection(TokioIo::new(stream), answer).await;
            drop(permit);
        });
    }
}

async fn answer(
    request: Request<Incoming>,
    address: SocketAddr,
    shared: Arc<Shared>,
) -> Result<Response<Full<Bytes>>, Infallible> {
    if !is_for(&request, address) {
        let sentence = format!("the host must be {address} or localhost:{}", address.port());
        return Ok(response(StatusCode::FORBIDDEN, TEXT, sentence));
    }
    if request.method() != Method::GET {
        return Ok(response(StatusCode::METHOD_NOT_ALLOWED, TEXT, "only GET is possible"));
    }
    Ok(match request.uri().path() {
        "/" => response(StatusCode::OK, HTML, shared.page.clone()),
        "/updates" => updates(request.uri().query().unwrap_or_default(), &shared).await,
        "/report.html" => report(&shared),
        _ => response(StatusCode::NOT_FOUND, TEXT, "not found"),
    })
}

/// Whether a request names this server. A page of another site could reach it under the other site's name, if that name
/// is changed to the loopback's address (DNS rebinding).
fn is_for(request: &Request<Incoming>, address: SocketAddr) -> bool {
    let host = request.headers().get(HOST).and_then(|host| host.to_str().ok());
    host.is_some_and(|host| host == address.to_string() || host == format!("localhost:{}", address.port()))
}

/// Answers with what the page lacks, as soon as it lacks something.
async fn updates(query: &str, shared: &Shared) -> Response<Full<Bytes>> {
    let Some(request) = UpdateRequest::of_query(query) else {
        return response(StatusCode::BAD_REQUEST, TEXT, "the query is not that of a page");
    };
    if request.leaves {
        shared.viewers().leave(request.viewer);
        return response(StatusCode::OK, JSON, "null");
    }
    shared.viewers().see(request.viewer);
    let mut changes = shared.changes();
    let until = Instant::now() + LONGEST_WAIT;
    let mut wants_news = true;
    let update = loop {
        if let Some(update) = shared.update(&request.page, wants_news) {
            break update;
        }
        wants_news = timeout_at(until, changes.changed()).await.is_ok();
    };
    shared.viewers().see(request.viewer);
    match update {
        Ok(json) => response(StatusCode::OK, JSON, json),
        Err(error) => response(StatusCode::INTERNAL_SERVER_ERROR, TEXT, error.to_string()),
    }
}

/// The report, when it is complete.
fn report(shared: &Shared) -> Response<Full<Bytes>> {
    match shared.report().map(std::fs::read) {
        None => response(StatusCode::NOT_FOUND, TEXT, "there is no report yet"),
        Some(Ok(html)) => response(StatusCode::OK, HTML, html),
        Some(Err(error)) => response(StatusCode::INTERNAL_SERVER_ERROR, TEXT, error.to_string()),
    }
}

fn response(status: StatusCode, content: &'static str, body: impl Into<Bytes>) -> Response<Full<Bytes>> {
    let mut response = Response::new(Full::new(body.into()));
    *response.status_mut() = status;
    let headers = [
        (CONTENT_TYPE, content),
        (CACHE_CONTROL, "no-store"),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (X_FRAME_OPTIONS, "DENY"),
        (RESOURCE_POLICY, "same-origin"),
    ];
    response.headers_mut().extend(headers.map(|(name, value)| (name, HeaderValue::from_static(value))));
    response
}
