//! Simulated time, counted in whole steps.

const NANOS_PER_SEC: u64 = 1_000_000_000;

/// Steps since the episode began.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    n_steps: u64,
    step_hz: u64,
    frame_hz: u64,
}

impl Clock {
    pub(super) fn new(step_hz: u32, frame_hz: u32) -> Self {
        Self { n_steps: 0, step_hz: u64::from(step_hz), frame_hz: u64::from(frame_hz) }
    }

    /// Whether a frame between boundaries will be due after the next step.
    pub(super) fn is_due_next(&self) -> bool {
        let mut next = *self;
        next.tick()
    }

    /// One step has passed; whether a frame between boundaries is due now.
    pub(super) fn tick(&mut self) -> bool {
        let frames = |n_steps: u64| n_steps * self.frame_hz / self.step_hz;
        let before = frames(self.n_steps);
        self.n_steps += 1;
        frames(self.n_steps) > before
    }

    /// Time since the episode began, in nanoseconds.
    pub(super) fn time_nanos(&self) -> u64 {
        self.n_steps * NANOS_PER_SEC / self.step_hz
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_due_exactly_as_often_as_asked() {
        for (step_hz, frame_hz) in [(240, 10), (240, 0), (250, 30), (120, 120)] {
            let mut clock = Clock::new(step_hz, frame_hz);
            let due = (0..step_hz).filter(|_| clock.tick()).count();
            assert_eq!(due, frame_hz as usize);
            assert_eq!(clock.time_nanos(), NANOS_PER_SEC);
        }
    }
}
