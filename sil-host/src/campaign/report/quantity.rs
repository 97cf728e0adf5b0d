//! Numeric quantities of a run: its varied values, its measures and its margins.

use serde::Serialize;

use crate::campaign::{Campaign, MEASURES, Row};

/// Source of a quantity's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A varied value.
    Varied,
    /// A measure of the flight.
    Measure,
    /// The distance of an observed value from its bound, positive on the good side.
    Margin,
}

/// Numeric quantity of a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Quantity {
    /// Name.
    pub name: String,
    /// Its unit; empty if it has none.
    pub unit: String,
    /// Source of its values.
    pub kind: Kind,
    #[serde(skip)]
    number: usize,
}

impl Quantity {
    /// Every quantity of a campaign: varied values, then margins, then measures.
    #[must_use]
    pub fn all(campaign: &Campaign) -> Vec<Self> {
        let quantity = |name: &str, unit: &str, kind, number| Self {
            name: name.to_owned(),
            unit: unit.to_owned(),
            kind,
            number,
        };
        let varied = campaign.parameters().iter().enumerate();
        let varied = varied.map(|(i, it)| quantity(&it.path, &it.unit, Kind::Varied, i));
        let margins = campaign.guarantees().iter().enumerate();
        let margins = margins.map(|(i, it)| quantity(it.name, it.unit, Kind::Margin, i));
        let measures = MEASURES.iter().enumerate();
        let measures = measures.map(|(i, it)| quantity(it.label, it.unit, Kind::Measure, i));
        varied.chain(margins).chain(measures).collect()
    }

    /// Its value in a run; none where it does not apply or is not finite.
    #[must_use]
    pub fn of(&self, row: &Row) -> Option<f64> {
        let value = match self.kind {
            Kind::Varied => row.parameters.get(self.number).copied(),
            Kind::Measure => *row.measures.get(self.number)?,
            Kind::Margin => row.guarantees.get(self.number)?.margin,
        };
        value.filter(|value| value.is_finite())
    }
}
