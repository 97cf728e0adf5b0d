//! Interior of the grid: the built-in campaigns `guarantees-*`, each variant a kind of disturbance.

use sil_host::campaign::{Campaign, CampaignOverrides};

use super::{Case, Kind};

/// Every flight of the built-in campaign `name`, with `times` the number of runs of its file.
///
/// # Panics
/// When there is no such campaign, a variant is called after no kind of disturbance, or a scenario
/// is refused.
#[must_use]
pub fn campaign(name: &str, times: u32) -> Vec<Case> {
    let open = |overrides: &CampaignOverrides| {
        Campaign::open(name, overrides, &[]).unwrap_or_else(|error| panic!("{error}"))
    };
    let runs = open(&CampaignOverrides::default()).runs() * times;
    let campaign = open(&CampaignOverrides { runs: Some(runs), first_seed: None });
    let flights = (0..runs).flat_map(|index| campaign.variants().iter().map(move |it| (index, it)));
    flights
        .map(|(index, variant)| {
            let loaded = campaign.scenario(index, variant);
            let loaded = loaded.unwrap_or_else(|error| panic!("{name}, run {index}: {error}"));
            let disturbance = Kind::named(&variant.name).expect("a kind of disturbance");
            Case { scenario: loaded.scenario().clone(), disturbance }
        })
        .collect()
}
