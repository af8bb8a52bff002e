//! The scalar settings in one table: path, unit and range.
//!
//! The checks of an input file, the sweeps of a study and the JSON schema all read this table, so
//! they cannot disagree. Conditions on vectors and between settings are in [`Settings::check`].

use std::error::Error;
use std::f64::consts::PI;
use std::fmt::{self, Display};
use std::ops::{Bound, RangeBounds};

use crate::model::record::Scalar;
use crate::model::settings::{
    ChamferSettings, EdgeSettings, MAX_TURNS, ProfileSettings, RoundSettings, Settings, Turns,
    WorkpieceKind,
};

/// Largest number of segments of a filament.
pub const MAX_SEGMENTS: usize = 400;

/// Largest number of filaments along a trim.
pub const MAX_POSITIONS: usize = 65;

/// Largest number of columns of a sector.
pub const MAX_COLUMNS: usize = 100_000;
/// Largest number of rows of a brush.
pub const MAX_ROWS: usize = 10_000;

/// Smallest number of sampled tools of a case: a few per coefficient of the sensitivity indices.
pub const MIN_SAMPLES: usize = 64;
/// Largest number of sampled tools of a case: the length of the sequence of samples.
pub const MAX_SAMPLES: usize = 1 << 16;

/// Scalar setting of an input file, which a study can sweep.
#[derive(Debug)]
pub struct Parameter {
    /// Dotted path in the input file: section and key.
    pub path: &'static str,
    /// Unit; empty for a dimensionless number.
    pub unit: &'static str,
    /// MODEL's symbol, with an underscore before a subscript; empty where MODEL has none.
    pub symbol: &'static str,
    /// Name in words.
    pub name: &'static str,
    /// Allowed values.
    pub range: Range,
    /// Word that may replace a number; empty if none.
    pub word: &'static str,
    /// `true` if the setting has no default.
    pub required: bool,
    /// Path of the setting to which this one converts, with other settings of the tool; empty if
    /// none. A file gives one of the two, and the other follows.
    pub instead_of: &'static str,
    /// Other names under which people look for the setting.
    pub also: &'static [&'static str],
    /// Default in words, where it is no fixed number; otherwise empty.
    pub default: &'static str,
    /// Source of the default; empty if nothing needs to be said.
    pub source: &'static str,
    /// `true` if the default is a property of some brush, filament or pair of materials that
    /// decides the force.
    pub decides_force: bool,
    /// Values of usual brushes, if values outside are likely a slip.
    pub usual: Option<Usual>,
    read: fn(&Settings) -> Option<f64>,
    absent: fn() -> f64,
    set: fn(&mut Settings, f64),
}

impl Parameter {
    /// Finds a setting by its dotted path.
    #[must_use]
    pub fn find(path: &str) -> Option<&'static Self> {
        PARAMETERS.iter().find(|parameter| parameter.path == path)
    }

    /// Returns the settings of which a file gives exactly one, or at most one: this one and its
    /// alternatives.
    pub fn group(&self) -> impl Iterator<Item = &'static Self> {
        let path = if self.instead_of.is_empty() {
            self.path
        } else {
            self.instead_of
        };
        PARAMETERS
            .iter()
            .filter(move |parameter| parameter.path == path || parameter.instead_of == path)
    }

    /// Returns the section of the input file that contains the setting.
    #[must_use]
    pub fn section(&self) -> &'static str {
        self.path.split_once('.').map_or("", |(section, _)| section)
    }

    /// Returns the setting's key within its section.
    #[must_use]
    pub fn key(&self) -> &'static str {
        self.path.split_once('.').map_or(self.path, |(_, key)| key)
    }

    /// Reads the setting; `None` if workpieces of the stated kind do not have it.
    #[must_use]
    pub fn read(&self, settings: &Settings) -> Option<f64> {
        (self.read)(settings)
    }

    /// Reads the setting, with the default instead of `None`.
    #[must_use]
    pub fn get(&self, settings: &Settings) -> f64 {
        self.read(settings).unwrap_or_else(self.absent)
    }

    /// Changes the setting, if the settings have it, without checks. A count takes the integer part
    /// of the value.
    pub fn set(&self, settings: &mut Settings, value: f64) {
        (self.set)(settings, value);
    }

    /// Formats a value with the fewest digits that read back the same, without a fraction if the
    /// setting is a count.
    #[must_use]
    pub fn format(&self, value: f64) -> String {
        match value {
            _ if self.range.whole && value.fract() == 0.0 => format!("{value}"),
            _ if value.abs() >= MIN_SCIENTIFIC => format!("{value:e}"),
            _ => format!("{value:?}"),
        }
    }

    /// Returns the allowed values, in words and with their unit.
    #[must_use]
    pub fn allowed(&self) -> String {
        let numbers = self.numbers();
        if self.word.is_empty() {
            numbers
        } else {
            format!("{numbers} or \"{}\"", self.word)
        }
    }

    /// Returns the unit after a comma, as in ", in m"; nothing if there is none.
    #[must_use]
    pub fn in_unit(&self) -> String {
        if self.unit.is_empty() {
            String::new()
        } else {
            format!(", in {}", self.unit)
        }
    }

    /// Returns the allowed numbers, in words and with their unit.
    fn numbers(&self) -> String {
        format!("{}{}", self.range, self.in_unit())
    }

    /// Checks that the settings have this setting, unless the value is the default.
    ///
    /// # Errors
    /// If workpieces of the stated kind do not have it.
    pub fn check_presence(&self, settings: &Settings, value: f64) -> Result<(), Violation> {
        let absent = || {
            let allowed = left_out(settings.workpiece.kind.name());
            Violation {
                path: self.path,
                value: self.format(value),
                allowed,
            }
        };
        if self.read(settings).is_some() || value == (self.absent)() {
            Ok(())
        } else {
            Err(absent())
        }
    }

    /// Checks one value of the setting on its own.
    pub fn check(&self, value: f64) -> Result<(), Violation> {
        if self.range.contains(value) {
            Ok(())
        } else {
            Err(Violation {
                path: self.path,
                value: self.format(value),
                allowed: self.numbers(),
            })
        }
    }

    const fn required(mut self) -> Self {
        self.required = true;
        self
    }

    const fn changed_by(mut self, set: fn(&mut Settings, f64)) -> Self {
        self.set = set;
        self
    }

    const fn or(mut self, word: &'static str) -> Self {
        self.word = word;
        self
    }

    const fn also(mut self, names: &'static [&'static str]) -> Self {
        self.also = names;
        self
    }

    const fn default_is(mut self, words: &'static str) -> Self {
        self.default = words;
        self
    }

    const fn source(mut self, source: &'static str) -> Self {
        self.source = source;
        self
    }

    const fn decides_force(mut self) -> Self {
        self.decides_force = true;
        self
    }

    const fn or_default(mut self, absent: fn() -> f64) -> Self {
        self.absent = absent;
        self
    }

    const fn usually(mut self, least: f64, largest: f64, slip: &'static str) -> Self {
        self.usual = Some(Usual {
            least,
            largest,
            slip,
        });
        self
    }

    const fn instead_of(mut self, path: &'static str) -> Self {
        self.instead_of = path;
        self
    }
}

/// Returns the allowed state of a setting that workpieces of a kind do not have.
#[must_use]
pub fn left_out(kind: &str) -> String {
    format!("left out: a workpiece of kind `{kind}` has none")
}

/// Usual values of a setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Usual {
    /// Smallest usual value.
    pub least: f64,
    /// Largest usual value.
    pub largest: f64,
    /// Slip that most likely leads to another value, such as "millimetres typed as metres".
    pub slip: &'static str,
}

/// Finite numbers between two bounds, or only the whole numbers among them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// `true` if the range contains only whole numbers.
    pub whole: bool,
    /// Lower bound.
    pub lower: Bound<f64>,
    /// Upper bound.
    pub upper: Bound<f64>,
}

impl Range {
    const POSITIVE: Self = Self::real(Bound::Excluded(0.0), Bound::Unbounded);
    const NOT_NEGATIVE: Self = Self::at_least(0.0);
    const ANGLE: Self = Self::real(Bound::Included(0.0), Bound::Excluded(std::f64::consts::TAU));

    const fn real(lower: Bound<f64>, upper: Bound<f64>) -> Self {
        Self {
            whole: false,
            lower,
            upper,
        }
    }

    const fn at_least(lower: f64) -> Self {
        Self::real(Bound::Included(lower), Bound::Unbounded)
    }

    const fn between(lower: f64, upper: f64) -> Self {
        Self::real(Bound::Included(lower), Bound::Included(upper))
    }

    const fn whole(lower: f64, upper: f64) -> Self {
        Self {
            whole: true,
            ..Self::between(lower, upper)
        }
    }

    /// Returns the value of the range that is nearest to a number; the number itself next to an
    /// excluded bound.
    #[must_use]
    pub fn nearest(&self, value: f64) -> f64 {
        let least = if let Bound::Included(lower) = self.lower {
            lower
        } else {
            f64::NEG_INFINITY
        };
        let largest = if let Bound::Included(upper) = self.upper {
            upper
        } else {
            f64::INFINITY
        };
        value.clamp(least, largest)
    }

    /// Returns `true` if the value is finite, within the bounds, and whole if it must be.
    #[must_use]
    pub fn contains(&self, value: f64) -> bool {
        value.is_finite()
            && (self.lower, self.upper).contains(&value)
            && (!self.whole || value.fract() == 0.0)
    }
}

impl Display for Range {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(if self.whole {
            "a whole number"
        } else {
            "a finite number"
        })?;
        if let (Bound::Included(lower), Bound::Included(upper)) = (self.lower, self.upper) {
            return write!(formatter, " from {} to {}", plain(lower), plain(upper));
        }
        let lower = bound_in_words(self.lower, "of at least", "greater than");
        let upper = bound_in_words(self.upper, "of at most", "less than");
        let bounds: Vec<String> = lower.into_iter().chain(upper).collect();
        if !bounds.is_empty() {
            write!(formatter, " {}", bounds.join(" and "))?;
        }
        Ok(())
    }
}

fn bound_in_words(bound: Bound<f64>, included: &str, excluded: &str) -> Option<String> {
    match bound {
        Bound::Included(number) => Some(format!("{included} {}", plain(number))),
        Bound::Excluded(number) => Some(format!("{excluded} {}", plain(number))),
        Bound::Unbounded => None,
    }
}

/// Smallest number that is shown as a power of ten.
const MIN_SCIENTIFIC: f64 = 1e7;

/// Formats a number without a trailing `.0`, or as π; a large one as a power of ten if that is much
/// shorter.
fn plain(number: f64) -> String {
    if number.abs() == PI {
        return if number < 0.0 { "-π" } else { "π" }.to_owned();
    }
    let (text, scientific) = (format!("{number:?}"), format!("{number:e}"));
    if number.abs() >= MIN_SCIENTIFIC && scientific.len() + 4 < text.len() {
        return scientific;
    }
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

/// Setting outside its range.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Violation {
    /// Dotted path of the setting.
    pub path: &'static str,
    /// Value found.
    pub value: String,
    /// Allowed values, in words.
    pub allowed: String,
}

impl Violation {
    /// Creates the violation of the setting at `path`, which has this `value`.
    pub(crate) fn of(
        path: &'static str,
        value: impl fmt::Debug,
        allowed: impl Into<String>,
    ) -> Self {
        Self {
            path,
            value: format!("{value:?}"),
            allowed: allowed.into(),
        }
    }
}

impl Display for Violation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            path,
            value,
            allowed,
        } = self;
        write!(formatter, "`{path}` is {value}, but must be {allowed}")
    }
}

impl Error for Violation {}

/// Makes a table entry whose path always matches its field.
macro_rules! entry {
    ($section:ident . $key:ident, $unit:literal, $range:expr, $symbol:literal, $name:literal, $get:expr, $set:expr) => {
        Parameter {
            path: concat!(stringify!($section), ".", stringify!($key)),
            unit: $unit,
            symbol: $symbol,
            name: $name,
            range: $range,
            word: "",
            required: false,
            instead_of: "",
            also: &[],
            default: "",
            source: "",
            decides_force: false,
            usual: None,
            read: $get,
            absent: || 0.0,
            set: $set,
        }
    };
}

/// Makes the entry of a setting in a section that every file has.
macro_rules! parameter {
    ($section:ident . $key:ident, $unit:literal, $range:expr, $symbol:literal, $name:literal) => {
        entry!(
            $section.$key,
            $unit,
            $range,
            $symbol,
            $name,
            |settings| Some(Scalar::into_f64(settings.$section.$key)),
            |settings, value| settings.$section.$key = Scalar::from_f64(value)
        )
    };
    // A setting whose default comes from a method of the same name.
    ($section:ident . $key:ident(), $unit:literal, $range:expr, $symbol:literal, $name:literal) => {
        entry!(
            $section.$key,
            $unit,
            $range,
            $symbol,
            $name,
            |settings| Some(Scalar::into_f64(settings.$section.$key())),
            |settings, value| settings.$section.$key = Some(Scalar::from_f64(value))
        )
    };
    // Another way to state a setting: read by a method of the same name, written by a method that
    // changes that setting.
    ($section:ident . $key:ident => $change:ident, $unit:literal, $range:expr, $symbol:literal, $name:literal) => {
        entry!(
            $section.$key,
            $unit,
            $range,
            $symbol,
            $name,
            |settings| Some(settings.$key()),
            Settings::$change
        )
    };
}

/// Makes an entry of `[brush]`, a section that a file may leave out: settings without it have its
/// default. Changing one adds the section. A count that the brush chooses if it is not stated
/// (`auto`) reads as one, its least value.
macro_rules! brush_parameter {
    (auto $key:ident, $range:expr, $symbol:literal, $name:literal) => {
        entry!(
            brush.$key,
            "",
            $range,
            $symbol,
            $name,
            |settings| Some(Scalar::into_f64(
                settings.brush_or_default().$key.unwrap_or(1)
            )),
            |settings, value| settings.brush.get_or_insert_default().$key =
                Some(Scalar::from_f64(value))
        )
        .default_is("chosen by the program")
    };
    ($key:ident, $unit:literal, $range:expr, $symbol:literal, $name:literal) => {
        entry!(
            brush.$key,
            $unit,
            $range,
            $symbol,
            $name,
            |settings| Some(Scalar::into_f64(settings.brush_or_default().$key)),
            |settings, value| settings.brush.get_or_insert_default().$key = Scalar::from_f64(value)
        )
    };
}

/// Makes an entry of `[workpiece]` that only some kinds of workpiece have. Its default comes from
/// the settings of one of them.
macro_rules! workpiece_parameter {
    ($settings:ident . $key:ident of $($kind:ident)|+, $unit:literal, $range:expr, $name:literal) => {
        entry!(
            workpiece.$key,
            $unit,
            $range,
            "",
            $name,
            |settings| match &settings.workpiece.kind {
                $(WorkpieceKind::$kind(own) => Some(Scalar::into_f64(own.$key)),)+
                _ => None,
            },
            |settings, value| match &mut settings.workpiece.kind {
                $(WorkpieceKind::$kind(own) => own.$key = Scalar::from_f64(value),)+
                _ => {}
            }
        )
        .or_default(|| Scalar::into_f64($settings::default().$key))
    };
}

/// Makes an entry of `[removal]` without a default. Where it is not stated, it reads as a `typical`
/// value without meaning.
macro_rules! removal_parameter {
    ($key:ident, $unit:literal, $typical:literal, $symbol:literal, $name:literal) => {
        entry!(
            removal.$key,
            $unit,
            Range::POSITIVE,
            $symbol,
            $name,
            |settings| Some(settings.removal_or_default().$key.unwrap_or($typical)),
            |settings, value| settings.removal.get_or_insert_default().$key = Some(value)
        )
    };
}

/// Scalar settings, in the order of [`Settings`].
pub static PARAMETERS: &[Parameter] = &[
    parameter!(tool.body_radius_m, "m", Range::between(1e-6, 1e3), "r_g", "radius of the brush body")
        .required()
        .also(&["radius", "core_radius", "hub_radius", "rg"])
        .usually(2e-3, 1.0, "millimetres typed as metres, or the diameter instead of the radius"),
    parameter!(tool.width_m, "m", Range::POSITIVE, "", "width of the trim")
        .required()
        .also(&["width", "breadth"])
        .usually(5e-4, 3.0, "millimetres typed as metres"),
    parameter!(tool.filament_angle_rad(), "rad", Range::between(0.0, PI), "γ", "angle of the filaments to the axis")
        .also(&["filament_angle", "cone_angle", "trim_angle", "gamma"])
        .default_is("that of `tool.kind`: π/2 of a round brush, 0 of a cup"),
    parameter!(tool.tilt_rad(), "rad", Range::between(-PI, PI), "τ", "tilt of the tool’s axis about x")
        .also(&["tilt", "tilt_angle", "inclination", "lean"])
        .default_is("that of `tool.kind`: 0 of a round brush, π/2 of a cup, π/2 − γ of a cone"),
    parameter!(tool.skew_rad, "rad", Range::between(-PI, PI), "σ", "skew of the tool’s axis about y")
        .also(&["skew", "skew_angle", "yaw"]),
    parameter!(tool.positions(), "", Range::whole(1.0, MAX_POSITIONS as f64), "", "filaments along a trim on which they differ")
    .default_is("5, or 33 where part of the trim lifts off the workpiece"),
    parameter!(tool.filament_count, "", Range::NOT_NEGATIVE, "N_f", "number of filaments")
        .required()
        .also(&["count", "filaments", "number_of_filaments", "bristles", "nf"])
        .usually(50.0, 1e6, "a point or comma between thousands, a count of another tool, or filaments per area in the place of their number"),
    parameter!(
        tool.filaments_per_m2 => set_filaments_per_m2,
        "1/m²",
        Range::POSITIVE,
        "",
        "filaments per area of the body’s surface"
    )
    .instead_of("tool.filament_count")
    .also(&["density_per_m2", "packing", "packing_density", "filament_density"]),
    parameter!(
        tool.fill_factor => set_fill_factor,
        "",
        Range::real(Bound::Excluded(0.0), Bound::Included(1.0)),
        "",
        "share of the body’s surface that filaments cover"
    )
    .instead_of("tool.filament_count")
    .also(&["fill", "filling", "coverage", "packing_factor", "fill_ratio"]),
    parameter!(
        tool.filament_count_uncertainty,
        "",
        Range::NOT_NEGATIVE,
        "ΔN_f",
        "uncertainty of the number of filaments"
    )
    .source("a number that is stated is taken as exact"),
    parameter!(filament.segments, "", Range::whole(1.0, MAX_SEGMENTS as f64), "n", "number of segments")
        .also(&["segment_count", "elements"])
        .usually(4.0, 200.0, "fewer segments do not bend like a filament, and more only take longer")
        .source("Uhlmann and Hoyer (2021)"),
    parameter!(filament.length_m, "m", Range::real(Bound::Excluded(0.0), Bound::Included(100.0)), "l_f", "free length")
        .required()
        .also(&["length", "free_length", "filament_length", "trim_length", "lf"])
        .usually(2e-3, 0.5, "millimetres typed as metres"),
    parameter!(filament.diameter_m, "m", Range::POSITIVE, "d", "diameter")
        .required()
        .also(&["diameter", "thickness", "filament_diameter"])
        .usually(2e-5, 5e-3, "millimetres or micrometres typed as metres, or the radius of the tool"),
    parameter!(filament.tip_diameter_m(), "m", Range::POSITIVE, "", "diameter at the tip").default_is("diameter_m"),
    parameter!(filament.waviness_amplitude_m, "m", Range::between(-100.0, 100.0), "A", "amplitude of the waviness")
        .usually(-5e-3, 5e-3, "millimetres typed as metres"),
    parameter!(filament.waviness_length_m(), "m", Range::POSITIVE, "λ", "length of a wave").default_is("length_m"),
    parameter!(filament.waviness_phase_rad, "rad", Range::between(-1e3, 1e3), "ψ", "phase of the waviness at the root"),
    parameter!(filament.density_kg_m3, "kg/m³", Range::between(0.1, 1e6), "ρ", "density")
        .also(&["density", "rho"])
        .usually(500.0, 2e4, "g/cm³ typed as kg/m³")
        .source("Uhlmann and Hoyer (2021)")
        .decides_force(),
    parameter!(filament.youngs_modulus_pa, "Pa", Range::between(1e3, 1e14), "E", "Young’s modulus")
        .also(&["modulus", "e_modulus", "elastic_modulus", "young", "youngs_modulus", "stiffness_pa"])
        .usually(1e7, 1e12, "GPa or MPa typed as Pa")
        .source("chosen: unfilled PA 6.12 filament is sold with 3.3 GPa, dry. Water about halves it: state yours, or filament.material")
        .decides_force(),
    parameter!(filament.damping_ratio, "", Range::between(0.0, 1e3), "ζ", "damping ratio of the first bending mode")
        .also(&["damping", "zeta"])
        .usually(1e-4, 0.5, "per cent typed as a ratio")
        .source("chosen")
        .decides_force(),
    parameter!(filament.lateral_tilt_rad, "rad", Range::between(-1.0, 1.0), "τ", "tilt of the clamp towards +z")
        .usually(-0.2, 0.2, "degrees typed as radians"),
    parameter!(contact.stiffness_n_m, "N/m^p", Range::POSITIVE, "k_c", "contact stiffness")
        .also(&["stiffness", "contact_stiffness", "kc"])
        .usually(1e3, 1e8, "N/mm typed as N/m")
        .source("chosen")
        .decides_force(),
    parameter!(contact.exponent, "", Range::between(1.0, 10.0), "p", "exponent of the penetration").usually(
        1.0,
        3.0,
        "another law of contact",
    ),
    parameter!(contact.damping_s_m, "s/m", Range::NOT_NEGATIVE, "χ", "contact damping"),
    parameter!(contact.radius_m, "m", Range::NOT_NEGATIVE, "", "contact radius of a node"),
    parameter!(contact.friction_coefficient, "", Range::between(0.0, 100.0), "µ", "coefficient of friction")
        .also(&["mu", "friction", "friction_coeff"])
        .usually(0.0, 1.5, "per cent typed as a ratio")
        .source("chosen: without friction the force is an upper bound")
        .decides_force(),
    parameter!(
        contact.friction_regularisation_m_s,
        "m/s",
        Range::between(1e-9, 1e4),
        "v_reg",
        "sliding speed over which friction sets in"
    ),
    parameter!(workpiece.feed_velocity_m_s, "m/s", Range::between(-1e4, 1e4), "v_ft", "feed velocity")
        .also(&["feed", "feed_rate", "feed_speed", "table_feed"])
        .usually(-5.0, 5.0, "mm/s or m/min typed as m/s"),
    workpiece_parameter!(
        EdgeSettings.offset_m of Edge | Chamfer | Cylinder | Bore | Profile,
        "m",
        Range::between(-1e3, 1e3),
        "offset of the workpiece along x"
    ),
    workpiece_parameter!(
        EdgeSettings.included_angle_rad of Edge | Chamfer,
        "rad",
        Range::between(0.1, 3.1),
        "angle between the faces of an edge"
    ),
    workpiece_parameter!(EdgeSettings.edge_radius_m of Edge | Chamfer, "m", Range::between(0.0, 1e3), "radius of the edges")
        .usually(0.0, 0.1, "millimetres typed as metres"),
    workpiece_parameter!(ChamferSettings.chamfer_width_m of Chamfer, "m", Range::between(0.0, 1e3), "width of the chamfer")
        .usually(0.0, 0.1, "millimetres typed as metres"),
    workpiece_parameter!(ChamferSettings.chamfer_angle_rad of Chamfer, "rad", Range::between(0.05, 3.0), "angle of the chamfer"),
    workpiece_parameter!(RoundSettings.radius_m of Cylinder | Bore, "m", Range::between(0.0, 1e3), "radius of the cylinder or bore")
        .usually(0.0, 10.0, "millimetres typed as metres"),
    workpiece_parameter!(ProfileSettings.degree of Profile, "", Range::whole(1.0, 10.0), "degree of the profile"),
    parameter!(process.brushing_velocity_m_s, "m/s", Range::between(1e-3, 1e4), "v_b", "brushing velocity")
        .required()
        .also(&["velocity", "tip_speed", "cutting_speed", "vb"])
        .usually(0.1, 150.0, "m/min or mm/s typed as m/s, or a rotational speed"),
    parameter!(
        process.rotational_speed_rpm => set_rotational_speed_rpm,
        "rpm",
        Range::between(1e-3, 1e7),
        "n_w",
        "rotational speed"
    )
    .instead_of("process.brushing_velocity_m_s")
    .also(&["rpm", "speed", "n", "spindle_speed", "rotation_speed", "revolutions", "omega"])
    .usually(5.0, 1e5, "revolutions per second, or m/s typed as rpm"),
    parameter!(process.penetration_depth_m, "m", Range::POSITIVE, "a_e", "penetration depth")
        .required()
        .changed_by(|settings, depth| *settings = settings.at_depth(depth))
        .also(&["depth", "penetration", "infeed", "engagement", "ae", "depth_of_cut"])
        .usually(1e-6, 0.05, "millimetres typed as metres, or micrometres typed as millimetres"),
    parameter!(
        process.tool_force_n => set_tool_force_n,
        "N",
        Range::POSITIVE,
        "",
        "force with which the tool is pressed on, in place of the depth"
    )
    .instead_of("process.penetration_depth_m")
    .also(&["force", "tool_force", "normal_force", "pressing_force", "load"]),
    parameter!(process.lead_angle_rad, "rad", Range::ANGLE, "", "angle simulated before nominal entry"),
    parameter!(process.tail_angle_rad, "rad", Range::ANGLE, "", "angle simulated past nominal exit"),
    parameter!(process.turns(), "", Range::whole(1.0, MAX_TURNS as f64), "", "turns of the tool")
        .or(Turns::STEADY)
        .default_is("1, or \"steady\" where filaments touch during the whole turn"),
    parameter!(solver.relative_tolerance, "", Range::between(1e-10, 1e-2), "", "relative tolerance")
        .also(&["tolerance", "rtol"])
        .usually(1e-10, 1e-3, "a tolerance in per cent"),
    parameter!(solver.samples, "", Range::whole(2.0, 1e6), "", "samples of a written history"),
    parameter!(uncertainty.length_std_m, "m", Range::NOT_NEGATIVE, "Δl_f", "standard deviation of the length"),
    parameter!(uncertainty.diameter_std_m, "m", Range::NOT_NEGATIVE, "Δd", "standard deviation of the diameter"),
    parameter!(
        uncertainty.youngs_modulus_std_pa,
        "Pa",
        Range::NOT_NEGATIVE,
        "ΔE",
        "standard deviation of Young’s modulus"
    ),
    parameter!(uncertainty.damping_ratio_std, "", Range::NOT_NEGATIVE, "Δζ", "standard deviation of the damping ratio"),
    parameter!(
        uncertainty.waviness_amplitude_std_m,
        "m",
        Range::NOT_NEGATIVE,
        "ΔA",
        "standard deviation of the waviness"
    ),
    parameter!(
        uncertainty.waviness_phase_std_rad,
        "rad",
        Range::NOT_NEGATIVE,
        "Δψ",
        "standard deviation of the phase of the waviness"
    ),
    parameter!(
        uncertainty.friction_coefficient_std,
        "",
        Range::NOT_NEGATIVE,
        "Δµ",
        "standard deviation of the coefficient of friction"
    ),
    parameter!(
        uncertainty.samples,
        "",
        Range::whole(MIN_SAMPLES as f64, MAX_SAMPLES as f64),
        "",
        "sampled tools per case"
    ),
    parameter!(uncertainty.seed, "", Range::whole(0.0, u32::MAX as f64), "", "seed of the samples"),
    brush_parameter!(auto columns, Range::whole(1.0, MAX_COLUMNS as f64), "", "columns of filaments"),
    brush_parameter!(auto rows, Range::whole(1.0, MAX_ROWS as f64), "", "rows of filaments"),
    brush_parameter!(stiffness_n_m2, "N/m²", Range::between(1.0, 1e15), "k_l", "contact stiffness between filaments"),
    brush_parameter!(auto contact_points, Range::whole(1.0, 1000.0), "N_q", "contact points per segment"),
    brush_parameter!(damping_s_m, "s/m", Range::between(0.0, 1e6), "", "contact damping between filaments"),
    brush_parameter!(
        friction_coefficient,
        "",
        Range::between(0.0, 100.0),
        "",
        "coefficient of friction between filaments"
    ),
    brush_parameter!(
        lateral_tilt_std_rad,
        "rad",
        Range::between(0.0, 1.0),
        "",
        "standard deviation of the clamps’ tilts"
    ),
    brush_parameter!(root_std_m, "m", Range::between(0.0, 1.0), "", "standard deviation of the roots’ shifts"),
    brush_parameter!(seed, "", Range::whole(0.0, u32::MAX as f64), "", "seed of the brush"),
    brush_parameter!(tolerance, "", Range::between(1e-6, 0.1), "", "tolerance of the mean impulse"),
    removal_parameter!(preston_m2_n, "m²/N", 1e-14, "k_P", "Preston coefficient of the workpiece")
        .also(&["preston", "preston_coefficient", "kp", "removal_coefficient"])
        .default_is("not known")
        .usually(1e-18, 1e-9, "mm³/(N m) typed as m²/N, which are 1e-9 of it"),
    removal_parameter!(filament_wear_m2_n, "m²/N", 1e-14, "k_w", "wear coefficient of the filaments")
        .also(&["wear", "wear_coefficient", "archard", "kw"])
        .default_is("not known: filaments do not wear")
        .usually(1e-18, 1e-9, "mm³/(N m) typed as m²/N, which are 1e-9 of it"),
    entry!(
        removal.force_loss,
        "",
        Range::real(Bound::Excluded(0.0), Bound::Excluded(1.0)),
        "",
        "part of the force that a worn brush may lose",
        |settings| Some(settings.removal_or_default().force_loss),
        |settings, value| settings.removal.get_or_insert_default().force_loss = value
    ),
    removal_parameter!(edge_feed_velocity_m_s, "m/s", 1e-2, "", "velocity of the feed along the edge").default_is("not fed"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_contain_finite_numbers_only() {
        let finite = Range::real(Bound::Unbounded, Bound::Unbounded);
        for range in [finite, Range::POSITIVE, Range::whole(1.0, 400.0)] {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert!(!range.contains(value), "{range} contains {value}");
            }
        }
    }

    #[test]
    fn ranges_keep_their_bounds() {
        assert!(!Range::POSITIVE.contains(0.0));
        assert!(Range::NOT_NEGATIVE.contains(0.0));
        assert!(Range::whole(1.0, 400.0).contains(400.0));
        assert!(!Range::whole(1.0, 400.0).contains(1.5));
    }

    #[test]
    fn ranges_read_as_sentences() {
        assert_eq!(
            Range::POSITIVE.to_string(),
            "a finite number greater than 0"
        );
        assert_eq!(
            Range::at_least(1.0).to_string(),
            "a finite number of at least 1"
        );
        assert_eq!(
            Range::whole(1.0, 400.0).to_string(),
            "a whole number from 1 to 400"
        );
        assert_eq!(
            Range::between(1e-10, 1e-2).to_string(),
            "a finite number from 1e-10 to 0.01"
        );
        assert_eq!(
            Range::between(-PI, PI).to_string(),
            "a finite number from -π to π"
        );
    }
}
