//! Resonances over the working area of a machine that moves in a plane.

use super::Natural;
use crate::error::Result;
use crate::machine::{Machine, Travel};

/// Number of positions along each axis of the map.
const PLACES: usize = 33;

/// Undamped frequencies of the elastic modes over the working area.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ResonanceMap {
    /// Positions of the bridge, m.
    pub bridge: Vec<f64>,
    /// Positions of the cart, m.
    pub cart: Vec<f64>,
    /// Hz, by mode, then by the bridge's position, then by the cart's.
    pub hertz: Vec<Vec<Vec<f64>>>,
}

impl ResonanceMap {
    /// Map of a machine with a bridge, if its spans follow bridge and cart, or the bridge yaws, and both have a travel.
    pub fn new(machine: &Machine) -> Result<Option<Self>> {
        let changes = machine.belt.following().is_some() || machine.yaw.is_some();
        let bridge = machine.bridge.as_ref().filter(|_| changes);
        let (Some(bridge), Some(cart)) = (bridge.and_then(|bridge| bridge.travel), machine.cart.travel) else {
            return Ok(None);
        };
        let places = |travel: Travel| -> Vec<f64> {
            let last = (PLACES - 1) as f64;
            (0..PLACES).map(|k| travel.min + (travel.max - travel.min) * k as f64 / last).collect()
        };
        let mechanism = machine.mechanism();
        let (bridge, cart) = (places(bridge), places(cart));
        let mut hertz: Vec<Vec<Vec<f64>>> = Vec::new();
        for (i, x) in bridge.iter().enumerate() {
            for y in &cart {
                let found = Natural::frequencies(&mechanism, &machine.without_strain(&[*x, *y], &[]).position)?;
                hertz.resize_with(found.len(), || vec![Vec::with_capacity(cart.len()); bridge.len()]);
                for (mode, frequency) in hertz.iter_mut().zip(found) {
                    mode[i].push(frequency);
                }
            }
        }
        Ok(Some(Self { bridge, cart, hertz }))
    }

    /// Least and largest frequency of a mode, Hz, each with its position (x, y), m.
    pub fn range(&self, mode: usize) -> [(f64, (f64, f64)); 2] {
        let mut range = [(f64::INFINITY, (0.0, 0.0)), (f64::NEG_INFINITY, (0.0, 0.0))];
        for (x, row) in self.bridge.iter().zip(&self.hertz[mode]) {
            for (y, hertz) in self.cart.iter().zip(row) {
                if *hertz < range[0].0 {
                    range[0] = (*hertz, (*x, *y));
                }
                if *hertz > range[1].0 {
                    range[1] = (*hertz, (*x, *y));
                }
            }
        }
        range
    }
}
