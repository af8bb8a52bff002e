"""Single contacts of the paper's case, by a planar code that shares nothing with the Rust code.

What enters: brushing velocities and penetration depths (default: six of the paper's 120).
What leaves: a CSV file with the contact metrics, with which those of the Rust code are compared.

How it is done:

1. Without gravity, friction and feed the filament stays in the plane of rotation, so one azimuth
   θ_k a segment describes it. E_kin, E_pot and D are written down in these; CasADi differentiates
   them into M(q) q̈ = f(q, q̇, t) (Uhlmann and Hoyer, Ceramics 2021, Eq. 1) and into the Jacobian
   of f. The contact force, k_c δ at every node that penetrates, is the derivative of ½ k_c δ².
2. SciPy's Radau (Radau IIA of order 5, Hairer and Wanner 1996, IV.8) integrates the whole pass,
   across the kinks of the contact force, with the impulse ∫ F_n dt as one more state.
3. Contact times are roots of the smallest gap on the dense output; peak force and largest
   deflection are located on it by maximisation. No metric comes from counting samples.

SI units, angles in radians: z along the tool axis, y normal to the plane workpiece
y = −(R − a_e), the body angle is β = β_0 + ω t.

Run from the repository root:

    python derivations/reference_contacts.py
"""

import argparse
import csv
import io
import math
import platform
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import casadi
import numpy as np
import scipy
from scipy.integrate import DenseOutput, Radau
from scipy.optimize import brentq, minimize_scalar

DEFAULT_OUTPUT = Path(__file__).parent.parent / "tests" / "data" / "reference_contacts.csv"

# The paper's tool and filament, and the defaults for what the paper leaves open.
SEGMENTS = 25
BODY_RADIUS_M = 0.140
LENGTH_M = 0.040
TOOL_RADIUS_M = BODY_RADIUS_M + LENGTH_M
FILAMENT_COUNT = 10_500
DIAMETER_M = 1.18e-3
DENSITY_KG_M3 = 1110.0
YOUNGS_MODULUS_PA = 3.0e9
DAMPING_RATIO = 0.05
FIRST_CANTILEVER_ROOT = 1.8751040687
CONTACT_STIFFNESS_N_M = 1e5
LEAD_ANGLE_RAD = 0.005
TAIL_ANGLE_RAD = 0.15

# (v_b in m/s, a_e in m): sweeping, striking, and the tier between, at both ends of the grid.
DEFAULT_CASES = (
    (2.5, 0.5e-3),
    (10.0, 1.0e-3),
    (15.0, 2.5e-3),
    (20.0, 3.0e-3),
    (30.0, 0.5e-3),
    (30.0, 5.0e-3),
)

# Units of the solver's states, so that one absolute tolerance fits all: angles of 1 rad, rates of
# 1000 rad/s, impulses of 1 mN s.
RATE_UNIT_RAD_S = 1e3
IMPULSE_UNIT_N_S = 1e-3
# Every step is searched for contact events between this many equidistant points. With at least
# LEAST_STEPS steps a pass, points are 0.03 % of the pass apart or less.
SEARCH_POINTS = 9
LEAST_STEPS = 500

COLUMNS = (
    "brushing_velocity_m_s",
    "penetration_depth_m",
    "contact_time_s",
    "contact_time_ratio",
    "contact_count",
    "contact_normal_impulse_n_s",
    "peak_contact_normal_force_n",
    "max_tip_deflection_m",
    "tool_contact_normal_force_n",
)

OfTime = Callable[[float], float]


@dataclass(frozen=True)
class Pass:
    """One pass of a filament over the workpiece: v_b in m/s and a_e in m, and what follows."""

    brushing_velocity_m_s: float
    penetration_depth_m: float

    @property
    def rate_rad_s(self) -> float:
        """ω = v_b / R."""
        return self.brushing_velocity_m_s / TOOL_RADIUS_M

    @property
    def contact_angle_rad(self) -> float:
        """Ω_c = 2 arccos((R − a_e)/R)."""
        return 2 * math.acos((TOOL_RADIUS_M - self.penetration_depth_m) / TOOL_RADIUS_M)

    @property
    def start_angle_rad(self) -> float:
        """β_0: the lead angle before nominal entry."""
        return -math.pi / 2 - self.contact_angle_rad / 2 - LEAD_ANGLE_RAD

    @property
    def nominal_entry_s(self) -> float:
        """Time at which the undeformed tip meets the workpiece."""
        return LEAD_ANGLE_RAD / self.rate_rad_s

    @property
    def nominal_contact_time_s(self) -> float:
        """t_d = Ω_c / ω."""
        return self.contact_angle_rad / self.rate_rad_s

    @property
    def nominal_exit_s(self) -> float:
        """Time at which the undeformed tip leaves the workpiece."""
        return self.nominal_entry_s + self.nominal_contact_time_s

    @property
    def end_s(self) -> float:
        """End of the simulation: the tail angle past nominal exit."""
        return self.nominal_exit_s + TAIL_ANGLE_RAD / self.rate_rad_s


class PlanarFilament:
    """The equations of motion of the planar chain during one pass, as functions of CasADi.

    The solver's state y is (θ_1 … θ_n, θ̇_1 … θ̇_n, ∫ F_n dt), in the units above.
    """

    def __init__(self, contact_pass: Pass) -> None:
        self.contact_pass = contact_pass
        time = casadi.SX.sym("t")
        angles = casadi.SX.sym("theta", SEGMENTS)
        rates = casadi.SX.sym("theta_rate", SEGMENTS)
        accelerations = casadi.SX.sym("theta_acceleration", SEGMENTS)

        kinetic, springs, dissipation, gaps = self._energies_and_gaps(time, angles, rates)
        penetrations = casadi.fmax(0, -gaps)
        contact_energy = CONTACT_STIFFNESS_N_M / 2 * casadi.sumsqr(penetrations)
        contact_force = CONTACT_STIFFNESS_N_M * casadi.sum1(penetrations)

        # d/dt ∂E_kin/∂q̇ = M q̈ + (∂²E_kin/∂q̇∂q) q̇ + ∂²E_kin/∂q̇∂t, the rest goes to the right.
        momenta = casadi.gradient(kinetic, rates)
        mass_matrix = casadi.jacobian(momenta, rates)
        right_side = (
            casadi.gradient(kinetic - springs - contact_energy, angles)
            - casadi.gradient(dissipation, rates)
            - casadi.jtimes(momenta, angles, rates)
            - casadi.jacobian(momenta, time)
        )
        residual = mass_matrix @ accelerations - right_side

        instant = [time, angles, rates]
        self._motion = casadi.Function("motion", instant, [mass_matrix, right_side, contact_force])
        self._tangents = casadi.Function(
            "tangents",
            [*instant, accelerations],
            [
                casadi.jacobian(residual, angles),
                casadi.jacobian(residual, rates),
                casadi.jacobian(contact_force, angles),
            ],
        )
        self._gaps = casadi.Function("gaps", [time, angles], [gaps])

    def _energies_and_gaps(
        self, time: casadi.SX, angles: casadi.SX, rates: casadi.SX
    ) -> tuple[casadi.SX, casadi.SX, casadi.SX, casadi.SX]:
        """E_kin and E_spring in J, D in W, and the gaps of the nodes 1 … n in m."""
        area = math.pi * DIAMETER_M**2 / 4
        bending_stiffness = YOUNGS_MODULUS_PA * math.pi * DIAMETER_M**4 / 64  # E I in N m²
        h = LENGTH_M / SEGMENTS
        mass = DENSITY_KG_M3 * area * h
        inertia = mass * h**2 / 12
        first_frequency = FIRST_CANTILEVER_ROOT**2 * math.sqrt(
            bending_stiffness / (DENSITY_KG_M3 * area * LENGTH_M**4)
        )
        damping_time = 2 * DAMPING_RATIO / first_frequency

        rate = self.contact_pass.rate_rad_s
        body_angle = self.contact_pass.start_angle_rad + rate * time
        node = BODY_RADIUS_M * casadi.vertcat(casadi.cos(body_angle), casadi.sin(body_angle))
        node_velocity = casadi.jacobian(node, time)
        previous_angle, previous_rate = body_angle, rate
        kinetic, springs, dissipation, gaps = 0, 0, 0, []
        for k in range(SEGMENTS):
            angle, angle_rate = angles[k], rates[k]
            direction = casadi.vertcat(casadi.cos(angle), casadi.sin(angle))
            direction_rate = angle_rate * casadi.vertcat(-casadi.sin(angle), casadi.cos(angle))
            kinetic += mass / 2 * casadi.sumsqr(node_velocity + h / 2 * direction_rate)
            kinetic += inertia / 2 * angle_rate**2
            # The clamp joint carries only half a segment's compliance.
            stiffness = bending_stiffness / h * (2 if k == 0 else 1)
            springs += stiffness / 2 * (angle - previous_angle) ** 2
            dissipation += damping_time * stiffness / 2 * (angle_rate - previous_rate) ** 2
            node = node + h * direction
            node_velocity = node_velocity + h * direction_rate
            gaps.append(node[1] + TOOL_RADIUS_M - self.contact_pass.penetration_depth_m)
            previous_angle, previous_rate = angle, angle_rate
        return kinetic, springs, dissipation, casadi.vertcat(*gaps)

    def start(self) -> np.ndarray:
        """State at t = 0: straight, turning rigidly with the body."""
        return np.concatenate(
            [
                np.full(SEGMENTS, self.contact_pass.start_angle_rad),
                np.full(SEGMENTS, self.contact_pass.rate_rad_s / RATE_UNIT_RAD_S),
                [0.0],
            ]
        )

    def _instant(self, time: float, y: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Time, angles in rad and rates in rad/s of a state."""
        return time, y[:SEGMENTS], y[SEGMENTS : 2 * SEGMENTS] * RATE_UNIT_RAD_S

    def derivative(self, time: float, y: np.ndarray) -> np.ndarray:
        """dy/dt."""
        instant = self._instant(time, y)
        mass_matrix, right_side, contact_force = self._motion(*instant)
        accelerations = np.linalg.solve(np.array(mass_matrix), np.array(right_side).ravel())
        return np.concatenate(
            [
                instant[2],
                accelerations / RATE_UNIT_RAD_S,
                [float(contact_force) / IMPULSE_UNIT_N_S],
            ]
        )

    def jacobian(self, time: float, y: np.ndarray) -> np.ndarray:
        """∂(dy/dt)/∂y: from M q̈ = f follows ∂q̈ = −M⁻¹ ∂(M q̈ − f) at the q̈ of the state."""
        instant = self._instant(time, y)
        mass_matrix, right_side, _ = (np.array(part) for part in self._motion(*instant))
        accelerations = np.linalg.solve(mass_matrix, right_side.ravel())
        by_angles, by_rates, force_by_angles = (
            np.array(part) for part in self._tangents(*instant, accelerations)
        )
        angles, rates = slice(0, SEGMENTS), slice(SEGMENTS, 2 * SEGMENTS)
        result = np.zeros((2 * SEGMENTS + 1, 2 * SEGMENTS + 1))
        result[angles, rates] = RATE_UNIT_RAD_S * np.eye(SEGMENTS)
        result[rates, angles] = -np.linalg.solve(mass_matrix, by_angles) / RATE_UNIT_RAD_S
        result[rates, rates] = -np.linalg.solve(mass_matrix, by_rates)
        result[-1, angles] = force_by_angles.ravel() / IMPULSE_UNIT_N_S
        return result

    def smallest_gap_m(self, time: float, y: np.ndarray) -> float:
        """Smallest gap of all nodes; there is contact while it is negative."""
        return float(np.min(np.array(self._gaps(time, y[:SEGMENTS]))))

    def contact_force_n(self, time: float, y: np.ndarray) -> float:
        """F_n, the sum over the nodes."""
        return float(self._motion(*self._instant(time, y))[2])

    def tip_deflection_m(self, time: float, y: np.ndarray) -> float:
        """Distance from the tip to the undeformed filament, the piece of length l_f from r_0."""
        body_angle = self.contact_pass.start_angle_rad + self.contact_pass.rate_rad_s * time
        # The tip as seen from the root, along and across the clamp direction.
        relative_angles = y[:SEGMENTS] - body_angle
        along = LENGTH_M / SEGMENTS * float(np.sum(np.cos(relative_angles)))
        across = LENGTH_M / SEGMENTS * float(np.sum(np.sin(relative_angles)))
        return math.hypot(along - min(max(along, 0.0), LENGTH_M), across)


def refined_maximum(function: OfTime, times: np.ndarray, values: list[float]) -> float:
    """Maximum of a smooth function near the largest of its sampled values."""
    best = int(np.argmax(values))
    left, right = times[max(best - 1, 0)], times[min(best + 1, len(times) - 1)]
    found = minimize_scalar(
        lambda time: -function(time),
        bounds=(left, right),
        method="bounded",
        options={"xatol": 1e-7 * (right - left)},
    )
    return max(values[best], -float(found.fun))


def with_touches(
    function: OfTime, times: np.ndarray, values: list[float]
) -> tuple[list[float], list[float]]:
    """The samples, and between them each short change of sign that they miss.

    A smallest absolute value next to which the function may turn is refined; if the function
    changes its sign there, that point is added: a touch, or a loss of contact, shorter than the
    distance of the samples.
    """
    samples = dict(zip((float(time) for time in times), values, strict=True))
    variation = max(values) - min(values)
    for i, value in enumerate(values):
        sign = math.copysign(1.0, value)
        lower, upper = max(i - 1, 0), min(i + 1, len(times) - 1)
        is_smallest = sign * value <= min(sign * values[lower], sign * values[upper])
        # Where the function is farther from zero than it moves in the step, it does not get there.
        if not is_smallest or abs(value) > variation:
            continue
        found = minimize_scalar(
            lambda time, sign=sign: sign * function(time),
            bounds=(times[lower], times[upper]),
            method="bounded",
            options={"xatol": 1e-7 * (times[upper] - times[lower])},
        )
        if found.fun < 0.0:
            samples[float(found.x)] = sign * float(found.fun)
    search_times = sorted(samples)
    return search_times, [samples[time] for time in search_times]


def contact_metrics(contact_pass: Pass, relative_tolerance: float) -> dict[str, float | int]:
    """Integrates one pass and returns a row of the CSV file."""
    filament = PlanarFilament(contact_pass)
    solver = Radau(
        filament.derivative,
        0.0,
        filament.start(),
        contact_pass.end_s,
        rtol=relative_tolerance,
        atol=0.1 * relative_tolerance,
        jac=filament.jacobian,
        first_step=1e-7,
        max_step=contact_pass.end_s / LEAST_STEPS,
    )
    contacts: list[tuple[float, float]] = []
    contact_start: float | None = None
    peak_force, largest_deflection = 0.0, 0.0
    while solver.status == "running":
        message = solver.step()
        if solver.status == "failed":
            raise RuntimeError(f"{contact_pass}: Radau stopped at t = {solver.t} s: {message}")
        dense = solver.dense_output()

        def gap(time: float, dense: DenseOutput = dense) -> float:
            return filament.smallest_gap_m(time, dense(time))

        def force(time: float, dense: DenseOutput = dense) -> float:
            return filament.contact_force_n(time, dense(time))

        def deflection(time: float, dense: DenseOutput = dense) -> float:
            return filament.tip_deflection_m(time, dense(time))

        times = np.linspace(solver.t_old, solver.t, SEARCH_POINTS)
        gaps = [gap(time) for time in times]
        search_times, search_gaps = with_touches(gap, times, gaps)
        for i in range(1, len(search_times)):
            before, after = search_gaps[i - 1] < 0.0, search_gaps[i] < 0.0
            if before == after:
                continue
            event = brentq(gap, search_times[i - 1], search_times[i], xtol=1e-17)
            if after:
                contact_start = event
            else:
                contacts.append((contact_start, event))
                contact_start = None

        # Maxima are refined only where they can exceed those found so far.
        if min(gaps) < 0.0:
            forces = [force(time) for time in times]
            if max(forces) > 0.98 * peak_force:
                peak_force = max(peak_force, refined_maximum(force, times, forces))
        deflections = [deflection(time) for time in times]
        if max(deflections) > 0.98 * largest_deflection:
            largest_deflection = max(
                largest_deflection, refined_maximum(deflection, times, deflections)
            )
    if contact_start is not None:
        contacts.append((contact_start, contact_pass.end_s))

    entry, leave = contact_pass.nominal_entry_s, contact_pass.nominal_exit_s
    nominal_part = sum(max(0.0, min(end, leave) - max(start, entry)) for start, end in contacts)
    impulse = float(solver.y[-1]) * IMPULSE_UNIT_N_S
    return {
        "brushing_velocity_m_s": contact_pass.brushing_velocity_m_s,
        "penetration_depth_m": contact_pass.penetration_depth_m,
        "contact_time_s": sum(end - start for start, end in contacts),
        "contact_time_ratio": nominal_part / contact_pass.nominal_contact_time_s,
        "contact_count": len(contacts),
        "contact_normal_impulse_n_s": impulse,
        "peak_contact_normal_force_n": peak_force,
        "max_tip_deflection_m": largest_deflection,
        # F_n,w = p_n N_f ω/(2π)
        "tool_contact_normal_force_n": (
            impulse * FILAMENT_COUNT * contact_pass.rate_rad_s / (2 * math.pi)
        ),
    }


def header(relative_tolerance: float, cases: list[tuple[float, float]]) -> str:
    """The comment that says how the file was made."""
    command = f"python derivations/reference_contacts.py --relative-tolerance {relative_tolerance}"
    if tuple(cases) != DEFAULT_CASES:
        command += "".join(f" --case {velocity} {depth}" for velocity, depth in cases)
    return (
        f"# {command} (Python {platform.python_version()}, casadi {casadi.__version__}, "
        f"numpy {np.__version__}, scipy {scipy.__version__})\n"
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description="Write the contact metrics of single passes of the paper's case."
    )
    parser.add_argument(
        "--case",
        nargs=2,
        type=float,
        action="append",
        metavar=("VELOCITY", "DEPTH"),
        help="brushing velocity in m/s and penetration depth in m; may be repeated",
    )
    parser.add_argument(
        "--relative-tolerance", type=float, default=1e-9, help="of the integrator, per step"
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=DEFAULT_OUTPUT,
        help="CSV file to write (default: tests/data/reference_contacts.csv)",
    )
    arguments = parser.parse_args()
    cases = [tuple(case) for case in arguments.case or DEFAULT_CASES]

    text = io.StringIO()
    text.write(header(arguments.relative_tolerance, cases))
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for velocity, depth in cases:
        metrics = contact_metrics(Pass(velocity, depth), arguments.relative_tolerance)
        # Twelve digits: more than the integrator gives, and no rounding of the processor's.
        writer.writerow(
            {key: f"{x:.12g}" if isinstance(x, float) else x for key, x in metrics.items()}
        )
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    arguments.output.write_text(text.getvalue(), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
