//! The table of quantities as protobuf messages, one per topic: the time, then the topic's quantities.

use glam::Vec3;
use prost::encoding;
use prost_types::Timestamp;
use prost_types::field_descriptor_proto::Type;

use super::schema::{File, Kind, Member, STAMP, TIME};
use crate::log::PREFIX;
use sim::quantity::{Quantity, Topic, Value, scalar_first};
use sim::tick::Tick;

/// Number of a topic's first field; the time is 1.
const FIRST: u32 = 2;

const FLOAT: Kind<'_> = Kind::Plain(Type::Float);

const VECTOR3: File<'_> = File {
    path: "gyrfalcon/vector3.proto",
    package: PREFIX,
    message: "Vector3",
    members: &[Member("x", 1, FLOAT), Member("y", 2, FLOAT), Member("z", 3, FLOAT)],
    imports: &[],
};

const QUATERNION: File<'_> = File {
    path: "gyrfalcon/quaternion.proto",
    package: PREFIX,
    message: "Quaternion",
    members: &[
        Member("w", 1, FLOAT),
        Member("x", 2, FLOAT),
        Member("y", 3, FLOAT),
        Member("z", 4, FLOAT),
    ],
    imports: &[],
};

#[derive(Clone, Copy, PartialEq, prost::Message)]
pub(super) struct Vector3 {
    #[prost(float, tag = "1")]
    pub(super) x: f32,
    #[prost(float, tag = "2")]
    pub(super) y: f32,
    #[prost(float, tag = "3")]
    pub(super) z: f32,
}

#[derive(Clone, Copy, PartialEq, prost::Message)]
struct Quaternion {
    #[prost(float, tag = "1")]
    w: f32,
    #[prost(float, tag = "2")]
    x: f32,
    #[prost(float, tag = "3")]
    y: f32,
    #[prost(float, tag = "4")]
    z: f32,
}

/// Name and bytes of a topic's schema: `gyrfalcon.Wrench` for `wrench`.
#[must_use]
pub fn schema(topic: &Topic) -> (String, Vec<u8>) {
    let mut letters = topic.name.chars();
    let message: String =
        letters.next().iter().flat_map(|c| c.to_uppercase()).chain(letters).collect();
    let numbered = (FIRST as i32..).zip(topic.quantities);
    let fields = numbered.map(|(number, quantity)| Member(quantity.field, number, kind(quantity)));
    let members: Vec<_> = [STAMP].into_iter().chain(fields).collect();
    let path = format!("{PREFIX}/{}.proto", topic.name);
    let imports = &[&VECTOR3, &QUATERNION, &TIME];
    let file = File { path: &path, package: PREFIX, message: &message, members: &members, imports };
    (file.full_name(), file.schema())
}

fn kind(quantity: &Quantity) -> Kind<'static> {
    match quantity.value {
        Value::Single(_) => FLOAT,
        Value::Double(_) | Value::Time(_) => Kind::Plain(Type::Double),
        Value::Vector(_) => Kind::Message(".gyrfalcon.Vector3"),
        Value::Quaternion(_) => Kind::Message(".gyrfalcon.Quaternion"),
        Value::Count(_) => Kind::Plain(Type::Uint64),
        Value::Bits(_) => Kind::Plain(Type::Uint32),
    }
}

/// Appends a topic's message at `time` to `out`.
pub fn encode(out: &mut Vec<u8>, topic: &Topic, time: &Timestamp, tick: &Tick) {
    encoding::message::encode(1, time, out);
    for (number, quantity) in (FIRST..).zip(topic.quantities) {
        match quantity.value {
            Value::Single(read) => encoding::float::encode(number, &read(tick), out),
            Value::Double(read) | Value::Time(read) => {
                encoding::double::encode(number, &read(tick), out)
            }
            Value::Vector(read) => {
                let Vec3 { x, y, z } = read(tick);
                encoding::message::encode(number, &Vector3 { x, y, z }, out);
            }
            Value::Quaternion(read) => {
                let [w, x, y, z] = scalar_first(read(tick));
                encoding::message::encode(number, &Quaternion { w, x, y, z }, out);
            }
            Value::Count(read) => encoding::uint64::encode(number, &read(tick), out),
            Value::Bits(read) => encoding::uint32::encode(number, &read(tick).into(), out),
        }
    }
}
