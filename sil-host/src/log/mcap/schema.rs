//! Schemas in protobuf's form: descriptors of files, with those of everything they import.

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet,
};

/// The file of protobuf's own time.
pub const TIMESTAMP: &str = "google/protobuf/timestamp.proto";

/// A file with one message.
#[derive(Clone, Copy, Debug)]
pub struct File<'a> {
    /// Path by which other files import it.
    pub path: &'a str,
    /// Package of the message.
    pub package: &'a str,
    /// Name of the message.
    pub message: &'a str,
    /// Members of the message.
    pub members: &'a [Member<'a>],
    /// Files that it imports.
    pub imports: &'a [&'a File<'a>],
}

/// A member of a message: name, number and type.
#[derive(Clone, Copy, Debug)]
pub struct Member<'a>(pub &'a str, pub i32, pub Kind<'a>);

/// Type of a member.
#[derive(Clone, Copy, Debug)]
pub enum Kind<'a> {
    /// A type without a name of its own.
    Plain(Type),
    /// A message by its full name, with a leading dot.
    Message(&'a str),
    /// Any number of such messages.
    Messages(&'a str),
    /// An enumeration that belongs to the message: its full name, and its values from 0 on.
    Enumeration(&'a str, &'a [&'a str]),
}

/// Protobuf's own time.
pub const TIME: File<'_> = File {
    path: TIMESTAMP,
    package: "google.protobuf",
    message: "Timestamp",
    members: &[
        Member("seconds", 1, Kind::Plain(Type::Int64)),
        Member("nanos", 2, Kind::Plain(Type::Int32)),
    ],
    imports: &[],
};

/// A member called `timestamp`, the first of every message here.
pub const STAMP: Member<'_> = Member("timestamp", 1, Kind::Message(".google.protobuf.Timestamp"));

impl File<'_> {
    /// Full name of the message.
    #[must_use]
    pub fn full_name(&self) -> String {
        format!("{}.{}", self.package, self.message)
    }

    /// The bytes of a schema: a set of this file and all that it imports, imports first.
    #[must_use]
    pub fn schema(&self) -> Vec<u8> {
        let mut set = FileDescriptorSet::default();
        self.add_to(&mut set);
        set.encode_to_vec()
    }

    fn add_to(&self, set: &mut FileDescriptorSet) {
        self.imports.iter().for_each(|import| import.add_to(set));
        if set.file.iter().all(|file| file.name() != self.path) {
            set.file.push(self.descriptor());
        }
    }

    fn descriptor(&self) -> FileDescriptorProto {
        let message = DescriptorProto {
            name: Some(self.message.to_owned()),
            field: self.members.iter().map(Member::descriptor).collect(),
            enum_type: self.members.iter().filter_map(Member::enumeration).collect(),
            ..DescriptorProto::default()
        };
        FileDescriptorProto {
            name: Some(self.path.to_owned()),
            package: Some(self.package.to_owned()),
            dependency: self.imports.iter().map(|import| import.path.to_owned()).collect(),
            message_type: vec![message],
            syntax: Some("proto3".to_owned()),
            ..FileDescriptorProto::default()
        }
    }
}

impl Member<'_> {
    fn descriptor(&self) -> FieldDescriptorProto {
        let Self(name, number, kind) = *self;
        let (kind, label, of) = match kind {
            Kind::Plain(kind) => (kind, Label::Optional, None),
            Kind::Message(of) => (Type::Message, Label::Optional, Some(of)),
            Kind::Messages(of) => (Type::Message, Label::Repeated, Some(of)),
            Kind::Enumeration(of, _) => (Type::Enum, Label::Optional, Some(of)),
        };
        FieldDescriptorProto {
            name: Some(name.to_owned()),
            number: Some(number),
            label: Some(label.into()),
            r#type: Some(kind.into()),
            type_name: of.map(str::to_owned),
            ..FieldDescriptorProto::default()
        }
    }

    fn enumeration(&self) -> Option<EnumDescriptorProto> {
        let Kind::Enumeration(name, values) = self.2 else { return None };
        let value = |(number, name): (i32, &&str)| EnumValueDescriptorProto {
            name: Some((*name).to_owned()),
            number: Some(number),
            options: None,
        };
        Some(EnumDescriptorProto {
            name: name.rsplit('.').next().map(str::to_owned),
            value: (0..).zip(values).map(value).collect(),
            ..EnumDescriptorProto::default()
        })
    }
}
