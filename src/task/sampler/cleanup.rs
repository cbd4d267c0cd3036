//! Table Clean-up: which of four bowls are stacked on the tray, in which order; the forks go into the last.
//!
//! # Source
//!
//! Paper, experiment 3: "up to 4 bowls", "the ordering in which bowls are stacked can vary". There are 64 orders of one
//! to four bowls. [`UNSEEN`] of each length are held out, so that every length is measured on orders never seen.

use rand::seq::SliceRandom as _;

use crate::scene::SlotIndex;
use crate::seed::Seed;
use crate::task::layout::cleanup::{FORK, N_BOWLS, TRAY};
use crate::task::sampler::task;
use crate::task::{Family, Goal, Split, Task};

/// How many orders of one, two, three and four bowls are held out.
const UNSEEN: [usize; N_BOWLS as usize] = [2, 4, 8, 10];
/// How many orders may be trained on.
pub(super) const N_TRAINING: u32 = 40;
/// How many orders are held out.
pub(super) const N_UNSEEN: u32 = 24;

/// Training tasks, then unseen ones.
pub(super) fn sample(train: usize, unseen: usize, seed: Seed) -> Vec<Task> {
    let mut seen_orders = Vec::new();
    let mut unseen_orders = Vec::new();
    for (length, n_unseen) in (1..).zip(UNSEEN) {
        let mut orders = orders(length);
        orders.shuffle(&mut seed.derive("cleanup_orders", &[length as u64]).rng());
        seen_orders.extend(orders.split_off(n_unseen));
        unseen_orders.extend(orders);
    }
    seen_orders.shuffle(&mut seed.derive("cleanup_seen", &[]).rng());
    unseen_orders.shuffle(&mut seed.derive("cleanup_unseen", &[]).rng());
    let seen = seen_orders.iter().take(train).map(|order| order_task(order, Split::Seen));
    seen.chain(unseen_orders.iter().take(unseen).map(|order| order_task(order, Split::Unseen))).collect()
}

/// Every order of so many bowls.
fn orders(length: usize) -> Vec<Vec<u16>> {
    if length == 0 {
        return vec![Vec::new()];
    }
    let longer = |order: Vec<u16>| {
        let others = (0..N_BOWLS).filter(|bowl| !order.contains(bowl)).collect::<Vec<_>>();
        others.into_iter().map(move |bowl| [order.as_slice(), &[bowl]].concat())
    };
    orders(length - 1).into_iter().flat_map(longer).collect()
}

/// The id names the order from below: `clean_31` puts `bowl_3` on the tray, `bowl_1` into it, and the forks into that.
fn order_task(order: &[u16], split: Split) -> Task {
    let bowls = order.iter().copied().map(SlotIndex);
    let below = std::iter::once(TRAY).chain(bowls.clone());
    let goals = bowls.chain([FORK]).zip(below).map(|(source, target)| Goal { source, target }).collect();
    let digits: String = order.iter().map(|bowl| (bowl + 1).to_string()).collect();
    task(format!("clean_{digits}"), Family::TableCleanup, goals, split)
}
