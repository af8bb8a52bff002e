//! Exact solutions from formulas. Nothing here depends on the solver.

pub mod beam;
pub mod elastica;
pub mod held;
pub mod impact;
pub mod pendulum;
pub mod pressed;
pub mod rotating_beam;
pub mod taper;

/// Lists checks with their names.
macro_rules! checks {
    ($($module:ident::$check:ident,)*) => {
        &[$((concat!(stringify!($module), "::", stringify!($check)), $module::checks::$check)),*]
    };
}

/// Checks of the solutions against tables and limits.
pub const CHECKS: &[(&str, fn())] = checks![
    beam::roots_match_the_tables,
    elastica::tip_load_matches_the_literature,
    elastica::buckled_force_starts_at_eulers_load,
    elastica::light_beams_follow_linear_theory,
    elastica::a_whole_turn_is_a_circle,
    held::sharp_edges_match_quoted_numbers,
    held::rounded_soft_edges_satisfy_the_equations,
    held::tips_on_curves_satisfy_the_equations,
    held::released_beams_are_in_equilibrium_until_then,
    held::a_flat_surface_buckles_the_beam,
    impact::restitution_has_its_limits,
    impact::elastic_impacts_match_the_textbook,
    pendulum::a_cone_is_a_conical_pendulum,
    pendulum::azimuth_is_the_integral_of_its_rate,
    pressed::the_integral_tends_to_the_law_of_hertz,
    pressed::forces_are_the_integrals,
    pressed::cantilevers_are_in_equilibrium,
    rotating_beam::frequencies_match_wright,
    rotating_beam::a_beam_at_rest_is_a_cantilever,
    rotating_beam::southwells_coefficient_is_known,
    rotating_beam::splay_solves_its_boundary_value_problem,
    rotating_beam::a_fast_beam_is_a_rope,
    taper::frequencies_match_those_with_more_digits,
    taper::the_modified_bessel_function_matches_the_table,
    taper::a_slight_taper_turns_as_a_uniform_beam,
];

/// A zero of `f` between `low` and `high`, to rounding; NaN if `f` has the same sign at both.
fn zero(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let rises = f(low) < 0.0;
    if rises == (f(high) < 0.0) {
        return f64::NAN;
    }
    loop {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            return middle;
        }
        if (f(middle) < 0.0) == rises {
            low = middle;
        } else {
            high = middle;
        }
    }
}
