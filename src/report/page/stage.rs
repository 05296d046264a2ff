//! The three-dimensional view: what the pages with one share.

use super::html::fill;

const STAGE: &str = include_str!("assets/stage.html");
const PLAYBAR: &str = include_str!("assets/playbar.html");
const CAMERA: &str = include_str!("assets/camera.html");
const HELP: &str = include_str!("assets/view_help.html");
const VIEW: &str = include_str!("assets/view.html");

/// A view with its playback and the buttons of its camera.
pub(super) struct Stage<'a> {
    /// Title.
    pub title: &'a str,
    /// Labels on the view, as HTML.
    pub overlays: &'a str,
    /// What the slider of the playback sets.
    pub slider: &'a str,
    /// Choices of the speed, as HTML.
    pub speeds: &'a str,
}

impl Stage<'_> {
    /// Fills a template with the view (`stage`), the buttons of its camera (`camera`), how to use it (`help`), and other values.
    pub fn fill(&self, template: &str, values: &[(&str, &str)]) -> String {
        let stage = fill(STAGE, &[("title", self.title), ("overlays", self.overlays)]);
        let parts = [("stage", stage.as_str()), ("camera", CAMERA), ("help", HELP)];
        fill(template, &[&parts, values].concat())
    }

    /// The button, the slider and the speed of the playback.
    pub fn playbar(&self) -> String {
        fill(PLAYBAR, &[("slider", self.slider), ("speeds", self.speeds)])
    }
}

/// The view of a run or a scene; `path` names its path, and `path_of` what moves along it.
pub(crate) fn view_section(title: &str, path: &str, path_of: &str) -> String {
    let stage = Stage {
        title,
        overlays: "<p id=\"closeup-label\" class=\"tag\" hidden>Head and spring</p>\n",
        slider: "Time",
        speeds: "<option value=\"0.25\">0.25 x</option><option value=\"1\" selected>1 x</option>\
                 <option value=\"4\">4 x</option><option value=\"16\">16 x</option>",
    };
    let values = [("view_title", title), ("path", path), ("path_of", path_of), ("playbar", &stage.playbar())];
    stage.fill(VIEW, &values)
}
