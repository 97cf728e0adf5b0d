//! The parameters of the law in the image, which stations may change: read again over the link after every change.

use ctrl_core::controller::ControllerConfig;
use link::{Downlink, Guidance, Parameters, Uplink};

/// See the module's documentation.
#[derive(Debug)]
pub(super) struct LawAboard {
    config: ControllerConfig,
    /// Changes aboard that `config` is of, once it has been read.
    changes: Option<u32>,
    /// Parameter that is read next.
    next: Option<u16>,
}

impl LawAboard {
    /// Nothing has been read; `config` has the controller's kind and its step period.
    pub fn new(config: &ControllerConfig) -> Self {
        Self { config: *config, changes: None, next: None }
    }

    /// `true` if the parameters aboard are known.
    pub fn is_known(&self) -> bool {
        self.changes.is_some() && self.next.is_none()
    }

    /// The message that asks for the next parameter; none if all are known.
    pub fn question(&self) -> Option<Uplink> {
        self.next.map(|index| Uplink::ParameterAt { index })
    }

    /// Takes an answer; the whole configuration, once its last parameter has come.
    pub fn take(&mut self, answer: &Downlink) -> Option<ControllerConfig> {
        match answer {
            Downlink::Guidance(Guidance { law_changes, .. })
                if self.changes != Some(*law_changes) =>
            {
                (self.changes, self.next) = (Some(*law_changes), Some(0));
                None
            }
            Downlink::Parameter(parameter) if self.next == Some(parameter.index) => {
                match &mut self.config {
                    ControllerConfig::RobustAdaptive(config) => {
                        set(config, parameter.index, parameter.value)
                    }
                    ControllerConfig::Saturated(config) => {
                        set(config, parameter.index, parameter.value)
                    }
                }
                let next = parameter.index + 1;
                self.next = (next < parameter.count).then_some(next);
                self.next.is_none().then_some(self.config)
            }
            _ => None,
        }
    }
}

/// Sets a parameter by its place; one that is not there belongs to other firmware, whose law then differs.
fn set<C: Parameters>(config: &mut C, index: u16, value: f32) {
    if let Some(field) = config.field(index.into()) {
        *field = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ctrl_core::mode::navigation::NavigationMode;
    use ctrl_core::reference::Reference;
    use link::ParameterValue;
    use sim::scenario::LoadedScenario;

    fn guidance(law_changes: u32) -> Downlink {
        let (navigation, reference) = (NavigationMode::Hold, Reference::hover(glam::Vec3::Z));
        Downlink::Guidance(Guidance { law_changes, navigation, reference })
    }

    #[test]
    fn a_change_is_read_from_the_first_parameter_on_and_one_amid_the_reading_again() {
        let scenario = LoadedScenario::open("paper-saturated", &[]).expect("a scenario");
        let ControllerConfig::Saturated(config) = scenario.scenario().controller else { panic!() };
        let answer = |index: u16, gain: f32| {
            let (name, value) = config.parameter_at(index).expect("a parameter");
            let value = if name == "k4.x" { gain } else { value };
            let count = u16::try_from(ctrl_core::config::SaturatedConfig::NAMES.len()).unwrap();
            let name = name.try_into().expect("it fits");
            Downlink::Parameter(ParameterValue { index, count, name, value })
        };
        let mut aboard = LawAboard::new(&ControllerConfig::Saturated(config));
        assert!(aboard.question().is_none() && !aboard.is_known());
        assert_eq!(aboard.take(&guidance(3)), None);
        let read = |aboard: &mut LawAboard, gain: f32, most: usize| {
            let mut whole = None;
            for _ in 0..most {
                let Some(Uplink::ParameterAt { index }) = aboard.question() else { break };
                aboard.take(&guidance(if gain == 3.0 { 3 } else { 4 }));
                whole = aboard.take(&answer(index, gain));
            }
            whole
        };
        assert_eq!(read(&mut aboard, 3.0, 20), None);
        assert_eq!(aboard.take(&guidance(4)), None);
        assert!(matches!(aboard.question(), Some(Uplink::ParameterAt { index: 0 })));
        let whole = read(&mut aboard, 5.0, 200).expect("whole");
        let ControllerConfig::Saturated(whole) = whole else { panic!() };
        assert!(whole.k4.x == 5.0 && whole.k4.y == config.k4.y && aboard.is_known());
        assert_eq!(aboard.take(&guidance(4)), None);
        assert!(aboard.question().is_none());
    }
}
