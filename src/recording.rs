//! Episodes to and from MCAP: one file a shard, its episodes back to back.
//!
//! # Input and output
//!
//! [`Episode`](crate::trace::Episode)s, an expert's demonstrations and a policy's rollouts alike, and `.mcap` files
//! with the protobuf messages of `schemas/mcap`. Where Foxglove has a message type it is used, so that Foxglove and
//! Rerun show a recording as it is.
//!
//! | topic | message | when |
//! |---|---|---|
//! | `/ntp/episode/start`, `/end` | `ntp.v1.EpisodeStart`, `EpisodeEnd` | provenance, scene; outcome, counts |
//! | `/tf` | `foxglove.FrameTransforms` | each frame: gripper, and bodies that moved; the first frame: all |
//! | `/ntp/observation` | `ntp.v1.Observation` | each frame: what is not a pose |
//! | `/ntp/call`, `/ntp/return` | `ntp.v1.ProgramCall`, `ProgramReturn` | each program call and its return |
//! | `/camera/NAME/image` or `/video`, `/calibration`, `/tf` | `foxglove.*` | what cameras saw, if there are any |
//! | `/ntp/push` | `ntp.v1.Push` | each push of an adversary |
//! | `/ntp/stack`, `/ntp/event`, `/scene`, `/log` | `ntp.v1.ProgramStack`, `foxglove.*` | for viewers alone |
//!
//! # Units and frames
//!
//! Log time is simulated time in nanoseconds from the file's start; episodes are one second apart. Poses are children
//! of `world`; a body's frame id is its name.
//!
//! # Errors
//!
//! [`RecordingError`]: each way in which a file can be wrong has its name and its place.
//!
//! # Invariants
//!
//! What is read equals what was written, poses bit for bit. The same episodes give the same bytes. Reading holds one
//! chunk and one episode in memory. No clock is read.

mod assembler;
mod calls;
mod cameras;
mod chunk;
mod container;
mod decode;
mod error;
mod events;
mod file_records;
mod index;
mod inspect;
mod joints;
mod messages;
mod observation;
mod plan;
mod pushes;
mod reader;
mod recover;
mod repair;
mod schema;
mod sink;
mod start;
mod stream;
mod summarised;
mod survey;
mod transform;
mod viewer;
mod wire;
mod writer;

pub use cameras::{CameraPictures, Pictured, cameras_of};
pub use error::{Damage, EpisodeProblem, MessageProblem, RecordingError};
pub use events::EventWriter;
pub use inspect::{RecordingInspection, TopicInspection, inspect};
pub(crate) use messages::{AnyChannel, AnyMessage, read_messages};
pub use reader::{BoundaryReader, CheckedReader, PicturedBoundaryReader, PicturedReader, ShardReader};
pub use recover::{Lost, Recovery, is_own, recover};
pub use repair::{PlanSource, RecordingRepair, repair};
pub use writer::{ShardSummary, ShardWriter};
