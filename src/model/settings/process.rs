//! Settings of the motion of the tool: section `[process]`.

use crate::model::record::Scalar;

/// Motion of the tool over the workpiece.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ProcessSettings {
    /// Brushing velocity `v_b = ω R`, the speed of the undeformed tip, in m/s. A file may give
    /// `rotational_speed_rpm` instead. May be left out if `[study]` sweeps it.
    pub brushing_velocity_m_s: f64,
    /// Penetration depth `a_e` of the undeformed tool into the workpiece, in m. May be left out if
    /// `[study]` sweeps it, or in a bore narrower than the brush, which is then concentric.
    pub penetration_depth_m: f64,
    /// Force `F_n,w` with which the tool is pressed on, in N, in place of the penetration depth,
    /// which is then found; none if the depth is given.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "f64"))]
    pub tool_force_n: Option<f64>,
    /// Gravitational acceleration, in m/s².
    #[cfg_attr(feature = "serde", serde(default))]
    pub gravity_m_s2: [f64; 3],
    /// Angle before nominal entry at which the simulation starts, in rad.
    #[cfg_attr(feature = "serde", serde(default = "default_lead_angle_rad"))]
    pub lead_angle_rad: f64,
    /// Angle past nominal exit at which the simulation ends, in rad.
    #[cfg_attr(feature = "serde", serde(default = "default_tail_angle_rad"))]
    pub tail_angle_rad: f64,
    /// Number of turns of the tool, or "steady": until the impulse no longer changes, at most 50.
    /// The metrics are those of the last turn. A single turn ends at the tail angle, several are
    /// whole. Without it one, or "steady" where filaments touch during the whole turn.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    #[cfg_attr(feature = "schema", schemars(with = "Turns"))]
    pub turns: Option<Turns>,
}

impl ProcessSettings {
    /// The turns of a filament that comes free of the workpiece in each of them.
    #[must_use]
    pub fn turns(&self) -> Turns {
        self.turns.unwrap_or_default()
    }
}

impl ProcessSettings {
    /// This brushing velocity `v_b` in m/s and penetration depth `a_e` in m, without gravity.
    #[must_use]
    pub fn new(brushing_velocity_m_s: f64, penetration_depth_m: f64) -> Self {
        Self {
            brushing_velocity_m_s,
            penetration_depth_m,
            tool_force_n: None,
            gravity_m_s2: [0.0; 3],
            lead_angle_rad: default_lead_angle_rad(),
            tail_angle_rad: default_tail_angle_rad(),
            turns: None,
        }
    }
}

fn default_lead_angle_rad() -> f64 {
    0.005
}

fn default_tail_angle_rad() -> f64 {
    0.15
}

/// The largest number of turns of a pass.
pub const MAX_TURNS: usize = 50;

/// Relative change of the impulse from turn to turn below which turns are steady.
pub const MAX_STEADY_CHANGE: f64 = 1e-3;

/// For how many turns of the tool a filament is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turns {
    /// This number.
    Count(usize),
    /// Until the contact normal impulses of two successive turns differ by less than 0.1 %, but for
    /// at most [`MAX_TURNS`].
    Steady,
}

impl Turns {
    /// The word for [`Turns::Steady`] in files.
    pub const STEADY: &'static str = "steady";

    /// The largest number of turns that this can be.
    #[must_use]
    pub fn at_most(self) -> usize {
        match self {
            Self::Count(count) => count,
            Self::Steady => MAX_TURNS,
        }
    }
}

/// A single pass.
impl Default for Turns {
    fn default() -> Self {
        Self::Count(1)
    }
}

/// The largest number of turns. Numbers of turns are counts.
impl Scalar for Turns {
    const WHOLE: bool = true;

    fn into_f64(self) -> f64 {
        self.at_most() as f64
    }

    fn from_f64(value: f64) -> Self {
        Self::Count(value as usize)
    }
}

/// A number, or the word.
#[cfg(feature = "serde")]
impl serde::Serialize for Turns {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Count(count) => serializer.serialize_u64(*count as u64),
            Self::Steady => serializer.serialize_str(Self::STEADY),
        }
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for Turns {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TurnsVisitor)
    }
}

#[cfg(feature = "serde")]
struct TurnsVisitor;

#[cfg(feature = "serde")]
impl serde::de::Visitor<'_> for TurnsVisitor {
    type Value = Turns;

    fn expecting(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            formatter,
            "a whole number from 1 to {MAX_TURNS} or \"{}\"",
            Turns::STEADY
        )
    }

    fn visit_u64<E: serde::de::Error>(self, count: u64) -> Result<Turns, E> {
        let found = serde::de::Unexpected::Unsigned(count);
        let count = usize::try_from(count)
            .ok()
            .filter(|count| (1..=MAX_TURNS).contains(count));
        count
            .map(Turns::Count)
            .ok_or_else(|| E::invalid_value(found, &self))
    }

    fn visit_i64<E: serde::de::Error>(self, count: i64) -> Result<Turns, E> {
        match u64::try_from(count) {
            Ok(count) => self.visit_u64(count),
            Err(_) => Err(E::invalid_value(
                serde::de::Unexpected::Signed(count),
                &self,
            )),
        }
    }

    fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Turns, E> {
        let is_known = word == Turns::STEADY;
        is_known
            .then_some(Turns::Steady)
            .ok_or_else(|| E::invalid_value(serde::de::Unexpected::Str(word), &self))
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Turns {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Turns".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "anyOf": [{ "type": "integer", "minimum": 1, "maximum": MAX_TURNS }, { "const": Self::STEADY }],
        })
    }
}
