//! Table of the scalar settings.

use std::f64::consts::PI;
use std::ops::Bound;

use super::{
    MAX_COLUMNS, MAX_POSITIONS, MAX_ROWS, MAX_SAMPLES, MAX_SEGMENTS, MIN_SAMPLES, Parameter, Range,
};
use crate::model::record::Scalar;
use crate::model::settings::{
    ChamferSettings, EdgeSettings, MAX_TURNS, ProfileSettings, RoundSettings, Settings, Turns,
    WorkpieceKind,
};

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
