//! When a render is good enough, in one word.

use super::progress::Limit;
use clap::ValueEnum;
use std::time::Duration;

/// Points on the front of error against time. The default settings were measured to lie on it at all times (benches/README.md), so
/// these say when to stop and nothing else.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Quality {
    /// A picture soon, to judge light and framing: error below 25 %, or 10 s
    Draft,
    /// 60 s
    Normal,
    /// Clean, to be published: error below 3 %, or an hour
    Final,
}

impl Quality {
    pub fn limit(self) -> Limit {
        let (error, seconds) = match self {
            Self::Draft => (Some(0.25), 10),
            Self::Normal => (None, 60),
            Self::Final => (Some(0.03), 3600),
        };
        Limit {
            iterations: None,
            time: Some(Duration::from_secs(seconds)),
            error,
        }
    }
}
