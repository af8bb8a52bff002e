"""Keys of ``metrics.json`` with their types; ``docs/results.md`` says what they are."""

from typing import TypedDict


class Statistics(TypedDict):
    """The work of the solver."""

    steps: int
    unresolved_steps: int
    rejected_steps: int
    newton_iterations: int
    newton_failures: int
    factorisations: int
    contact_events: int


class ContactMetrics(TypedDict):
    """Metrics that a filament and a brush have, in SI units."""

    brushing_velocity_m_s: float
    rotational_speed_rpm: float
    contact_angle_rad: float
    nominal_contact_length_m: float
    nominal_contact_time_s: float
    contact_time_s: float
    contact_length_m: float
    contact_time_ratio: float
    contact_count: int
    contact_normal_impulse_n_s: float
    equivalent_contact_normal_force_n: float
    peak_contact_normal_force_n: float
    max_tip_deflection_m: float
    tool_contact_normal_force_n: float
    contact_impulse_x_n_s: float
    contact_impulse_y_n_s: float
    contact_impulse_z_n_s: float
    edge_contact_normal_impulse_n_s: float
    edge_share: float
    edge_evenness: float
    max_edge_penetration_m: float
    friction_work_j: float
    contact_angular_impulse_n_m_s: float
    tool_tangential_force_n: float
    tool_torque_n_m: float
    tool_power_w: float
    lateral_amplification: float
    laterally_unstable: bool
    turns: int
    unsteady_turns: bool
    turn_contact_normal_impulses_n_s: list[float]


class Metrics(ContactMetrics, Statistics):
    """What ``metrics.json`` of a contact has, in SI units."""


class BrushMetrics(ContactMetrics):
    """What ``metrics.json`` of a brush has, in SI units."""

    interaction_factor: float
    contact_normal_impulse_alone_n_s: float
    tool_contact_normal_force_alone_n: float
    columns: int
    rows: int
    first_counted_column: int
    last_counted_column: int
    impulse_scatter: float
    impulse_drift: float
    impulse_change_with_more_columns: float
    krylov_vectors: int
    steps: int
    halved_steps: int
    newton_iterations: int
