//! Runs as logs.

use std::sync::Arc;
use taut::log::{Log, Output, Quantity};
use taut::signal::Hold;
use taut::trajectory::Trajectory;

/// The log of a run that shows these angles of the drive pulley.
pub fn logged(name: &str, run: &Trajectory, drive_angle: Vec<f64>) -> Arc<Log> {
    Arc::new(Log {
        name: name.into(),
        file: Default::default(),
        time: run.get("time").unwrap().to_vec(),
        input: run.get("voltage").unwrap().to_vec(),
        added: None,
        hold: Hold::Zero,
        reference: run.get("reference").map(<[f64]>::to_vec),
        outputs: vec![Output { quantity: Quantity::DriveAngle, absolute: false, values: drive_angle }],
        ended: None,
    })
}
