"""Equations of motion by CasADi's differentiation, and their integration in windows.

1. CasADi differentiates the energies into M(q) q̈ = f(q, q̇, t) (Uhlmann and Hoyer, Ceramics 2021,
   Eq. 1) and into the Jacobian of f.
2. The solver's state y is (q, q̇, integrals), in the units below. The equations take the active set
   as parameters p, and are smooth while it does not change.
3. A window is a piece of the motion with one active set. Where the set changes between two points,
   the time is located by bisection. The window ends there, and the solver starts again: no step
   crosses a kink.

The solver is CVODES of SUNDIALS (BDF of orders 1 to 5, Newton's method), as CasADi ships it.

Users of this module state energies, forces and active sets.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import casadi
import numpy as np
from scipy.interpolate import BPoly

# Units of the solver's states, for one absolute tolerance: 1 rad for angles, 1000 rad/s for rates,
# 1 mN s, 1 mJ and 1 mN m s for integrals.
RATE_UNIT_RAD_S = 1e3
INTEGRAL_UNIT = 1e-3
# Absolute over relative tolerance, in these units.
ABSOLUTE_TOLERANCE = 0.1
# Points of each window, among which changes of the active set are searched.
POINTS = 401
SHARES = np.linspace(0.0, 1.0, POINTS)
# Bisections of the distance of two points, to 2e-9 of it.
BISECTIONS = 29
# Length of a window over the time for which the active set has lasted, within limits.
WINDOW_GROWTH = 2.0
SHORTEST_WINDOW_S = 4e-6
# Least length of a window that is repeated after a failure.
SHORTEST_RETRY_S = 1e-9

State = np.ndarray
# States at the points from start_s to end_s, as columns, from the state y and with parameters p.
Solver = Callable[[float, float, State, np.ndarray], np.ndarray]


def velocity_of(vector: casadi.SX, instant: Sequence[casadi.SX]) -> casadi.SX:
    """Returns the rate of a function of time and coordinates."""
    time, coordinates, rates = instant
    return casadi.jacobian(vector, time) + casadi.jtimes(vector, coordinates, rates)


class Equations:
    """Equations of motion as functions of CasADi of (t, y, p), with their Jacobian.

    A subclass calls `derive`. Its `parameters(active)` are the active set for the equations.
    """

    def derive(
        self,
        instant: Sequence[casadi.SX],
        parameters: casadi.SX,
        energies: tuple[casadi.SX, casadi.SX, casadi.SX],
        force: casadi.SX,
        integrands: casadi.SX,
    ) -> None:
        """Derives Lagrange's equations from E_kin, E_pot and D, and from other generalised forces.

        `instant` is time, coordinates and rates; `integrands` are the rates of the integrals.
        """
        time, coordinates, rates = instant
        kinetic, potential, dissipation = energies
        self.count, self.integral_count = coordinates.numel(), integrands.numel()
        self.size, self.parameter_count = 2 * self.count + self.integral_count, parameters.numel()
        # d/dt ∂E_kin/∂q̇ = M q̈ + (∂²E_kin/∂q̇∂q) q̇ + ∂²E_kin/∂q̇∂t; the rest goes to the right.
        momenta = casadi.gradient(kinetic, rates)
        mass_matrix = casadi.jacobian(momenta, rates)
        right_side = (
            casadi.gradient(kinetic - potential, coordinates)
            - casadi.gradient(dissipation, rates)
            - velocity_of(momenta, instant)
            + force
        )
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
        """Sets dy/dt as a function of (t, y, p), which knows its Jacobian."""
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
        # CasADi wants the Jacobian by all arguments, given the result too; it does not use those by
        # t and p.
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


def cvodes(equations: Equations, relative_tolerance: float) -> Solver:
    """Returns CVODES for windows of any length."""
    # Time is the elapsed share, so that one integrator serves all windows.
    share, y = casadi.MX.sym("share"), casadi.MX.sym("y", equations.size)
    p, window = casadi.MX.sym("p", equations.parameter_count), casadi.MX.sym("window", 2)
    derivative = equations.derivative(window[0] + window[1] * share, y, p)
    parameters = casadi.vertcat(window, p)
    problem = {"t": share, "x": y, "p": parameters, "ode": window[1] * derivative}
    options = {
        "reltol": relative_tolerance,
        "abstol": ABSOLUTE_TOLERANCE * relative_tolerance,
        "max_num_steps": 1_000_000,
    }
    integrator = casadi.integrator("window", "cvodes", problem, 0.0, list(SHARES), options)

    def solve(start_s: float, end_s: float, y: State, parameters: np.ndarray) -> np.ndarray:
        p = np.concatenate([[start_s, end_s - start_s], parameters])
        return np.array(integrator(x0=y, p=p)["xf"])

    return solve


@dataclass(frozen=True)
class Window:
    """A piece of the motion with one active set: whole numbers, with 0 for the air."""

    times: np.ndarray
    states: np.ndarray  # columns
    active: np.ndarray
    parameters: np.ndarray
    equations: Equations
    ends_turn: bool = False

    def until(self, count: int) -> "Window":
        """Returns its first points."""
        return replace(self, times=self.times[:count], states=self.states[:, :count])

    def integrals(self, point: int) -> np.ndarray:
        """Returns the integrals at a point."""
        return self.states[2 * self.equations.count :, point] * INTEGRAL_UNIT

    def after(self, point: int) -> Callable[[float], State]:
        """Returns the motion after a point, until the next one.

        Polynomials have degree 5 in angles, and 3 in integrals.
        """
        n, angles, integrals = self.equations.count, [], []
        ends = slice(point, point + 2)
        for time, y in zip(self.times[ends], self.states[:, ends].T, strict=True):
            slope = np.array(self.equations.derivative(time, y, self.parameters)).ravel()
            angles.append([y[:n], slope[:n], RATE_UNIT_RAD_S * slope[n : 2 * n]])
            integrals.append([y[2 * n :], slope[2 * n :]])
        # The time starts at the point, whose rounding would else enter.
        span = [0.0, self.times[point + 1] - self.times[point]]
        of_angles, of_integrals = (BPoly.from_derivatives(span, y) for y in (angles, integrals))
        of_rates = of_angles.derivative()
        return lambda since: np.concatenate(
            [of_angles(since), of_rates(since) / RATE_UNIT_RAD_S, of_integrals(since)]
        )


class Motion:
    """A motion, window by window.

    A subclass has `start()`, the state at t = 0; `active_sets(times, states)`, as rows; and
    `equations_of(active)`.
    """

    longest_window_s = 4e-4

    def __init__(
        self, name: str, relative_tolerance: float, ends_of_turns_s: Sequence[float]
    ) -> None:
        self.name, self.ends_of_turns_s, self.changes = name, ends_of_turns_s, 0
        self._tolerance = relative_tolerance
        self._solvers: dict[Equations, Solver] = {}

    def active_set(self, time: float, y: State) -> np.ndarray:
        """Returns the active set of one state."""
        return self.active_sets(np.array([time]), y[:, None])[0]

    def window(self, start_s: float, end_s: float, y: State, active: np.ndarray) -> Window:
        """Integrates with one active set, even if it does not last.

        The window is shorter where the equations fail: a polynomial of a spline may diverge beyond
        its piece.
        """
        equations = self.equations_of(active)
        if equations not in self._solvers:
            self._solvers[equations] = cvodes(equations, self._tolerance)
        parameters = equations.parameters(active)
        while True:
            times = start_s + (end_s - start_s) * SHARES
            times[-1] = end_s
            try:
                states = self._solvers[equations](start_s, end_s, y, parameters)
                if np.all(np.isfinite(states)):
                    return Window(times, states, active, parameters, equations)
            except RuntimeError:
                pass
            end_s = start_s + (end_s - start_s) / 4
            if end_s - start_s < SHORTEST_RETRY_S:
                raise RuntimeError(f"{self.name}: the solver stopped at {start_s} s")

    def windows(self) -> Iterator[Window]:
        """Yields the whole motion."""
        start_s, y, until_s = 0.0, self.start(), None
        active, length, since_s = self.active_set(start_s, y), self.longest_window_s, 0.0
        for end_of_turn in self.ends_of_turns_s:
            while start_s < end_of_turn:
                end_s = until_s or min(start_s + length, end_of_turn)
                # The last bit of a turn is no window of its own.
                if end_of_turn - end_s < 1e-3 * length:
                    end_s = end_of_turn
                window = self.window(start_s, end_s, y, active)
                change = self._first_change(window)
                following, until_of_next = active, None
                if change is not None and until_s is None:
                    # Again, at much finer points, from the point before the change to it.
                    until_of_next = float(window.times[change])
                    window = window.until(change)
                elif change is not None:
                    window, following = self._until_change(window, change)
                    self.changes += 1
                if len(window.times) > 1:
                    yield replace(window, ends_turn=bool(window.times[-1] == end_of_turn))
                start_s, y = float(window.times[-1]), window.states[:, -1]
                if following is not active:
                    length, since_s = start_s - since_s, start_s
                length = WINDOW_GROWTH * max(length, start_s - since_s)
                length = min(max(length, SHORTEST_WINDOW_S), self.longest_window_s)
                active, until_s = following, until_of_next

    def _first_change(self, window: Window) -> int | None:
        """Returns the first point, but the start, with another active set."""
        rows = self.active_sets(window.times, window.states)
        changed = np.flatnonzero(np.any(rows != window.active, axis=1))
        # The start is the event that ended the window before.
        changed = changed[changed > 0]
        return int(changed[0]) if len(changed) > 0 else None

    def _until_change(self, window: Window, change: int) -> tuple[Window, np.ndarray]:
        """Locates the change before a point: the window until then, and the next active set."""
        before = float(window.times[change - 1])
        state = window.after(change - 1)
        low, high = 0.0, float(window.times[change]) - before
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            if np.array_equal(self.active_set(before + middle, state(middle)), window.active):
                low = middle
            else:
                high = middle
        times = np.append(window.times[:change], before + high)
        states = np.column_stack([window.states[:, :change], state(high)])
        ended = replace(window, times=times, states=states)
        return ended, self.active_set(before + high, state(high))

    def sampled(self, rows: int) -> Iterator[tuple[float, State, Window]]:
        """Yields equally spaced times, the states there, and the windows in which they lie."""
        times, row = np.linspace(0.0, self.ends_of_turns_s[-1], rows), 0
        for window in self.windows():
            while row < rows and times[row] <= window.times[-1]:
                i = int(np.searchsorted(window.times, times[row], side="right")) - 1
                i = min(max(i, 0), len(window.times) - 2)
                yield times[row], window.after(i)(times[row] - window.times[i]), window
                row += 1
