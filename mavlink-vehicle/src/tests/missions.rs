//! Missions: upload, download, lost messages.

use mavlink::dialects::common::{
    MISSION_ACK_DATA, MISSION_CLEAR_ALL_DATA, MISSION_COUNT_DATA, MISSION_CURRENT_DATA,
    MISSION_ITEM_INT_DATA, MISSION_ITEM_REACHED_DATA, MISSION_REQUEST_DATA,
    MISSION_REQUEST_INT_DATA, MISSION_REQUEST_LIST_DATA, MISSION_SET_CURRENT_DATA, MavCmd,
    MavFrame, MavMissionResult,
};

use super::*;

const ACCEPTED: MavMissionResult = MavMissionResult::MAV_MISSION_ACCEPTED;

fn item(seq: u16, command: MavCmd, east: f32, height: f32) -> MISSION_ITEM_INT_DATA {
    let (x, y, _) = ProtocolConfig::default().origin.global(Vec3::new(east, 0.0, 0.0));
    MISSION_ITEM_INT_DATA {
        param4: f32::NAN,
        x,
        y,
        z: height,
        seq,
        command,
        target_system: 1,
        target_component: 1,
        frame: MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        autocontinue: 1,
        ..MISSION_ITEM_INT_DATA::default()
    }
}

fn flight() -> Vec<MISSION_ITEM_INT_DATA> {
    std::vec![
        item(0, MavCmd::MAV_CMD_NAV_TAKEOFF, 0.0, 3.0),
        item(1, MavCmd::MAV_CMD_NAV_WAYPOINT, 4.0, 3.0),
        item(2, MavCmd::MAV_CMD_NAV_WAYPOINT, 4.0, 4.0),
        item(3, MavCmd::MAV_CMD_NAV_LAND, 2.0, 0.0),
    ]
}

fn count(air: &mut Air, count: u16, kind: u8) {
    let data = MISSION_COUNT_DATA { count, target_system: 1, target_component: 1 };
    air.send_extended(&data, &[kind]);
}

/// Uploads as a station does: every item when it is asked for. `lost` drops requests by their number.
fn upload(air: &mut Air, items: &[MISSION_ITEM_INT_DATA], lost: &[usize]) -> Vec<MavMissionResult> {
    count(air, items.len() as u16, 0);
    let mut asked = 0;
    for _ in 0..400 {
        air.run(0.02);
        for MISSION_REQUEST_INT_DATA { seq, .. } in air.take() {
            if !lost.contains(&asked) {
                air.send(&items[usize::from(seq)]);
            }
            asked += 1;
        }
        let acks = air.take::<MISSION_ACK_DATA>();
        if !acks.is_empty() {
            return acks.iter().map(|ack| ack.mavtype).collect();
        }
    }
    panic!("no acknowledgement");
}

fn download(air: &mut Air) -> Vec<MISSION_ITEM_INT_DATA> {
    air.send(&MISSION_REQUEST_LIST_DATA { target_system: 1, target_component: 1 });
    air.run(0.02);
    let MISSION_COUNT_DATA { count, .. } = air.take()[0];
    (0..count)
        .map(|seq| {
            air.send(&MISSION_REQUEST_INT_DATA { seq, target_system: 1, target_component: 1 });
            air.run(0.02);
            air.take::<MISSION_ITEM_INT_DATA>()[0].clone()
        })
        .collect()
}

/// The same item but for what depends on the direction of the message.
fn as_sent(items: &[MISSION_ITEM_INT_DATA]) -> Vec<std::string::String> {
    let same = |item: &MISSION_ITEM_INT_DATA| {
        let plain = MISSION_ITEM_INT_DATA {
            target_system: 0,
            target_component: 0,
            current: 0,
            ..item.clone()
        };
        std::format!("{plain:?}")
    };
    items.iter().map(same).collect()
}

#[test]
fn what_was_uploaded_is_downloaded() {
    let mut air = Air::new();
    assert_eq!(upload(&mut air, &flight(), &[]), [ACCEPTED]);
    assert_eq!(as_sent(&download(&mut air)), as_sent(&flight()));
    // The old request is answered alike.
    air.send(&MISSION_REQUEST_DATA { seq: 1, target_system: 1, target_component: 1 });
    air.run(0.02);
    assert_eq!(air.take::<MISSION_ITEM_INT_DATA>()[0].seq, 1);
}

#[test]
fn an_uploaded_mission_is_flown_to_its_end() {
    let mut air = Air::new();
    upload(&mut air, &flight(), &[]);
    assert_eq!(air.command(400, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Some(0));
    assert_eq!(air.command(300, [0.0; 7]), Some(0));
    air.run(60.0);
    let reached: Vec<_> = air.take::<MISSION_ITEM_REACHED_DATA>().iter().map(|m| m.seq).collect();
    assert_eq!(reached, [0, 1, 2, 3]);
    assert_eq!(air.vehicle.mode, Mode::Disarmed);
    assert!((air.vehicle.state.position_world.x - 2.0).abs() < 0.05);
}

#[test]
fn an_upload_survives_a_loss_of_any_message_and_ends_when_all_are_lost() {
    for lost in 0..flight().len() {
        let mut air = Air::new();
        assert_eq!(upload(&mut air, &flight(), &[lost]), [ACCEPTED], "request {lost} lost");
        assert_eq!(air.vehicle.navigator.mission().len(), 4);
    }
    for sent in 0..flight().len() {
        let mut air = Air::new();
        upload(&mut air, &flight()[..1], &[]);
        let lost: Vec<_> = (sent..100).collect();
        let cancelled = MavMissionResult::MAV_MISSION_OPERATION_CANCELLED;
        assert_eq!(upload(&mut air, &flight(), &lost), [cancelled], "cut after {sent}");
        assert_eq!(air.vehicle.navigator.mission().len(), 1, "the old mission stays");
        assert_eq!(download(&mut air).len(), 1);
    }
}

#[test]
fn a_download_that_is_cut_anywhere_can_be_begun_again() {
    let mut air = Air::new();
    upload(&mut air, &flight(), &[]);
    for cut in 0..flight().len() as u16 {
        air.send(&MISSION_REQUEST_LIST_DATA { target_system: 1, target_component: 1 });
        for seq in 0..cut {
            air.send(&MISSION_REQUEST_INT_DATA { seq, target_system: 1, target_component: 1 });
        }
        air.run(10.0);
        air.received.clear();
        assert_eq!(as_sent(&download(&mut air)), as_sent(&flight()), "cut after {cut}");
    }
}

#[test]
fn a_repeated_item_is_taken_once_and_a_strange_one_is_refused() {
    let mut air = Air::new();
    count(&mut air, 2, 0);
    air.send(&flight()[0]);
    air.send(&flight()[0]);
    air.send(&MISSION_ITEM_INT_DATA { seq: 1, ..flight()[1].clone() });
    air.run(0.05);
    let results: Vec<_> = air.take::<MISSION_ACK_DATA>().iter().map(|ack| ack.mavtype).collect();
    assert_eq!(results, [ACCEPTED]);
    // The acknowledgement was lost: the last item comes again.
    air.send(&MISSION_ITEM_INT_DATA { seq: 1, ..flight()[1].clone() });
    air.send(&flight()[3]);
    air.run(0.05);
    let results: Vec<_> = air.take::<MISSION_ACK_DATA>().iter().map(|ack| ack.mavtype).collect();
    assert_eq!(results, [ACCEPTED, MavMissionResult::MAV_MISSION_INVALID_SEQUENCE]);
}

#[test]
fn an_upload_during_which_home_moves_is_refused_and_can_be_sent_again() {
    let mut air = Air::new();
    count(&mut air, 2, 0);
    air.send(&flight()[0]);
    air.vehicle.navigator.set_home(Vec3::new(0.0, 0.0, 2.0)).unwrap();
    air.send(&MISSION_ITEM_INT_DATA { seq: 1, ..flight()[1].clone() });
    air.run(0.05);
    let results: Vec<_> = air.take::<MISSION_ACK_DATA>().iter().map(|ack| ack.mavtype).collect();
    assert_eq!(results, [MavMissionResult::MAV_MISSION_OPERATION_CANCELLED]);
    assert!(air.texts().iter().any(|text| text.contains("home has moved")));
    assert!(air.vehicle.navigator.mission().is_empty());
    // Heights of the one that follows are above the new home.
    assert_eq!(upload(&mut air, &flight(), &[]), [ACCEPTED]);
    assert_eq!(air.vehicle.navigator.mission()[1].position_world.z, 5.0);
}

#[test]
fn items_that_cannot_be_flown_end_the_upload() {
    use MavMissionResult as Result;
    let refused = |change: fn(&mut MISSION_ITEM_INT_DATA), expected: Result| {
        let mut air = Air::new();
        let mut items = flight();
        change(&mut items[1]);
        assert_eq!(upload(&mut air, &items, &[]), [expected]);
        assert!(air.vehicle.navigator.mission().is_empty());
        assert!(air.texts().iter().any(|text| text.starts_with("item 1 refused")));
    };
    let unsupported = Result::MAV_MISSION_UNSUPPORTED;
    refused(|item| item.command = MavCmd::MAV_CMD_NAV_FOLLOW, unsupported);
    let frame = Result::MAV_MISSION_UNSUPPORTED_FRAME;
    refused(|item| item.frame = MavFrame::MAV_FRAME_BODY_FRD, frame);
    refused(|item| item.z = f32::NAN, Result::MAV_MISSION_INVALID);
    refused(|item| item.x = i32::MAX, Result::MAV_MISSION_INVALID);
    refused(|item| item.param1 = -5.0, Result::MAV_MISSION_INVALID);
}

#[test]
fn too_many_items_and_other_lists_are_refused() {
    let mut air = Air::new();
    for (number, kind, expected) in [
        (65, 0, MavMissionResult::MAV_MISSION_NO_SPACE),
        (u16::MAX, 0, MavMissionResult::MAV_MISSION_NO_SPACE),
        (3, 1, MavMissionResult::MAV_MISSION_UNSUPPORTED),
        (3, 2, MavMissionResult::MAV_MISSION_UNSUPPORTED),
    ] {
        count(&mut air, number, kind);
        air.run(0.05);
        let ack = air.received.iter().find(|packet| packet.id == MISSION_ACK_DATA::ID).unwrap();
        assert_eq!((ack.byte(2), ack.byte(3)), (expected as u8, kind));
        air.take::<MISSION_ACK_DATA>();
    }
    let list = MISSION_REQUEST_LIST_DATA { target_system: 1, target_component: 1 };
    air.send_extended(&list, &[1]);
    air.run(0.05);
    let fence = air.received.iter().find(|packet| packet.id == MISSION_COUNT_DATA::ID).unwrap();
    assert_eq!((fence.u16_at(0), fence.byte(4)), (0, 1), "no fence");
}

#[test]
fn a_mission_is_cleared_by_message_and_by_an_empty_upload() {
    for empty in [false, true] {
        let mut air = Air::new();
        upload(&mut air, &flight(), &[]);
        if empty {
            count(&mut air, 0, 0);
        } else {
            let clear = MISSION_CLEAR_ALL_DATA { target_system: 1, target_component: 1 };
            air.send_extended(&clear, &[255]);
        }
        air.run(0.05);
        assert_eq!(air.take::<MISSION_ACK_DATA>()[0].mavtype, ACCEPTED);
        assert!(download(&mut air).is_empty() && air.vehicle.navigator.mission().is_empty());
    }
}

#[test]
fn the_current_item_is_selected() {
    let mut air = Air::new();
    upload(&mut air, &flight(), &[]);
    air.take::<MISSION_CURRENT_DATA>();
    air.send(&MISSION_SET_CURRENT_DATA { seq: 2, target_system: 1, target_component: 1 });
    air.run(0.05);
    assert_eq!(air.take::<MISSION_CURRENT_DATA>()[0].seq, 2);
    assert_eq!(air.command(224, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Some(0));
    assert_eq!(air.vehicle.navigator.current_item(), 1);
    let rejected = air.command(224, [9.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(rejected, result(MavResult::MAV_RESULT_TEMPORARILY_REJECTED));
}
