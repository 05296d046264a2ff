//! Files that a spec of faults refers to.

use super::{FaultKind, FaultsSpec, check};
use zsim_base::spec::{Kind, Source, SpecError, text_file};

/// Maximum number of arrival times in a file: bounds the memory.
const MAX_ARRIVALS: usize = 1_000_000;

impl FaultsSpec {
    /// Reads the files that the spec refers to, and replaces each file of `thin` with the arrival times.
    ///
    /// # Errors
    /// If a file cannot be read, or a line is not a number.
    pub fn with_files(mut self, source: &Source) -> Result<Self, SpecError> {
        for (index, fault) in self.faults.iter_mut().enumerate() {
            let FaultKind::Thin { arrivals_s, file, .. } = &mut fault.fault else { continue };
            if arrivals_s.is_some() {
                continue;
            }
            let Some(name) = file.take() else { continue };
            let found = text_file(Kind::Faults, source, &name);
            let text = found.map_err(|error| check::about(source, index, "file", error.to_string()))?;
            *arrivals_s = Some(arrivals(&text)?);
        }
        Ok(self)
    }
}

/// The arrival times of a file, s.
fn arrivals(file: &Source) -> Result<Vec<f64>, SpecError> {
    let mut arrivals_s: Vec<f64> = Vec::new();
    for (index, line) in file.text.lines().enumerate() {
        let number = line.split('#').next().unwrap_or_default().trim();
        if number.is_empty() {
            continue;
        }
        let wrong = |message: String| {
            // Without the line itself: the spec can name any file of the machine.
            let place = format!("{}:{}", file.name, index + 1);
            SpecError::plain(&place, message).with_help("one arrival time a line, s, in order; `#` before comments")
        };
        let last = arrivals_s.last().copied().unwrap_or(0.0);
        match number.parse::<f64>() {
            Ok(s) if s.is_finite() && s >= 0.0 && s >= last => arrivals_s.push(s),
            Ok(s) => return Err(wrong(format!("an arrival at {s} s, after one at {last} s"))),
            Err(_) => return Err(wrong("expected a number".to_owned())),
        }
        if arrivals_s.len() > MAX_ARRIVALS {
            return Err(wrong(format!("more than {MAX_ARRIVALS} arrival times")));
        }
    }
    Ok(arrivals_s)
}
