//! What the paper reports in numbers, to be set beside ours.
//!
//! # Source
//!
//! Xu et al., "Neural Task Programming: Learning to Generalize Across Hierarchical Tasks", ICRA 2018. Only numbers that
//! its text and tables give; its plots are not read off.

use schemars::JsonSchema;
use serde::Serialize;

/// A success rate of the paper.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PaperValue {
    /// Of which variant. Our `ntp` and `ntp_paper` are both set beside the paper's `ntp`.
    pub variant: String,
    /// In which suite. `sorting_unseen` also stands for `sorting_unseen_4`, `sorting_unseen_40` and so on.
    pub suite: String,
    /// The share of successes.
    pub success_rate: f64,
    /// Where and how it is said.
    pub source: String,
}

impl PaperValue {
    /// Whether it is to be set beside a result.
    pub fn is_for(&self, variant: &str, suite: &str) -> bool {
        let same_variant = variant.strip_suffix("_paper").unwrap_or(variant) == self.variant;
        let number = suite.strip_prefix(self.suite.as_str()).and_then(|rest| rest.strip_prefix('_'));
        let is_part = number.is_some_and(|rest| !rest.is_empty() && rest.bytes().all(|byte| byte.is_ascii_digit()));
        same_variant && (suite == self.suite || is_part)
    }
}

/// Variant, suite, success rate, source.
const VALUES: [(&str, &str, f64, &str); 9] = [
    ("ntp", "stacking_unseen", 0.863, "table \u{201c}Adversarial Dynamics\u{201d}, no failure; 1000 training tasks"),
    ("ntp", "stacking_seen", 0.85, "experiment 2, \u{201c}around 85 %\u{201d}; 1000 training tasks"),
    ("ntp", "stacking_adversary", 0.663, "table \u{201c}Adversarial Dynamics\u{201d}, with failures; probability 25 %"),
    ("ntp", "sorting_unseen", 0.90, "experiment 1, \u{201c}over 90 %\u{201d} for 4 to 40 objects"),
    (
        "ntp_gru",
        "stacking_unseen",
        0.884,
        "table \u{201c}Adversarial Dynamics\u{201d}, no failure; 1000 training tasks",
    ),
    ("ntp_gru", "stacking_seen", 0.85, "experiment 2, \u{201c}around 85 %\u{201d}; 1000 training tasks"),
    (
        "ntp_gru",
        "stacking_adversary",
        0.422,
        "table \u{201c}Adversarial Dynamics\u{201d}, with failures; probability 25 %",
    ),
    ("flat", "sorting_unseen_4", 0.40, "experiment 1, flat models at 4 objects, \u{201c}around 40 %\u{201d}"),
    ("flat", "sorting_unseen_40", 0.25, "experiment 1, flat models at 40 objects, \u{201c}around 25 %\u{201d}"),
];

/// The paper's success rates.
pub fn paper_values() -> Vec<PaperValue> {
    let value = |(variant, suite, success_rate, source): (&str, &str, f64, &str)| PaperValue {
        variant: variant.to_owned(),
        suite: suite.to_owned(),
        success_rate,
        source: source.to_owned(),
    };
    VALUES.into_iter().map(value).collect()
}
