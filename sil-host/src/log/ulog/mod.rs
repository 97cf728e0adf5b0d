//! ULog, PX4's log format: our topics and PX4's own, gains as parameters, notes as messages.
//!
//! Written from PX4's description of the file format: a header; definitions (flag bits, formats,
//! facts, parameters); then subscriptions, data and messages in the order of time. Topics are ordered
//! so that every field lies at a multiple of its size, hence no padding.

mod message;
#[cfg(test)]
mod tests;

use std::fmt;
use std::io::{self, Write};

use super::description::{COMMIT, Description, release};
use super::moment::{Moment, microseconds};
use super::note::{Level, Note};
use super::{PREFIX, Writer, px4};
use message::{Kind, MAGIC, key, message};
use sim::quantity::{Quantity, TOPICS, Value, scalar_first};

/// Most bytes of text in one part of a fact.
const PART: usize = 1 << 15;
/// `MAV_TYPE` of MAVLink: a quadrotor.
const QUADROTOR: i32 = 2;

/// Writes a flight as ULog.
#[derive(Debug)]
pub struct UlogWriter<W: Write> {
    out: W,
    buffer: Vec<u8>,
    topics: Vec<Subscribed>,
}

/// A topic with its name in the file.
#[derive(Debug)]
struct Subscribed {
    name: String,
    fields: Fields,
}

/// Fields of a topic.
#[derive(Clone, Copy, Debug)]
enum Fields {
    /// Of the table of quantities.
    Own(&'static [Quantity]),
    /// Of PX4.
    Px4(&'static [px4::Field], &'static [px4::More]),
}

impl<W: Write> UlogWriter<W> {
    /// Writes everything before the first data; `out` should be buffered.
    ///
    /// # Errors
    /// When `out` fails, or a text of the description is longer than ULog can hold.
    pub fn new(out: W, description: &Description) -> io::Result<Self> {
        let own = TOPICS.iter().map(|topic| Subscribed {
            name: format!("{PREFIX}_{}", topic.name),
            fields: Fields::Own(topic.quantities),
        });
        let known = px4::topics(&description.bounds, description.battery).map(|topic| Subscribed {
            name: topic.name.to_owned(),
            fields: Fields::Px4(topic.fields, topic.more),
        });
        let topics = known.chain(own).collect();
        let mut writer = Self { out, buffer: Vec::new(), topics };
        writer.buffer.extend(MAGIC);
        writer.buffer.extend(0_u64.to_le_bytes()); // start [us]
        message(&mut writer.buffer, Kind::FlagBits, |body| body.extend([0; 40]))?;
        writer.formats()?;
        writer.facts(description)?;
        writer.parameters(description)?;
        writer.subscriptions()?;
        writer.write_out()?;
        Ok(writer)
    }

    fn formats(&mut self) -> io::Result<()> {
        let Self { buffer, topics, .. } = self;
        topics.iter().try_for_each(|Subscribed { name, fields }| {
            let fields: String = match fields {
                Fields::Own(fields) => fields.iter().map(declaration).collect(),
                Fields::Px4(fields, more) => fields
                    .iter()
                    .map(declaration)
                    .chain(more.iter().map(declaration_of_more))
                    .collect(),
            };
            let format = format!("{name}:uint64_t timestamp;{fields}");
            message(buffer, Kind::Format, |body| body.extend_from_slice(format.as_bytes()))
        })
    }

    fn facts(&mut self, description: &Description) -> io::Result<()> {
        let Description { scenario, description, controller, seed, toml, .. } = description;
        self.fact("sys_name", "Gyrfalcon")?;
        self.fact("ver_sw", COMMIT)?;
        message(&mut self.buffer, Kind::Information, |body| {
            key(body, "uint32_t", "ver_sw_release");
            body.extend(release().to_le_bytes());
        })?;
        self.fact("scenario", scenario)?;
        self.fact("description", description)?;
        self.fact("controller", controller)?;
        message(&mut self.buffer, Kind::Information, |body| {
            key(body, "uint64_t", "seed");
            body.extend(seed.to_le_bytes());
        })?;
        for (index, part) in parts(toml).enumerate() {
            self.part("scenario_toml", index > 0, part)?;
        }
        let units: Vec<_> = self.topics.iter().map(units).collect();
        units.iter().try_for_each(|text| self.part("units", false, text))
    }

    fn fact(&mut self, name: &str, text: &str) -> io::Result<()> {
        message(&mut self.buffer, Kind::Information, |body| {
            key(body, &format!("char[{}]", text.len()), name);
            body.extend_from_slice(text.as_bytes());
        })
    }

    fn part(&mut self, name: &str, continued: bool, text: &str) -> io::Result<()> {
        message(&mut self.buffer, Kind::MultiInformation, |body| {
            body.push(continued.into());
            key(body, &format!("char[{}]", text.len()), name);
            body.extend_from_slice(text.as_bytes());
        })
    }

    fn parameters(&mut self, description: &Description) -> io::Result<()> {
        message(&mut self.buffer, Kind::Parameter, |body| {
            key(body, "int32_t", "MAV_TYPE");
            body.extend(QUADROTOR.to_le_bytes());
        })?;
        description.parameters.iter().try_for_each(|(name, value)| {
            message(&mut self.buffer, Kind::Parameter, |body| {
                key(body, "float", name);
                body.extend(value.to_le_bytes());
            })
        })
    }

    fn subscriptions(&mut self) -> io::Result<()> {
        let Self { buffer, topics, .. } = self;
        (0_u16..).zip(topics).try_for_each(|(id, topic)| {
            message(buffer, Kind::Subscription, |body| {
                body.push(0); // the only instance
                body.extend(id.to_le_bytes());
                body.extend_from_slice(topic.name.as_bytes());
            })
        })
    }

    fn write_out(&mut self) -> io::Result<()> {
        self.out.write_all(&self.buffer)?;
        self.buffer.clear();
        Ok(())
    }
}

impl<W: Write + fmt::Debug> Writer for UlogWriter<W> {
    fn moment(&mut self, moment: &Moment) -> io::Result<()> {
        let time = microseconds(moment.tick.time);
        for (id, subscribed) in (0_u16..).zip(&self.topics) {
            message(&mut self.buffer, Kind::Data, |body| {
                body.extend(id.to_le_bytes());
                body.extend(time.to_le_bytes());
                match subscribed.fields {
                    Fields::Own(fields) => fields.iter().for_each(|it| put(body, it, &moment.tick)),
                    Fields::Px4(fields, more) => {
                        fields.iter().for_each(|it| put(body, it, moment));
                        more.iter().for_each(|it| put_more(body, it, moment));
                    }
                }
            })?;
        }
        self.write_out()
    }

    fn note(&mut self, note: &Note) -> io::Result<()> {
        let level = match note.level {
            Level::Error => b'3',
            Level::Warning => b'4',
            Level::Info => b'6',
        };
        message(&mut self.buffer, Kind::Logging, |body| {
            body.push(level);
            body.extend(microseconds(note.time).to_le_bytes());
            body.extend_from_slice(note.text.as_bytes());
        })?;
        self.write_out()
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.out.flush()
    }
}

/// Declaration of a field in a format.
fn declaration<I>(field: &Quantity<I>) -> String {
    let kind = match field.value {
        Value::Single(_) => "float",
        Value::Double(_) => "double",
        Value::Vector(_) => "float[3]",
        Value::Quaternion(_) => "float[4]",
        Value::Time(_) | Value::Count(_) => "uint64_t",
        Value::Bits(_) => "uint16_t",
    };
    format!("{kind} {};", field.field)
}

/// Declaration of a field that PX4's topics alone have.
fn declaration_of_more(field: &px4::More) -> String {
    let kind = match field.value {
        px4::MoreValue::Motors(_) => "float[12]",
        px4::MoreValue::State(_) => "uint8_t",
    };
    format!("{kind} {};", field.name)
}

/// Appends the bytes of such a field.
fn put_more(out: &mut Vec<u8>, field: &px4::More, moment: &Moment) {
    match field.value {
        px4::MoreValue::Motors(read) => {
            out.extend(read(moment).iter().flat_map(|x| x.to_le_bytes()));
        }
        px4::MoreValue::State(read) => out.push(read(moment)),
    }
}

/// A topic's fields with their units, `name [unit]` each.
fn units(Subscribed { name, fields }: &Subscribed) -> String {
    let fields: Vec<_> = match fields {
        Fields::Own(fields) => fields.iter().map(with_unit).collect(),
        Fields::Px4(fields, more) => {
            let more = more.iter().map(|field| format!("{} [{}]", field.name, field.unit));
            fields.iter().map(with_unit).chain(more).collect()
        }
    };
    format!("{name}: {}", fields.join(", "))
}

fn with_unit<I>(field: &Quantity<I>) -> String {
    format!("{} [{}]", field.field, field.unit)
}

/// Appends the bytes of a field; times are in microseconds.
fn put<I>(out: &mut Vec<u8>, field: &Quantity<I>, input: &I) {
    let mut floats = |values: &[f32]| out.extend(values.iter().flat_map(|x| x.to_le_bytes()));
    match field.value {
        Value::Single(read) => floats(&[read(input)]),
        Value::Vector(read) => floats(&read(input).to_array()),
        Value::Quaternion(read) => floats(&scalar_first(read(input))),
        Value::Double(read) => out.extend(read(input).to_le_bytes()),
        Value::Time(read) => out.extend(microseconds(read(input)).to_le_bytes()),
        Value::Count(read) => out.extend(read(input).to_le_bytes()),
        Value::Bits(read) => out.extend(read(input).to_le_bytes()),
    }
}

/// A text in parts of at most [`PART`] bytes, cut between characters.
fn parts(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = text;
    std::iter::from_fn(move || {
        let (part, after) = rest.split_at(rest.floor_char_boundary(PART));
        rest = after;
        (!part.is_empty()).then_some(part)
    })
}
