//! A random gantry.

use super::{Draw, Drawn, Feature, Sizes, StageKind};
use std::fmt::Write;

impl Draw {
    /// Of these sizes: masses of a pulley, of the bridge with the cart, of the cart.
    pub(super) fn gantry(mut self, title: String, mut sizes: Sizes) -> Drawn {
        let (kind, spans, sides): (&str, usize, &[&str]) = match () {
            () if self.wants(Feature::HFrame) => ("h-frame", 3, &["left", "right"]),
            () if self.wants(Feature::DualBelt) => ("dual-belt", 6, &["left", "right", "cart"]),
            () => ("core-xy", 4, &["left", "right"]),
        };
        let _ = writeln!(self.text, "title = \"{title}\"\nkind = \"{kind}\"");
        let cart = {
            let value = sizes.mass[1] * self.random.even(0.2, 0.8);
            self.digits(value)
        };
        let bridge = self.digits(sizes.mass[1]);
        // Four spans pull at a slide, of an H-frame one of them twice.
        self.fastest *= 2.5;
        sizes.mass[2] = cart;
        let scale = self.motor(&sizes);
        let r = sizes.radius;
        let curves = self.curves;
        let frictions = [(sizes.mass[0], r), (bridge + cart, 1.0), (cart, 1.0)];
        let [pulley, of_bridge, of_cart] = [0, 1, 2].map(|k| {
            let (mass, arm) = frictions[k];
            self.friction(&sizes, mass, arm, curves[k], false)
        });
        if self.random.chance(0.4) {
            let more = self.random.even(0.5, 2.0);
            let resistance = self.digits(self.value_of("resistance") * more);
            let _ = writeln!(self.text, "\n[right_drive.motor]\nresistance = {resistance:e}");
        }
        self.table("drive_pulley");
        self.line("radius", r);
        self.line("inertia", sizes.mass[0] * r * r);
        self.text.push_str(&pulley);
        for (name, mass, friction) in [("bridge", bridge, of_bridge), ("cart", cart, of_cart)] {
            self.table(name);
            self.line("mass", mass);
            self.text.push_str(&friction);
            self.travel_of(&sizes, mass);
        }
        self.belts(&sizes, spans);
        let until = self.digits(sizes.time);
        let every = {
            let value = until / (20.0 + self.random.below(30) as f64);
            self.digits(value)
        }
        .min(until);
        let input =
            |(number, side): (usize, &&str)| format!("{side} = {}", self.input_by_recipe(until, scale.input, number));
        let inputs: Vec<String> = sides.iter().enumerate().map(input).collect();
        self.text.push_str("\n[[experiment]]\nname = \"run\"\n");
        let _ = writeln!(self.text, "input = {{ {} }}", inputs.join(", "));
        let _ = writeln!(self.text, "until = {until:e}\nevery = {every:e}");
        if self.random.chance(0.3) {
            let [x, y] = [(); 2].map(|()| self.even(-0.5, 0.5) * sizes.way / until);
            let _ = writeln!(self.text, "initial = {{ bridge_speed = {x:e}, cart_speed = {y:e} }}");
        }
        self.kinds.sort();
        Drawn { text: self.text, kinds: self.kinds }
    }

    /// The travel of bridge or cart.
    fn travel_of(&mut self, sizes: &Sizes, mass: f64) {
        let stops = self.wants(Feature::Stop);
        if !stops && !self.wants(Feature::Follows) {
            return;
        }
        self.kind(StageKind::Travel);
        let [low, high] = [(); 2].map(|()| sizes.way * self.random.decades(if stops { 0.01 } else { 1.5 }, 2.0));
        let (low, high) = (self.digits(-low), self.digits(high));
        let mut text = format!("min = {low:e}, max = {high:e}");
        if stops {
            let k = {
                let value = sizes.stiffness[self.random.below(3)] * self.random.decades(0.1, 3.0);
                self.digits(value)
            };
            let c =
                if self.random.chance(0.5) { 0.0 } else { 2.0 * self.random.decades(1e-3, 1.0) * (k * mass).sqrt() };
            let c = self.digits(c);
            self.faster((2.0 * k / mass).sqrt().max(2.0 * c / mass));
            let _ = write!(text, ", stop_stiffness = {k:e}, stop_damping = {c:e}");
        }
        let _ = writeln!(self.text, "travel = {{ {text} }}");
    }

    fn belts(&mut self, sizes: &Sizes, count: usize) {
        let mut spans: Vec<[f64; 2]> = (0..3).map(|j| [sizes.stiffness[j], sizes.damping[j]]).collect();
        for more in 0..count - 3 {
            let again = self.random.even(0.5, 2.0);
            spans.push([self.digits(sizes.stiffness[more] * again), sizes.damping[more]]);
        }
        let list = |of: &dyn Fn(&[f64; 2]) -> f64| {
            let values: Vec<String> = spans.iter().map(|span| format!("{:e}", of(span))).collect();
            values.join(", ")
        };
        self.table("belt");
        let damping = list(&|span| span[1]);
        if self.wants(Feature::Follows) {
            let stiffness: Vec<f64> = spans.iter().map(|span| span[0]).collect();
            let rigidity = self.rigidity(sizes, &stiffness);
            let lengths = list(&|span| self.digits(rigidity / span[0]));
            let _ =
                writeln!(self.text, "modulus = {rigidity:e}\nsection = 1\nspans = [{lengths}]\nfollows_cart = true");
        } else {
            let stiffness = list(&|span| span[0]);
            let _ = writeln!(self.text, "stiffness = [{stiffness}]");
        }
        let _ = writeln!(self.text, "damping = [{damping}]");
        if self.wants(Feature::Slack) {
            self.kind(StageKind::Slack);
            let pretension = sizes.force * self.random.decades(0.01, 10.0);
            self.line("pretension", pretension.max(1e-14));
        }
    }
}
