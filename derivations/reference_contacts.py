"""Single contacts of the paper's case, by a planar code that shares nothing with the Rust code.

What enters: brushing velocities and penetration depths (default: six of the paper's 120).
What leaves: a CSV file with the contact metrics, with which those of the Rust code are compared;
one file for each of two solvers, which share the equations and the search for the metrics.

How it is done:

1. Without gravity, friction and feed the filament stays in the plane of rotation, so one azimuth
   θ_k a segment describes it. E_kin, E_pot and D are written down in these, and not taken from
   `cvodes.py`, which has CasADi differentiate them. The contact force, k_c δ at every node that
   penetrates, is the derivative of ½ k_c δ².
2. The impulse ∫ F_n dt is one more state. Either SciPy's Radau (Radau IIA of order 5, Hairer and
   Wanner 1996, IV.8) integrates the whole pass, across the kinks of the contact force. Or CVODES
   of SUNDIALS (BDF of orders 1 to 5, Newton's method) does, as CasADi ships it, and is started
   again wherever a node closes or opens, so that no step crosses a kink.
3. Contact times are roots of the smallest gap on the dense output; peak force and largest
   deflection are located on it by maximisation. No metric comes from counting samples.

SI units, angles in radians: z along the tool axis, y normal to the plane workpiece
y = −(R − a_e), the body angle is β = β_0 + ω t.

Run from the repository root:

    python derivations/reference_contacts.py
    python derivations/reference_contacts.py --solver cvodes
"""

import argparse
import csv
import io
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import casadi
import numpy as np
import scipy
from cases import (
    BODY_RADIUS_M,
    CONTACT_STIFFNESS_N_M,
    DAMPING_RATIO,
    DATA,
    DENSITY_KG_M3,
    DIAMETER_M,
    FIRST_CANTILEVER_ROOT,
    LEAD_ANGLE_RAD,
    LENGTH_M,
    TAIL_ANGLE_RAD,
    TOOL_RADIUS_M,
    YOUNGS_MODULUS_PA,
    Passing,
    made_by,
    write,
)
from cvodes import ABSOLUTE_TOLERANCE, INTEGRAL_UNIT, RATE_UNIT_RAD_S, Equations
from scipy.integrate import Radau
from scipy.interpolate import BPoly
from scipy.optimize import brentq, minimize_scalar

DEFAULT_OUTPUTS = {
    "radau": DATA / "reference_contacts.csv",
    "cvodes": DATA / "reference_contacts_cvodes.csv",
}

SEGMENTS = 25
FILAMENT_COUNT = 10_500

# (v_b in m/s, a_e in m): sweeping, striking, and the tier between, at both ends of the grid.
DEFAULT_CASES = (
    (2.5, 0.5e-3),
    (10.0, 1.0e-3),
    (15.0, 2.5e-3),
    (20.0, 3.0e-3),
    (30.0, 0.5e-3),
    (30.0, 5.0e-3),
)

# The equations depend on nothing but the motion.
NO_PARAMETERS = casadi.DM(0, 1)
# Relative tolerances that make the metrics good to 1e-9: those of CVODES are off by up to 70 times
# the tolerance (times; 10 times the others), those of Radau by less than the tolerance.
DEFAULT_TOLERANCES = {"radau": 1e-9, "cvodes": 1e-11}
# Every step is searched for contact events between this many equidistant points. With at least
# LEAST_STEPS steps a pass, points are 0.03 % of the pass apart or less.
SEARCH_POINTS = 9
LEAST_STEPS = 500
# CVODES is asked for the motion one window after the other, so many a pass, and gives it at points
# that make so many steps a window.
WINDOWS = 50
STEPS_A_WINDOW = 50
# A window that ends on an event ends past it by up to this much, in m: more than the rounding of
# a gap, so that the node is on the other side; 1e-7 N of contact force.
EVENT_DEPTH_M = 1e-12

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
class Step:
    """A piece of the motion, short enough to be searched at a few points."""

    start_s: float
    end_s: float
    angles: Callable[[float], np.ndarray]  # θ_1 … θ_n at any time of the step
    end_impulse_n_s: float


@dataclass(frozen=True)
class Pass(Passing):
    """One pass of a filament over the workpiece: v_b in m/s and a_e in m, and what follows."""

    brushing_velocity_m_s: float
    penetration_depth_m: float

    @property
    def nominal_entry_s(self) -> float:
        """Time at which the undeformed tip meets the workpiece."""
        return LEAD_ANGLE_RAD / self.rate_rad_s

    @property
    def nominal_contact_time_s(self) -> float:
        """t_d = Ω_c / ω."""
        return 2 * self.half_angle_rad / self.rate_rad_s

    @property
    def nominal_exit_s(self) -> float:
        """Time at which the undeformed tip leaves the workpiece."""
        return self.nominal_entry_s + self.nominal_contact_time_s

    @property
    def end_s(self) -> float:
        """End of the simulation: the tail angle past nominal exit."""
        return self.nominal_exit_s + TAIL_ANGLE_RAD / self.rate_rad_s


class PlanarFilament(Equations):
    """The equations of motion of the planar chain during one pass, as functions of CasADi.

    The solver's state y is (θ_1 … θ_n, θ̇_1 … θ̇_n, ∫ F_n dt).
    """

    def __init__(self, contact_pass: Pass) -> None:
        self.contact_pass = contact_pass
        time = casadi.SX.sym("t")
        angles = casadi.SX.sym("theta", SEGMENTS)
        rates = casadi.SX.sym("theta_rate", SEGMENTS)
        kinetic, springs, dissipation, gaps = self._energies_and_gaps(time, angles, rates)
        penetrations = casadi.fmax(0, -gaps)
        contact_energy = CONTACT_STIFFNESS_N_M / 2 * casadi.sumsqr(penetrations)
        contact_force = CONTACT_STIFFNESS_N_M * casadi.sum1(penetrations)

        instant, lagrangian = [time, angles, rates], kinetic - springs - contact_energy
        energies = kinetic, lagrangian, dissipation
        self.derive(instant, casadi.SX(0, 1), energies, [], contact_force)
        self.contact = casadi.Function("contact", [time, angles], [gaps, contact_force])
        gap_rates = casadi.jacobian(gaps, time) + casadi.jtimes(gaps, angles, rates)
        self._gap_rates = casadi.Function("gap_rates", instant, [gap_rates])

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
        at, rate = self.contact_pass, self.contact_pass.rate_rad_s / RATE_UNIT_RAD_S
        return np.array([*[at.start_angle_rad] * SEGMENTS, *[rate] * SEGMENTS, 0.0])

    def gaps_m(self, time: float, angles: np.ndarray) -> np.ndarray:
        """Gaps of the nodes 1 … n."""
        return np.array(self.contact(time, angles)[0]).ravel()

    def gap_rates_m_s(self, time: float, y: np.ndarray) -> np.ndarray:
        """Their rates at a state."""
        rates = self._gap_rates(time, y[:SEGMENTS], y[SEGMENTS:-1] * RATE_UNIT_RAD_S)
        return np.array(rates).ravel()

    def contact_force_n(self, time: float, angles: np.ndarray) -> float:
        """F_n, the sum over the nodes."""
        return float(self.contact(time, angles)[1])

    def tip_deflection_m(self, time: float, angles: np.ndarray) -> float:
        """Distance from the tip to the undeformed filament, the piece of length l_f from r_0."""
        body_angle = self.contact_pass.start_angle_rad + self.contact_pass.rate_rad_s * time
        # The tip as seen from the root, along and across the clamp direction.
        relative_angles = angles - body_angle
        along = LENGTH_M / SEGMENTS * float(np.sum(np.cos(relative_angles)))
        across = LENGTH_M / SEGMENTS * float(np.sum(np.sin(relative_angles)))
        return math.hypot(along - min(max(along, 0.0), LENGTH_M), across)


def radau_steps(filament: PlanarFilament, relative_tolerance: float) -> Iterator[Step]:
    """The pass by SciPy's Radau, step by step."""
    end_s = filament.contact_pass.end_s
    solver = Radau(
        lambda time, y: np.array(filament.derivative(time, y, NO_PARAMETERS)).ravel(),
        0.0,
        filament.start(),
        end_s,
        rtol=relative_tolerance,
        atol=ABSOLUTE_TOLERANCE * relative_tolerance,
        jac=lambda time, y: np.array(filament.jacobian(time, y, NO_PARAMETERS)),
        first_step=1e-7,
        max_step=end_s / LEAST_STEPS,
    )
    while solver.status == "running":
        message = solver.step()
        if solver.status == "failed":
            raise RuntimeError(
                f"{filament.contact_pass}: Radau stopped at t = {solver.t} s: {message}"
            )
        dense, impulse = solver.dense_output(), float(solver.y[-1]) * INTEGRAL_UNIT
        yield Step(
            solver.t_old, solver.t, lambda time, dense=dense: dense(time)[:SEGMENTS], impulse
        )


class Cvodes:
    """CVODES, started again at every window of time and at every event in it."""

    def __init__(self, filament: PlanarFilament, relative_tolerance: float) -> None:
        self._filament = filament
        self._shares = np.linspace(0.0, 1.0, (SEARCH_POINTS - 1) * STEPS_A_WINDOW + 1)
        self._integrator = filament.integrator(relative_tolerance, self._shares)
        self._derivatives = filament.derivative.map(len(self._shares))
        self._contacts = filament.contact.map(len(self._shares))

    def steps(self) -> Iterator[Step]:
        """The pass, as the motion between the points that CVODES gives."""
        end_s = self._filament.contact_pass.end_s
        start_s, y = 0.0, self._filament.start()
        while start_s < end_s:
            window_end_s = min(start_s + end_s / WINDOWS, end_s)
            # The last bit of a pass is no window of its own.
            if end_s - window_end_s < 1e-6 * end_s:
                window_end_s = end_s
            times, states = self._window(start_s, window_end_s, y)
            motion = self._interpolant(times, states)
            event = self._first_event(times, states, motion)
            if event is not None:
                times, states = self._landed(start_s, y, *event)
                motion = self._interpolant(times, states)
            for first in range(0, len(times) - 1, SEARCH_POINTS - 1):
                last = first + SEARCH_POINTS - 1
                impulse = float(states[-1, last]) * INTEGRAL_UNIT
                yield Step(times[first], times[last], motion, impulse)
            start_s, y = times[-1], states[:, -1]

    def _window(self, start_s: float, end_s: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Times and states, a column each, from the state y at start_s on."""
        result = self._integrator(x0=y, p=[start_s, end_s - start_s])
        times = start_s + (end_s - start_s) * self._shares
        times[-1] = end_s
        return times, np.array(result["xf"])

    def _interpolant(self, times: np.ndarray, states: np.ndarray) -> BPoly:
        """The angles over time, of order 5 between the points: by θ, θ̇ and θ̈ at both ends."""
        derivatives = np.array(self._derivatives(times[None, :], states, NO_PARAMETERS))
        rates = derivatives[:SEGMENTS]
        accelerations = derivatives[SEGMENTS:-1] * RATE_UNIT_RAD_S
        knots = np.stack([states[:SEGMENTS], rates, accelerations])
        return BPoly.from_derivatives(times, knots.transpose(2, 0, 1))

    def _first_event(
        self, times: np.ndarray, states: np.ndarray, motion: BPoly
    ) -> tuple[float, int] | None:
        """Time and node of the first event: the gap of a node changes its sign."""
        gaps = np.array(self._contacts(times[None, :], states[:SEGMENTS])[0])
        changes = (gaps[:, 1:] < 0.0) != (gaps[:, :-1] < 0.0)
        if not changes.any():
            return None
        point = int(np.argmax(changes.any(axis=0)))

        def event(node: int) -> float:
            def gap(time: float) -> float:
                return self._filament.gaps_m(time, motion(time))[node]

            return brentq(gap, times[point], times[point + 1], xtol=1e-17)

        return min((event(node), int(node)) for node in np.flatnonzero(changes[:, point]))

    def _landed(
        self, start_s: float, y: np.ndarray, end_s: float, node: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """The window once more, with an end that is moved until it lies on the event."""
        opens = self._filament.gaps_m(start_s, y[:SEGMENTS])[node] < 0.0
        for _ in range(20):
            times, states = self._window(start_s, end_s, y)
            gap = self._filament.gaps_m(end_s, states[:SEGMENTS, -1])[node]
            past = gap if opens else -gap
            if 0.0 < past <= EVENT_DEPTH_M:
                return times, states
            rate = abs(self._filament.gap_rates_m_s(end_s, states[:, -1])[node])
            end_s += (EVENT_DEPTH_M / 2 - past) / rate
        raise RuntimeError(
            f"{self._filament.contact_pass}: no end on the event of node {node} at {end_s} s"
        )


# Each gives the pass, step by step, for a filament and a relative tolerance.
SOLVERS = {
    "radau": radau_steps,
    "cvodes": lambda filament, tolerance: Cvodes(filament, tolerance).steps(),
}


def minimum_beside(function: OfTime, times: np.ndarray, i: int) -> tuple[float, float]:
    """Where a smooth function is least between the points beside point i, and its value."""
    left, right = times[max(i - 1, 0)], times[min(i + 1, len(times) - 1)]
    options = {"xatol": 1e-7 * (right - left)}
    found = minimize_scalar(function, bounds=(left, right), method="bounded", options=options)
    return float(found.x), float(found.fun)


def refined_maximum(function: OfTime, times: np.ndarray, values: list[float]) -> float:
    """Maximum of a smooth function near the largest of its sampled values."""
    best = int(np.argmax(values))
    return max(values[best], -minimum_beside(lambda time: -function(time), times, best)[1])


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
        is_smallest = sign * value <= min(sign * each for each in values[max(i - 1, 0) : i + 2])
        # Where the function is farther from zero than it moves in the step, it does not get there.
        if not is_smallest or abs(value) > variation:
            continue
        time, least = minimum_beside(lambda time, sign=sign: sign * function(time), times, i)
        if least < 0.0:
            samples[time] = sign * least
    search_times = sorted(samples)
    return search_times, [samples[time] for time in search_times]


def contact_metrics(
    contact_pass: Pass, solver: str, relative_tolerance: float
) -> dict[str, float | int]:
    """Integrates one pass and returns a row of the CSV file."""
    filament = PlanarFilament(contact_pass)
    contacts: list[tuple[float, float]] = []
    contact_start: float | None = None
    peak_force, largest_deflection, impulse = 0.0, 0.0, 0.0
    for step in SOLVERS[solver](filament, relative_tolerance):

        def gap(time: float, step: Step = step) -> float:
            return float(np.min(filament.gaps_m(time, step.angles(time))))

        def force(time: float, step: Step = step) -> float:
            return filament.contact_force_n(time, step.angles(time))

        def deflection(time: float, step: Step = step) -> float:
            return filament.tip_deflection_m(time, step.angles(time))

        times = np.linspace(step.start_s, step.end_s, SEARCH_POINTS)
        gaps = [gap(time) for time in times]
        search_times, search_gaps = with_touches(gap, times, gaps)
        for ends, (before, after) in zip(
            pairwise(search_times), pairwise(search_gaps), strict=True
        ):
            if (before < 0.0) == (after < 0.0):
                continue
            event = brentq(gap, *ends, xtol=1e-17)
            if after < 0.0:
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
        impulse = step.end_impulse_n_s
    if contact_start is not None:
        contacts.append((contact_start, contact_pass.end_s))

    entry, leave = contact_pass.nominal_entry_s, contact_pass.nominal_exit_s
    nominal_part = sum(max(0.0, min(end, leave) - max(start, entry)) for start, end in contacts)
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


def header(solver: str, relative_tolerance: float, cases: list[tuple[float, float]]) -> str:
    """The comment that says how the file was made."""
    command = f"reference_contacts.py --solver {solver} --relative-tolerance {relative_tolerance}"
    if tuple(cases) != DEFAULT_CASES:
        command += "".join(f" --case {velocity} {depth}" for velocity, depth in cases)
    return (
        f"# {made_by(command, casadi, np, scipy)}\n"
        f"# Absolute tolerance: {ABSOLUTE_TOLERANCE * relative_tolerance:.3g} of 1 rad, "
        f"{RATE_UNIT_RAD_S:g} rad/s, {INTEGRAL_UNIT:g} N s.\n"
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
    parser.add_argument("--solver", choices=SOLVERS, default="radau")
    parser.add_argument(
        "--relative-tolerance",
        type=float,
        help="of the integrator, per step (default: 1e-9 for radau, 1e-11 for cvodes)",
    )
    parser.add_argument(
        "--output",
        type=Path,
        help="CSV file to write (default: that of the solver in tests/data)",
    )
    arguments = parser.parse_args()
    tolerance = arguments.relative_tolerance or DEFAULT_TOLERANCES[arguments.solver]
    output = arguments.output or DEFAULT_OUTPUTS[arguments.solver]
    cases = [tuple(case) for case in arguments.case or DEFAULT_CASES]

    text = io.StringIO()
    text.write(header(arguments.solver, tolerance, cases))
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for velocity, depth in cases:
        metrics = contact_metrics(Pass(velocity, depth), arguments.solver, tolerance)
        # Twelve digits: more than the integrator gives, and no rounding of the processor's.
        writer.writerow(
            {key: f"{x:.12g}" if isinstance(x, float) else x for key, x in metrics.items()}
        )
    write(output, text.getvalue())


if __name__ == "__main__":
    main()
