use serde::Serialize;
use std::fmt;

/// Topic with messages of a sensor that is not used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UnusedTopic {
    /// Topic name.
    pub topic: String,
    /// Why it is not used, a clause.
    pub reason: String,
    /// Whether it could be used if it were requested.
    pub is_usable: bool,
}

impl fmt::Display for UnusedTopic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "topic {}: {}", self.topic, self.reason)
    }
}
