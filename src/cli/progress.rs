//! How far a render is: a bar on a terminal, lines of JSON for programs.

use crate::{Result, render::Renderer};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use std::{
    io::{IsTerminal, Write},
    time::{Duration, Instant},
};

/// When a render ends: at whichever comes first.
#[derive(Debug, Clone, Copy)]
pub struct Limit {
    pub iterations: Option<u64>,
    pub time: Option<Duration>,
}

impl Limit {
    /// How much of the way is done; 1 or more: stop.
    pub fn done(&self, iterations: u64, elapsed: Duration) -> f64 {
        let by_iterations = self.iterations.map(|n| iterations as f64 / n as f64);
        let by_time = self.time.map(|t| elapsed.as_secs_f64() / t.as_secs_f64());
        by_iterations.unwrap_or(0.0).max(by_time.unwrap_or(0.0))
    }
}

/// Where a render stands.
pub struct Status {
    pub iterations: u64,
    pub elapsed: Duration,
    /// Light paths emitted since the program started.
    pub photons: u64,
    pub noise: f64,
    pub radius_global: f32,
    pub radius_caustic: f32,
}

impl Status {
    fn photons_per_second(&self) -> f64 {
        self.photons as f64 / self.elapsed.as_secs_f64().max(1e-9)
    }

    pub fn json(&self, event: &str) -> Value {
        json!({
            "event": event,
            "iterations": self.iterations,
            "seconds": self.elapsed.as_secs_f64(),
            "photons": self.photons,
            "photons_per_second": self.photons_per_second(),
            "noise": self.noise,
            "radius_global": self.radius_global,
            "radius_caustic": self.radius_caustic,
        })
    }

    pub fn text(&self) -> String {
        format!(
            "{} iterations, {:.2} M photons/s, noise {:.3} %, radius {:.3e} m, caustic {:.3e} m",
            self.iterations,
            self.photons_per_second() * 1e-6,
            self.noise * 100.0,
            self.radius_global,
            self.radius_caustic,
        )
    }
}

/// Reports to whoever listens.
pub struct Progress {
    limit: Limit,
    start: Instant,
    photons_before: u64,
    bar: Option<ProgressBar>,
    json: bool,
    next: Duration,
}

/// Noise is read back from the device, so it is not asked for more often.
const INTERVAL: Duration = Duration::from_secs(1);

impl Progress {
    /// Starts the clock. There is a bar unless `quiet`, `json` or stderr is no terminal.
    pub fn start(limit: Limit, renderer: &Renderer, quiet: bool, json: bool) -> Self {
        let shown = !quiet && !json && std::io::stderr().is_terminal();
        let bar = shown.then(|| {
            let style = ProgressStyle::with_template("{bar:24} {wide_msg}");
            ProgressBar::new(1000)
                .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        });
        Self {
            limit,
            start: Instant::now(),
            photons_before: renderer.photons_emitted(),
            bar,
            json,
            next: INTERVAL,
        }
    }

    pub fn limit_reached(&self, renderer: &Renderer) -> bool {
        self.limit.done(renderer.iterations(), self.start.elapsed()) >= 1.0
    }

    pub fn status(&self, renderer: &Renderer) -> Result<Status> {
        let radii = renderer.radii();
        Ok(Status {
            iterations: renderer.iterations(),
            elapsed: self.start.elapsed(),
            photons: renderer
                .photons_emitted()
                .saturating_sub(self.photons_before),
            noise: renderer.noise()?,
            radius_global: radii.global,
            radius_caustic: radii.caustic,
        })
    }

    /// To be called after each iteration.
    pub fn update(&mut self, renderer: &Renderer) -> Result<()> {
        let elapsed = self.start.elapsed();
        if elapsed < self.next || (self.bar.is_none() && !self.json) {
            return Ok(());
        }
        self.next = elapsed + INTERVAL;
        let status = self.status(renderer)?;
        if self.json {
            print_json(&status.json("progress"));
        }
        if let Some(bar) = &self.bar {
            let done = self.limit.done(status.iterations, elapsed).clamp(1e-6, 1.0);
            let left = elapsed.mul_f64((1.0 - done) / done).as_secs();
            bar.set_position((done * 1000.0) as u64);
            let elapsed = elapsed.as_secs();
            bar.set_message(format!("{elapsed} s, {left} s left: {}", status.text()));
        }
        Ok(())
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// One line on stdout. A reader who went away does not end a render: its image is still wanted.
pub fn print_json(value: &Value) {
    let _ = writeln!(std::io::stdout(), "{value}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whichever_limit_comes_first() {
        let limit = Limit {
            iterations: Some(10),
            time: Some(Duration::from_secs(100)),
        };
        assert_eq!(limit.done(1, Duration::from_secs(50)), 0.5);
        assert_eq!(limit.done(9, Duration::from_secs(50)), 0.9);
        assert_eq!(limit.done(10, Duration::ZERO), 1.0);
        assert_eq!(limit.done(0, Duration::from_secs(100)), 1.0);
    }
}
