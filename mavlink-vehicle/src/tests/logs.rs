//! Logs: list, download in parts, gaps asked for again.

use mavlink::dialects::common::{
    LOG_DATA_DATA, LOG_ENTRY_DATA, LOG_ERASE_DATA, LOG_REQUEST_DATA_DATA, LOG_REQUEST_END_DATA,
    LOG_REQUEST_LIST_DATA,
};

use super::*;

fn with_logs() -> Air {
    let mut air = Air::new();
    air.vehicle.logs = std::vec![(0..200).collect(), (0..255).cycle().take(10_000).collect()];
    air
}

fn list(air: &mut Air, start: u16, end: u16) -> Vec<(u16, u32, u16)> {
    air.send(&LOG_REQUEST_LIST_DATA { start, end, target_system: 1, target_component: 1 });
    air.run(0.1);
    let entries = air.take::<LOG_ENTRY_DATA>();
    entries.iter().map(|entry| (entry.id, entry.size, entry.num_logs)).collect()
}

fn fetch(air: &mut Air, id: u16, ofs: u32, count: u32) -> Vec<u8> {
    air.send(&LOG_REQUEST_DATA_DATA { ofs, count, id, target_system: 1, target_component: 1 });
    air.run(1.0);
    let mut bytes = Vec::new();
    for part in air.take::<LOG_DATA_DATA>() {
        assert_eq!((part.ofs, part.id), (ofs + bytes.len() as u32, id));
        bytes.extend(&part.data[..usize::from(part.count)]);
    }
    bytes
}

#[test]
fn the_list_has_every_log_or_says_that_there_is_none() {
    let mut air = with_logs();
    assert_eq!(list(&mut air, 0, u16::MAX), [(0, 200, 2), (1, 10_000, 2)]);
    assert_eq!(list(&mut air, 1, 1), [(1, 10_000, 2)]);
    air.vehicle.logs.clear();
    assert_eq!(list(&mut air, 0, u16::MAX), [(0, 0, 0)]);
}

#[test]
fn a_log_comes_whole_and_in_any_part() {
    let mut air = with_logs();
    assert_eq!(fetch(&mut air, 1, 0, u32::MAX), air.vehicle.logs[1]);
    assert_eq!(fetch(&mut air, 1, 90, 45), air.vehicle.logs[1][90..135]);
    assert_eq!(fetch(&mut air, 0, 150, 90), air.vehicle.logs[0][150..]);
    assert_eq!(fetch(&mut air, 0, 5_000, 90), [], "behind the end");
    assert_eq!(fetch(&mut air, 77, 0, 90), [], "no such log");
}

#[test]
fn a_transfer_ends_on_request_and_nothing_is_erased() {
    let mut air = with_logs();
    let all = LOG_REQUEST_DATA_DATA {
        ofs: 0,
        count: u32::MAX,
        id: 1,
        target_system: 1,
        target_component: 1,
    };
    air.send(&all);
    air.run(0.01);
    air.send(&LOG_REQUEST_END_DATA { target_system: 1, target_component: 1 });
    air.take::<LOG_DATA_DATA>();
    air.run(0.5);
    assert!(air.take::<LOG_DATA_DATA>().is_empty());
    air.send(&LOG_ERASE_DATA { target_system: 1, target_component: 1 });
    air.run(0.05);
    assert_eq!(air.vehicle.logs.len(), 2);
    assert_eq!(air.texts(), ["logs are not erased from here"]);
}

#[test]
fn telemetry_goes_on_while_a_log_is_sent() {
    use mavlink::dialects::common::ATTITUDE_DATA;
    let mut air = with_logs();
    air.vehicle.logs[1] = std::vec![7; 1_000_000];
    air.send(&LOG_REQUEST_DATA_DATA {
        ofs: 0,
        count: u32::MAX,
        id: 1,
        target_system: 1,
        target_component: 1,
    });
    air.received.clear();
    air.run(2.0);
    assert!(air.take::<ATTITUDE_DATA>().len() >= 99);
    assert!(air.take::<LOG_DATA_DATA>().len() > 2_000, "90 bytes every 0.4 ms at most");
}
