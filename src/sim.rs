//! The tabletop world in rapier3d: bodies, gripper, robot API, recorded frames.
