//! A pass over the workpiece with any method, with located events and the metrics of the contact.

use bristle::equations::linear::{add, scale};
use bristle::integrate::SecondOrderSystem;
use bristle::integrate::hermite::{Knot, interpolate};
use bristle::model::metrics::{ContactRecord, tip_deflection};
use bristle::tool::ClampMotion;

use crate::newton::{Failure, MAX_ITERATIONS};
use crate::system::{Filament, Point, Problem, StepView, System, Work};

/// A method that takes one step at a time.
pub trait Method {
    /// Starts at a point, or continues at a point at which the system has changed.
    fn restart(&mut self, start: &Point);

    /// Attempts a step of length `step` (s); returns its error relative to the tolerance.
    fn attempt(&mut self, system: &mut System, start: &Point, step: f64, end: &mut Point) -> Result<f64, Failure>;

    /// Accepts the last attempt, and returns the proposed length of the next step (s).
    ///
    /// `step` is the length that had the error `error`. If the step was `landed` on an event, the last attempt was shorter.
    fn accept(&mut self, start: &Point, end: &Point, step: f64, error: f64, landed: bool) -> f64;

    /// The length (s) to try after a step of the length `step` with an error above the tolerance.
    fn reject(&mut self, step: f64, error: f64) -> f64;

    /// The numbers of stages that took one, two, … Newton iterations.
    fn distribution(&self) -> [usize; MAX_ITERATIONS] {
        [0; MAX_ITERATIONS]
    }
}

/// The factor by which the controller of the library changes the step.
pub fn pi_factor(error: f64, previous_error: f64, order: f64) -> f64 {
    (0.9 * error.max(1e-10).powf(-0.7 / order) * previous_error.powf(0.3 / order)).clamp(0.2, 5.0)
}

/// How a step is shortened to end on an event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Landing {
    /// The step is repeated with a corrected length.
    Repeat,
    /// The state is taken from the quintic interpolant of the step.
    Interpolate,
}

/// Settings of a pass that do not belong to the method.
#[derive(Clone, Copy, Debug)]
pub struct PassSettings {
    pub landing: Landing,
    /// Depth past the event at which a node switches, divided by relative tolerance × filament length.
    pub location: f64,
    /// Step after an event, relative to the step that the method proposes.
    pub after_event: f64,
    /// Takes the impulse from the interpolant instead of the method's own quadrature.
    pub quadrature: bool,
}

impl Default for PassSettings {
    fn default() -> Self {
        Self { landing: Landing::Repeat, location: 1e-4, after_event: 1.0, quadrature: false }
    }
}

const MAX_STEPS: usize = 400_000;

/// The record of a pass and its work; `None` if the integration failed.
pub fn run(problem: &Problem, settings: PassSettings, method: &mut dyn Method) -> Option<(ContactRecord, Work)> {
    let (mut system, mut start) = problem.start();
    let n = system.blocks();
    let relative = problem.tolerances.relative;
    let location = location(&system, relative, settings);
    let none = Knot { value: [0.0; 3], rate: [0.0; 3], acceleration: [0.0; 3] };
    let (mut start_nodes, mut end_nodes) = (vec![none; n], vec![none; n]);
    let mut end = start.clone();
    let mut record = ContactRecord::default();
    let mut was_closed = false;
    let (entry, exit) = problem.nominal_times();
    method.restart(&start);
    system.track(&start, &mut start_nodes);
    let mut proposed = 1e-3 * problem.end_time;
    while start.time < problem.end_time {
        if system.work.steps + system.work.rejected + system.work.failed > MAX_STEPS || proposed < 1e-17 {
            return None;
        }
        let remaining = problem.end_time - start.time;
        let limited = proposed >= remaining;
        let step = match () {
            () if limited => remaining,
            () if 2.0 * proposed > remaining => remaining / 2.0,
            () => proposed,
        };
        let error = match method.attempt(&mut system, &start, step, &mut end) {
            Ok(error) if error <= 1.0 => error,
            Ok(error) => {
                proposed = method.reject(step, error);
                system.work.rejected += 1;
                continue;
            }
            Err(Failure) => {
                proposed = 0.3 * step;
                system.work.failed += 1;
                continue;
            }
        };
        if limited {
            end.time = problem.end_time;
        }
        system.track(&end, &mut end_nodes);
        let view = StepView { start: &start, end: &end, start_nodes: &start_nodes, end_nodes: &end_nodes };
        let crossing = first_crossing(&system, &view, location);
        let on_the_spot = crossing.is_some_and(|crossing| crossing.after == 0.0);
        if let Some(crossing) = crossing
            && !on_the_spot
        {
            let landed = match settings.landing {
                Landing::Repeat => land(method, &mut system, &start, &mut end, &mut end_nodes, crossing, location),
                Landing::Interpolate => {
                    let whole = end.clone();
                    read_off(
                        &mut system,
                        (&start, &start_nodes),
                        &whole,
                        (&mut end, &mut end_nodes),
                        crossing,
                        location,
                    );
                    Some(())
                }
            };
            if landed.is_none() {
                system.work.failed += 1;
                proposed = 0.3 * crossing.after;
                continue;
            }
        }
        if !on_the_spot {
            system.work.steps += 1;
            if settings.quadrature {
                let view = StepView { start: &start, end: &end, start_nodes: &start_nodes, end_nodes: &end_nodes };
                end.integrals[0] = start.integrals[0] + impulse(&system, &view);
            }
            let view = StepView { start: &start, end: &end, start_nodes: &start_nodes, end_nodes: &end_nodes };
            observe(&system, problem, &view, &mut record, &mut was_closed, (entry, exit));
            let next = method.accept(&start, &end, step, error, crossing.is_some());
            // A step cut short by the end of the pass is no reason against a longer one.
            proposed = if limited { proposed.max(next) } else { next };
            std::mem::swap(&mut start, &mut end);
            std::mem::swap(&mut start_nodes, &mut end_nodes);
        }
        if let Some(Crossing { node, .. }) = crossing {
            let closed = system.inner.is_closed(0, node);
            system.inner.set_closed(0, node, !closed);
            system.work.events += 1;
            method.restart(&start);
            proposed *= settings.after_event;
        }
    }
    Some((record, system.work))
}

fn location(system: &Filament, relative: f64, settings: PassSettings) -> f64 {
    settings.location / 1e-4 * system.inner.filament(0).event_tolerance(relative, 0.0)
}

/// Normal impulse of a step by Gauss quadrature of the force on the interpolant.
fn impulse(system: &Filament, step: &StepView<'_>) -> f64 {
    const NODES: [(f64, f64); 3] =
        [(0.11270166537925831, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.8872983346207417, 5.0 / 18.0)];
    if !system.is_in_contact() {
        return 0.0;
    }
    step.length() * NODES.iter().map(|&(s, weight)| weight * system.normal_force(step, s)).sum::<f64>()
}

fn observe(
    system: &Filament,
    problem: &Problem,
    step: &StepView<'_>,
    record: &mut ContactRecord,
    was_closed: &mut bool,
    (entry, exit): (f64, f64),
) {
    let closed = system.is_in_contact();
    if closed {
        record.time += step.length();
        record.nominal_time += (step.end.time.min(exit) - step.start.time.max(entry)).max(0.0);
        record.count += usize::from(!*was_closed);
        record.peak_force = maximum(|s| system.normal_force(step, s), record.peak_force);
    }
    *was_closed = closed;
    record.impulse = step.end.integrals[0];
    let deflection = |s: f64| {
        let clamp = system.inner.filament(0).motion.at(step.time(s));
        let (tip, _) = step.node(step.end_nodes.len() - 1, s);
        tip_deflection(tip, clamp.position, clamp.direction, problem.settings.filament.length_m)
    };
    record.max_deflection = maximum(deflection, record.max_deflection);
}

/// The larger of `so_far` and the largest value in a step.
fn maximum(f: impl Fn(f64) -> f64, so_far: f64) -> f64 {
    let values: [f64; 5] = std::array::from_fn(|i| f(i as f64 / 4.0));
    let (best, &highest) = values.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).expect("not empty");
    // Refining is only worthwhile if the maximum may exceed the largest value so far.
    let spread = highest - values.iter().fold(f64::INFINITY, |low, &value| low.min(value));
    if highest + spread <= so_far {
        return so_far;
    }
    let low = (best as f64 - 1.0).max(0.0) / 4.0;
    let high = (best as f64 + 1.0).min(4.0) / 4.0;
    so_far.max(f(maximise(&f, low, high))).max(highest)
}

#[derive(Clone, Copy, Debug)]
struct Crossing {
    node: usize,
    after: f64,
    past: f64,
}

fn excess(system: &Filament, node: usize, position: [f64; 3], velocity: [f64; 3], time: f64, location: f64) -> f64 {
    let filament = system.inner.filament(0);
    let pressing = filament.law.pressing(&filament.approach(position, velocity, time));
    (if system.inner.is_closed(0, node) { -pressing } else { pressing }) - location
}

/// The earliest event of a step, from its interpolant (as in `bristle::simulation`).
fn first_crossing(system: &Filament, step: &StepView<'_>, location: f64) -> Option<Crossing> {
    const INNER_POINTS: usize = 8;
    let mut first: Option<Crossing> = None;
    for node in 0..step.start_nodes.len() {
        let at = |s: f64| {
            let (position, velocity) = step.node(node, s);
            excess(system, node, position, velocity, step.time(s), location)
        };
        let (before, after) = (at(0.0), at(1.0));
        let past = if before > 0.0 {
            0.0
        } else if after > 0.0 {
            1.0
        } else {
            if system.inner.filament(0).law.damping == 0.0 && before.max(after) < -step.length() * step.speeds(node) {
                continue;
            }
            let inner = (1..INNER_POINTS).map(|i| i as f64 / INNER_POINTS as f64);
            let best = inner.max_by(|&a, &b| at(a).total_cmp(&at(b))).unwrap_or(0.5);
            let spacing = 1.0 / INNER_POINTS as f64;
            let peak = maximise(at, best - spacing, best + spacing);
            if at(peak) <= 0.0 {
                continue;
            }
            peak
        };
        let crossing = if past == 0.0 { 0.0 } else { root(at, 0.0, past) };
        let after = crossing * step.length();
        if first.is_none_or(|first| after < first.after) {
            first = Some(Crossing { node, after, past: past * step.length() });
        }
    }
    first
}

/// Repeats the step until it ends on the event.
fn land(
    method: &mut dyn Method,
    system: &mut Filament,
    start: &Point,
    end: &mut Point,
    end_nodes: &mut [Knot<3>],
    crossing: Crossing,
    location: f64,
) -> Option<()> {
    let Crossing { node, after, past } = crossing;
    let (mut low, mut high, mut length) = (0.0, past, after);
    for landing in 0..60 {
        system.work.landings += 1;
        method.attempt(system, start, length, end).ok()?;
        system.track(end, end_nodes);
        let Knot { value, rate, acceleration } = end_nodes[node];
        let here = excess(system, node, value, rate, end.time, location);
        let resolved = high - low <= 4.0 * f64::EPSILON * (start.time.abs() + high);
        if here.abs() <= location / 2.0 || (resolved && here > 0.0) {
            break;
        }
        if here > 0.0 {
            high = length
        } else {
            low = length
        }
        let back = 1e-4 * length;
        let earlier = add(value, scale(-back, rate));
        let slower = add(rate, scale(-back, acceleration));
        let slope = (here - excess(system, node, earlier, slower, end.time - back, location)) / back;
        let next = length - here / slope;
        let inside = next > low && next < high && landing < 12;
        length = match () {
            () if resolved => high,
            () if inside => next,
            () => (low + high) / 2.0,
        };
    }
    Some(())
}

/// Takes the state at the event from the interpolant of the step, and corrects the time until the nodes of that state are at
/// the event.
fn read_off(
    system: &mut Filament,
    (start, start_nodes): (&Point, &[Knot<3>]),
    whole: &Point,
    (end, end_nodes): (&mut Point, &mut [Knot<3>]),
    crossing: Crossing,
    location: f64,
) {
    let Crossing { node, after, past } = crossing;
    let step = whole.time - start.time;
    let (mut low, mut high, mut length) = (0.0, past, after);
    for landing in 0..8 {
        system.work.landings += 1;
        let s = length / step;
        let knot = |state: &Point, k: usize| Knot {
            value: state.q[k],
            rate: state.v[k],
            acceleration: state.accelerations[k],
        };
        for k in 0..start.q.len() {
            let (a, b) = (knot(start, k), knot(whole, k));
            (end.q[k], end.v[k]) = interpolate(&a, &b, step, s);
            end.accelerations[k] = second_derivative(&a, &b, step, s);
        }
        end.time = start.time + length;
        system.track(end, end_nodes);
        let Knot { value, rate, acceleration } = end_nodes[node];
        let here = excess(system, node, value, rate, end.time, location);
        if here.abs() <= location / 2.0 || landing == 7 {
            break;
        }
        if here > 0.0 {
            high = length
        } else {
            low = length
        }
        let back = 1e-4 * length;
        let earlier = add(value, scale(-back, rate));
        let slower = add(rate, scale(-back, acceleration));
        let slope = (here - excess(system, node, earlier, slower, end.time - back, location)) / back;
        let next = length - here / slope;
        length = if next > low && next < high { next } else { (low + high) / 2.0 };
    }
    let view = StepView { start, end, start_nodes, end_nodes };
    end.integrals[0] = start.integrals[0] + impulse(system, &view);
    let (q, v, a) = (&end.q, &end.v, &end.accelerations);
    let rates = if system.is_in_contact() { system.rates(end.time, q, v, a) } else { [0.0] };
    end.rates = rates;
}

/// Second derivative of the quintic at the fraction `s`.
fn second_derivative(start: &Knot<2>, end: &Knot<2>, step: f64, s: f64) -> [f64; 2] {
    std::array::from_fn(|i| {
        let rise = end.value[i] - start.value[i] - step * start.rate[i] - step * step / 2.0 * start.acceleration[i];
        let slope = step * (end.rate[i] - start.rate[i]) - step * step * start.acceleration[i];
        let bend = step * step * (end.acceleration[i] - start.acceleration[i]);
        let cubic = 10.0 * rise - 4.0 * slope + 0.5 * bend;
        let quartic = 7.0 * slope - 15.0 * rise - bend;
        let quintic = 6.0 * rise - 3.0 * slope + 0.5 * bend;
        start.acceleration[i] + s * (6.0 * cubic + s * (12.0 * quartic + s * 20.0 * quintic)) / (step * step)
    })
}

/// A zero of `f` between `low`, where it is negative, and `high`, where it is positive (Illinois method).
fn root(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let (mut below, mut above) = (f(low), f(high));
    let mut middle = high;
    let mut last_side = 0;
    for _ in 0..60 {
        middle = (low * above - high * below) / (above - below);
        if !(middle > low && middle < high) {
            return if middle.is_finite() { middle.clamp(low, high) } else { high };
        }
        let value = f(middle);
        if value > 0.0 {
            (high, above) = (middle, value);
            if last_side == 1 {
                below /= 2.0;
            }
            last_side = 1;
        } else {
            (low, below) = (middle, value);
            if last_side == -1 {
                above /= 2.0;
            }
            last_side = -1;
        }
        if high - low < 1e-14 {
            break;
        }
    }
    middle
}

/// The point between `low` and `high` at which `f` is largest (golden-section search).
fn maximise(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut left, mut right) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_left, mut at_right) = (f(left), f(right));
    while high - low > 1e-6 {
        if at_left > at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - golden * (high - low);
            at_left = f(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + golden * (high - low);
            at_right = f(right);
        }
    }
    (low + high) / 2.0
}
