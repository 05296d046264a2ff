//! The parts of the page that are readable without scripts.

use crate::{CauseMetrics, EventMetrics, Metrics, rows};

const SHELL: &str = include_str!("assets/page.html");
const STYLE: &str = concat!(include_str!("assets/vendor/uplot.min.css"), include_str!("assets/style.css"));

/// Escapes text for elements and attributes.
pub(crate) fn escaped(text: &str) -> String {
    let escape = |c: char| match c {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        '\'' => "&#39;".to_owned(),
        c if c.is_control() && c != '\n' && c != '\t' => format!("\\u{{{:x}}}", u32::from(c)),
        c => c.to_string(),
    };
    text.chars().map(escape).collect()
}

/// Replaces each `{{name}}` of the template by its value, in one pass: values are not searched for names.
pub(crate) fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut parts = template.split("{{");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, rest) = part.split_once("}}").unwrap_or((part, ""));
        let value = values.iter().find(|(known, _)| *known == name).map_or("", |(_, value)| value);
        text += value;
        text += rest;
    }
    text
}

/// Kind of the page of a run that is not complete, the only one that may connect to its server.
pub(crate) const LIVE: &str = "live";

/// Everything that differs between pages; the shell is the same.
#[derive(Default)]
pub(crate) struct Page<'a> {
    /// Kind of the page, which the scripts read.
    pub kind: &'a str,
    /// Title, as text.
    pub title: &'a str,
    /// Status of the verdict, as text; empty without one.
    pub status: &'a str,
    /// First paragraph, as HTML.
    pub introduction: String,
    /// What works without scripts, as text.
    pub without_scripts: &'a str,
    /// Sections, as HTML.
    pub sections: String,
    /// Last line, as text.
    pub footer: &'a str,
    /// Version of zsim that made the data; `None` for this one.
    pub version: Option<&'a str>,
    /// Data of the scripts: JSON without `<`, `>` and `&`.
    pub data: String,
    /// Scripts in the order of their dependencies.
    pub scripts: &'a [&'a str],
}

impl Page<'_> {
    /// The page as one HTML file; the same values give the same bytes.
    pub fn html(&self) -> String {
        fill(
            SHELL,
            &[
                ("page", self.kind),
                ("connections", if self.kind == LIVE { "; connect-src 'self'" } else { "" }),
                ("title", &escaped(self.title)),
                ("status", &escaped(self.status)),
                ("style", STYLE),
                ("introduction", &self.introduction),
                ("without_scripts", &escaped(self.without_scripts)),
                ("sections", &self.sections),
                ("footer", &escaped(self.footer)),
                ("version", &escaped(self.version.unwrap_or(env!("CARGO_PKG_VERSION")))),
                ("data", &self.data),
                ("script", &self.scripts.join("\n")),
            ],
        )
    }
}

/// Escapes text with code between backticks, as in Markdown.
pub(crate) fn with_code(text: &str) -> String {
    let parts: Vec<&str> = text.split('`').collect();
    if parts.len().is_multiple_of(2) {
        return escaped(text);
    }
    let part = |(k, part): (usize, &&str)| match k % 2 {
        0 => escaped(part),
        _ => format!("<code>{}</code>", escaped(part)),
    };
    parts.iter().enumerate().map(part).collect()
}

/// The verdict: icon, status and reason.
pub(crate) fn verdict(metrics: &Metrics) -> String {
    let (Some(verdict), Some(status)) = (rows::verdict(metrics), metrics.status.as_deref()) else {
        return String::new();
    };
    verdict_line(status, reason(&verdict, status))
}

/// The verdict without its status.
pub(crate) fn reason<'a>(verdict: &'a str, status: &str) -> &'a str {
    verdict.strip_prefix(status).map_or(verdict, |rest| rest.trim_start_matches(": "))
}

/// A status with its icon and a reason.
pub(crate) fn verdict_line(status: &str, reason: &str) -> String {
    let (class, icon) = match status {
        "good" => ("good", "<path d=\"M5 12.5l4.5 4.5L19 7.5\"/>"),
        "degraded" => ("degraded", "<path d=\"M12 4v10M12 18.5v.5\"/>"),
        _ => ("lost", "<path d=\"M6 6l12 12M18 6L6 18\"/>"),
    };
    format!(
        "<p class=\"verdict {class}\" role=\"status\"><svg viewBox=\"0 0 24 24\" aria-hidden=\"true\">{icon}</svg>\
         <span><strong>{}</strong> {}</span></p>",
        escaped(status),
        escaped(reason)
    )
}

/// Causes of the status, losses and notes.
pub(crate) fn events(metrics: &Metrics) -> String {
    let cause = |cause: &CauseMetrics| {
        format!("{}, {:.1} to {:.1} s: {}", cause.status, cause.from_s, cause.to_s, cause.sentence)
    };
    let lines = |events: &[EventMetrics]| events.iter().map(EventMetrics::line).collect::<Vec<_>>();
    let causes: Vec<String> = metrics.integrity.causes.iter().map(cause).collect();
    [("Causes", causes), ("Losses", lines(&metrics.losses)), ("Notes", lines(&metrics.notes))]
        .iter()
        .map(|(title, lines)| list(title, lines))
        .collect()
}

fn list(title: &str, lines: &[String]) -> String {
    if lines.is_empty() {
        return format!("<h3>{title}</h3>\n<p class=\"none\">none</p>\n");
    }
    let items: String = lines.iter().map(|line| format!("<li>{}</li>\n", escaped(line))).collect();
    format!("<h3>{title}</h3>\n<ul>\n{items}</ul>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_not_filled_again() {
        assert_eq!(fill("a {{x}} b {{y}} c", &[("x", "{{y}}"), ("y", "2")]), "a {{y}} b 2 c");
    }

    #[test]
    fn text_cannot_become_markup() {
        assert_eq!(with_code("head `a<b`, `c`"), "head <code>a&lt;b</code>, <code>c</code>");
        assert_eq!(with_code("a`b"), "a`b");
        assert_eq!(escaped("<a b=\"c\" d='e'>&\u{1b}"), "&lt;a b=&quot;c&quot; d=&#39;e&#39;&gt;&amp;\\u{1b}");
    }
}
