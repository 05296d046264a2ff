//! `--live`: the page of a run while it runs.

use crate::cli::live_run::LiveRun;
use crate::command::run;
use crate::hostile_scene::{HOSTILE, hostile_scene};
use serde_json::Value;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

/// Files of a run whose bytes contain no run time.
const FILES: [&str; 8] = [
    "recording.mcap",
    "truth.tum",
    "open_loop.tum",
    "closed_loop.tum",
    "map.ply",
    "cloud.ply",
    "integrity.csv",
    "windows.csv",
];

impl LiveRun {
    /// The answer to a GET request.
    fn get(&self, path: &str) -> Answer {
        self.request("GET", path, &self.address.to_string())
    }

    /// Tells the server that the page has everything; the server may end before it has answered.
    fn leave(&self) {
        let mut stream = TcpStream::connect(self.address).unwrap();
        write!(stream, "GET /updates?viewer=7&leaves=1 HTTP/1.1\r\nHost: {}\r\n\r\n", self.address).unwrap();
    }

    fn request(&self, method: &str, path: &str, host: &str) -> Answer {
        let mut stream = TcpStream::connect(self.address).unwrap();
        write!(stream, "{method} {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).unwrap();
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n").unwrap();
        let head = String::from_utf8(bytes[..end].to_vec()).unwrap();
        Answer { head, body: bytes[end + 4..].to_vec() }
    }

    /// Requests updates as a page does, until the end of the run.
    fn updates(&self) -> Vec<Value> {
        let mut page = Page::default();
        let mut all = Vec::new();
        loop {
            let answer = self.get(&page.query());
            assert!(answer.head.starts_with("HTTP/1.1 200 "), "{}", answer.head);
            let update: Value = serde_json::from_slice(&answer.body).unwrap();
            page.take(&update);
            let is_last = !update["end"].is_null() && update["points"]["count"] == 0;
            all.push(update);
            if is_last {
                return all;
            }
        }
    }
}

/// An answer of the server.
struct Answer {
    head: String,
    body: Vec<u8>,
}

/// What a page has.
#[derive(Default)]
struct Page {
    version: u64,
    scan: u64,
    points: (u64, u64),
    estimate: (u64, u64),
    truth: (u64, u64),
}

impl Page {
    fn query(&self) -> String {
        let cursor = |(restart, count): (u64, u64)| format!("{restart}.{count}");
        format!(
            "/updates?viewer=7&version={}&scan={}&points={}&estimate={}&truth={}",
            self.version,
            self.scan,
            cursor(self.points),
            cursor(self.estimate),
            cursor(self.truth)
        )
    }

    fn take(&mut self, update: &Value) {
        let number = |value: &Value| value.as_u64().unwrap();
        let cursor = |name: &str, before: (u64, u64)| {
            let (restart, first) = (number(&update[name]["restart"]), number(&update[name]["first"]));
            assert!(first == 0 || (restart, first) == before, "{name}: items are missing");
            (restart, first + number(&update[name]["count"]))
        };
        self.points = cursor("points", self.points);
        self.estimate = cursor("estimate", self.estimate);
        self.truth = cursor("truth", self.truth);
        (self.version, self.scan) = (number(&update["version"]), number(&update["nextScan"]));
    }
}

/// Total number of points and of estimated poses that the updates of a stage have.
fn counts(updates: &[Value], stage: &str) -> (u64, u64) {
    let of_stage = updates.iter().filter(|update| update["stage"].as_str().unwrap().starts_with(stage));
    let sum = |name: &str| of_stage.clone().map(|update| update[name]["count"].as_u64().unwrap()).sum();
    (sum("points"), sum("estimate"))
}

#[test]
fn a_page_sees_the_map_grow_and_the_verdict_and_the_results_are_the_same() {
    let here = tempfile::tempdir().unwrap();
    let scene = hostile_scene(here.path());
    let run_of = |out: &str| format!("--quiet --scene {} --duration 10s --seed 3 --out {out}", scene.display());
    let live = LiveRun::start(here.path(), &format!("{} --live", run_of("live")));
    assert!(live.address.ip().is_loopback());

    let page = String::from_utf8(live.get("/").body).unwrap();
    assert!(!page.contains(HOSTILE) && page.contains("&lt;script&gt;window.hostile=1"));
    assert!(page.contains("default-src 'none'") && page.contains("connect-src 'self'"));
    let updates = live.updates();
    let (simulated, _) = counts(&updates, "simulating");
    let (estimated, poses) = counts(&updates, "estimating");
    assert!(simulated > 1000 && estimated > 1000 && poses > 100, "{simulated}, {estimated}, {poses}");
    let growing = updates.iter().filter(|update| update["points"]["count"].as_u64().unwrap() > 0).count();
    assert!(growing > 3, "the points came in {growing} updates");
    let last = updates.last().unwrap();
    let report = PathBuf::from(last["end"]["report"].as_str().unwrap());
    assert!(live.get("/report.html").body == std::fs::read(report).unwrap(), "the report is another one");
    let metrics: Value =
        serde_json::from_slice(&std::fs::read(here.path().join("live/metrics.json")).unwrap()).unwrap();
    assert_eq!(last["verdict"]["status"], metrics["status"]);
    live.leave();
    let live_code = live.exit_code();

    let (code, _, errors) = run(here.path(), &run_of("plain"));
    assert_eq!(code, live_code, "{errors}");
    for name in FILES {
        let [live, plain] = ["live", "plain"].map(|out| std::fs::read(here.path().join(out).join(name)).unwrap());
        assert!(live == plain, "{name} depends on --live");
    }
}

#[test]
fn a_page_of_a_run_without_a_report_names_none() {
    let here = tempfile::tempdir().unwrap();
    let arguments = "--quiet --scene mocap_room --duration 8s --out out --live --metrics-only";
    let live = LiveRun::start(here.path(), arguments);
    let updates = live.updates();
    let last = updates.last().unwrap();
    assert!(last["end"]["report"].is_null() && last["verdict"]["status"].is_string(), "{last}");
    assert!(live.get("/report.html").head.starts_with("HTTP/1.1 404"));
    live.leave();
    assert_eq!(live.exit_code(), 0);
}

#[test]
fn requests_in_the_name_of_another_site_are_refused() {
    let here = tempfile::tempdir().unwrap();
    let live = LiveRun::start(here.path(), "--quiet --scene mocap_room --duration 20s --out out --live");
    let port = live.address.port();
    for (method, path, host, status) in [
        ("GET", "/", format!("localhost:{port}"), "200"),
        ("GET", "/", format!("evil.example:{port}"), "403"),
        ("GET", "/updates", "127.0.0.1".to_owned(), "403"),
        ("GET", "/../metrics.json", format!("127.0.0.1:{port}"), "404"),
        ("GET", "/report.html", format!("127.0.0.1:{port}"), "404"),
        ("GET", "/updates?points=x", format!("127.0.0.1:{port}"), "400"),
        ("POST", "/", format!("127.0.0.1:{port}"), "405"),
    ] {
        let answer = live.request(method, path, &host);
        assert!(answer.head.starts_with(&format!("HTTP/1.1 {status} ")), "{method} {path} {host}: {}", answer.head);
        assert!(!answer.head.to_lowercase().contains("access-control"), "{}", answer.head);
    }
    // Two pages that request and never read do not hold up the run.
    let silent = [(); 2].map(|()| {
        let mut stream = TcpStream::connect(live.address).unwrap();
        write!(stream, "GET / HTTP/1.1\r\nHost: {}\r\n\r\n", live.address).unwrap();
        stream
    });
    let code = live.exit_code();
    assert!(code == 0 || code == 3, "{code}");
    drop(silent);
}

#[test]
fn clients_that_never_read_or_never_ask_do_not_starve_a_page() {
    let here = tempfile::tempdir().unwrap();
    let mut live = LiveRun::start(here.path(), "--quiet --scene office --duration 2000s --out out --live");
    let connect = |request: &str| {
        let mut stream = TcpStream::connect(live.address).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        stream
    };
    let request = format!("GET / HTTP/1.1\r\nHost: {}\r\n\r\n", live.address);
    let mut hostile: Vec<TcpStream> = Vec::new();
    // Clients that ask and never read, that never ask, and that ask without end.
    for (name, count, request) in [("silent", 100, &*request), ("idle", 200, ""), ("slow", 100, "GET / HTT")] {
        hostile.extend((0..count).map(|_| connect(request)));
        let started = Instant::now();
        assert!(live.get("/").head.starts_with("HTTP/1.1 200 "), "{name}");
        assert!(live.get("/updates?viewer=7").head.starts_with("HTTP/1.1 200 "), "{name}");
        let elapsed = started.elapsed();
        assert!(elapsed < Duration::from_secs(8), "{name}: {elapsed:?}");
    }
    live.child.kill().unwrap();
    live.child.wait().unwrap();
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_run_and_its_page() {
    let here = tempfile::tempdir().unwrap();
    let live = LiveRun::start(here.path(), "--quiet --scene office --duration 2000s --out out --live");
    assert!(live.get("/").head.starts_with("HTTP/1.1 200 "));
    let id = live.child.id().to_string();
    std::thread::sleep(Duration::from_millis(300));
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let started = Instant::now();
    let updates = live.updates();
    assert_eq!(updates.last().unwrap()["end"]["sentence"], "the run was stopped");
    live.leave();
    assert_eq!(live.exit_code(), 130);
    assert!(started.elapsed() < Duration::from_secs(60));
}

#[test]
fn a_port_in_use_is_an_error_before_the_run() {
    let here = tempfile::tempdir().unwrap();
    let taken = TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let port = taken.local_addr().unwrap().port();
    let (code, _, errors) = run(here.path(), &format!("--scene office --out out --live {port}"));
    assert_eq!(code, 1);
    assert!(errors.contains(&format!("--live {port}: the port cannot be opened on 127.0.0.1")), "{errors}");
    assert!(!here.path().join("out").exists());
}
