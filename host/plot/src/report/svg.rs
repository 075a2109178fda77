//! A small chart in SVG: axes with round ticks, lines, bands, dots. Colours are classes, so that one style sheet serves
//! light, dark and print.

use std::fmt::Write as _;

/// Escapes text for HTML and XML, attributes too. Control characters that XML cannot hold are dropped.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' => out.push(c),
            c if c.is_control() => {}
            c => out.push(c),
        }
    }
    out
}

/// Style of the classes used here; colours come from the custom properties of [`COLOURS`].
pub const STYLE: &str = "\
.axis{stroke:var(--line);fill:none}.grid{stroke:var(--grid);fill:none}\
.tick,.label,.note{fill:var(--soft);font:11px system-ui,sans-serif}.note{fill:var(--ink)}\
.title{fill:var(--ink);font:600 12px system-ui,sans-serif}\
.measured{fill:none;stroke:var(--soft);stroke-width:6;stroke-opacity:.35;stroke-linecap:round}\
.before{fill:none;stroke:var(--before);stroke-width:1.8}.before.fill{fill:var(--before);stroke:none}\
.after{fill:none;stroke:var(--after);stroke-width:1.8}.after.fill{fill:var(--after);stroke:none}\
.floor{fill:none;stroke:var(--soft);stroke-dasharray:4 3}.shade{fill:var(--shade);stroke:none}\
.other.fill{fill:var(--soft);stroke:none}.thin{stroke-width:1;opacity:.75}.faint{opacity:.35}";

/// Colours for light, dark and print: blue and orange, told apart by the colour-blind and in grey.
pub const COLOURS: &str = "\
:root{--paper:#fff;--ink:#1b1f24;--soft:#57606a;--line:#8c959f;--grid:#e6e9ec;--shade:#e4e9ef;--card:#f6f8fa;\
--before:#c8500a;--after:#0a63c9;--good:#1a7f37;--warn:#9a6700;color-scheme:light dark}\
@media screen and (prefers-color-scheme:dark){:root{--paper:#14171b;--ink:#e6e9ec;--soft:#a3acb5;--line:#6b747d;\
--grid:#2a3038;--shade:#2b333d;--card:#1c2127;--before:#ff9350;--after:#6cb0ff;--good:#56d37a;--warn:#e3b341}}";

/// A style sheet with the colours of [`COLOURS`] for light in place of their names, for a picture that stands alone: not
/// every program that shows SVG knows custom properties.
#[must_use]
pub fn fixed(style: &str) -> String {
    let light = COLOURS.trim_start_matches(":root{").split('}').next().unwrap_or_default();
    let named = light.split(';').filter_map(|entry| entry.split_once(':')).filter(|(name, _)| name.starts_with("--"));
    named.fold(style.to_owned(), |style, (name, colour)| style.replace(&format!("var({name})"), colour))
}

/// A chart under construction. Coordinates are data; anything outside the ranges is cut off.
#[derive(Clone, Debug)]
pub struct Chart {
    width: f64,
    height: f64,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    x: (f64, f64),
    y: (f64, f64),
    body: String,
    clip: String,
    decades: bool,
}

impl Chart {
    /// A chart of this size (CSS px) over these ranges. `name` must be unique in the page (letters, digits, hyphen).
    #[must_use]
    pub fn new(name: &str, (width, height): (f64, f64), x: (f64, f64), y: (f64, f64)) -> Self {
        let (left, right, top, bottom) = (48.0, 10.0, 24.0, 34.0);
        let clip = format!(
            "<clipPath id=\"{name}\"><rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\"/></clipPath>",
            width - left - right,
            height - top - bottom
        );
        let mut chart = Self {
            width,
            height,
            left,
            right,
            top,
            bottom,
            x: spread(x),
            y: spread(y),
            body: String::new(),
            clip,
            decades: false,
        };
        chart.body.push_str(&format!("<g clip-path=\"url(#{name})\">"));
        chart
    }

    /// The x axis holds logarithms to base 10: ticks show the numbers themselves.
    #[must_use]
    pub fn decades(mut self) -> Self {
        self.decades = true;
        self
    }

    fn x_ticks(&self) -> Vec<(f64, f64)> {
        if !self.decades {
            return ticks(self.x, 5).into_iter().map(|value| (value, value)).collect();
        }
        let powers = (self.x.0.floor() as i32)..=(self.x.1.ceil() as i32);
        let wide = self.x.1 - self.x.0 > 2.5;
        let steps: &[f64] = if wide { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let values = powers.flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)));
        values.map(|value| (value.log10(), value)).filter(|(at, _)| (self.x.0..=self.x.1).contains(at)).collect()
    }

    /// Across the page, px.
    #[must_use]
    pub fn px(&self, x: f64) -> f64 {
        self.left + (x - self.x.0) / (self.x.1 - self.x.0) * (self.width - self.left - self.right)
    }

    /// Down the page, px.
    #[must_use]
    pub fn py(&self, y: f64) -> f64 {
        self.height - self.bottom - (y - self.y.0) / (self.y.1 - self.y.0) * (self.height - self.top - self.bottom)
    }

    /// A line; it breaks where a value is not finite.
    pub fn line(&mut self, points: impl IntoIterator<Item = (f64, f64)>, class: &str) {
        let mut path = String::new();
        let mut pen_down = false;
        for (x, y) in points {
            if !(x.is_finite() && y.is_finite()) {
                pen_down = false;
                continue;
            }
            let _ = write!(path, "{}{:.1} {:.1}", if pen_down { 'L' } else { 'M' }, self.px(x), self.bounded(y));
            pen_down = true;
        }
        if !path.is_empty() {
            let _ = write!(self.body, "<path class=\"{class}\" d=\"{path}\"/>");
        }
    }

    /// Dots of this radius, px.
    pub fn dots(&mut self, points: impl IntoIterator<Item = (f64, f64)>, radius: f64, class: &str) {
        let mut path = String::new();
        for (x, y) in points {
            if x.is_finite() && y.is_finite() {
                let (x, y) = (self.px(x) - radius, self.bounded(y));
                let _ = write!(
                    path,
                    "M{x:.1} {y:.1}a{radius} {radius} 0 1 0 {0} 0a{radius} {radius} 0 1 0 -{0} 0",
                    2.0 * radius
                );
            }
        }
        if !path.is_empty() {
            let _ = write!(self.body, "<path class=\"{class} dot\" d=\"{path}\"/>");
        }
    }

    /// A rectangle from corner to corner.
    pub fn block(&mut self, x: (f64, f64), y: (f64, f64), class: &str) {
        let (x0, x1) = (self.px(x.0.min(x.1)), self.px(x.0.max(x.1)));
        let (y0, y1) = (self.bounded(y.0.max(y.1)), self.bounded(y.0.min(y.1)));
        let _ = write!(
            self.body,
            "<rect class=\"{class}\" x=\"{x0:.1}\" y=\"{y0:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
            x1 - x0,
            y1 - y0
        );
    }

    /// A stretch of x over the whole height.
    pub fn shade(&mut self, from: f64, to: f64) {
        let y = self.y;
        self.block((from, to), y, "shade");
    }

    /// A level over the whole width.
    pub fn level(&mut self, y: f64, class: &str) {
        let x = self.x;
        self.line([(x.0, y), (x.1, y)], class);
    }

    /// Text at a point; `anchor` is `start`, `middle` or `end`.
    pub fn note(&mut self, x: f64, y: f64, anchor: &str, text: &str) {
        let (x, y) = (self.px(x), self.py(y));
        let _ = write!(
            self.body,
            "<text class=\"note\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>",
            escape(text)
        );
    }

    fn bounded(&self, y: f64) -> f64 {
        self.py(y).clamp(-1e4, 1e4)
    }

    /// Puts axes, ticks and words around it. `title` is drawn; `robot_file` is for screen readers.
    #[must_use]
    pub fn finish(self, title: &str, x_label: &str, y_label: &str, description: &str) -> String {
        let Self { width, height, left, right, top, bottom, .. } = self;
        let mut frame = String::new();
        let (x0, x1, y0, y1) = (left, width - right, height - bottom, top);
        for (at, value) in self.x_ticks() {
            let x = self.px(at);
            let _ = write!(
                frame,
                "<path class=\"grid\" d=\"M{x:.1} {y0}V{y1}\"/><text class=\"tick\" x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                y0 + 14.0,
                number(value)
            );
        }
        for value in ticks(self.y, 4) {
            let y = self.py(value);
            let _ = write!(
                frame,
                "<path class=\"grid\" d=\"M{x0} {y:.1}H{x1}\"/><text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                x0 - 5.0,
                y + 3.5,
                number(value)
            );
        }
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">\
             <defs>{}</defs>{frame}{}</g><path class=\"axis\" d=\"M{x0} {y1}V{y0}H{x1}\"/>\
             <text class=\"title\" x=\"4\" y=\"14\">{}</text>\
             <text class=\"label\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\
             <text class=\"label\" x=\"{:.1}\" y=\"14\" text-anchor=\"end\">{}</text></svg>",
            escape(description),
            self.clip,
            self.body,
            escape(title),
            x1,
            height - 5.0,
            escape(x_label),
            x1,
            escape(y_label),
        )
    }
}

/// A range with some width.
fn spread((low, high): (f64, f64)) -> (f64, f64) {
    if !(low.is_finite() && high.is_finite()) {
        return (0.0, 1.0);
    }
    if high - low > 1e-12 * low.abs().max(high.abs()).max(1e-9) { (low, high) } else { (low - 0.5, high + 0.5) }
}

/// Round values within a range, about `count` of them.
#[must_use]
pub fn ticks((low, high): (f64, f64), count: usize) -> Vec<f64> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) || count == 0 {
        return Vec::new();
    }
    let rough = span / count as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= rough).unwrap_or(10.0 * power);
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|n| n as f64 * step).collect()
}

/// A number as a person writes it: about four digits, no trailing zeros, a true minus.
#[must_use]
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let magnitude = value.abs();
    if magnitude < 1e-12 {
        return "0".into();
    }
    let text = if !(1e-3..1e5).contains(&magnitude) {
        let exponent = magnitude.log10().floor() as i32;
        let mantissa = trimmed(&format!("{:.2}", value / 10f64.powi(exponent)));
        format!("{mantissa}e{exponent}")
    } else {
        let decimals = (3 - magnitude.log10().floor() as i32).clamp(0, 6) as usize;
        trimmed(&format!("{value:.decimals$}"))
    };
    text.replace('-', "−")
}

fn trimmed(text: &str) -> String {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text.to_string() }
}

/// Least and greatest finite value with a little room; `None` when there is none.
#[must_use]
pub fn range(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let (low, high) = values
        .into_iter()
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    (low <= high).then(|| {
        let room = 0.05 * (high - low);
        (low - room, high + room)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks((0.0, 10.0), 5), vec![0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(ticks((-180.0, 180.0), 4), vec![-100.0, 0.0, 100.0]);
        assert!(ticks((1.0, 1.0), 4).is_empty() && ticks((0.0, f64::NAN), 4).is_empty());
    }

    #[test]
    fn numbers_read_well() {
        assert_eq!(number(0.0123456), "0.01235");
        assert_eq!(number(-97.0), "−97");
        assert_eq!(number(1.1e-6), "1.1e−6");
        assert_eq!(number(12345.6), "12346");
        assert_eq!(number(f64::NAN), "–");
    }

    #[test]
    fn text_cannot_break_out() {
        assert_eq!(escape("<a href=\"x\">&'\u{0}"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
    }
}
