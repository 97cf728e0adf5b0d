//! One coordinate system with its lines.

use serde::{Serialize, Serializer};

use super::axis::{Axis, Scale, superscript};
use super::svg::{Font, Svg};

/// A line of data.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// Points in the units of the axes.
    #[serde(serialize_with = "single_precision")]
    pub points: Vec<(f64, f64)>,
    /// Colour and dashes.
    pub style: Style,
}

/// Coordinates in turn, in single precision: a page has no use for more digits.
fn single_precision<S: Serializer>(points: &[(f64, f64)], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(points.iter().flat_map(|&(x, y)| [x as f32, y as f32]))
}

/// Style of a line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Style {
    /// Colour.
    pub colour: &'static str,
    /// Width (px).
    pub width: f64,
    /// SVG dash pattern; empty for a solid line.
    pub dashes: &'static str,
    /// From 0, transparent, to 1, opaque.
    pub opacity: f64,
}

impl Style {
    /// A solid line.
    #[must_use]
    pub const fn solid(colour: &'static str) -> Self {
        Self { colour, width: 1.3, dashes: "", opacity: 1.0 }
    }

    /// A dashed line.
    #[must_use]
    pub const fn dashed(colour: &'static str) -> Self {
        Self { colour, width: 1.3, dashes: "5 4", opacity: 1.0 }
    }

    /// As SVG attributes.
    #[must_use]
    pub fn attributes(self) -> String {
        let Self { colour, width, dashes, opacity } = self;
        let dashes = if dashes.is_empty() {
            String::new()
        } else {
            format!(" stroke-dasharray=\"{dashes}\"")
        };
        format!(
            "stroke=\"{colour}\" stroke-width=\"{width}\" stroke-opacity=\"{opacity}\" \
             stroke-linejoin=\"round\"{dashes}"
        )
    }
}

/// A bound or a true value: a dashed horizontal line with its name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Guide {
    /// Position on the vertical axis.
    pub value: f64,
    /// Name, with `_{}` for subscripts.
    pub label: String,
    /// Colour.
    pub colour: &'static str,
    /// `true` if the name is below the line.
    pub below: bool,
}

/// One coordinate system.
#[derive(Clone, Debug, Serialize)]
pub struct Panel {
    /// Title above the axes.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Data, drawn in order.
    pub lines: Vec<Line>,
    /// Bounds and true values; those outside the axis are left out.
    pub guides: Vec<Guide>,
    /// Places to mark, with a name.
    pub marks: Vec<((f64, f64), &'static str)>,
    /// `true` if a unit is as long on both axes; the shorter one is extended.
    pub equal: bool,
}

/// The frame of a panel on the page (px).
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Left edge of the axes.
    pub left: f64,
    /// Upper edge.
    pub top: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

const GRID: &str = "stroke=\"#e6e6e6\" stroke-width=\"1\"";
const FRAME: &str = "fill=\"none\" stroke=\"#444444\" stroke-width=\"1\"";
const LABEL: Font = Font::new(12.0, "middle");

impl Panel {
    /// Draws it; `id` names it on its page.
    pub fn draw(&self, svg: &mut Svg, frame: Frame, id: &str) {
        if self.equal {
            let mut fitted = Self { equal: false, ..self.clone() };
            let unit = ((self.x.upper - self.x.lower) / frame.width)
                .max((self.y.upper - self.y.lower) / frame.height);
            fitted.x.widen(unit * frame.width);
            fitted.y.widen(unit * frame.height);
            return fitted.draw(svg, frame, id);
        }
        let Frame { left, top, width, height } = frame;
        self.draw_x_axis(svg, frame);
        self.draw_y_axis(svg, frame);
        svg.begin_clip(id, (left, top), (width, height));
        for line in &self.lines {
            let points = line.points.iter().map(|point| self.place(frame, *point));
            svg.polyline(points, &line.style.attributes());
        }
        svg.end_clip();
        self.draw_guides(svg, frame);
        for (point, name) in &self.marks {
            let (x, y) = self.place(frame, *point);
            svg.circle((x, y), 3.5, "fill=\"#222222\"");
            let anchor = if x > left + 0.7 * width { "end" } else { "start" };
            halo(svg, (x, y + 16.0), Font::new(11.0, anchor), name);
        }
        svg.rectangle((left, top), (width, height), FRAME);
        svg.text((left + 0.5 * width, top - 7.0), LABEL.fill("#555555"), &self.title);
    }

    fn place(&self, frame: Frame, (x, y): (f64, f64)) -> (f64, f64) {
        let Frame { left, top, width, height } = frame;
        (left + width * self.x.position(x), top + height * (1.0 - self.y.position(y)))
    }

    fn draw_x_axis(&self, svg: &mut Svg, frame: Frame) {
        let Frame { left, top, width, height } = frame;
        let bottom = top + height;
        let (ticks, _) = self.x.ticks((width / 65.0).clamp(2.0, 8.0));
        for (value, label) in ticks {
            let (x, _) = self.place(frame, (value, self.y.lower));
            svg.line((x, top), (x, bottom), GRID);
            svg.text((x, bottom + 16.0), LABEL, &label);
        }
        svg.text((left + 0.5 * width, bottom + 35.0), LABEL, &self.x.label);
    }

    fn draw_y_axis(&self, svg: &mut Svg, frame: Frame) {
        let Frame { left, top, width, height } = frame;
        let (ticks, exponent) = self.y.ticks((height / 34.0).clamp(2.0, 8.0));
        let mut widest = 0;
        for (value, label) in ticks {
            let (_, y) = self.place(frame, (self.x.lower, value));
            svg.line((left, y), (left + width, y), GRID);
            svg.text((left - 6.0, y + 4.0), Font::new(12.0, "end"), &label);
            widest = widest.max(label.chars().count());
        }
        if self.y.scale == Scale::Linear && self.y.contains(0.0) {
            let (_, y) = self.place(frame, (self.x.lower, 0.0));
            svg.line((left, y), (left + width, y), "stroke=\"#bbbbbb\" stroke-width=\"1\"");
        }
        if exponent != 0 {
            let power = format!("×10{}", superscript(exponent));
            svg.text((left, top - 7.0), Font::new(11.0, "start"), &power);
        }
        let away = 16.0 + 6.7 * widest as f64;
        let middle = (left - away, top + 0.5 * height);
        svg.rotated_text(middle, -90.0, LABEL, &self.y.label);
    }

    fn draw_guides(&self, svg: &mut Svg, frame: Frame) {
        for guide in self.guides.iter().filter(|guide| self.y.contains(guide.value)) {
            let (_, y) = self.place(frame, (self.x.lower, guide.value));
            let right = frame.left + frame.width;
            svg.line((frame.left, y), (right, y), &Style::dashed(guide.colour).attributes());
            let below = guide.below || y < frame.top + 15.0;
            let at = (right - 5.0, if below { y + 14.0 } else { y - 5.0 });
            halo(svg, at, Font::new(11.5, "end").fill(guide.colour), &guide.label);
        }
    }
}

/// Text with a white edge, legible on top of lines.
fn halo(svg: &mut Svg, at: (f64, f64), font: Font, content: &str) {
    let edge = Font { weight: "normal\" stroke=\"#ffffff\" stroke-width=\"3", ..font };
    svg.text(at, edge, content);
    svg.text(at, font, content);
}
