//! Figures of a flight like the paper's 1 to 8: self-contained SVG documents, and data for its page.

pub mod axis;
pub mod catalogue;
pub mod panel;
pub mod record;
pub mod svg;
mod time_series;

use serde::Serialize;

use panel::{Frame, Panel, Style};
pub use record::FigureRecorder;
use svg::{Font, Svg, text_width};

/// A drawing of one or more panels in a row under a common legend. Pages carry it as data, which their
/// scripts draw.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// Name of its file, without extension.
    pub name: &'static str,
    /// Title above the panels.
    pub title: String,
    /// Styles and names of the lines, with `_{}` for subscripts.
    pub legend: Vec<(Style, String)>,
    /// Panels from left to right, with the share of the width that each takes.
    pub panels: Vec<(f64, Panel)>,
    /// Height of the axes (px).
    pub height: f64,
}

/// Width of every figure (px).
const WIDTH: f64 = 1160.0;
/// Room left of each panel's axes for its tick labels (px).
const GUTTER: f64 = 74.0;
/// Upper edge of the axes (px).
const TOP: f64 = 84.0;
/// Room below the axes (px).
const BOTTOM: f64 = 48.0;

impl Figure {
    /// The SVG document for the scenario `scope`, whose name makes its ids unique on a page.
    #[must_use]
    pub fn svg(&self, scope: &str) -> String {
        let mut svg = Svg::new(WIDTH, TOP + self.height + BOTTOM, &self.title);
        svg.text((14.0, 25.0), Font::new(16.0, "start").bold(), &self.title);
        svg.text((WIDTH - 20.0, 25.0), Font::new(13.0, "end").fill("#777777"), scope);
        self.draw_legend(&mut svg);
        let shares: f64 = self.panels.iter().map(|(share, _)| share).sum();
        let room = WIDTH - 20.0 - GUTTER * self.panels.len() as f64;
        let mut left = GUTTER;
        for (index, (share, panel)) in self.panels.iter().enumerate() {
            let width = room * share / shares;
            let frame = Frame { left, top: TOP, width, height: self.height };
            panel.draw(&mut svg, frame, &format!("{scope}-{}-{index}", self.name));
            left += width + GUTTER;
        }
        svg.finish()
    }

    /// A row under the title: it never covers data.
    fn draw_legend(&self, svg: &mut Svg) {
        let mut x = 16.0;
        for (style, label) in &self.legend {
            svg.line(
                (x, 45.0),
                (x + 26.0, 45.0),
                &Style { width: style.width.max(2.2), ..*style }.attributes(),
            );
            svg.text((x + 32.0, 49.0), Font::new(13.0, "start"), label);
            x += 32.0 + text_width(label, 13.0) + 24.0;
        }
    }
}
