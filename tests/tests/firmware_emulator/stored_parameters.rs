//! Parameters that the image keeps over a restart: it flies with the same bits.

use std::fs;
use std::path::{Path, PathBuf};

use ctrl_core::mode::Command;
use ctrl_core::vehicle::VehicleState;
use firmware::parameter_store::SLOT;
use glam::Vec3;
use link::{Downlink, ParameterOrigin, ParametersInForce, Rejection, Uplink};
use sil_host::pil::flight::fly;
use sil_host::pil::session::VehicleSession;
use sil_host::pil::set_up::ready;
use sim::scenario::LoadedScenario;

use crate::serial_link::Vehicle;

/// Bytes of a sector of the chip's flash.
const SECTOR: usize = 16 * 1024;
const HERE: VehicleState = VehicleState::at_rest(Vec3::new(1.0, 2.0, 3.0));
/// Parameters written to the vehicle, and the scenario with the same values for SIL.
const CHANGES: [(&str, f32); 3] = [("k4.x", 3.7), ("cascade.k1", 0.43), ("initial.mass", 0.8)];

/// The same as changes of the scenario's controller.
const IN_A_SCENARIO: [&str; 3] = ["k4=[3.7, 4, 4]", "cascade.k1=0.43", "initial.mass=0.8"];

/// A file that no other test uses, absent.
fn memory(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.parameters"));
    let _ = fs::remove_file(&path);
    path
}

/// Boots the image with a memory; the vehicle, and which parameters it says are in force.
fn boot(memory: &Path) -> (Vehicle, ParametersInForce) {
    let (vehicle, first) = Vehicle::boot(&[&format!("parameters={}", memory.display())]);
    let [Downlink::Identity(_), Downlink::ParametersInForce(in_force)] = first[..] else {
        panic!("{first:?}")
    };
    (vehicle, in_force)
}

fn write(vehicle: &mut Vehicle, name: &str, value: f32) {
    let name = name.try_into().unwrap();
    vehicle.ask(Uplink::ParameterWrite { name, value }, HERE).unwrap();
}

/// Every parameter, as bits.
fn parameters(vehicle: &mut Vehicle) -> Vec<(String, u32)> {
    let mut found = Vec::new();
    for index in 0.. {
        let mut received = vehicle.send(&[Uplink::ParameterAt { index }]);
        let parameter = (0..100).find_map(|_| {
            let said = received.iter().find_map(|message| match message {
                Downlink::Parameter(parameter) => Some(parameter.clone()),
                _ => None,
            });
            received = vehicle.send(&[]);
            said
        });
        let parameter = parameter.expect("an answer");
        found.push((parameter.name.to_string(), parameter.value.to_bits()));
        if index + 1 == parameter.count {
            break;
        }
    }
    found
}

fn in_force(origin: ParameterOrigin, generation: u32) -> ParametersInForce {
    ParametersInForce { origin, generation, changed: false }
}

/// A memory that the image has kept [`CHANGES`] in.
fn with_changes(name: &str) -> (PathBuf, Vec<(String, u32)>) {
    let memory = memory(name);
    let (mut vehicle, said) = boot(&memory);
    assert_eq!(said, in_force(ParameterOrigin::BuiltIn, 0));
    CHANGES.iter().for_each(|(name, value)| write(&mut vehicle, name, *value));
    vehicle.ask(Uplink::ParametersPersist, HERE).unwrap();
    let changed = parameters(&mut vehicle);
    (memory, changed)
}

#[test]
fn parameters_that_were_kept_are_flown_with_after_a_restart_as_in_sil() {
    let (memory, changed) = with_changes("flown");
    let (mut vehicle, said) = boot(&memory);
    assert_eq!(said, in_force(ParameterOrigin::Stored, 1));
    assert_eq!(parameters(&mut vehicle), changed);
    let mut changes = vec!["duration=0.5".to_owned()];
    changes.extend(IN_A_SCENARIO.map(|change| format!("controller.saturated.{change}")));
    let loaded = LoadedScenario::open("paper-saturated", &changes).unwrap();
    let session: &mut VehicleSession = &mut vehicle.0;
    ready(session, loaded.scenario()).unwrap();
    let on_board = fly(&loaded, session, &mut (), &|_| ()).unwrap();
    assert_eq!((on_board.ticks, on_board.difference), (500, None));
}

#[test]
fn parameters_that_were_forgotten_stay_so_and_the_built_in_ones_are_in_force_at_once() {
    let (mut vehicle, _) = Vehicle::boot(&[]);
    let built_in = parameters(&mut vehicle);
    let (memory, changed) = with_changes("forgotten");
    assert_ne!(built_in, changed);
    let (mut vehicle, _) = boot(&memory);
    vehicle.ask(Uplink::ParametersForget, HERE).unwrap();
    assert_eq!(parameters(&mut vehicle), built_in);
    let (mut vehicle, said) = boot(&memory);
    assert_eq!(said, in_force(ParameterOrigin::BuiltIn, 2));
    assert_eq!(parameters(&mut vehicle), built_in);
}

#[test]
fn a_damaged_memory_leads_to_the_set_before_or_the_built_in_one_and_is_told() {
    let (memory, changed) = with_changes("damaged");
    let (mut vehicle, _) = boot(&memory);
    write(&mut vehicle, "k4.x", 3.9);
    vehicle.ask(Uplink::ParametersPersist, HERE).unwrap();
    let mut bytes = fs::read(&memory).unwrap();
    assert_eq!(bytes.len(), 2 * SECTOR);
    bytes[2 * SLOT + 100] ^= 0x10; // the newer record, behind the sector's mark and the older one
    fs::write(&memory, &bytes).unwrap();
    let (mut vehicle, said) = boot(&memory);
    assert_eq!(said, in_force(ParameterOrigin::Stored, 1));
    assert_eq!(parameters(&mut vehicle), changed);
    bytes[SLOT + 100] ^= 0x10;
    fs::write(&memory, &bytes).unwrap();
    let (_, said) = boot(&memory);
    assert_eq!(said, in_force(ParameterOrigin::Unreadable, 0));
}

#[test]
fn parameters_are_kept_disarmed_only_while_control_misses_no_deadline() {
    let memory = memory("armed");
    let (mut vehicle, _) = boot(&memory);
    vehicle.subscribe(HERE);
    for _ in 0..60 {
        vehicle.tick(&[Uplink::State { tick: 0, state: HERE }]);
    }
    vehicle.ask(Uplink::ParametersPersist, HERE).unwrap();
    vehicle.ask(Uplink::Command(Command::Arm), HERE).unwrap();
    for message in [Uplink::ParametersPersist, Uplink::ParametersForget] {
        assert_eq!(vehicle.ask(message, HERE), Err(Rejection::NotNow));
    }
    vehicle.health(HERE);
    let health = vehicle.health(HERE);
    assert_eq!(health.groups.map(|group| group.overruns), [0; 4], "{health:?}");
}

#[test]
fn a_vehicle_without_a_memory_says_so() {
    let (mut vehicle, _) = Vehicle::boot(&[]);
    let refused = vehicle.ask(Uplink::ParametersPersist, HERE);
    assert_eq!(refused, Err(Rejection::StorageFailed));
}
