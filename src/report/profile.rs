//! Run time of the estimator, by part.

use super::quantity::{percent, time};
use super::table;
use zsim_estimation::Timing;

/// A table of the time of each part of the estimator, and its percentage of the open loop's `wall_s`.
///
/// The remaining time is reading the recording, ordering the measurements and writing the poses.
pub fn timing_table(timing: &Timing, wall_s: f64) -> String {
    let parts = timing.parts();
    let rest_s = wall_s - parts.iter().map(|part| part.seconds).sum::<f64>();
    let row = |name: &str, seconds: f64| vec![name.to_owned(), time(seconds), percent(seconds / wall_s)];
    let mut rows: Vec<_> = parts.iter().map(|part| row(part.name, part.seconds)).collect();
    rows.push(row("reading and other", rest_s.max(0.0)));
    rows.push(row("open loop", wall_s));
    table(&["part", "time", "percent"], &rows, true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentages_relate_to_the_total_and_the_remainder_is_a_row() {
        let timing = Timing { surfels_s: 1.0, solve_s: 2.0, ..Timing::default() };
        let table = timing_table(&timing, 4.0);
        let percentage = |name: &str| {
            let line = table.lines().find(|line| line.trim_start().starts_with(name)).unwrap();
            line.split_whitespace().rev().nth(1).unwrap().to_owned()
        };
        assert_eq!([percentage("surfels"), percentage("solve"), percentage("reading")], ["25.0", "50.0", "25.0"]);
    }
}
