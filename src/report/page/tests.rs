//! Tests of the page: escaping, size and repeatability.

use super::*;
use crate::{CauseMetrics, IntegrityMetrics, Metrics};
use zsim_base::geometry::{Pose, Vector};
use zsim_estimation::Severity;

const HOSTILE: &str = "</script><script>alert(1)</script>";
/// Maximum size of a page, bytes.
const MAX_BYTES: usize = 12_000_000;

fn metrics(status: &str) -> Metrics {
    let sentence = format!("gap {HOSTILE}");
    let cause = CauseMetrics { status: status.to_owned(), sentence, ..CauseMetrics::default() };
    let integrity = IntegrityMetrics { causes: vec![cause], ..IntegrityMetrics::default() };
    Metrics {
        scene: Some(HOSTILE.to_owned()),
        status: Some(status.to_owned()),
        integrity,
        duration_s: 12.0,
        ..Metrics::default()
    }
}

fn page<'a>(metrics: &'a Metrics, view: View) -> RunPage<'a> {
    let interval = Interval { from_s: 1.0, to_s: 2.0, sentence: HOSTILE.to_owned() };
    let row = TimelineRow { name: HOSTILE.to_owned(), severity: Severity::Lost, events: vec![interval] };
    RunPage { metrics, manifest: HOSTILE, parts: vec![], view, charts: vec![], timeline: vec![row] }
}

/// A full view: the maximum number of points and triangles, and ten minutes of poses.
fn full_view() -> View {
    let at = |k: usize| Vector::new((k % 977) as f64 * 0.01, (k % 883) as f64 * 0.02, (k % 331) as f64 * 0.01);
    let point = |k: usize| ViewPoint {
        position: at(k),
        t_s: k as f64 * 2e-3,
        intensity: (k % 4096) as f64,
        turn_rate_deg_per_s: (k % 300) as f64,
        sigma_m: 0.01,
        error_m: (k % 20) as f64 * 1e-3 - 0.01,
        material: Some(k % 7),
    };
    let pose = |k: usize| TimedPose { t_s: k as f64 * 0.03, pose: Pose::translation(at(k).x, at(k).y, 1.0) };
    let poses: Vec<TimedPose> = (0..MAX_PAGE_POSES).map(pose).collect();
    View {
        points: (0..MAX_PAGE_POINTS).map(point).collect(),
        materials: (0..7).map(|k| format!("{HOSTILE}{k}")).collect(),
        estimate: poses.clone(),
        truth: poses.clone(),
        base: poses,
        surfaces: (0..MAX_PAGE_TRIANGLES).map(|k| [at(k), at(k + 1), at(k + 2)]).collect(),
        surface_materials: vec![],
        surfaces_are_partial: true,
        links: vec![],
        parts: vec![],
    }
}

#[test]
fn a_hostile_name_is_inert() {
    let metrics = metrics("lost");
    let view = View { materials: vec![HOSTILE.to_owned()], ..View::default() };
    let html = page(&metrics, view).html();
    assert!(!html.contains(HOSTILE));
    assert!(html.contains("gap &lt;/script&gt;&lt;script&gt;alert(1)"));
    let scripts = html.matches("<script").count();
    assert_eq!((scripts, html.matches("</script>").count()), (2, 2), "the data and the script of the page");
}

#[test]
fn a_page_loads_nothing_from_the_network() {
    let html = page(&metrics("good"), View::default()).html();
    assert!(html.contains("default-src 'none'"));
    let markup = &html[..html.find("<script").unwrap()];
    assert!(!markup.contains("src=") && !markup.contains("href=\"http"));
}

#[test]
fn the_largest_page_is_below_12_mb_and_the_same_data_give_the_same_bytes() {
    let metrics = metrics("good");
    let html = page(&metrics, full_view()).html();
    assert!(html.len() < MAX_BYTES, "{} bytes", html.len());
    assert!(html.len() > MAX_PAGE_POINTS * 17, "the points are missing");
    assert!(html == page(&metrics, full_view()).html());
}

#[test]
fn the_verdict_differs_by_status_in_text_icon_and_class() {
    let verdicts: Vec<String> = ["good", "degraded", "lost"].map(|status| html::verdict(&metrics(status))).into();
    for (verdict, status) in verdicts.iter().zip(["good", "degraded", "lost"]) {
        assert!(verdict.contains(&format!("verdict {status}")) && verdict.contains(&format!("<strong>{status}")));
    }
    let icon = |verdict: &str| verdict[verdict.find("<path").unwrap()..verdict.find("/></svg>").unwrap()].to_owned();
    assert_ne!(icon(&verdicts[0]), icon(&verdicts[1]));
    assert_ne!(icon(&verdicts[1]), icon(&verdicts[2]));
}
