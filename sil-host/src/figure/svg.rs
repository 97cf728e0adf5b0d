//! The little of SVG that the figures need.

use std::fmt::{self, Write};

/// A document in the making; coordinates are pixels, y down.
#[derive(Clone, Debug)]
pub struct Svg {
    text: String,
}

/// Alignment and type of a text.
#[derive(Clone, Copy, Debug)]
pub struct Font {
    /// Height (px).
    pub size: f64,
    /// `start`, `middle` or `end`.
    pub anchor: &'static str,
    /// Colour.
    pub fill: &'static str,
    /// `normal` or `bold`.
    pub weight: &'static str,
}

impl Font {
    /// Dark, upright, of `size`.
    #[must_use]
    pub const fn new(size: f64, anchor: &'static str) -> Self {
        Self { size, anchor, fill: "#222222", weight: "normal" }
    }

    /// The same in another colour.
    #[must_use]
    pub const fn fill(self, fill: &'static str) -> Self {
        Self { fill, ..self }
    }

    /// The same in bold.
    #[must_use]
    pub const fn bold(self) -> Self {
        Self { weight: "bold", ..self }
    }
}

impl Svg {
    /// An empty white page.
    #[must_use]
    pub fn new(width: f64, height: f64, title: &str) -> Self {
        let mut svg = Self { text: String::new() };
        svg.put(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             width=\"{width}\" height=\"{height}\" \
             font-family=\"Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif\">\n\
             <title>{}</title>\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>",
            escape(title)
        ));
        svg
    }

    fn put(&mut self, element: fmt::Arguments) {
        let _ = self.text.write_fmt(element); // writing to a String cannot fail
        self.text.push('\n');
    }

    /// A straight line.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), style: &str) {
        let ((x1, y1), (x2, y2)) = (from, to);
        self.put(format_args!(
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}/>"
        ));
    }

    /// A rectangle.
    pub fn rectangle(&mut self, corner: (f64, f64), size: (f64, f64), style: &str) {
        let ((x, y), (width, height)) = (corner, size);
        self.put(format_args!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" {style}/>"
        ));
    }

    /// A dot.
    pub fn circle(&mut self, centre: (f64, f64), radius: f64, style: &str) {
        let (x, y) = centre;
        self.put(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" {style}/>"));
    }

    /// A line through points; a point that is not finite interrupts it.
    pub fn polyline(&mut self, points: impl Iterator<Item = (f64, f64)>, style: &str) {
        let mut path = String::new();
        let mut drawing = false;
        let mut last = None;
        for (x, y) in points {
            if !(x.is_finite() && y.is_finite()) {
                drawing = false;
                continue;
            }
            let now = [x, y].map(|pixels| (10.0 * pixels).round() as i64);
            if !drawing || last != Some(now) {
                path.push(if drawing { 'L' } else { 'M' });
                push_tenths(&mut path, now[0]);
                path.push(' ');
                push_tenths(&mut path, now[1]);
            }
            (drawing, last) = (true, Some(now));
        }
        if !path.is_empty() {
            self.put(format_args!("<path d=\"{path}\" fill=\"none\" {style}/>"));
        }
    }

    /// Text; `_{...}` sets a subscript.
    pub fn text(&mut self, at: (f64, f64), font: Font, content: &str) {
        self.rotated_text(at, 0.0, font, content);
    }

    /// Text turned by `angle` degrees about its anchor.
    pub fn rotated_text(&mut self, (x, y): (f64, f64), angle: f64, font: Font, content: &str) {
        let Font { size, anchor, fill, weight } = font;
        let turn = if angle == 0.0 {
            String::new()
        } else {
            format!(" transform=\"rotate({angle} {x:.1} {y:.1})\"")
        };
        self.put(format_args!(
            "<text xml:space=\"preserve\" x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\" \
             fill=\"{fill}\" font-weight=\"{weight}\"{turn}>{}</text>",
            subscripts(content, size)
        ));
    }

    /// Clips what follows to a rectangle until [`end_clip`](Self::end_clip); `id` must be unique on
    /// a page that shows several documents.
    pub fn begin_clip(&mut self, id: &str, corner: (f64, f64), size: (f64, f64)) {
        self.put(format_args!("<clipPath id=\"{id}\">"));
        self.rectangle(corner, size, "");
        self.put(format_args!("</clipPath><g clip-path=\"url(#{id})\">"));
    }

    /// Ends the clipping.
    pub fn end_clip(&mut self) {
        self.put(format_args!("</g>"));
    }

    /// The finished document.
    #[must_use]
    pub fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

/// Replaces the characters that XML and HTML reserve.
#[must_use]
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            _ => escaped.push(character),
        }
    }
    escaped
}

/// Appends `tenths` as pixels; many times faster than formatting floating-point numbers.
fn push_tenths(text: &mut String, tenths: i64) {
    if tenths < 0 {
        text.push('-');
    }
    let magnitude = tenths.unsigned_abs();
    text.push_str(itoa::Buffer::new().format(magnitude / 10));
    let digit = (b'0' + (magnitude % 10) as u8) as char;
    if digit != '0' {
        text.push('.');
        text.push(digit);
    }
}

/// `a_{b} c` with a lowered, smaller `b`.
fn subscripts(text: &str, size: f64) -> String {
    let mut parts = text.split("_{");
    let mut set = escape(parts.next().unwrap_or_default());
    let (small, drop) = (0.75 * size, 0.25 * size);
    for part in parts {
        let (below, after) = part.split_once('}').unwrap_or((part, ""));
        let _ = write!(
            set,
            "<tspan font-size=\"{small:.1}\" dy=\"{drop:.1}\">{}</tspan><tspan dy=\"-{drop:.1}\">{}</tspan>",
            escape(below),
            // An empty span does not move the pen back: a zero-width space does.
            if after.is_empty() { "\u{200b}".to_owned() } else { escape(after) },
        );
    }
    set
}

/// Width of `text` in Helvetica-like type, near enough to lay out a legend (px).
#[must_use]
pub fn text_width(text: &str, size: f64) -> f64 {
    let shown = text.chars().filter(|character| !"_{}".contains(*character)).count();
    0.56 * size * shown as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reserved_characters_and_subscripts() {
        assert_eq!(escape("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
        let set = subscripts("p_{d} < 1", 10.0);
        assert!(set.starts_with("p<tspan") && set.contains(">d</tspan>") && set.contains("&lt; 1"));
    }

    #[test]
    fn a_gap_interrupts_a_line_and_repeated_points_are_dropped() {
        let mut svg = Svg::new(10.0, 10.0, "t");
        let points =
            [(0.0, 1.0), (0.0, 1.04), (-2.5, 3.12), (f64::NAN, 0.0), (4.0, 5.0), (6.0, 70.0)];
        svg.polyline(points.into_iter(), "stroke=\"red\"");
        assert!(svg.finish().contains("d=\"M0 1L-2.5 3.1M4 5L6 70\""));
    }
}
