//! The report of a run as one HTML file without external resources.

use super::plot::{Figure, PlotError};
use super::{EventMetrics, Metrics, integrity, rows};

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;color:#262626;max-width:760px;margin:2rem auto;padding:0 1rem}\
h1{font-size:1.5rem;font-weight:600}h2{font-size:1.1rem;font-weight:600;margin:2rem 0 .5rem}\
table{border-collapse:collapse;width:100%}td,th{padding:.15rem .5rem;text-align:left;vertical-align:top}\
th{font-weight:600;padding-left:0}td:last-child{text-align:right;font-variant-numeric:tabular-nums}\
.verdict{padding:.6rem .8rem;border-left:.4rem solid;font-weight:600}.good{border-color:#0072b2;background:#e8f3fa}\
.degraded{border-color:#e69f00;background:#fdf4e3}.lost{border-color:#d55e00;background:#fbe9e0}\
tbody tr:first-child>*{border-top:1px solid #d0d0d0}figure{margin:0}svg{width:100%;height:auto}\
pre{background:#f5f5f5;padding:.8rem;overflow:auto;font-size:.8rem}footer{margin-top:2rem;color:#707070;font-size:.85rem}";

/// A plot on the page with a heading.
pub struct Section {
    /// Heading.
    pub title: String,
    /// The plot.
    pub figure: Figure,
}

/// Builds the HTML page of a run: metrics, plots and manifest.
///
/// # Errors
/// When a plot cannot be drawn.
pub fn page(metrics: &Metrics, sections: &[Section], manifest: &str) -> Result<String, PlotError> {
    let title = escaped(&rows::title(metrics));
    let mut body = format!("<h1>{title}</h1>\n{}{}", verdict(metrics), metrics_table(metrics));
    for section in sections {
        let svg = section.figure.svg()?;
        let svg = &svg[svg.find("<svg").unwrap_or_default()..];
        body += &format!("<h2>{}</h2>\n<figure>{svg}</figure>\n", escaped(&section.title));
    }
    body += &format!("<h2>Manifest</h2>\n<pre>{}</pre>\n", escaped(manifest));
    let version = escaped(&metrics.version);
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width\">\n<title>zsim: {title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}\
         <footer>zsim {version}</footer>\n</body>\n</html>\n"
    ))
}

/// The verdict with causes, losses and notes, as HTML.
fn verdict(metrics: &Metrics) -> String {
    let (Some(verdict), Some(status)) = (integrity::verdict(metrics), &metrics.status) else { return String::new() };
    let cause = |cause: &super::CauseMetrics| {
        format!("{:.1} to {:.1} s, {}: {}", cause.from_s, cause.to_s, cause.status, cause.sentence)
    };
    let causes: Vec<String> = metrics.integrity.causes.iter().map(cause).collect();
    let events = |events: &[EventMetrics]| events.iter().map(EventMetrics::line).collect::<Vec<_>>();
    format!(
        "<p class=\"verdict {}\">{}</p>\n{}{}{}",
        escaped(status),
        escaped(&verdict),
        list("Causes", &causes),
        list("Losses", &events(&metrics.losses)),
        list("Notes", &events(&metrics.notes))
    )
}

fn list(title: &str, lines: &[String]) -> String {
    if lines.is_empty() {
        return String::new();
    }
    let items: String = lines.iter().map(|line| format!("<li>{}</li>\n", escaped(line))).collect();
    format!("<details><summary>{title} ({})</summary>\n<ul>\n{items}</ul>\n</details>\n", lines.len())
}

fn metrics_table(metrics: &Metrics) -> String {
    let mut html = String::from("<table>\n");
    for group in rows::groups(metrics) {
        html += "<tbody>\n";
        for (index, row) in group.rows.iter().enumerate() {
            let title = if index == 0 { group.title } else { "" };
            html += &format!("<tr><th>{title}</th><td>{}</td><td>{}</td></tr>\n", row.name, escaped(&row.value));
        }
        html += "</tbody>\n";
    }
    html + "</table>\n"
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::plot::Chart;
    use crate::report::{CauseMetrics, IntegrityMetrics};

    #[test]
    fn the_verdict_precedes_the_table() {
        let cause = CauseMetrics { status: "lost".to_owned(), sentence: "a < b".to_owned(), ..CauseMetrics::default() };
        let integrity = IntegrityMetrics { causes: vec![cause], ..IntegrityMetrics::default() };
        let metrics = Metrics { status: Some("lost".to_owned()), integrity, ..Metrics::default() };
        let html = page(&metrics, &[], "").unwrap();
        assert!(html.find("class=\"verdict lost\">lost: a &lt; b").unwrap() < html.find("<table>").unwrap());
    }

    #[test]
    fn the_page_has_no_external_resources_and_escapes_text() {
        let metrics = Metrics { scene: Some("<b>&".to_owned()), duration_s: 12.0, ..Metrics::default() };
        let section = Section { title: "A & B".to_owned(), figure: Figure::of(vec![Chart::new("t", "x", "y")]) };
        let html = page(&metrics, &[section], "(scene: \"a<b\")").unwrap();
        assert!(html.contains("&lt;b&gt;&amp;, 12.0 s") && html.contains("A &amp; B") && html.contains("a&lt;b"));
        assert!(html.contains("<svg") && !html.contains("src=") && !html.contains("href="));
    }
}
