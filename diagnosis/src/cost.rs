//! What a diagnosis took: simulations and seconds by what was being done.

use anhyst_identify::order::descending;
use std::sync::Arc;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::plant::Memory;

/// What one kind of work took.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    pub work: String,
    /// Runs that were simulated.
    pub simulations: usize,
    /// Of them those whose field and hysteresis were stepped, too; the others differed behind the hysteresis only.
    pub magnetized: usize,
    /// By the clock.
    pub seconds: f64,
}

/// Hears what is being done, passes it on, and keeps account.
pub(crate) struct Meter<'a> {
    progress: &'a mut dyn FnMut(&str, f64),
    memory: Arc<Memory>,
    costs: Vec<Cost>,
    begun: Instant,
    before: [usize; 2],
}

impl<'a> Meter<'a> {
    pub fn new(memory: Arc<Memory>, progress: &'a mut dyn FnMut(&str, f64)) -> Self {
        Meter {
            progress,
            memory,
            costs: Vec::new(),
            begun: Instant::now(),
            before: [0, 0],
        }
    }

    /// Something is begun.
    pub fn begin(&mut self, what: &str, done: f64) {
        (self.progress)(what, done);
        self.close();
        // What is fitted stands behind the word.
        let work = what.split(' ').next().filter(|own| *own == "fitting").unwrap_or(what);
        match self.costs.iter().position(|own| own.work == work) {
            // The last one is what is being done.
            Some(place) => {
                let own = self.costs.remove(place);
                self.costs.push(own);
            }
            None => self.costs.push(Cost {
                work: work.to_owned(),
                ..Cost::default()
            }),
        }
    }

    fn close(&mut self) {
        let now = [self.memory.simulated.so_far(), self.memory.magnetized.so_far()];
        if let Some(own) = self.costs.last_mut() {
            own.seconds += self.begun.elapsed().as_secs_f64();
            own.simulations += now[0] - self.before[0];
            own.magnetized += now[1] - self.before[1];
        }
        (self.begun, self.before) = (Instant::now(), now);
    }

    /// What took longest first.
    pub fn costs(mut self) -> Vec<Cost> {
        self.close();
        descending(&mut self.costs, |cost| cost.seconds);
        self.costs
    }
}
