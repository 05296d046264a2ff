//! `diagnostic_msgs/DiagnosticArray`: the status of a program.

use crate::RecordingError;
use crate::wire::Encoder;
use zsim_base::time::Stamp;

/// Level of a status, as in `diagnostic_msgs/DiagnosticStatus`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DiagnosticLevel {
    /// No problem.
    Ok = 0,
    /// Usable with care.
    Warn = 1,
    /// Not usable.
    Error = 2,
}

/// A status of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Level.
    pub level: DiagnosticLevel,
    /// What has this status.
    pub name: String,
    /// The status, a sentence.
    pub message: String,
    /// Further values, by name.
    pub values: Vec<(String, String)>,
}

/// Encodes an array of one status.
///
/// # Errors
/// When the stamp or a length does not fit into a message.
pub fn encode(out: &mut Encoder<'_>, stamp: Stamp, diagnostic: &Diagnostic) -> Result<(), RecordingError> {
    out.header(stamp, "")?;
    out.length(1)?;
    out.byte(diagnostic.level as u8);
    out.string(&diagnostic.name)?;
    out.string(&diagnostic.message)?;
    // The hardware has no identifier.
    out.string("")?;
    out.length(diagnostic.values.len())?;
    for (key, value) in &diagnostic.values {
        out.string(key)?;
        out.string(value)?;
    }
    Ok(())
}
