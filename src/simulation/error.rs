//! Reasons why a pass cannot be simulated.

use std::error::Error;
use std::fmt;

use super::force::Unreachable;
use crate::integrate::{self, RejectionCause};

/// State at which a step can neither start nor end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// Segment of a spatial motion at a pole of its coordinates.
    Pole {
        /// Number of the segment, counted from 1.
        segment: usize,
    },
    /// Segment of a planar motion that is folded back on the one inside it.
    Fold {
        /// Number of the segment, counted from 1.
        segment: usize,
    },
}

impl fmt::Display for Obstacle {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pole { segment } => write!(
                formatter,
                "segment {segment} is at a pole of its coordinates"
            ),
            Self::Fold { segment } => write!(
                formatter,
                "segment {segment} is folded back on segment {}",
                segment - 1
            ),
        }
    }
}

/// Reason why the integration of a filament cannot continue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IntegrationError {
    /// No step can be taken.
    Step(integrate::StepControlError<Obstacle>),
    /// The pass exceeds the work of any pass, although it may miss the tolerance
    /// ([`StepControl::within`](crate::integrate::StepControl::within)).
    TooManySteps {
        /// Steps taken.
        steps: usize,
        /// Share of the pass that is done, from 0 to 1.
        share: f64,
        /// Step in s.
        step: f64,
    },
    /// A contact's force begins or ends with a jump: its event was missed.
    Jump {
        /// Time in s.
        time: f64,
        /// Normal force in N; negative if it pulls.
        force: f64,
    },
    /// The normal of a workpiece is no unit vector where it is touched.
    Normal {
        /// Time in s.
        time: f64,
        /// Length of the normal.
        length: f64,
    },
    /// The filament touches the workpiece at the start of the pass, and nowhere before is it free
    /// for the lead angle.
    NotFree,
    /// A [`Stop`](super::Stop) was requested.
    Stopped,
}

impl fmt::Display for IntegrationError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        use integrate::StepControlError::{NotFinite, Refused, StepTooSmall};
        match self {
            Self::Step(error @ StepTooSmall { cause, .. }) => {
                let extreme = match cause {
                    RejectionCause::NotFinite => ", for a setting of extreme size, or a joint folded back on itself",
                    _ => "",
                };
                write!(formatter, "{error}{extreme}; try a softer contact, more damping, or another relative tolerance")
            }
            Self::Step(error @ NotFinite { .. }) => {
                write!(formatter, "{error}: a setting of extreme size, or a joint folded back on itself")
            }
            Self::Step(error @ Refused { .. }) => error.fmt(formatter),
            Self::TooManySteps { steps, share, step } => write!(
                formatter,
                "the work of a whole pass was spent on {:.1} % of this one, in {steps} steps of {step:.1e} s at last; try a \
                 filament.damping_ratio above 0, fewer filament.segments, a softer contact, or a larger friction \
                 regularisation",
                100.0 * share
            ),
            Self::Jump { time, force } => write!(
                formatter,
                "the contact was not resolved: at t = {time:.9e} s a force jumps by {:.3e} N; also at a tenth of the \
                 tolerance; try a stiffer contact, or a workpiece without features smaller than a segment",
                force.abs()
            ),
            Self::Normal { time, length } => write!(
                formatter,
                "the normal of the workpiece has the length {length:.6} where it is touched at t = {time:.9e} s; \
                 `Surface` needs a unit vector"
            ),
            Self::NotFree => formatter.write_str(
                "the filament would start inside the workpiece: before it enters, there is no angle of the tool at which it is \
                 free; try a smaller contact radius, a smaller lead angle, or another place of the workpiece or of the tool",
            ),
            Self::Stopped => formatter.write_str("the simulation was asked to stop"),
        }
    }
}

impl Error for IntegrationError {}

impl From<integrate::StepControlError<Obstacle>> for IntegrationError {
    fn from(error: integrate::StepControlError<Obstacle>) -> Self {
        Self::Step(error)
    }
}

/// Reason why a pass could not be simulated.
#[derive(Clone, Debug, PartialEq)]
pub enum SimulationError {
    /// The integration stopped.
    Integration(IntegrationError),
    /// A metric or a sample is infinite or not a number.
    NotFinite,
    /// No depth reaches the required force.
    Force(Unreachable),
    /// Work, energies and losses do not balance.
    Unbalanced {
        /// Residual of the balance, relative to the sum of the terms.
        residual: f64,
        /// Largest relative residual of a pass that counts as resolved.
        limit: f64,
        /// `true` if tool and workpiece are those of the settings.
        is_rotary: bool,
    },
    /// Filaments that are bent by centrifugal forces have no equilibrium to start from.
    NoEquilibrium,
}

impl fmt::Display for SimulationError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integration(error) => error.fmt(formatter),
            Self::Unbalanced {
                residual,
                limit,
                is_rotary,
            } => {
                let remedy = if *is_rotary {
                    "try a softer contact, or more damping"
                } else {
                    "check the derivatives of the tool and the normals of the workpiece first"
                };
                write!(
                    formatter,
                    "the contact was not resolved: work and energies of the pass differ by {residual:.1e} of their sum, more than {limit:.0e}, \
                     also at a tenth of the tolerance; {remedy}"
                )
            }
            Self::NoEquilibrium => formatter.write_str(
                "the turning filament has no equilibrium to start from; try a lower speed, or a stiffer filament",
            ),
            Self::Force(error) => error.fmt(formatter),
            Self::NotFinite => formatter.write_str(
                "the results of the pass are not finite; are the settings of extreme size?",
            ),
        }
    }
}

impl Error for SimulationError {}

impl From<Unreachable> for SimulationError {
    fn from(error: Unreachable) -> Self {
        Self::Force(error)
    }
}

impl From<IntegrationError> for SimulationError {
    fn from(error: IntegrationError) -> Self {
        Self::Integration(error)
    }
}

/// The undeformed tool and the workpiece have no contact that could lie between the start and the
/// end of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoContactArc;

impl fmt::Display for NoContactArc {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(
            "the undeformed tips never touch the workpiece, or never leave it; is it placed where the tool turns?",
        )
    }
}

impl Error for NoContactArc {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_say_what_to_try() {
        use integrate::StepControlError::{NotFinite, Refused, StepTooSmall};
        let too_small = |cause| StepTooSmall {
            time: 1e-3,
            step: 2e-18,
            cause,
        };
        let messages = [
            IntegrationError::Step(too_small(RejectionCause::Newton)),
            IntegrationError::Step(too_small(RejectionCause::NotFinite)),
            IntegrationError::Step(too_small(RejectionCause::Refused(Obstacle::Pole {
                segment: 2,
            }))),
            IntegrationError::Step(NotFinite { time: 1e-3 }),
            IntegrationError::Step(Refused {
                time: 1e-3,
                reason: Obstacle::Fold { segment: 2 },
            }),
            IntegrationError::TooManySteps {
                steps: 30_000,
                share: 0.125,
                step: 2e-9,
            },
        ]
        .map(|error| error.to_string());
        assert_eq!(
            messages,
            [
                "no step is accepted at t = 1.000000000e-3 s, down to 2.000e-18 s: Newton's method does not converge; \
                 try a softer contact, more damping, or another relative tolerance",
                "no step is accepted at t = 1.000000000e-3 s, down to 2.000e-18 s: the equations are not finite, for a \
                 setting of extreme size, or a joint folded back on itself; try a softer contact, more damping, or \
                 another relative tolerance",
                "no step is accepted at t = 1.000000000e-3 s, down to 2.000e-18 s: segment 2 is at a pole of its \
                 coordinates; try a softer contact, more damping, or another relative tolerance",
                "the accelerations at t = 1.000000000e-3 s are not finite: a setting of extreme size, or a joint folded \
                 back on itself",
                "no step can start at t = 1.000000000e-3 s: segment 2 is folded back on segment 1",
                "the work of a whole pass was spent on 12.5 % of this one, in 30000 steps of 2.0e-9 s at last; try a \
                 filament.damping_ratio above 0, fewer filament.segments, a softer contact, or a larger friction \
                 regularisation",
            ]
        );
    }
}
