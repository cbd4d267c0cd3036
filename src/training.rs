//! From trials in memory to trained weights: examples, batches, learner, checkpoints.
