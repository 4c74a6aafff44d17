//! Bars made of parts, as SVG.

use super::plot::{COLORS, WIDTH, style};
use super::{escape, number};
use std::fmt::Write;

/// Bars made of parts, one below the other: names, and the parts' names and lengths. `unit` follows the sums.
pub fn bars(rows: &[(String, Vec<(String, f64)>)], unit: &str) -> String {
    const ROW: f64 = 46.0;
    let sum = |parts: &[(String, f64)]| parts.iter().map(|p| p.1).sum::<f64>();
    let longest = rows.iter().map(|r| sum(&r.1)).fold(0.0, f64::max);
    if longest <= 0.0 {
        return String::new();
    }
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in rows.iter().flat_map(|r| &r.1) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let mut svg = format!(
        "<figure><svg viewBox=\"0 0 {WIDTH} {:.0}\" role=\"img\" aria-label=\"time of each pass\">\n",
        rows.len() as f64 * ROW + 4.0
    );
    for (i, (label, parts)) in rows.iter().enumerate() {
        let top = i as f64 * ROW;
        let _ = writeln!(
            svg,
            "<text x=\"0\" y=\"{:.0}\">{}</text><text class=\"end\" x=\"{WIDTH}\" y=\"{:.0}\">{} {unit}</text>",
            top + 15.0,
            escape(label),
            top + 15.0,
            number(sum(parts))
        );
        let mut x = 0.0;
        for (name, value) in parts {
            let width = value / longest * WIDTH;
            let index = names.iter().position(|n| n == name).unwrap_or(0);
            let _ = writeln!(
                svg,
                "<rect x=\"{x:.2}\" y=\"{:.0}\" width=\"{width:.2}\" height=\"18\" fill=\"{}\" fill-opacity=\"{}\"><title>{}: {} {unit}</title></rect>",
                top + 21.0,
                style(index).0,
                shade(index),
                escape(name),
                number(*value)
            );
            x += width;
        }
    }
    svg += "</svg>\n<figcaption>";
    for (index, name) in names.iter().enumerate() {
        let _ = write!(
            svg,
            "<span class=\"key\"><svg viewBox=\"0 0 12 12\"><rect width=\"12\" height=\"12\" fill=\"{}\" fill-opacity=\"{}\"/></svg>{}</span> ",
            style(index).0,
            shade(index),
            escape(name)
        );
    }
    svg + "</figcaption></figure>\n"
}

/// Colours come again, paler.
fn shade(index: usize) -> f64 {
    1.0 / (1.0 + (index / COLORS.len()) as f64)
}

#[cfg(test)]
mod tests {
    use super::bars;

    #[test]
    fn bars_are_as_long_as_their_parts() {
        let row = |name: &str, parts: &[(&str, f64)]| {
            let parts = parts.iter().map(|p| (p.0.to_string(), p.1)).collect();
            (name.to_string(), parts)
        };
        let svg = bars(
            &[row("a", &[("x", 1.0), ("y", 3.0)]), row("b", &[("y", 2.0)])],
            "ms",
        );
        for width in [120.0, 360.0, 240.0] {
            assert!(svg.contains(&format!("width=\"{width:.2}\"")), "{svg}");
        }
        assert_eq!(bars(&[row("a", &[])], "ms"), "");
    }
}
