//! What encoders that know slots one by one make of frames and state, whatever the frames are.

use burn::tensor::{Tensor, TensorData};

use crate::model::features::{self, AGENT_WIDTH, OBJECT_WIDTH};
use crate::model::layers::{Mlp, TemporalConv, max_over_frames};
use crate::model::windows::Padding;
use crate::trace::ObservationRows;

/// Each frame with its neighbours, `[B, T, H]` and zero beyond a window; and the most and last of the window,
/// `[B, 2 H]`.
///
/// # Shapes
///
/// frames `[B, T, H]`
pub(crate) fn summarize(conv: &TemporalConv, frames: Tensor<3>, padding: Option<&Padding>) -> (Tensor<3>, Tensor<2>) {
    let frames = Padding::mask(padding, frames);
    let last = Padding::last_frame(padding, frames.clone());
    let frames = Padding::mask(padding, conv.forward(frames));
    let most = max_over_frames(frames.clone());
    (frames, Tensor::cat(vec![most, last], 1))
}

/// The state, in which slots have no order, with the gripper: `[B, H + AGENT_WIDTH]`.
pub(crate) fn state_with_gripper(slots: &Mlp, states: &ObservationRows, conv: &TemporalConv) -> Tensor<2> {
    let device = conv.device();
    let (objects, agents) = (features::objects(states), features::agents(states));
    let n_batch = states.len();
    let objects = TensorData::new(objects, [n_batch, states.n_slots(), OBJECT_WIDTH]);
    let state = slots.forward(Tensor::<3>::from_data(objects, &device)).max_dim(1).squeeze_dim(1);
    let agents = TensorData::new(agents, [n_batch, AGENT_WIDTH]);
    Tensor::cat(vec![state, Tensor::from_data(agents, &device)], 1)
}
