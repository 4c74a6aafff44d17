//! Diagrams as SVG, small and without scripts. Text takes the page's colour and size.

use super::{escape, number};
use std::fmt::Write;

/// Okabe & Ito 2008: told apart by people who do not see all colours, and on grey paper by their dashes.
pub const COLORS: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#888888",
];
const DASHES: [&str; 4] = ["", "7 3", "2 3", "9 3 2 3"];

pub const WIDTH: f64 = 480.0;
const HEIGHT: f64 = 320.0;
/// Of the frame.
const LEFT: f64 = 66.0;
const RIGHT: f64 = WIDTH - 12.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = HEIGHT - 46.0;

/// Lines over a frame.
pub struct Plot {
    pub x: Axis,
    pub y: Axis,
    pub lines: Vec<Line>,
    /// A level that none can be told from, with its name.
    pub level: Option<(f64, String)>,
}

pub struct Axis {
    pub label: String,
    pub logarithmic: bool,
}

pub struct Line {
    /// None where empty: a line among others that go unnamed, thin and without dots.
    pub label: String,
    /// Which colour.
    pub index: usize,
    pub points: Vec<[f64; 2]>,
    /// x, lower and upper bound.
    pub band: Vec<[f64; 3]>,
}

/// Where numbers lie on the page.
struct Scale {
    logarithmic: bool,
    /// In the axis's own measure.
    range: [f64; 2],
    page: [f64; 2],
}

impl Scale {
    fn new(axis: &Axis, values: impl Iterator<Item = f64>, page: [f64; 2]) -> Option<Self> {
        let logarithmic = axis.logarithmic;
        let (low, high) = values
            .filter(|v| v.is_finite() && (!logarithmic || *v > 0.0))
            .map(|v| if logarithmic { v.log10() } else { v })
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(v), b.max(v))
            });
        if low > high {
            return None;
        }
        // Zero is the honest end of a linear axis.
        let low = if logarithmic { low } else { low.min(0.0) };
        let margin = ((high - low) * 0.04).max(if logarithmic {
            0.05
        } else {
            high.abs() * 0.04 + 1e-12
        });
        let range = [if logarithmic { low - margin } else { low }, high + margin];
        Some(Self {
            logarithmic,
            range,
            page,
        })
    }

    fn at(&self, value: f64) -> Option<f64> {
        let v = if self.logarithmic {
            value.log10()
        } else {
            value
        };
        let [low, high] = self.range;
        v.is_finite()
            .then(|| self.page[0] + (v - low) / (high - low) * (self.page[1] - self.page[0]))
    }

    fn ticks(&self) -> Vec<f64> {
        let [low, high] = self.range;
        if !self.logarithmic {
            let raw = (high - low) / 5.0;
            let decade = 10f64.powf(raw.log10().floor());
            let step = decade
                * [1.0, 2.0, 5.0, 10.0]
                    .into_iter()
                    .find(|s| s * decade >= raw)
                    .unwrap_or(10.0);
            let first = (low / step).ceil() as i64;
            return (first..first + 12)
                .map(|i| i as f64 * step)
                .filter(|t| *t <= high)
                .collect();
        }
        let digits: &[f64] = match high - low {
            span if span > 2.5 => &[1.0],
            span if span > 0.7 => &[1.0, 2.0, 5.0],
            _ => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0],
        };
        let decades = low.floor() as i32..=high.ceil() as i32;
        let all = decades.flat_map(|e| digits.iter().map(move |d| d * 10f64.powi(e)));
        all.filter(|t| (low..=high).contains(&t.log10())).collect()
    }
}

impl Plot {
    /// Empty where there is nothing to draw.
    pub fn svg(&self) -> String {
        let points = || self.lines.iter().flat_map(|l| &l.points);
        let bounds = self
            .lines
            .iter()
            .flat_map(|l| l.band.iter().flat_map(|b| [b[1], b[2]]));
        let level = self.level.iter().map(|l| l.0);
        let ys = points().map(|p| p[1]).chain(bounds).chain(level);
        let x = Scale::new(&self.x, points().map(|p| p[0]), [LEFT, RIGHT]);
        let y = Scale::new(&self.y, ys, [BOTTOM, TOP]);
        let (Some(x), Some(y)) = (x, y) else {
            return String::new();
        };
        let mut svg = format!(
            "<figure><svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{} over {}\">\n",
            escape(&self.y.label),
            escape(&self.x.label)
        );
        self.frame(&mut svg, &x, &y);
        if let Some((value, name)) = &self.level
            && let Some(at) = y.at(*value)
        {
            let _ = writeln!(
                svg,
                "<path class=\"level\" d=\"M{LEFT} {at:.1}H{RIGHT}\"/><text class=\"end\" x=\"{:.0}\" y=\"{:.1}\">{}</text>",
                RIGHT - 4.0,
                at - 4.0,
                escape(name)
            );
        }
        for line in &self.lines {
            self.line(&mut svg, line, &x, &y);
        }
        svg += "</svg>\n<figcaption>";
        for line in self.lines.iter().filter(|l| !l.label.is_empty()) {
            let (color, dash) = style(line.index);
            let _ = write!(
                svg,
                "<span class=\"key\"><svg viewBox=\"0 0 26 8\"><path d=\"M0 4H26\" stroke=\"{color}\" stroke-dasharray=\"{dash}\"/></svg>{}</span> ",
                escape(&line.label)
            );
        }
        svg + "</figcaption></figure>\n"
    }

    fn frame(&self, svg: &mut String, x: &Scale, y: &Scale) {
        let _ = writeln!(
            svg,
            "<path class=\"frame\" d=\"M{LEFT} {TOP}V{BOTTOM}H{RIGHT}\"/>"
        );
        for tick in x.ticks() {
            let Some(at) = x.at(tick) else { continue };
            let _ = writeln!(
                svg,
                "<path class=\"grid\" d=\"M{at:.1} {TOP}V{BOTTOM}\"/><text class=\"middle\" x=\"{at:.1}\" y=\"{:.1}\">{}</text>",
                BOTTOM + 17.0,
                number(tick)
            );
        }
        for tick in y.ticks() {
            let Some(at) = y.at(tick) else { continue };
            let _ = writeln!(
                svg,
                "<path class=\"grid\" d=\"M{LEFT} {at:.1}H{RIGHT}\"/><text class=\"end\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                LEFT - 6.0,
                at + 4.5,
                number(tick)
            );
        }
        let (across, down) = ((LEFT + RIGHT) / 2.0, (TOP + BOTTOM) / 2.0);
        let _ = writeln!(
            svg,
            "<text class=\"middle\" x=\"{across:.0}\" y=\"{:.0}\">{}</text>\n<text class=\"middle\" transform=\"translate(13 {down:.0}) rotate(-90)\">{}</text>",
            HEIGHT - 8.0,
            escape(&self.x.label),
            escape(&self.y.label)
        );
    }

    fn line(&self, svg: &mut String, line: &Line, x: &Scale, y: &Scale) {
        let (color, dash) = style(line.index);
        let place = |p: [f64; 2]| Some(format!("{:.1} {:.1}", x.at(p[0])?, y.at(p[1])?));
        let upper = line.band.iter().filter_map(|b| place([b[0], b[2]]));
        let lower = line.band.iter().rev().filter_map(|b| place([b[0], b[1]]));
        let outline: Vec<String> = upper.chain(lower).collect();
        if outline.len() > 3 {
            let _ = writeln!(
                svg,
                "<path class=\"band\" fill=\"{color}\" d=\"M{}Z\"/>",
                outline.join("L")
            );
        }
        let points: Vec<String> = line.points.iter().filter_map(|p| place(*p)).collect();
        if points.is_empty() {
            return;
        }
        let named = !line.label.is_empty();
        let class = if named { "line" } else { "line thin" };
        let _ = writeln!(
            svg,
            "<path class=\"{class}\" stroke=\"{color}\" stroke-dasharray=\"{dash}\" d=\"M{}\"/>",
            points.join("L")
        );
        if named && points.len() <= 15 {
            for point in points {
                let (cx, cy) = point.split_once(' ').unwrap_or_default();
                let _ = write!(
                    svg,
                    "<circle fill=\"{color}\" cx=\"{cx}\" cy=\"{cy}\" r=\"2.6\"/>"
                );
            }
        }
    }
}

pub fn style(index: usize) -> (&'static str, &'static str) {
    (COLORS[index % COLORS.len()], DASHES[index % DASHES.len()])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(logarithmic: bool) -> Axis {
        Axis {
            label: "a < b".into(),
            logarithmic,
        }
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let ticks = |logarithmic, values: &[f64]| {
            Scale::new(&axis(logarithmic), values.iter().copied(), [0.0, 100.0])
                .unwrap()
                .ticks()
        };
        assert_eq!(ticks(false, &[1.0, 9.3]), [0.0, 2.0, 4.0, 6.0, 8.0]);
        let decades = ticks(true, &[1e-4, 0.2]);
        assert_eq!(decades.len(), 4);
        assert!((decades[0] - 1e-4).abs() < 1e-12);
        assert!(ticks(true, &[0.3, 0.5]).len() >= 3);
        assert!(ticks(false, &[0.0]).len() < 13, "a line of zeros");
    }

    #[test]
    fn draws_what_can_be_drawn() {
        let line = |points: &[[f64; 2]]| Line {
            label: "x & y".into(),
            index: 9,
            points: points.to_vec(),
            band: Vec::new(),
        };
        let plot = |lines| {
            Plot {
                x: axis(true),
                y: axis(true),
                lines,
                level: None,
            }
            .svg()
        };
        assert_eq!(plot(vec![line(&[[f64::NAN, 1.0], [0.0, 0.0]])]), "");
        let svg = plot(vec![line(&[
            [1.0, 1.0],
            [2.0, f64::NAN],
            [3.0, 0.5],
            [4.0, 0.0],
        ])]);
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(svg.contains("x &amp; y") && svg.contains("a &lt; b") && !svg.contains("NaN"));
        let mut unnamed = line(&[[1.0, 1.0], [2.0, 2.0]]);
        unnamed.label.clear();
        let svg = plot(vec![unnamed]);
        assert!(svg.contains("line thin") && !svg.contains("key") && !svg.contains("<circle"));
    }
}
