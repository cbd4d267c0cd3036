//! Scripted programs that act in physics and yield checked episodes.
