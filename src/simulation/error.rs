//! Why a pass cannot be simulated.

use std::error::Error;
use std::fmt;

use crate::integrate::{self, RejectionCause};

/// A segment at a pole of its coordinates, where a step can neither start nor end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AtPole {
    /// Number of the segment, counted from 1.
    pub segment: usize,
}

impl fmt::Display for AtPole {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "segment {} meets a pole of its coordinates", self.segment)
    }
}

/// Why the integration of a filament cannot continue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IntegrationError {
    /// No step can be taken.
    Step(integrate::IntegrationError<AtPole>),
    /// The pass takes more steps than any sensible case.
    TooManySteps {
        /// Steps taken.
        steps: usize,
        /// Time in s.
        time: f64,
        /// Step in s.
        step: f64,
    },
}

impl fmt::Display for IntegrationError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        use integrate::IntegrationError::{NotFinite, Refused, StepTooSmall};
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
            Self::Step(Refused { time, reason: AtPole { segment } }) => write!(
                formatter,
                "segment {segment} stands at a pole of its coordinates at t = {time:.9e} s, where its azimuth has no \
                 meaning"
            ),
            Self::TooManySteps { steps, time, step } => write!(
                formatter,
                "{steps} steps reached only t = {time:.9e} s, with steps of {step:.3e} s at last; try more damping, a \
                 larger friction regularisation, or a looser relative tolerance"
            ),
        }
    }
}

impl Error for IntegrationError {}

impl From<integrate::IntegrationError<AtPole>> for IntegrationError {
    fn from(error: integrate::IntegrationError<AtPole>) -> Self {
        Self::Step(error)
    }
}

/// Why a pass could not be simulated.
#[derive(Clone, Debug, PartialEq)]
pub enum SimulationError {
    /// The integration stopped.
    Integration(IntegrationError),
    /// A metric or a sample is infinite or not a number.
    NotFinite,
}

impl fmt::Display for SimulationError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integration(error) => error.fmt(formatter),
            Self::NotFinite => {
                formatter.write_str("the results of the pass are not finite; are the settings of extreme size?")
            }
        }
    }
}

impl Error for SimulationError {}

impl From<IntegrationError> for SimulationError {
    fn from(error: IntegrationError) -> Self {
        Self::Integration(error)
    }
}

/// The undeformed tool and the workpiece have no contact that could lie between the start and the end of a pass.
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
        use integrate::IntegrationError::{NotFinite, Refused, StepTooSmall};
        let too_small = |cause| StepTooSmall { time: 1e-3, step: 2e-18, cause };
        let messages = [
            IntegrationError::Step(too_small(RejectionCause::Newton)),
            IntegrationError::Step(too_small(RejectionCause::NotFinite)),
            IntegrationError::Step(too_small(RejectionCause::Refused(AtPole { segment: 2 }))),
            IntegrationError::Step(NotFinite { time: 1e-3 }),
            IntegrationError::Step(Refused { time: 1e-3, reason: AtPole { segment: 2 } }),
            IntegrationError::TooManySteps { steps: 300_000, time: 1e-3, step: 2e-9 },
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
                "no step is accepted at t = 1.000000000e-3 s, down to 2.000e-18 s: segment 2 meets a pole of its \
                 coordinates; try a softer contact, more damping, or another relative tolerance",
                "the accelerations at t = 1.000000000e-3 s are not finite: a setting of extreme size, or a joint folded \
                 back on itself",
                "segment 2 stands at a pole of its coordinates at t = 1.000000000e-3 s, where its azimuth has no meaning",
                "300000 steps reached only t = 1.000000000e-3 s, with steps of 2.000e-9 s at last; try more damping, a \
                 larger friction regularisation, or a looser relative tolerance",
            ]
        );
    }
}
