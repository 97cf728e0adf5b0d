//! Foxglove's well-known messages, which its 3-D and log panels, and Rerun's, display without configuration.
//!
//! Each message stands beside its schema; the tests hold the schemas against Foxglove's own package.

use glam::{DQuat, DVec3};
use prost_types::Timestamp;
use prost_types::field_descriptor_proto::Type;

use super::schema::{File, Kind, Member, STAMP, TIME};

/// A vector.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub struct Vector3 {
    /// x.
    #[prost(double, tag = "1")]
    pub x: f64,
    /// y.
    #[prost(double, tag = "2")]
    pub y: f64,
    /// z.
    #[prost(double, tag = "3")]
    pub z: f64,
}

/// A rotation.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub struct Quaternion {
    /// x.
    #[prost(double, tag = "1")]
    pub x: f64,
    /// y.
    #[prost(double, tag = "2")]
    pub y: f64,
    /// z.
    #[prost(double, tag = "3")]
    pub z: f64,
    /// The scalar part.
    #[prost(double, tag = "4")]
    pub w: f64,
}

/// A place and an attitude.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub struct Pose {
    /// Position (m).
    #[prost(message, optional, tag = "1")]
    pub position: Option<Vector3>,
    /// Attitude, from the pose's own axes to those of its frame.
    #[prost(message, optional, tag = "2")]
    pub orientation: Option<Quaternion>,
}

/// A pose at a time.
#[derive(Clone, PartialEq, prost::Message)]
pub struct PoseInFrame {
    /// Time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// Axes of the pose.
    #[prost(string, tag = "2")]
    pub frame_id: String,
    /// The pose.
    #[prost(message, optional, tag = "3")]
    pub pose: Option<Pose>,
}

/// Many poses at a time: a path.
#[derive(Clone, PartialEq, prost::Message)]
pub struct PosesInFrame {
    /// Time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// Axes of the poses.
    #[prost(string, tag = "2")]
    pub frame_id: String,
    /// The poses.
    #[prost(message, repeated, tag = "3")]
    pub poses: Vec<Pose>,
}

/// Pose of one frame in another.
#[derive(Clone, PartialEq, prost::Message)]
pub struct FrameTransform {
    /// Time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// The fixed frame.
    #[prost(string, tag = "2")]
    pub parent_frame_id: String,
    /// The moving frame.
    #[prost(string, tag = "3")]
    pub child_frame_id: String,
    /// Origin of the child in the parent (m).
    #[prost(message, optional, tag = "4")]
    pub translation: Option<Vector3>,
    /// From the child's axes to the parent's.
    #[prost(message, optional, tag = "5")]
    pub rotation: Option<Quaternion>,
}

/// A line of text.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Log {
    /// Time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// [`INFO`], [`WARNING`], [`ERROR`].
    #[prost(int32, tag = "2")]
    pub level: i32,
    /// The text.
    #[prost(string, tag = "3")]
    pub message: String,
    /// Name of the source.
    #[prost(string, tag = "4")]
    pub name: String,
}

/// All went as expected; its place in [`LEVELS`].
pub const INFO: i32 = 2;
/// Something is out of the ordinary.
pub const WARNING: i32 = 3;
/// Something is wrong.
pub const ERROR: i32 = 4;
/// Levels of a [`Log`], from 0 on.
pub const LEVELS: [&str; 6] = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];

impl From<DVec3> for Vector3 {
    fn from(DVec3 { x, y, z }: DVec3) -> Self {
        Self { x, y, z }
    }
}

impl From<DQuat> for Quaternion {
    fn from(DQuat { x, y, z, w }: DQuat) -> Self {
        Self { x, y, z, w }
    }
}

impl Pose {
    /// At `position` (m) with `attitude`.
    #[must_use]
    pub fn new(position: DVec3, attitude: DQuat) -> Self {
        Self { position: Some(position.into()), orientation: Some(attitude.into()) }
    }
}

const PACKAGE: &str = "foxglove";
const DOUBLE: Kind<'_> = Kind::Plain(Type::Double);
const STRING: Kind<'_> = Kind::Plain(Type::String);

const VECTOR3: File<'_> = File {
    path: "foxglove/Vector3.proto",
    package: PACKAGE,
    message: "Vector3",
    members: &[Member("x", 1, DOUBLE), Member("y", 2, DOUBLE), Member("z", 3, DOUBLE)],
    imports: &[],
};

const QUATERNION: File<'_> = File {
    path: "foxglove/Quaternion.proto",
    package: PACKAGE,
    message: "Quaternion",
    members: &[
        Member("x", 1, DOUBLE),
        Member("y", 2, DOUBLE),
        Member("z", 3, DOUBLE),
        Member("w", 4, DOUBLE),
    ],
    imports: &[],
};

const POSE: File<'_> = File {
    path: "foxglove/Pose.proto",
    package: PACKAGE,
    message: "Pose",
    members: &[
        Member("position", 1, Kind::Message(".foxglove.Vector3")),
        Member("orientation", 2, Kind::Message(".foxglove.Quaternion")),
    ],
    imports: &[&QUATERNION, &VECTOR3],
};

/// Schema of [`PoseInFrame`].
pub const POSE_IN_FRAME: File<'_> = File {
    path: "foxglove/PoseInFrame.proto",
    package: PACKAGE,
    message: "PoseInFrame",
    members: &[
        STAMP,
        Member("frame_id", 2, STRING),
        Member("pose", 3, Kind::Message(".foxglove.Pose")),
    ],
    imports: &[&POSE, &TIME],
};

/// Schema of [`PosesInFrame`].
pub const POSES_IN_FRAME: File<'_> = File {
    path: "foxglove/PosesInFrame.proto",
    package: PACKAGE,
    message: "PosesInFrame",
    members: &[
        STAMP,
        Member("frame_id", 2, STRING),
        Member("poses", 3, Kind::Messages(".foxglove.Pose")),
    ],
    imports: &[&POSE, &TIME],
};

/// Schema of [`FrameTransform`].
pub const FRAME_TRANSFORM: File<'_> = File {
    path: "foxglove/FrameTransform.proto",
    package: PACKAGE,
    message: "FrameTransform",
    members: &[
        STAMP,
        Member("parent_frame_id", 2, STRING),
        Member("child_frame_id", 3, STRING),
        Member("translation", 4, Kind::Message(".foxglove.Vector3")),
        Member("rotation", 5, Kind::Message(".foxglove.Quaternion")),
    ],
    imports: &[&QUATERNION, &VECTOR3, &TIME],
};

/// Schema of [`Log`].
pub const LOG: File<'_> = File {
    path: "foxglove/Log.proto",
    package: PACKAGE,
    message: "Log",
    members: &[
        STAMP,
        Member("level", 2, Kind::Enumeration(".foxglove.Log.Level", &LEVELS)),
        Member("message", 3, STRING),
        Member("name", 4, STRING),
        Member("file", 5, STRING),
        Member("line", 6, Kind::Plain(Type::Fixed32)),
    ],
    imports: &[&TIME],
};
