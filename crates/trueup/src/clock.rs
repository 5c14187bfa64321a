//! Seconds per stage.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Wall seconds per stage. Stages that run interleaved on one picture after another share the time of their phase in
/// proportion to the work they did.
#[derive(Debug, Clone, Default)]
pub(crate) struct Clock(BTreeMap<String, f64>);

impl Clock {
    /// Runs `work` and adds its wall time to `stage`.
    pub fn time<T>(&mut self, stage: &str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.add(stage, start.elapsed());
        result
    }

    /// Adds a duration to `stage`.
    pub fn add(&mut self, stage: &str, duration: Duration) {
        *self.0.entry(stage.to_owned()).or_default() += duration.as_secs_f64();
    }

    /// Splits `wall` among stages in proportion to the time each was busy on any thread.
    pub fn share(&mut self, wall: Duration, busy: &[(&str, Duration)]) {
        let total: f64 = busy.iter().map(|(_, duration)| duration.as_secs_f64()).sum();
        for (stage, duration) in busy {
            let part = if total > 0.0 { duration.as_secs_f64() / total } else { 0.0 };
            self.add(stage, wall.mul_f64(part));
        }
    }

    /// Adds seconds that were counted elsewhere.
    pub fn add_all(&mut self, seconds: &BTreeMap<String, f64>) {
        for (stage, seconds) in seconds {
            *self.0.entry(stage.clone()).or_default() += seconds;
        }
    }

    /// Wall seconds by stage name, taken out.
    pub fn into_seconds(self) -> BTreeMap<String, f64> {
        self.0
    }

    /// Wall seconds by stage name.
    pub fn seconds(&self) -> &BTreeMap<String, f64> {
        &self.0
    }
}
