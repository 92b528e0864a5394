//! A cart that rides across on a bridge that yaws: the part of the mass matrix that is not diagonal.
//!
//! With x of the bridge's middle, its yaw ψ and the cart's position y along it, the cart is at u = x + y ψ along the
//! travel, to the first order in ψ. Within this the equations are Lagrange's, with g the part of gravity against x:
//!
//! ```text
//! T = ½ m_b ẋ² + ½ I ψ̇² + ½ m (u̇² + ẏ²),   V = … + m g u
//! (m_b + m) ẍ + m c = Q_x,   I ψ̈ + y N = Q_ψ,   m ÿ + ψ N = Q_y
//! N = m (ẍ + c + g),   c = y ψ̈ + ψ ÿ + 2 ẏ ψ̇
//! ```
//!
//! N is the force along x with which the bridge carries the cart; Q_x contains −(m_b + m) g. The linear equations of a
//! mode have the diagonal diag(m_b + m, I, m): they give the accelerations a = Q/diag that the bodies would have
//! without the rest, and the ride subtracts m c, y N and ψ N from the forces. With μ = m (1 − m/(m_b + m)),
//!
//! ```text
//! N = (m (a_x + g) + μ B)/(1 + μ D),   c = B − D N,   D = y²/I + ψ²/m,   B = y a_ψ + ψ a_y + 2 ẏ ψ̇
//! ```
//!
//! A bridge at rest has a_x = 0 and μ = m, a cart at rest a_y = 0 and no ψ²/m.

use super::Mechanism;

/// A cart that rides across on a bridge that yaws.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Ride {
    /// The body of the bridge, whose inertia includes the cart.
    pub bridge: usize,
    /// The body of the cart.
    pub cart: usize,
    /// The yaw of the bridge, a body of its own.
    pub yaw: usize,
    /// g: the part of the acceleration of gravity against x, m/s².
    pub gravity: f64,
}

/// Motion of a ride: what its forces depend on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Riding<T = f64> {
    /// y, m, and ẏ, m/s.
    pub cart: T,
    /// ẏ, m/s.
    pub cart_speed: T,
    /// ψ, rad.
    pub yaw: T,
    /// ψ̇, rad/s.
    pub yaw_speed: T,
    /// a_x, m/s².
    pub bridge_free: T,
    /// a_y, m/s².
    pub cart_free: T,
    /// a_ψ, rad/s².
    pub yaw_free: T,
}

impl<T> Riding<T> {
    /// Its parts, in a fixed order.
    pub fn parts(self) -> [T; 7] {
        let Self { cart, cart_speed, yaw, yaw_speed, bridge_free, cart_free, yaw_free } = self;
        [cart, cart_speed, yaw, yaw_speed, bridge_free, cart_free, yaw_free]
    }

    /// Each part changed.
    pub fn map<U>(self, change: impl FnMut(T) -> U) -> Riding<U> {
        let [cart, cart_speed, yaw, yaw_speed, bridge_free, cart_free, yaw_free] = self.parts().map(change);
        Riding { cart, cart_speed, yaw, yaw_speed, bridge_free, cart_free, yaw_free }
    }
}

/// A part of a ride that a force is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Ridden {
    /// m c on the bridge, N.
    Bridge,
    /// y N on its yaw, N m.
    Yaw,
    /// ψ N on the cart, N.
    Cart,
}

impl Ridden {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Bridge, Self::Yaw, Self::Cart];
}

/// Inertias of a ride, and which of its bodies move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RideLaw {
    /// m, kg.
    mass: f64,
    /// I, kg m².
    inertia: f64,
    gravity: f64,
    /// μ, kg.
    free: f64,
    /// 1 if the cart moves, else 0.
    cart: f64,
}

/// N and c, or their derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Carried {
    force: f64,
    excess: f64,
}

impl Ride {
    /// The body that a force is on.
    pub fn body(&self, ridden: Ridden) -> usize {
        match ridden {
            Ridden::Bridge => self.bridge,
            Ridden::Yaw => self.yaw,
            Ridden::Cart => self.cart,
        }
    }

    /// Its law while bridge and cart move, or do not.
    pub fn law(&self, mechanism: &Mechanism, bridge_moves: bool, cart_moves: bool) -> RideLaw {
        let inertia = |body: usize| mechanism.bodies[body].inertia;
        let (whole, mass) = (inertia(self.bridge), inertia(self.cart));
        let free = if bridge_moves { mass * (1.0 - mass / whole) } else { mass };
        let cart = if cart_moves { 1.0 } else { 0.0 };
        RideLaw { mass, inertia: inertia(self.yaw), gravity: self.gravity, free, cart }
    }
}

impl RideLaw {
    /// D, 1/kg.
    fn lightness(&self, at: &Riding) -> f64 {
        at.cart * at.cart / self.inertia + self.cart * at.yaw * at.yaw / self.mass
    }

    fn carried(&self, at: &Riding) -> Carried {
        let lightness = self.lightness(at);
        // B = y a_ψ + ψ a_y + 2 ẏ ψ̇
        let turning = at.cart * at.yaw_free + self.cart * at.yaw * at.cart_free + 2.0 * at.cart_speed * at.yaw_speed;
        // N = (m (a_x + g) + μ B)/(1 + μ D), c = B − D N
        let pushed = self.mass * (at.bridge_free + self.gravity) + self.free * turning;
        let force = pushed / (1.0 + self.free * lightness);
        Carried { force, excess: turning - lightness * force }
    }

    /// Reduction of the force on a body by the ride, N or N m.
    pub fn force(&self, on: Ridden, at: &Riding) -> f64 {
        let Carried { force, excess } = self.carried(at);
        match on {
            Ridden::Bridge => self.mass * excess,
            Ridden::Yaw => at.cart * force,
            Ridden::Cart => at.yaw * force,
        }
    }

    /// Derivatives of it by each part of the motion.
    pub fn slopes(&self, on: Ridden, at: &Riding) -> Riding {
        let (Carried { force, .. }, lightness) = (self.carried(at), self.lightness(at));
        // Derivatives of D, B, and m a_x by each part.
        let none = [0.0; 3];
        let by = Riding {
            cart: [2.0 * at.cart / self.inertia, at.yaw_free, 0.0],
            cart_speed: [0.0, 2.0 * at.yaw_speed, 0.0],
            yaw: [2.0 * self.cart * at.yaw / self.mass, self.cart * at.cart_free, 0.0],
            yaw_speed: [0.0, 2.0 * at.cart_speed, 0.0],
            bridge_free: [0.0, 0.0, self.mass],
            cart_free: [0.0, self.cart * at.yaw, 0.0],
            yaw_free: [0.0, at.cart, 0.0],
        };
        let mut slopes = by.map(|own| {
            let [light, turning, pushed] = if own == none { return 0.0 } else { own };
            // N′ (1 + μ D) = m a_x′ + μ B′ − N μ D′, c′ = B′ − D′ N − D N′
            let steep = (pushed + self.free * (turning - force * light)) / (1.0 + self.free * lightness);
            match on {
                Ridden::Bridge => self.mass * (turning - light * force - lightness * steep),
                Ridden::Yaw => at.cart * steep,
                Ridden::Cart => at.yaw * steep,
            }
        });
        match on {
            Ridden::Bridge => {}
            Ridden::Yaw => slopes.cart += force,
            Ridden::Cart => slopes.yaw += force,
        }
        slopes
    }
}

impl Mechanism {
    /// Energy of a ride beyond that of the diagonal, J: m ẋ w + ½ m w² with w = ẏ ψ + y ψ̇.
    pub(super) fn riding_energy(&self, state: &super::State) -> f64 {
        let Some(ride) = self.ride else { return 0.0 };
        let mass = self.bodies[ride.cart].inertia;
        let beyond =
            state.speed[ride.cart] * state.position[ride.yaw] + state.position[ride.cart] * state.speed[ride.yaw];
        mass * beyond * (state.speed[ride.bridge] + 0.5 * beyond)
    }

    /// The mass matrix of bridge, cart and yaw at this position of the cart without yaw, in the order of `bodies`:
    /// added to the diagonal of all of them.
    pub fn ridden_mass(&self, bodies: &[usize], position: &[f64; super::BODIES]) -> Vec<(usize, usize, f64)> {
        let Some(ride) = self.ride else { return Vec::new() };
        let place = |body: usize| bodies.iter().position(|own| *own == body);
        let Some((bridge, yaw)) = place(ride.bridge).zip(place(ride.yaw)) else { return Vec::new() };
        let (mass, y) = (self.bodies[ride.cart].inertia, position[ride.cart]);
        vec![(bridge, yaw, mass * y), (yaw, bridge, mass * y), (yaw, yaw, mass * y * y)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_differences() {
        let law = RideLaw { mass: 2.0, inertia: 0.3, gravity: 0.4, free: 1.2, cart: 1.0 };
        let at = Riding {
            cart: 0.2,
            cart_speed: -0.5,
            yaw: 0.1,
            yaw_speed: 0.7,
            bridge_free: 3.0,
            cart_free: -1.5,
            yaw_free: 4.0,
        };
        let parts: [fn(&mut Riding) -> &mut f64; 7] = [
            |at| &mut at.cart,
            |at| &mut at.cart_speed,
            |at| &mut at.yaw,
            |at| &mut at.yaw_speed,
            |at| &mut at.bridge_free,
            |at| &mut at.cart_free,
            |at| &mut at.yaw_free,
        ];
        for on in Ridden::ALL {
            let mut slopes = law.slopes(on, &at);
            for (k, part) in parts.iter().enumerate() {
                let beside = |step: f64| {
                    let mut moved = at;
                    *part(&mut moved) += step;
                    law.force(on, &moved)
                };
                let (slope, difference) = (*part(&mut slopes), (beside(1e-5) - beside(-1e-5)) / 2e-5);
                assert!((slope - difference).abs() < 1e-7 * slope.abs().max(1.0), "{k}: {slope} for {difference}");
            }
        }
    }
}
