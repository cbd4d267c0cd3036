//! A pipeline file, resolved into plans, run stage by stage.
