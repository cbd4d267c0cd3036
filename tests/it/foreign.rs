//! Datasets of others, as they are: taken in, checked, asked, shown, edited, published.

mod edits;
mod fuzz;
mod labels;
mod mini;
mod rules;

pub(crate) use mini::{Mini, one, whole};
