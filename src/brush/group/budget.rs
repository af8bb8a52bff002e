//! Energy and momentum of filaments, and their exchange with the surroundings.

use super::super::field::wide;
use super::super::gmres;
use super::{Group, Surroundings};
use crate::equations::linear::{add, dot, scale, sub, zero};
use crate::equations::{Chain, Lanes, Lanewise, Real};

/// Energy and momentum of all filaments, and their exchange with the surroundings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Budget {
    /// Energy of the filaments and their contacts in J.
    pub energy: f64,
    /// Momentum of the filaments in N s.
    pub momentum: [f64; 3],
    /// Exchange with the surroundings.
    pub exchange: Exchange,
}

impl Budget {
    pub fn add(&mut self, other: &Self) {
        let Exchange {
            work,
            taken,
            force,
            strength,
        } = other.exchange;
        self.energy += other.energy;
        self.momentum = add(self.momentum, other.momentum);
        let exchange = &mut self.exchange;
        exchange.work += work;
        exchange.taken += taken;
        exchange.force = add(exchange.force, force);
        exchange.strength += strength;
    }
}

/// Exchange of filaments with their surroundings at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Exchange {
    /// Power of the clamps and of a moving workpiece in W.
    pub work: f64,
    /// Power that joints and contacts dissipate, in W.
    pub taken: f64,
    /// Force of clamps, workpiece and gravity in N, without forces between filaments.
    pub force: [f64; 3],
    /// Sum of the magnitudes of the forces of the workpiece in N.
    pub strength: f64,
}

impl Group {
    /// Returns the budget of its filaments, once the residual was computed with the `forces` on
    /// nodes. The clamps hold the roots.
    pub fn budget<M>(
        &mut self,
        around: &Surroundings<'_, M>,
        [q, v]: [&gmres::GroupPart; 2],
        forces: &[[Lanes; 3]],
    ) -> Budget {
        let n = self.equations.segments();
        let energies = self.equations.energies(self.clamp.holding(q, v));
        let root_force = sub(self.equations.root_force(), forces[0]);
        let power = dot(root_force, self.clamp.velocity) + energies.clamp_torque_power;
        let energy = energies.kinetic + energies.spring + energies.gravity;
        let velocities = &around.nodes.velocities.0[self.index * (n + 1)..][..=n];
        let (of_nodes, weight) = wide(
            #[inline(always)]
            || {
                let Chain { links, gravity, .. } = self.equations.chain();
                let (mut momentum, mut mass) = (zero(), Lanes::ZERO);
                for (link, ends) in links.iter().zip(velocities.windows(2)) {
                    momentum = add(
                        momentum,
                        scale(Lanes::from_f64(0.5) * link.mass, add(ends[0], ends[1])),
                    );
                    mass = mass + link.mass;
                }
                (momentum, scale(mass, *gravity))
            },
        );
        let outside = forces.iter().fold(weight, |sum, force| add(sum, *force));
        self.momentum_rate = add(root_force, outside);
        let mut budget = Budget::default();
        let Budget {
            energy: sum,
            momentum,
            exchange:
                Exchange {
                    work,
                    taken,
                    force,
                    strength,
                },
        } = &mut budget;
        for (lane, load) in self.loads.iter().enumerate() {
            *sum += energy.lane(lane) + load.energy;
            *work += power.lane(lane) + load.moving_power;
            *taken += 2.0 * energies.dissipation.lane(lane)
                + load.sum.friction_power
                + load.sum.damped_power;
            *momentum = add(*momentum, of_nodes.map(|component| component.lane(lane)));
            let root = root_force.map(|component| component.lane(lane));
            let outside = add(load.sum.force, weight.map(|component| component.lane(lane)));
            *force = add(*force, add(root, outside));
            *strength += dot(load.sum.force, load.sum.force).sqrt();
        }
        for (_, press) in around.pressing.of_points(self.index) {
            budget.energy += press.energy();
            budget.exchange.taken += press.dissipated;
        }
        budget
    }
}
