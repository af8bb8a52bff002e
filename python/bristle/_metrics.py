"""Keys of ``metrics.json``; ``docs/results.md`` and ``docs/MODEL.md`` define them."""

from typing import TypedDict


class Statistics(TypedDict):
    """The work of the solver: numbers of steps and iterations."""

    steps: int
    """Accepted steps."""

    unresolved_steps: int
    """Accepted steps that miss the tolerance."""

    rejected_steps: int
    """Steps that were repeated because of their error or a pole."""

    newton_iterations: int
    """Iterations, each one residual and one linear solution."""

    newton_failures: int
    """Steps that were repeated because Newton's method did not converge."""

    factorisations: int
    """Factorisations of the step matrix."""

    contact_events: int
    """Located openings and closings of the contact."""


class ContactMetrics(TypedDict):
    """Metrics that a contact and a brush have in common, in SI units.

    Means over the filaments that count and largest values of extremes, if of a brush.
    """

    brushing_velocity_m_s: float
    """v_b, speed of the undeformed tips, in m/s."""

    rotational_speed_rpm: float
    """n_w, rotational speed of the tool, in rpm."""

    penetration_depth_m: float
    """a_e, penetration depth, as stated or found for a given force, in m."""

    force_stiffness_n_m: float
    """dF_n,w/da_e of a tool that is pressed on with a given force, in N/m; else zero."""

    contact_angle_rad: float
    """Ω_c, angle by which the tool turns while the undeformed filament touches, in
    rad."""

    nominal_contact_length_m: float
    """l_d = R Ω_c, nominal contact length, in m."""

    nominal_contact_time_s: float
    """t_d = Ω_c/ω, nominal contact time, in s."""

    contact_time_s: float
    """t_c, time with F_n > 0, in s."""

    contact_length_m: float
    """l_c = v_b t_c, contact length, in m."""

    contact_time_ratio: float
    """ε_tc, fraction of t_d with F_n > 0: near 0 the filament strikes, near 1 it
    sweeps."""

    contact_count: int
    """Number of intervals with F_n > 0."""

    contact_normal_impulse_n_s: float
    """p_n, integral of F_n over one pass of one filament, in N s."""

    equivalent_contact_normal_force_n: float
    """p_n/t_c, mean normal force while it touches, in N; zero without contact."""

    peak_contact_normal_force_n: float
    """Largest F_n of all nodes together, in N."""

    max_tip_deflection_m: float
    """s_n,max, largest distance of the tip from the undeformed filament, in m."""

    tool_contact_normal_force_n: float
    """F_n,w = p_n N_f ω/(2π), normal force of the tool, in N."""

    contact_impulse_x_n_s: float
    """Integral of the force on the filament along x, in N s."""

    contact_impulse_y_n_s: float
    """Integral of the force on the filament along y, in N s."""

    contact_impulse_z_n_s: float
    """Integral of the force on the filament along z, in N s."""

    edge_contact_normal_impulse_n_s: float
    """The share of p_n on edges of the workpiece, in N s."""

    edge_share: float
    """The share of p_n on edges, over p_n; zero without contact."""

    edge_evenness: float
    """Mean over largest value of the work per length around each edge, from 0 to 1;
    zero if the filament touches no edge."""

    max_edge_penetration_m: float
    """Largest penetration of an edge, in m."""

    friction_work_j: float
    """Energy taken by friction in one pass of one filament, in J."""

    sliding_work_j: float
    """W_s, integral of F_n |v_t| over one pass of one filament, in J."""

    edge_sliding_work_j: float
    """W_e, the share of W_s on edges of the workpiece, in J."""

    edge_work_angle_rad: float
    """Mean angle of W_e from the bisector of the edge, in rad; positive towards the face
    that filaments meet last."""

    edge_work_angle_std_rad: float
    """Standard deviation of W_e around the edge, in rad."""

    contact_angular_impulse_n_m_s: float
    """Integral of the moment of the contact force about the tool axis, in N m s."""

    tool_tangential_force_n: float
    """F_t,w, force with which the tool drags the workpiece along x, in N."""

    tool_lateral_force_n: float
    """F_l,w, force with which the tool drags the workpiece along z, in N."""

    tool_torque_n_m: float
    """M_w, torque of the tool, which the drive must supply, in N m."""

    tool_power_w: float
    """P_w = M_w ω, what the contact takes from the drive, in W."""

    turns: int
    """Turns that were simulated; all metrics are those of the last one."""

    unsteady_turns: bool
    """Whether p_n still changes after 50 turns with ``turns = "steady"``."""

    equilibrium_residual: float
    """Largest angular acceleration of a segment at the start over ω², seen from the tool."""

    energy_residual: float
    """What is missing in the balance of the energies, relative to the sum of its terms."""

    turn_contact_normal_impulses_n_s: tuple[float, ...]
    """p_n of each turn, in N s."""


class Metrics(ContactMetrics, Statistics, TypedDict):
    """What ``metrics.json`` of a contact has: `ContactMetrics`, `Statistics`, and what a
    brush does not have."""

    lateral_amplification: float
    """Growth of a tilt out of the plane of rotation (``docs/stability.md``)."""

    laterally_unstable: bool
    """Whether ``lateral_amplification`` is above 100."""


class BrushMetrics(ContactMetrics, TypedDict):
    """What ``metrics.json`` of a brush has: `ContactMetrics`, and what follows."""

    interaction_factor: float
    """p_n in the brush over that of one filament alone; zero if that is zero."""

    contact_normal_impulse_alone_n_s: float
    """p_n of one filament alone, in N s."""

    tool_contact_normal_force_alone_n: float
    """F_n,w without interaction, in N."""

    columns: int
    """Filaments of a row, one behind the other around the tool."""

    rows: int
    """Rows of filaments along the axis."""

    first_counted_column: int
    """First column that counts; column 0 meets the workpiece first."""

    last_counted_column: int
    """Last column that counts."""

    impulse_scatter: float
    """Standard deviation of p_n over the filaments that count, over the mean."""

    impulse_drift: float
    """By how much the mean p_n of the first half of the columns that count differs from
    that of the last half, over the mean."""

    impulse_change_with_more_columns: float
    """Estimated change of p_n with 25 % more columns, over the mean."""

    step_error: float
    """Largest relative change of p_n of a turn of one filament by itself, from its
    error-controlled pass to the steps of the brush. Above ``brush.tolerance`` it warns."""

    energy_residual: float
    """Energy that is lacking in the balance of the brush, over that put in and taken."""

    momentum_residual: float
    """Momentum that is lacking in the balance of the brush, over that of the filaments and
    the impulse of the workpiece on them."""

    krylov_vectors: int
    """Iterations of the linear solutions."""

    steps: int
    """Accepted steps."""

    halved_steps: int
    """Steps that were repeated with half their length."""

    newton_iterations: int
    """Iterations, each one residual and one linear solution."""
