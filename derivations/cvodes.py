"""Motions by CVODES of SUNDIALS (BDF of orders 1 to 5, Newton's method), as CasADi ships it.

What enters: energies and forces as expressions of CasADi, and what touches at a state.
What leaves: the motion, window by window.

1. CasADi differentiates the energies into M(q) q̈ = f(q, q̇, t) (Uhlmann and Hoyer, Ceramics 2021,
   Eq. 1) and into the Jacobian of f.
2. The solver's state y is (q, q̇, the integrals), in the units below. The equations take what
   touches as parameters p, and are smooth while it does not change.
3. CVODES integrates windows with a constant touch. Where it changes, between two points of the
   motion, the time is located by bisection, the window ends there, and CVODES is started again. No
   step crosses a kink.

No contact is stated here, and of the mechanics only the chain in the plane.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import casadi
import numpy as np
import scipy
from cases import BODY_RADIUS_M, LENGTH_M, Passing, made_by
from scipy.interpolate import BPoly

# Units of the solver's states, so that one absolute tolerance fits all: angles of 1 rad, rates of
# 1000 rad/s, integrals of 1 mN s, 1 mJ and 1 mN m s.
RATE_UNIT_RAD_S = 1e3
INTEGRAL_UNIT = 1e-3
# Absolute over relative tolerance, in these units.
ABSOLUTE_TOLERANCE = 0.1
# CVODES gives the motion at so many points of each window.
POINTS = 401
# More changes of the touch than this mean that a pass chatters, which this code does not solve.
MOST_CHANGES = 50_000
# Of a trajectory, both ends included.
ROWS = 1001

State = np.ndarray
# The state after a time that is counted from a point of a window.
OfTime = Callable[[float], State]


def planar_chain(
    instant: Sequence[casadi.SX],
    body: tuple[casadi.SX, casadi.SX],
    masses: Sequence[float],
    stiffnesses: Sequence[float],
    damping_time_s: float,
    relaxed: Sequence[float],
) -> tuple[casadi.SX, casadi.SX, casadi.SX, casadi.SX]:
    """E_kin and E_spring in J, D in W of a chain, and the positions of its nodes 0 … n as columns.

    The chain stays in the plane. `instant` is time, azimuths and rates of the segments; `body` is
    its angle and rate. Of each segment the mass, the stiffness of its inner joint, and the relaxed
    direction relative to the clamp.
    """
    time, angles, rates = instant
    n = len(masses)
    h = LENGTH_M / n
    nodes = [BODY_RADIUS_M * casadi.vertcat(casadi.cos(body[0]), casadi.sin(body[0]))]
    kinetic, springs, dissipation = 0, 0, 0
    before, before_rate, before_relaxed = *body, 0.0
    for k, (mass, stiffness) in enumerate(zip(masses, stiffnesses, strict=True)):
        step = h * casadi.vertcat(casadi.cos(angles[k]), casadi.sin(angles[k]))
        velocity = velocity_of(nodes[k] + step / 2, instant)
        kinetic += mass / 2 * casadi.sumsqr(velocity) + mass * h**2 / 24 * rates[k] ** 2
        bend = angles[k] - before - (relaxed[k] - before_relaxed)
        springs += stiffness / 2 * bend**2
        dissipation += damping_time_s * stiffness / 2 * (rates[k] - before_rate) ** 2
        nodes.append(nodes[k] + step)
        before, before_rate, before_relaxed = angles[k], rates[k], relaxed[k]
    return kinetic, springs, dissipation, casadi.horzcat(*nodes)


def velocity_of(point: casadi.SX, instant: Sequence[casadi.SX]) -> casadi.SX:
    """The rate of what depends on time and coordinates."""
    time, coordinates, rates = instant
    return casadi.jacobian(point, time) + casadi.jtimes(point, coordinates, rates)


class Equations:
    """The equations of motion as functions of CasADi of (t, y, p), with their Jacobian."""

    def derive(
        self,
        instant: Sequence[casadi.SX],
        parameters: casadi.SX,
        energies: tuple[casadi.SX, casadi.SX, casadi.SX],
        forces: Sequence[casadi.SX],
        integrands: casadi.SX,
    ) -> None:
        """Lagrange's equations from E_kin, E_kin − E_pot and D, with other generalised forces.

        `instant` is time, coordinates and rates; `integrands` are the rates of the integrals.
        """
        time, coordinates, rates = instant
        kinetic, lagrangian, dissipation = energies
        self.count, self.integral_count = coordinates.numel(), integrands.numel()
        self.size, self.parameter_count = 2 * self.count + self.integral_count, parameters.numel()
        # d/dt ∂E_kin/∂q̇ = M q̈ + (∂²E_kin/∂q̇∂q) q̇ + ∂²E_kin/∂q̇∂t, the rest goes to the right.
        momenta = casadi.gradient(kinetic, rates)
        mass_matrix = casadi.jacobian(momenta, rates)
        right_side = (
            casadi.gradient(lagrangian, coordinates)
            - casadi.gradient(dissipation, rates)
            - casadi.jtimes(momenta, coordinates, rates)
            - casadi.jacobian(momenta, time)
        )
        for force in forces:
            right_side += force
        accelerations = casadi.SX.sym("accelerations", self.count)
        residual = mass_matrix @ accelerations - right_side
        arguments, by = [*instant, parameters], casadi.vertcat(coordinates, rates)
        motion = casadi.Function("motion", arguments, [mass_matrix, right_side, integrands])
        tangents = casadi.Function(
            "tangents",
            [*arguments, accelerations],
            [casadi.jacobian(residual, by), casadi.jacobian(integrands, by)],
        )
        self._set_derivative(motion, tangents)

    def _set_derivative(self, motion: casadi.Function, tangents: casadi.Function) -> None:
        """dy/dt as a function of (t, y, p), which knows its Jacobian."""
        n, extra = self.count, self.integral_count
        time, y = casadi.MX.sym("t"), casadi.MX.sym("y", self.size)
        p = casadi.MX.sym("p", self.parameter_count)
        instant = [time, y[:n], y[n : 2 * n] * RATE_UNIT_RAD_S, p]
        mass_matrix, right_side, integrands = motion(*instant)
        accelerations = casadi.solve(mass_matrix, right_side, "ldl")
        derivative = casadi.vertcat(
            instant[2], accelerations / RATE_UNIT_RAD_S, integrands / INTEGRAL_UNIT
        )
        # From M q̈ = f follows ∂q̈ = −M⁻¹ ∂(M q̈ − f) at the q̈ of the state.
        by_state, integrands_by_state = tangents(*instant, accelerations)
        by_state = -casadi.solve(mass_matrix, casadi.densify(by_state), "ldl")
        by_angles, by_rates = casadi.horzsplit(by_state, n)
        by_integrands = casadi.horzsplit(integrands_by_state, n)
        unit_rates = casadi.MX(RATE_UNIT_RAD_S * casadi.DM.eye(n))
        jacobian = casadi.vertcat(
            casadi.horzcat(casadi.MX(n, n), unit_rates, casadi.MX(n, extra)),
            casadi.horzcat(by_angles / RATE_UNIT_RAD_S, by_rates, casadi.MX(n, extra)),
            casadi.horzcat(
                by_integrands[0] / INTEGRAL_UNIT,
                by_integrands[1] * (RATE_UNIT_RAD_S / INTEGRAL_UNIT),
                casadi.MX(extra, extra),
            ),
        )
        self.jacobian = casadi.Function("jacobian", [time, y, p], [jacobian])
        # CasADi wants the Jacobian by all arguments, given the result too; those by t and p are
        # not used.
        empty = casadi.MX(self.size, 1)
        custom = casadi.Function(
            "jac_derivative",
            [time, y, p, empty],
            [empty, jacobian, casadi.MX(self.size, self.parameter_count)],
            ["t", "y", "p", "out_ode"],
            ["jac_ode_t", "jac_ode_y", "jac_ode_p"],
        )
        names, options = (["t", "y", "p"], ["ode"]), {"custom_jacobian": custom}
        arguments = [time, y, p]
        self.derivative = casadi.Function("derivative", arguments, [derivative], *names, options)

    def integrator(self, relative_tolerance: float, shares: np.ndarray) -> casadi.Function:
        """CVODES for a window: gives the states at shares of its length.

        Its parameters are the start and the length of the window in s, and those of the equations.
        """
        # Over the share that has passed, so that one integrator serves all windows.
        share, y = casadi.MX.sym("share"), casadi.MX.sym("y", self.size)
        p, window = casadi.MX.sym("p", self.parameter_count), casadi.MX.sym("window", 2)
        derivative = self.derivative(window[0] + window[1] * share, y, p)
        problem = {
            "t": share,
            "x": y,
            "p": casadi.vertcat(window, p),
            "ode": window[1] * derivative,
        }
        options = {
            "reltol": relative_tolerance,
            "abstol": ABSOLUTE_TOLERANCE * relative_tolerance,
            "max_num_steps": 1_000_000,
        }
        return casadi.integrator("window", "cvodes", problem, 0.0, list(shares), options)


@dataclass(frozen=True)
class Window:
    """A piece of the motion with one touch: whole numbers, of which 0 stands for the air."""

    times: np.ndarray
    states: np.ndarray  # columns
    touch: np.ndarray
    parameters: np.ndarray
    ends_turn: bool = False

    def first(self, count: int) -> "Window":
        """Its first points."""
        return replace(self, times=self.times[:count], states=self.states[:, :count])


class Motion:
    """A pass, window by window.

    Who inherits has `start()`, the state at t = 0; `touches(times, states)`, the touches as rows;
    and `parameters(touch)`, the touch as the equations take it.
    """

    # A window is so many times longer than the touch has lasted, within these limits.
    longest_window_s, shortest_window_s, window_growth = 1e-4, 4e-6, 2.0

    def __init__(self, case: Passing, equations: Equations, relative_tolerance: float) -> None:
        self.case, self.equations = case, equations
        self._shares = np.linspace(0.0, 1.0, POINTS)
        self._integrator = equations.integrator(relative_tolerance, self._shares)

    @property
    def ends_of_turns_s(self) -> list[float]:
        """When turns end."""
        return self.case.ends_of_turns_s

    def check(self, window: Window) -> None:
        """That nothing happens which the equations leave out."""

    def changed(self, touch: np.ndarray, following: np.ndarray) -> None:
        """Hears of every change of the touch."""

    def touch(self, time: float, y: State) -> np.ndarray:
        """That of one state."""
        return self.touches(np.array([time]), y[:, None])[0]

    def _window(self, start_s: float, end_s: float, y: State, touch: np.ndarray) -> Window:
        """The motion with one touch, whether or not it lasts."""
        parameters = self.parameters(touch)
        p = np.concatenate([[start_s, end_s - start_s], parameters])
        states = np.array(self._integrator(x0=y, p=p)["xf"])
        if not np.all(np.isfinite(states)):
            raise RuntimeError(f"{self.case.name}: CVODES stopped in the window at {start_s} s")
        times = start_s + (end_s - start_s) * self._shares
        times[-1] = end_s
        return Window(times, states, touch, parameters)

    def between(self, window: Window, i: int) -> OfTime:
        """The state after point i, until the next: of degree 5 in angles, 3 in the integrals."""
        n, angles, integrals = self.equations.count, [], []
        for time, y in zip(window.times[i : i + 2], window.states[:, i : i + 2].T, strict=True):
            slope = np.array(self.equations.derivative(time, y, window.parameters)).ravel()
            angles.append([y[:n], slope[:n], RATE_UNIT_RAD_S * slope[n : 2 * n]])
            integrals.append([y[2 * n :], slope[2 * n :]])
        # Over the time since point i, whose rounding would else enter.
        ends = [0.0, window.times[i + 1] - window.times[i]]
        of_angles, of_integrals = (BPoly.from_derivatives(ends, y) for y in (angles, integrals))
        of_rates = of_angles.derivative()
        return lambda since: np.concatenate(
            [of_angles(since), of_rates(since) / RATE_UNIT_RAD_S, of_integrals(since)]
        )

    def observed(self, time: float, y: State, parameters: np.ndarray) -> list[np.ndarray]:
        """What the equations observe at a state."""
        n = self.equations.count
        instant = [time, y[:n], y[n : 2 * n] * RATE_UNIT_RAD_S, parameters]
        return [np.array(each).ravel() for each in self.equations.observed.call(instant)]

    def integrals(self, window: Window, i: int) -> np.ndarray:
        """Those of the solver at a point."""
        return window.states[2 * self.equations.count :, i] * INTEGRAL_UNIT

    def windows(self) -> Iterator[Window]:
        """The whole motion."""
        start_s, y, until_s, self.changes = 0.0, self.start(), None, 0
        touch, length, since_s = self.touch(start_s, y), self.longest_window_s, 0.0
        for end_of_turn in self.ends_of_turns_s:
            while start_s < end_of_turn:
                end_s = until_s or min(start_s + length, end_of_turn)
                # The last bit of a turn is no window of its own.
                if end_of_turn - end_s < 1e-3 * length:
                    end_s = end_of_turn
                window = self._window(start_s, end_s, y, touch)
                change = self._first_change(window)
                following, until_of_next = touch, None
                if change is not None and until_s is None:
                    # Once more, at much finer points, from the point before the change to it.
                    until_of_next = float(window.times[change])
                    window = window.first(change)
                elif change is not None:
                    window, following = self._until_change(window, change)
                    self.changed(touch, following)
                    self.changes += 1
                    if self.changes > MOST_CHANGES:
                        raise RuntimeError(f"{self.case.name}: chatters at {start_s} s")
                if len(window.times) > 1:
                    self.check(window)
                    yield replace(window, ends_turn=bool(window.times[-1] == end_of_turn))
                start_s, y = float(window.times[-1]), window.states[:, -1]
                if following is not touch:
                    length, since_s = start_s - since_s, start_s
                length = self.window_growth * max(length, start_s - since_s)
                length = min(max(length, self.shortest_window_s), self.longest_window_s)
                touch, until_s = following, until_of_next

    def _first_change(self, window: Window) -> int | None:
        """The first point, but the start, at which something else touches."""
        rows = self.touches(window.times, window.states)
        changed = np.flatnonzero(np.any(rows != window.touch, axis=1))
        # The start is the event that ended the window before.
        changed = changed[changed > 0]
        return int(changed[0]) if len(changed) > 0 else None

    def _until_change(self, window: Window, change: int) -> tuple[Window, np.ndarray]:
        """The window until the touch changes, which is located, and the next touch."""
        before = float(window.times[change - 1])
        state = self.between(window, change - 1)
        low, high = 0.0, float(window.times[change]) - before
        # To 2e-9 of the distance of the points.
        for _ in range(29):
            middle = (low + high) / 2
            if np.array_equal(self.touch(before + middle, state(middle)), window.touch):
                low = middle
            else:
                high = middle
        times = np.append(window.times[:change], before + high)
        states = np.column_stack([window.states[:, :change], state(high)])
        ended = replace(window, times=times, states=states)
        return ended, self.touch(before + high, state(high))

    def sampled(self) -> Iterator[tuple[float, State, Window]]:
        """Equally spaced times, the states there, and the windows in which they lie."""
        times, row = np.linspace(0.0, self.case.end_s, ROWS), 0
        for window in self.windows():
            while row < ROWS and times[row] <= window.times[-1]:
                i = int(np.searchsorted(window.times, times[row], side="right")) - 1
                i = min(max(i, 0), len(window.times) - 2)
                yield times[row], self.between(window, i)(times[row] - window.times[i]), window
                row += 1


def command(script: str, tolerance: float) -> str:
    """How a file of such motions was made."""
    return (
        f"{made_by(script, casadi, np, scipy)}: "
        f"CVODES, relative tolerance {tolerance:g}, absolute {ABSOLUTE_TOLERANCE * tolerance:g} "
        f"of 1 rad, {RATE_UNIT_RAD_S:g} rad/s, {INTEGRAL_UNIT:g} N s"
    )


def differences(columns: Sequence[str], table: np.ndarray, other: np.ndarray) -> str:
    """Largest difference in each column but the first, with its name."""
    largest = np.max(np.abs(table - other), axis=0)[1:]
    return ", ".join(f"{name} {error:.1g}" for name, error in zip(columns[1:], largest, strict=True))


def table_text(
    comments: Sequence[str], columns: Sequence[str], table: np.ndarray, least: float = 0.0
) -> str:
    """A CSV file, in which numbers up to `least` are zero."""
    table = np.where(np.abs(table) > least, table, 0.0)
    lines = [*(f"# {comment}" for comment in comments), ",".join(columns)]
    lines += [",".join(f"{value:.12g}" for value in row) for row in table]
    return "\n".join(lines) + "\n"
