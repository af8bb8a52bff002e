//! What the page calls settings, metrics and statistics, in the symbols of MODEL.

use crate::metrics::Metrics;
use crate::simulation::Statistics;
use crate::uncertainty::ForceScatter;

/// A setting's name for people.
#[derive(Clone, Copy, Debug)]
pub(super) struct SettingLegend {
    pub path: &'static str,
    /// Empty where MODEL has none.
    pub symbol: &'static str,
    pub name: &'static str,
}

const fn legend(path: &'static str, symbol: &'static str, name: &'static str) -> SettingLegend {
    SettingLegend { path, symbol, name }
}

/// All settings in the order of the page.
pub(super) const SETTINGS: [SettingLegend; 34] = [
    legend("tool.kind", "", "kind of tool"),
    legend("tool.body_radius_m", "r_g", "radius of the brush body"),
    legend("tool.width_m", "", "width of the brush"),
    legend("tool.filament_count", "N_f", "number of filaments"),
    legend("tool.filament_count_uncertainty", "ΔN_f", "uncertainty of the number of filaments"),
    legend("filament.segments", "n", "number of segments"),
    legend("filament.length_m", "l_f", "free length"),
    legend("filament.diameter_m", "d", "diameter"),
    legend("filament.density_kg_m3", "ρ", "density"),
    legend("filament.youngs_modulus_pa", "E", "Young’s modulus"),
    legend("filament.damping_ratio", "ζ", "damping ratio of the first bending mode"),
    legend("contact.stiffness_n_m", "k_c", "contact stiffness"),
    legend("contact.exponent", "p", "exponent of the penetration"),
    legend("contact.damping_s_m", "χ", "contact damping"),
    legend("contact.radius_m", "", "contact radius of a node"),
    legend("contact.friction_coefficient", "µ", "coefficient of friction"),
    legend("contact.friction_regularisation_m_s", "v_reg", "sliding speed over which friction sets in"),
    legend("workpiece.kind", "", "kind of workpiece"),
    legend("workpiece.normal", "n⃗", "outward normal"),
    legend("workpiece.feed_velocity_m_s", "v_ft", "feed velocity"),
    legend("process.brushing_velocity_m_s", "v_b", "brushing velocity"),
    legend("process.penetration_depth_m", "a_e", "penetration depth"),
    legend("process.gravity_m_s2", "g⃗", "acceleration of free fall"),
    legend("process.lead_angle_rad", "", "angle simulated before nominal entry"),
    legend("process.tail_angle_rad", "", "angle simulated past nominal exit"),
    legend("solver.relative_tolerance", "", "relative tolerance"),
    legend("solver.samples", "", "samples of a written history"),
    legend("uncertainty.length_std_m", "Δl_f", "standard deviation of the length"),
    legend("uncertainty.diameter_std_m", "Δd", "standard deviation of the diameter"),
    legend("uncertainty.youngs_modulus_std_pa", "ΔE", "standard deviation of Young’s modulus"),
    legend("uncertainty.damping_ratio_std", "Δζ", "standard deviation of the damping ratio"),
    legend("uncertainty.samples", "", "sampled tools a case"),
    legend("uncertainty.seed", "", "seed of the samples"),
    legend("uncertainty.hold", "", "what tools of another radius have in common"),
];

/// Where a setting stands in the page; last if it has no legend.
pub(super) fn place(path: &str) -> usize {
    SETTINGS.iter().position(|setting| setting.path == path).unwrap_or(SETTINGS.len())
}

/// A setting's legend; its path for a name if it has none.
pub(super) fn setting(path: &'static str) -> SettingLegend {
    SETTINGS.get(place(path)).copied().unwrap_or(legend(path, "", path))
}

/// A figure of the page, out of a structure of them.
pub(super) struct Quantity<T> {
    /// Its column in `runs.csv`.
    pub key: &'static str,
    pub symbol: &'static str,
    /// SI unit without prefix, empty for a pure number.
    pub unit: &'static str,
    pub name: &'static str,
    pub meaning: &'static str,
    pub value: fn(&T) -> f64,
}

/// Makes an entry whose key cannot differ from the field that it names.
macro_rules! quantity {
    ($key:ident, $symbol:literal, $unit:literal, $name:literal, $meaning:literal) => {
        Quantity {
            key: stringify!($key),
            symbol: $symbol,
            unit: $unit,
            name: $name,
            meaning: $meaning,
            value: |figures| figures.$key as f64,
        }
    };
}

/// All metrics, the most asked for first.
pub(super) const QUANTITIES: [Quantity<Metrics>; 12] = [
    quantity!(
        contact_time_ratio,
        "ε_tc",
        "",
        "contact time ratio",
        "share of t_d with F_n > 0: near 0 the filament strikes, near 1 it sweeps"
    ),
    quantity!(contact_normal_impulse_n_s, "p_n", "N s", "contact normal impulse", "∫ F_n dt of one filament, one pass"),
    quantity!(
        tool_contact_normal_force_n,
        "F_n,w",
        "N",
        "tool contact normal force",
        "p_n N_f ω/(2π): each filament passes once a turn"
    ),
    quantity!(
        max_tip_deflection_m,
        "s_n,max",
        "m",
        "largest tip deflection",
        "largest distance of the tip from the undeformed filament"
    ),
    quantity!(contact_time_s, "t_c", "s", "contact time", "total time with F_n > 0"),
    quantity!(
        peak_contact_normal_force_n,
        "max F_n",
        "N",
        "peak contact normal force",
        "largest force of all nodes together"
    ),
    quantity!(contact_count, "", "", "number of contacts", "number of intervals with F_n > 0"),
    quantity!(
        equivalent_contact_normal_force_n,
        "F̄_n",
        "N",
        "equivalent contact normal force",
        "p_n/t_c, zero without contact"
    ),
    quantity!(contact_length_m, "l_c", "m", "contact length", "v_b t_c"),
    quantity!(contact_angle_rad, "Ω_c", "rad", "nominal contact angle", "2 arccos((R − a_e)/R) of the undeformed tool"),
    quantity!(nominal_contact_length_m, "l_d", "m", "nominal contact length", "R Ω_c"),
    quantity!(nominal_contact_time_s, "t_d", "s", "nominal contact time", "Ω_c/ω"),
];

/// All figures of the distribution; the Sobol indices in the order of [`INPUTS`](crate::uncertainty::INPUTS).
pub(super) const SCATTER: [Quantity<ForceScatter>; 10] = [
    quantity!(
        tool_force_lower_95_n,
        "",
        "N",
        "lower end of the 95 % band of F_n,w",
        "2.5 % of the sampled tools have less"
    ),
    quantity!(
        tool_force_upper_95_n,
        "",
        "N",
        "upper end of the 95 % band of F_n,w",
        "2.5 % of the sampled tools have more"
    ),
    quantity!(tool_force_mean_n, "", "N", "mean of F_n,w over the tools", "mean of the sampled tools"),
    quantity!(tool_force_std_n, "", "N", "standard deviation of F_n,w", "over the sampled tools"),
    quantity!(sobol_length, "", "", "share of the length", "first-order Sobol index of l_f in the variance of F_n,w"),
    quantity!(sobol_diameter, "", "", "share of the diameter", "first-order Sobol index of d in the variance of F_n,w"),
    quantity!(
        sobol_youngs_modulus,
        "",
        "",
        "share of Young’s modulus",
        "first-order Sobol index of E in the variance of F_n,w"
    ),
    quantity!(
        sobol_damping_ratio,
        "",
        "",
        "share of the damping ratio",
        "first-order Sobol index of ζ in the variance of F_n,w"
    ),
    quantity!(
        sobol_filament_count,
        "",
        "",
        "share of the number of filaments",
        "first-order Sobol index of N_f in the variance of F_n,w"
    ),
    quantity!(failed_samples, "", "", "failed tools", "sampled tools that are left out, as their simulation failed"),
];

/// What the solver has counted.
pub(super) struct Count {
    pub key: &'static str,
    pub name: &'static str,
    pub value: fn(&Statistics) -> usize,
}

macro_rules! count {
    ($key:ident, $name:literal) => {
        Count { key: stringify!($key), name: $name, value: |statistics| statistics.$key }
    };
}

/// The solver's statistics, as in `runs.csv`.
pub(super) const STATISTICS: [Count; 6] = [
    count!(steps, "accepted steps"),
    count!(rejected_steps, "rejected steps"),
    count!(newton_iterations, "Newton iterations"),
    count!(newton_failures, "steps without convergence"),
    count!(factorisations, "factorisations"),
    count!(contact_events, "contact events located"),
];
