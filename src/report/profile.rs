//! Where the open loop's time went.

use super::quantity::{percent, time};
use super::table;
use crate::estimation::TimeSpent;

/// A table of the estimator's parts with their shares of the open loop's `wall_s`; what is left over is reading the
/// recording, putting measurements in order, and writing poses.
pub fn time_spent(spent: &TimeSpent, wall_s: f64) -> String {
    let parts = spent.parts();
    let rest_s = wall_s - parts.iter().map(|(_, seconds)| seconds).sum::<f64>();
    let row = |name: &str, seconds: f64| vec![name.to_owned(), time(seconds), percent(seconds / wall_s)];
    let mut rows: Vec<_> = parts.iter().map(|(name, seconds)| row(name, *seconds)).collect();
    rows.push(row("reading and the rest", rest_s.max(0.0)));
    rows.push(row("open loop", wall_s));
    table(&["where time went", "", "share"], &rows, true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_the_whole_and_the_rest_is_what_is_left() {
        let spent = TimeSpent { surfels_s: 1.0, solve_s: 2.0, ..TimeSpent::default() };
        let told = time_spent(&spent, 4.0);
        let share = |name: &str| {
            let line = told.lines().find(|line| line.trim_start().starts_with(name)).unwrap();
            line.split_whitespace().rev().nth(1).unwrap().to_owned()
        };
        assert_eq!([share("surfels"), share("solve"), share("reading")], ["25.0", "50.0", "25.0"]);
    }
}
