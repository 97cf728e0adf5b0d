//! The second pass over the rows: histograms over the extents that the first pass found, and the envelope.

use super::envelope::Envelope;
use super::histogram::Histogram;
use super::quantity::Quantity;
use super::scan::Scan;
use crate::campaign::{Campaign, Row};

/// Histograms of all quantities, and the envelope if the campaign defines one.
#[derive(Clone, Debug)]
pub struct Counts {
    /// In the order of the quantities.
    pub histograms: Vec<Histogram>,
    /// Shares over two varied values.
    pub envelope: Option<Envelope>,
}

impl Counts {
    /// Before the first row.
    #[must_use]
    pub fn new(campaign: &Campaign, scan: &Scan) -> Self {
        let variants = campaign.variants().len();
        Self {
            histograms: scan.extents.iter().map(|it| Histogram::new(*it, variants)).collect(),
            envelope: campaign.envelope().map(|axes| Envelope::new(campaign, axes, &scan.axes)),
        }
    }

    /// Takes in a row.
    pub fn push(&mut self, row: &Row, quantities: &[Quantity]) {
        for (histogram, quantity) in self.histograms.iter_mut().zip(quantities) {
            histogram.push(row.variant, quantity.of(row));
        }
        if let Some(envelope) = &mut self.envelope {
            envelope.push(row);
        }
    }
}
