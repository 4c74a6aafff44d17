//! Where and when numbers were measured.

use crate::gpu::{DeviceKind, Gpu};
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

/// What every number has to name.
pub struct About {
    pub device: String,
    pub driver: String,
    pub cpu: String,
    pub system: String,
    /// lightfall's version and, where there is one, commit.
    pub program: String,
    pub command: String,
    pub date: String,
}

impl About {
    pub fn now(gpu: &Gpu) -> Self {
        let info = gpu.info();
        let (major, minor, patch) = info.api_version;
        let kind = match info.kind {
            DeviceKind::Discrete => "discrete GPU",
            DeviceKind::Integrated => "integrated GPU",
            DeviceKind::Virtual => "virtual GPU",
            DeviceKind::Cpu => "CPU device",
            DeviceKind::Other => "unknown kind",
        };
        Self {
            device: format!("{} ({kind})", info.name),
            driver: format!("{}, Vulkan {major}.{minor}.{patch}", info.driver),
            cpu: cpu(),
            system: system(),
            program: format!("lightfall {}{}", env!("CARGO_PKG_VERSION"), commit()),
            command: command(),
            date: date(
                SystemTime::now()
                    .duration_since(UNIX_EPOCH)
                    .map_or(0, |d| d.as_secs()),
            ),
        }
    }

    /// Names and values for people and programs.
    pub fn pairs(&self) -> [(&'static str, &str); 7] {
        [
            ("device", &self.device),
            ("driver", &self.driver),
            ("cpu", &self.cpu),
            ("system", &self.system),
            ("program", &self.program),
            ("command", &self.command),
            ("date", &self.date),
        ]
    }
}

fn cpu() -> String {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let file = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = file
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or(std::env::consts::ARCH, |(_, name)| name.trim());
    format!("{model}, {threads} threads")
}

fn system() -> String {
    let file = std::fs::read_to_string("/etc/os-release").unwrap_or_default();
    let name = file
        .lines()
        .find_map(|line| line.strip_prefix("PRETTY_NAME="));
    name.map_or(std::env::consts::OS.into(), |name| {
        name.trim_matches('"').into()
    })
}

/// Of the checkout that the program was built in, if that is still there.
fn commit() -> String {
    let git = |args: &[&str]| {
        let output = Command::new("git")
            .arg("-C")
            .arg(env!("CARGO_MANIFEST_DIR"))
            .args(args)
            .output();
        let output = output.ok().filter(|o| o.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let Some(hash) = git(&["rev-parse", "--short=10", "HEAD"]) else {
        return String::new();
    };
    match git(&["status", "--porcelain", "--untracked-files=no"]) {
        Some(changes) if changes.is_empty() => format!(", commit {hash}"),
        _ => format!(", commit {hash} with changes"),
    }
}

fn command() -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=:,+@%".contains(c);
    let mut words: Vec<String> = std::env::args_os()
        .map(|w| w.to_string_lossy().into_owned())
        .collect();
    if let Some(program) = words.first_mut() {
        *program = "lightfall".into();
    }
    let quoted = words
        .into_iter()
        .map(|word| match word.chars().all(plain) && !word.is_empty() {
            true => word,
            false => format!("'{}'", word.replace('\'', r"'\''")),
        });
    quoted.collect::<Vec<_>>().join(" ")
}

/// Date and time (UTC) of a Unix time (s): days to civil dates after Hinnant 2013.
fn date(seconds: u64) -> String {
    let (days, rest) = (seconds / 86_400 + 719_468, seconds % 86_400);
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 {
        shifted + 3
    } else {
        shifted - 9
    };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    format!(
        "{year}-{month:02}-{day:02} {:02}:{:02} UTC",
        rest / 3600,
        rest / 60 % 60
    )
}

#[cfg(test)]
mod tests {
    #[test]
    fn dates() {
        for (seconds, text) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_399, "2000-02-28 23:59 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (1_735_689_600, "2025-01-01 00:00 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
        ] {
            assert_eq!(super::date(seconds), text);
        }
    }
}
