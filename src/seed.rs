//! Randomness that depends on identity alone.
//!
//! A seed is derived from its parent and from what it is for (a label and numbers), never from a thread, a host, an
//! order or a clock. So the same run seed gives the same bytes for any number of threads or shards.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng as _;
use sha2::{Digest as _, Sha256};

/// A 64-bit seed. `ChaCha8` behind it is value-stable across versions, which `StdRng` is not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Seed(pub u64);

impl Seed {
    /// The seed of one named thing under this one: `run.derive("generate", &[trial])`.
    #[must_use]
    pub fn derive(self, label: &str, path: &[u64]) -> Self {
        let mut hasher = Sha256::new();
        hasher.update(self.0.to_le_bytes());
        hasher.update((label.len() as u64).to_le_bytes());
        hasher.update(label.as_bytes());
        for number in path {
            hasher.update(number.to_le_bytes());
        }
        let digest = hasher.finalize();
        let mut first = [0_u8; 8];
        first.copy_from_slice(&digest[..8]);
        Self(u64::from_le_bytes(first))
    }

    /// A generator that starts at this seed.
    pub fn rng(self) -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::Seed;

    #[test]
    fn seeds_differ_by_label_and_by_path() {
        let root = Seed(1);
        let seeds = [
            root.derive("a", &[]),
            root.derive("b", &[]),
            root.derive("a", &[0]),
            root.derive("a", &[1]),
            root.derive("a", &[0, 0]),
            Seed(2).derive("a", &[]),
        ];
        for (i, a) in seeds.iter().enumerate() {
            assert!(seeds[..i].iter().all(|b| a != b));
        }
    }

    #[test]
    fn a_derived_seed_never_changes() {
        // The first eight bytes of SHA-256 over 7, 8, "generate", 3 and 4, numbers as eight bytes, the lowest first.
        assert_eq!(Seed(7).derive("generate", &[3, 4]), Seed(0xcbc5_55cf_e680_c33b));
    }
}
