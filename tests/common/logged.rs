//! Runs as logs.

use std::sync::Arc;
use taut::log::{Log, Output, Quantity};
use taut::signal::Hold;
use taut::trajectory::Trajectory;

/// A log of these columns.
pub fn columns(name: &str, time: Vec<f64>, input: Vec<f64>, outputs: Vec<Output>) -> Arc<Log> {
    Arc::new(Log {
        name: name.into(),
        file: Default::default(),
        time,
        inputs: vec![input],
        added: None,
        hold: Hold::Zero,
        reference: None,
        outputs,
        ended: None,
    })
}

/// The values of a sensor.
pub fn output(quantity: Quantity, values: Vec<f64>) -> Output {
    Output { quantity, absolute: false, values }
}

/// The log of a run that shows these angles of the drive pulley.
pub fn logged(name: &str, run: &Trajectory, drive_angle: Vec<f64>) -> Arc<Log> {
    let column = |name: &str| run.get(name).unwrap().to_vec();
    let mut log = columns(name, column("time"), column("voltage"), vec![output(Quantity::DriveAngle, drive_angle)]);
    Arc::make_mut(&mut log).reference = run.get("reference").map(<[f64]>::to_vec);
    log
}
