"""Keys of ``metrics.json``; ``docs/results.md`` and ``docs/MODEL.md`` define them."""

from typing import NotRequired, TypedDict


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
    Those that are not required are there if ``[removal]`` states their coefficients.
    """

    brushing_velocity_m_s: float
    """v_b, speed of the undeformed tips, in m/s."""

    rotational_speed_rpm: float
    """n_w, rotational speed of the tool, in rpm."""

    penetration_depth_m: float
    """Penetration depth, a_e in m: as stated, or found for the force with which the
    tool is pressed on."""

    force_stiffness_n_m: float
    """Stiffness of the force in N/m: dF_n,w/da_e of a tool that is pressed on with a
    given force; zero where the depth is given."""

    contact_angle_rad: float
    """Nominal contact angle, Ω_c in rad: by how much the tool turns while the
    undeformed filament touches; 2 arccos((R − a_e)/R) on a plane."""

    nominal_contact_length_m: float
    """Nominal contact length, l_d in m: R Ω_c."""

    nominal_contact_time_s: float
    """Nominal contact time, t_d in s: Ω_c/ω."""

    contact_time_s: float
    """Contact time, t_c in s: total time with F_n > 0."""

    contact_length_m: float
    """Contact length, l_c in m: v_b t_c."""

    contact_time_ratio: float
    """Contact time ratio, ε_tc: fraction of t_d with F_n > 0: near 0 the filament
    strikes, near 1 it sweeps."""

    contact_count: int
    """Number of contacts: number of intervals with F_n > 0."""

    contact_normal_impulse_n_s: float
    """Contact normal impulse of a filament, p_n in N s: ∫ F_n dt of one filament, one
    pass."""

    equivalent_contact_normal_force_n: float
    """Equivalent contact normal force, F̄_n in N: p_n/t_c, zero without contact."""

    peak_contact_normal_force_n: float
    """Peak contact normal force, max F_n in N: largest force of all nodes together."""

    max_penetration_m: float
    """Largest penetration in m: largest penetration of a node or an edge; the contact
    is stiff as long as this is small against a_e and d."""

    contact_nodes: int
    """Nodes in contact: number of outer nodes among which are all that touched a face:
    1 if only the tip did."""

    max_tip_deflection_m: float
    """Largest tip deflection, s_n,max in m: largest distance of the tip from the
    undeformed filament."""

    tool_contact_normal_force_n: float
    """Contact normal force of the tool, F_n,w in N: p_n N_f ω/(2π): each filament
    passes once per turn."""

    contact_impulse_x_n_s: float
    """Contact impulse along x in N s: ∫ of the contact force on the filament."""

    contact_impulse_y_n_s: float
    """Contact impulse along y in N s: ∫ of the contact force on the filament."""

    contact_impulse_z_n_s: float
    """Contact impulse along z in N s: ∫ of the contact force on the filament."""

    edge_contact_normal_impulse_n_s: float
    """Contact normal impulse on edges in N s: the share of p_n on edges of the
    workpiece."""

    edge_share: float
    """Share of the impulse on edges: contact normal impulse on edges over p_n, zero
    without contact."""

    edge_evenness: float
    """Evenness of the work around edges: mean over largest value of ∫ F_n |v_t| dt per
    length, the friction work over µ, among 24 parts of each edge: 1 if the filament
    works everywhere alike, near 0 if in one place; zero if it touches no edge."""

    max_edge_penetration_m: float
    """Largest penetration of an edge in m: the force on an edge is that of a rigid one
    as long as this is small against its radius."""

    friction_work_j: float
    """Friction work in J: energy taken by friction in one pass of one filament."""

    sliding_work_j: float
    """Sliding work, W_s in J: ∫ F_n |v_t| dt of one filament, one pass, by which it
    removes material and wears."""

    edge_sliding_work_j: float
    """Sliding work on edges, W_e in J: the share of W_s on edges of the workpiece."""

    edge_work_angle_rad: float
    """Angle of the edge's work in rad: mean angle of W_e from the bisector of the edge,
    positive towards the face that filaments meet last; zero without such work."""

    edge_work_angle_std_rad: float
    """Deviation of the angle of the edge's work in rad: standard deviation of W_e
    around the edge."""

    contact_angular_impulse_n_m_s: float
    """Contact angular impulse in N m s: ∫ of the moment of the contact force about the
    tool axis."""

    tool_tangential_force_n: float
    """Tangential force of the tool, F_t,w in N: −∫ F_x dt N_f ω/(2π): positive where
    the tool drags the workpiece along x."""

    tool_lateral_force_n: float
    """Lateral force of the tool, F_l,w in N: −∫ F_z dt N_f ω/(2π): positive where the
    tool drags the workpiece along z."""

    tool_torque_n_m: float
    """Torque of the tool, M_w in N m: −contact angular impulse N_f ω/(2π): what the
    drive must supply."""

    tool_power_w: float
    """Power of the tool, P_w in W: M_w ω: what the contact takes from the drive."""

    removal_rate_m3_s: NotRequired[float]
    """Removal rate of the tool in m³/s: k_P W_s N_f ω/(2π) (Preston)."""

    recession_per_pass_m: NotRequired[float]
    """Recession per pass in m: k_P W_s N_f ω/(2π b v_f): by how much a plane recedes
    under a brush of the width b that is fed over it once."""

    wear_ratio: NotRequired[float]
    """Wear ratio: volume removed from the workpiece over volume lost by the filaments,
    k_P/k_w."""

    turns: int
    """Turns: turns of the tool that were simulated; metrics are those of the last one,
    or means over the last 25 of 50 that do not become steady."""

    unsteady_turns: bool
    """Unsteady turns: whether p_n still changes from turn to turn after 50 turns with
    turns = "steady"."""

    impulse_standard_error: float
    """Standard error of p_n: standard error of p_n over p_n, where turns do not become
    steady and p_n is a mean over the last ones; else 0."""

    equilibrium_residual: float
    """Residual of the start: largest angular acceleration of a segment at the start
    over ω², seen from the tool: filaments that are not radial start in equilibrium."""

    energy_residual: float
    """Energy residual: what is missing in the balance of work, energies and losses over
    all turns, relative to the sum of its terms; above 1e-3, or ten tolerances, the pass
    is refused."""

    turn_contact_normal_impulses_n_s: tuple[float, ...]
    """p_n of each turn, in N s."""


class Metrics(ContactMetrics, Statistics, TypedDict):
    """Content of ``metrics.json`` of a contact: `ContactMetrics`, `Statistics`, and
    metrics that a brush does not have."""

    lateral_amplification: float
    """Lateral amplification: largest |∂z_tip/∂τ|/l_f of the pass, τ the tilt of the
    clamp out of the plane of rotation; above 100 the pass is laterally unstable, and
    1e30 stands for anything larger. In a spatial pass |z_tip|/(l_f sin τ), 0 without a
    tilt."""

    laterally_unstable: bool
    """Laterally unstable: whether the lateral amplification is above 100."""


class BrushMetrics(ContactMetrics, TypedDict):
    """Content of ``metrics.json`` of a brush: `ContactMetrics` and those of interaction."""

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

    impulse_error_estimate: float
    """Error estimate of the mean p_n, over it: the embedded error estimate of the steps (or the
    difference from filaments alone, if none touches another), and the standard error of the mean
    over columns."""

    energy_residual: float
    """Energy that is lacking in the balance of the brush, over that put in and taken."""

    momentum_residual: float
    """Momentum that is lacking in the balance of the brush, over that of the filaments and
    the impulse of the workpiece on them."""

    krylov_vectors: int
    """Iterations of the linear solutions."""

    steps: int
    """Accepted steps."""

    rejected_steps: int
    """Steps that were repeated because their error was too large."""

    newton_failures: int
    """Steps that were repeated because Newton's method failed."""

    newton_iterations: int
    """Iterations, each one residual and one linear solution."""
