//! Search for the step that ends on the first event of a contact.

use super::super::crossing::{Crossing, GAP_RATE, TooLong, crossing as crossing_of};
use super::super::filament::Filament;
use super::super::step::{Step, at_knots};
use super::Trajectory;
use crate::equations::linear::dot;
use crate::integrate::hermite::Knot;
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;

/// Largest number of repetitions of a step until its end lies on an event: first by Newton's
/// method, then by bisection to rounding.
const MAX_NEWTON_LANDINGS: usize = 12;
const MAX_LANDINGS: usize = 60;

/// Search for the step that ends on an event: within half of the tolerance or, if rounding prevents
/// that, at the first instant after the event.
#[derive(Clone, Copy, Debug)]
pub(super) struct Landing {
    pub(super) crossing: Crossing,
    /// Lengths of steps that end before and after the event, in s.
    low: f64,
    high: f64,
    /// Length to try next.
    pub(super) length: f64,
    pub(super) attempts: usize,
    /// Number of events that were replaced by an earlier one.
    pub(super) earlier: usize,
}

impl Landing {
    /// Starts the search for `crossing`, which replaces `earlier` later events of the same step.
    pub(super) fn on(crossing: Crossing, earlier: usize) -> Self {
        let Crossing {
            after,
            past,
            at_end,
            ..
        } = crossing;
        // An event that only the interpolant shows is checked first.
        let length = if at_end { after } else { past };
        Self {
            crossing,
            low: 0.0,
            high: past,
            length,
            attempts: 0,
            earlier,
        }
    }
}

impl Trajectory {
    /// Returns `true` if the contact of `landing` is past its event at the end of the step.
    pub(super) fn is_past_at_end<M: ClampMotion, W: Workpiece>(
        &self,
        landing: Landing,
        filament: &Filament<M, W>,
    ) -> bool {
        let nodes = at_knots(filament, &self.end_nodes.knots, self.end.time, 0.0);
        self.excess(landing.crossing.contact, filament, &nodes, self.end.time) > 0.0
    }

    /// Finds the earliest event of the step, except events of the contact `except`, at whose event
    /// the step ends. Updates the distances of the contacts from their events at its end.
    pub(super) fn first_crossing<M: ClampMotion, W: Workpiece>(
        &mut self,
        filament: &Filament<M, W>,
        except: Option<usize>,
    ) -> Result<Option<Crossing>, TooLong> {
        let mut distances = std::mem::take(&mut self.end_nodes.distances);
        let step = self.step();
        let drift = step.length() * surface_speed(filament, &step);
        let way = self.start_nodes.way_to(&self.end_nodes, step.length());
        // If the workpiece does not just translate, every contact is checked.
        let reach = if filament.workpiece.translates() {
            GAP_RATE * (way + drift)
        } else {
            f64::INFINITY
        };
        let mut first: Result<Option<Crossing>, TooLong> = Ok(None);
        for (contact, end) in distances.iter_mut().enumerate() {
            let start = self.start_nodes.distances[contact];
            if except == Some(contact) {
                *end = 0.0;
                continue;
            }
            if start > reach {
                *end = start - reach;
                continue;
            }
            match crossing_of(filament, &step, contact, self.location, drift) {
                Ok((distance, crossing)) => {
                    *end = distance;
                    if let (Ok(earliest), Some(crossing)) = (&first, crossing)
                        && earliest.is_none_or(|first| crossing.after < first.after)
                    {
                        first = Ok(Some(crossing));
                    }
                }
                Err(TooLong) => {
                    *end = 0.0;
                    first = Err(TooLong);
                }
            }
        }
        self.end_nodes.distances = distances;
        first
    }

    /// Returns the next landing after the attempt of `landing`; `None` if that was close enough to
    /// the event.
    pub(super) fn correct<M: ClampMotion, W: Workpiece>(
        &self,
        landing: Landing,
        filament: &Filament<M, W>,
    ) -> Option<Landing> {
        let Landing {
            crossing,
            mut low,
            mut high,
            length,
            attempts,
            ..
        } = landing;
        let location = self.location;
        // Excess a time `back` before the end.
        let excess = |back: f64| {
            let nodes = at_knots(filament, &self.end_nodes.knots, self.end.time, back);
            self.excess(crossing.contact, filament, &nodes, self.end.time - back)
        };
        let here = excess(0.0);
        // Where work is limited, a step may end past the event by `depth`, but not before it: the
        // node would switch back.
        let limited = self
            .control
            .is_at_floor(crossing.past, self.end_time - self.start.time);
        let depth = if limited { self.coarse_location } else { 0.0 };
        let resolved = high - low <= 4.0 * f64::EPSILON * (self.start.time.abs() + high);
        let near = here.abs() <= location / 2.0 || (0.0..=depth).contains(&here);
        if near || (resolved && here > 0.0) || attempts + 1 >= MAX_LANDINGS {
            return None;
        }
        if here > 0.0 {
            high = length
        } else {
            low = length
        }
        // Newton's method inside the bracket, with the slope over a small part of the step.
        let back = 1e-4 * length;
        let slope = (here - excess(back)) / back;
        let next = length - (here - depth / 2.0) / slope;
        let inside = next > low && next < high && attempts < MAX_NEWTON_LANDINGS;
        let length = match () {
            () if resolved => high,
            () if inside => next,
            () => (low + high) / 2.0,
        };
        Some(Landing {
            low,
            high,
            length,
            attempts: attempts + 1,
            ..landing
        })
    }
}

/// Returns the speed of the surface of the workpiece at the tip in m/s: the larger value of both
/// ends of a step.
fn surface_speed<M: ClampMotion, W: Workpiece>(filament: &Filament<M, W>, step: &Step<'_>) -> f64 {
    let tip = step.start_nodes.len() - 1;
    let speed = |knot: &Knot<3>, time: f64| {
        let velocity = filament.workpiece.surface(knot.value, time).velocity;
        dot(velocity, velocity).sqrt()
    };
    let start = speed(&step.start_nodes[tip], step.start.time);
    if filament.workpiece.translates() {
        start
    } else {
        start.max(speed(&step.end_nodes[tip], step.end.time))
    }
}
