//! Closing and opening of contacts at the start of a step.

use super::super::error::IntegrationError;
use super::super::filament::Filament;
use super::super::step::at_knots;
use super::super::system::FilamentSystem;
use super::super::system::integral::CONTACT_DISSIPATION;
use super::Trajectory;
use crate::contact::Approach;
use crate::equations::Compiled;
use crate::equations::linear::dot;
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;

/// Largest penetration of a contact that takes over from another, over that of the deepest closed
/// contact.
const MAX_TAKEOVER_RATIO: f64 = 2.0;
/// Largest share of the kinetic energy of the outermost segment that a contact may store when it
/// closes. The energy balance tells whether that matters.
const MAX_UNNOTICED_SHARE: f64 = 0.1;

impl Trajectory {
    /// Returns the deepest penetration of a closed contact at the start, in m.
    pub(super) fn deepest<M: ClampMotion, W: Workpiece>(&self, filament: &Filament<M, W>) -> f64 {
        let closed = (0..self.closed.len()).filter(|&contact| self.closed[contact]);
        closed
            .map(|contact| self.approach(contact, filament).penetration)
            .fold(0.0, f64::max)
    }

    /// Returns `contact` at the start. A closed contact that has just left its face or edge is
    /// evaluated a little earlier: beyond, another face or edge is the nearest.
    fn approach<M: ClampMotion, W: Workpiece>(
        &self,
        contact: usize,
        filament: &Filament<M, W>,
    ) -> Approach {
        /// Way back, in tolerances of the location of events.
        const LOOKBACK_TOLERANCES: f64 = 8.0;
        let at = |back: f64| {
            let nodes = at_knots(filament, &self.start_nodes.knots, self.start.time, back);
            filament
                .touch(contact, &nodes, None, self.start.time - back)
                .approach
        };
        let here = at(0.0);
        let has_left = self.closed[contact] && here.margin < 0.0;
        if has_left {
            at(LOOKBACK_TOLERANCES * self.location / self.start_nodes.speed)
        } else {
            here
        }
    }

    /// Returns the penetration of the contact that opened just before the start, in m; zero if
    /// there is none. Where one contact takes over from another, each event is located to the
    /// tolerance by itself.
    pub(super) fn just_released(&self) -> f64 {
        /// Largest way of a node between both events, in tolerances of their location.
        const MAX_HANDOVER_TOLERANCES: f64 = 100.0;
        let [time, depth] = self.released;
        let way = (self.start.time - time) * self.start_nodes.speed;
        if way <= MAX_HANDOVER_TOLERANCES * self.location {
            depth
        } else {
            0.0
        }
    }

    /// Closes or opens `contact` at the start of the next step. `deepest` is the penetration of the
    /// deepest contact that was closed, in m.
    ///
    /// The energy of a contact that closes or opens while it is pressed in is accounted for. It
    /// opens so if it recedes so fast that its damping would pull, or if the filament moves to
    /// another face or edge. Its elastic energy then does no more work. A contact that closes again
    /// before it has come out, or takes over from another one, gets that energy back.
    ///
    /// # Errors
    /// If the force begins or ends with a jump: the event was missed.
    pub(super) fn switch<M: ClampMotion, W: Workpiece, T: Compiled>(
        &mut self,
        contact: usize,
        deepest: f64,
        lane: usize,
        system: &mut FilamentSystem<M, W, T>,
    ) -> Result<(), IntegrationError> {
        let filament = system.filament(lane);
        if !self.closed[contact] {
            self.check_normal(contact, filament)?;
        }
        let approach = self.approach(contact, filament);
        let force = filament.law.normal_force(&approach);
        let takes_over = approach.penetration <= MAX_TAKEOVER_RATIO * deepest;
        let stored = if approach.penetration > 0.0 {
            filament.law.stored_energy(&approach)
        } else {
            0.0
        };
        // Where a node passes the border of a face and its surface at once, one event delays the
        // other. The stored energy is then below this.
        let noticed = MAX_UNNOTICED_SHARE
            * 0.5
            * filament.chain.links[self.end.q.len() - 1].mass
            * self.start_nodes.speed.powi(2);
        let jumps = match self.closed[contact] {
            true => force < -self.jump,
            false => force > self.jump && stored > noticed && !takes_over,
        };
        if jumps {
            return Err(IntegrationError::Jump {
                time: self.start.time,
                force,
            });
        }
        if self.closed[contact] {
            self.released = [self.start.time, approach.penetration];
            self.start.integrals[CONTACT_DISSIPATION] += stored - self.stored[contact];
        } else {
            self.stored[contact] = if takes_over || filament.law.damping > 0.0 {
                stored
            } else {
                0.0
            };
        }
        self.closed[contact] = !self.closed[contact];
        self.start_nodes.distances[contact] = 0.0;
        system.set_closed(lane, contact, self.closed[contact]);
        self.contact_events += 1;
        Ok(())
    }

    /// Checks that the normal of the workpiece at the node of `contact` is a unit vector.
    fn check_normal<M: ClampMotion, W: Workpiece>(
        &self,
        contact: usize,
        filament: &Filament<M, W>,
    ) -> Result<(), IntegrationError> {
        /// Largest deviation of the length of a unit vector.
        const ROUNDING: f64 = 1e-6;
        let (time, node) = (self.start.time, self.start_nodes.knots.get(contact));
        let length = node.map_or(1.0, |node| {
            let normal = filament.workpiece.surface(node.value, time).normal;
            dot(normal, normal).sqrt()
        });
        if (length - 1.0).abs() <= ROUNDING {
            Ok(())
        } else {
            Err(IntegrationError::Normal { time, length })
        }
    }

    /// Returns `true` if `contact` presses at the start although it is open, or vice versa.
    pub(super) fn is_past<M: ClampMotion, W: Workpiece>(
        &self,
        contact: usize,
        filament: &Filament<M, W>,
    ) -> bool {
        let nodes = at_knots(filament, &self.start_nodes.knots, self.start.time, 0.0);
        self.excess(contact, filament, &nodes, self.start.time) > -self.location
    }
}
