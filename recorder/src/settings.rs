//! What a scenario may say about its recording.

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Settings of the recorder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RecorderSettings {
    /// Ticks that are written at a time, fewer while live viewers are served. A killed run loses at most one block and the
    /// ones in the queue.
    pub block_ticks: usize,
    /// Blocks that circulate between the loop and the logger: the depth of the queue.
    pub blocks: usize,
    /// True: the loop waits for a logger that cannot follow (lockstep). False: rows are dropped and counted (real time).
    pub lossless: bool,
    /// The longest that a lossless recorder waits for the logger, once; after that it drops and counts.
    pub patience_s: f64,
    /// Rows per second of the plots. Each pair of rows holds the smallest and the largest value of its stretch of ticks.
    pub plot_rate_hz: f64,
    /// Size from which on a recording goes on in another part, MB.
    pub part_mb: f64,
    /// The same for its length; none: only the size counts.
    pub part_s: Option<f64>,
    /// Only what surrounds events is kept: at least so long before each and after it. Takes the place of `part_s`.
    pub ring_s: Option<f64>,
    /// Half the height of the error plot; without it the height is chosen from the run when it ends.
    pub error_axis_nm: Option<f64>,
    /// TCP port on 127.0.0.1 where viewers may join the running recording.
    pub live: Option<u16>,
    /// Rows per second of the plots sent to live viewers, which hold everything in memory.
    pub live_rate_hz: f64,
}

impl Default for RecorderSettings {
    fn default() -> Self {
        Self {
            block_ticks: 4000,
            blocks: 12,
            lossless: true,
            patience_s: 10.0,
            plot_rate_hz: 4000.0,
            part_mb: 250.0,
            part_s: None,
            ring_s: None,
            error_axis_nm: None,
            live: None,
            live_rate_hz: 2000.0,
        }
    }
}

impl RecorderSettings {
    /// Refuses what cannot be used.
    ///
    /// # Errors
    /// The field, its value and the reason.
    pub fn validate(&self) -> Result<(), Invalid> {
        Invalid::unless_between("block_ticks", self.block_ticks as f64, 16.0, 65536.0, "ticks")?;
        Invalid::unless_between("blocks", self.blocks as f64, 2.0, 1024.0, "blocks")?;
        Invalid::unless_between("patience_s", self.patience_s, 0.0, 3600.0, "s")?;
        Invalid::unless_positive("plot_rate_hz", self.plot_rate_hz, "Hz")?;
        Invalid::unless_positive("live_rate_hz", self.live_rate_hz, "Hz")?;
        Invalid::unless_between("part_mb", self.part_mb, 1.0, 1e6, "MB")?;
        let optional = [
            ("error_axis_nm", self.error_axis_nm, "nm"),
            ("part_s", self.part_s, "s"),
            ("ring_s", self.ring_s, "s"),
        ];
        for (name, value, unit) in optional {
            value.map_or(Ok(()), |value| Invalid::unless_positive(name, value, unit))?;
        }
        if self.live == Some(0) {
            return Err(Invalid::new(
                "live",
                "port 0 cannot be joined: name a port from 1 to 65535",
            ));
        }
        Ok(())
    }
}
