//! How far a render is: a bar on a terminal, lines of JSON for programs.

use crate::{
    Result,
    render::{Accuracy, Renderer, Unknown, next_look},
};
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
    /// Of [`Accuracy::error_95`].
    pub error: Option<f64>,
}

impl Limit {
    /// How much of the way is done; 1 or more: stop.
    pub fn done(&self, iterations: u64, elapsed: Duration, error_95: f64) -> f64 {
        let by_iterations = self.iterations.map(|n| iterations as f64 / n as f64);
        let by_time = self.time.map(|t| elapsed.as_secs_f64() / t.as_secs_f64());
        // Noise falls with the square root of the iterations.
        let by_error = self.error.map(|e| (e / error_95).powi(2));
        [by_iterations, by_time, by_error]
            .into_iter()
            .flatten()
            .fold(0.0, f64::max)
    }
}

/// Where a render stands.
pub struct Status {
    pub iterations: u64,
    /// Of them, those since the program started.
    pub iterations_now: u64,
    pub elapsed: Duration,
    /// Light paths emitted since the program started.
    pub photons: u64,
    pub accuracy: Accuracy,
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
            "error": self.accuracy.error,
            "error_95": self.accuracy.error_95,
            "noise": self.accuracy.noise,
            "bias": self.accuracy.bias,
            "unknown": self.accuracy.unknown.map(Unknown::text),
            "radius_global": self.radius_global,
            "radius_caustic": self.radius_caustic,
        })
    }

    pub fn text(&self) -> String {
        format!(
            "{} iterations, {:.2} M photons/s, error {}, radius {:.3e} m, caustic {:.3e} m",
            self.iterations,
            self.photons_per_second() * 1e-6,
            error_text(&self.accuracy),
            self.radius_global,
            self.radius_caustic,
        )
    }
}

fn error_text(accuracy: &Accuracy) -> String {
    match accuracy.unknown {
        Some(unknown) => unknown.text().into(),
        None => format!(
            "{:.2} % (noise {:.2} %, bias {:.2} %)",
            accuracy.error * 100.0,
            accuracy.noise * 100.0,
            accuracy.bias * 100.0
        ),
    }
}

/// Reports to whoever listens.
pub struct Progress {
    limit: Limit,
    start: Instant,
    iterations_before: u64,
    photons_before: u64,
    bar: Option<ProgressBar>,
    json: bool,
    next: Duration,
    /// As last looked at, for the limit.
    error_95: f64,
    /// Iterations at which to look again.
    next_look: u64,
}

/// Errors are read back from the device, so they are not asked for more often.
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
            iterations_before: renderer.iterations(),
            photons_before: renderer.photons_emitted(),
            bar,
            json,
            next: INTERVAL,
            error_95: f64::INFINITY,
            next_look: next_look(0).max(renderer.iterations()),
        }
    }

    pub fn limit_reached(&self, renderer: &Renderer) -> bool {
        let elapsed = self.start.elapsed();
        self.limit
            .done(renderer.iterations(), elapsed, self.error_95)
            >= 1.0
    }

    pub fn status(&self, renderer: &Renderer) -> Result<Status> {
        let radii = renderer.radii();
        Ok(Status {
            iterations: renderer.iterations(),
            iterations_now: renderer.iterations().saturating_sub(self.iterations_before),
            elapsed: self.start.elapsed(),
            photons: renderer
                .photons_emitted()
                .saturating_sub(self.photons_before),
            accuracy: renderer.accuracy()?,
            radius_global: radii.global,
            radius_caustic: radii.caustic,
        })
    }

    /// To be called after each iteration.
    pub fn update(&mut self, renderer: &Renderer) -> Result<()> {
        if self.limit.error.is_some() && renderer.iterations() >= self.next_look {
            self.next_look = next_look(renderer.iterations());
            let accuracy = renderer.accuracy()?;
            self.error_95 = match accuracy.unknown {
                Some(_) => f64::INFINITY,
                None => accuracy.error_95,
            };
        }
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
            let done = self
                .limit
                .done(status.iterations, elapsed, self.error_95)
                .clamp(1e-6, 1.0);
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
            error: Some(0.1),
        };
        let unknown = f64::INFINITY;
        assert_eq!(limit.done(1, Duration::from_secs(50), unknown), 0.5);
        assert_eq!(limit.done(9, Duration::from_secs(50), unknown), 0.9);
        assert_eq!(limit.done(10, Duration::ZERO, unknown), 1.0);
        assert_eq!(limit.done(0, Duration::from_secs(100), unknown), 1.0);
        assert_eq!(limit.done(0, Duration::ZERO, 0.2), 0.25);
        assert!(limit.done(0, Duration::ZERO, 0.09) > 1.0);
    }
}
