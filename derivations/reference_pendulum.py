"""Motion of a planar double pendulum to 17 digits.

What enters: two equal rods, their start (constants below), the digits of the arithmetic.
What leaves: a CSV file with the angles and their rates over time.

A chain of two segments without springs and dampers, fixed at the axis, under gravity: its motion
is chaotic, so it shows every error of the equations and of the integrator, enlarged.

Model
-----
SI units, angles in radians. Two uniform rods of length l, mass m and moment of inertia m l²/12
about the centre; the first turns about the origin, the second about the end of the first. θ_1 and
θ_2 are absolute, counterclockwise from +x; gravity g acts along −y; nothing else acts.

Derivation
----------
1. The centres are at (l/2) e_1 and l e_1 + (l/2) e_2 with e_k = (cos θ_k, sin θ_k), and
   ė_1·ė_2 = θ̇_1 θ̇_2 cos(θ_1 − θ_2). So, with the rods' own rotation,
       E_kin = ½ m l² [(1/4 + 1/12 + 1) θ̇_1² + (1/4 + 1/12) θ̇_2² + θ̇_1 θ̇_2 cos(θ_1 − θ_2)],
       E_pot = m g l [(3/2) sin θ_1 + ½ sin θ_2].
2. Lagrange's equations, divided by m l², with C + iS = exp(i(θ_1 − θ_2)) and γ = g/l:
       (4/3) θ̈_1 + ½ C θ̈_2 = −½ S θ̇_2² − (3/2) γ cos θ_1 = a,
       ½ C θ̈_1 + (1/3) θ̈_2 = +½ S θ̇_1² − ½ γ cos θ_2 = b.
   Hence D θ̈_1 = a/3 − ½ C b and D θ̈_2 = (4/3) b − ½ C a with D = 4/9 − C²/4 > 0.
3. Taylor series. θ_k, their rates, sines, cosines, C, S, a, b, D and θ̈_k are power series of the
   time since the start of a step. Each coefficient follows from those before it: products by
   Cauchy's formula, (sin θ)˙ = θ̇ cos θ, (cos θ)˙ = −θ̇ sin θ, quotients by D from D θ̈ = ….
4. Two runs differ in order, step and digits. They agree in more digits than are written, and
   E_kin + E_pot stays as it was; the script stops if not.

Run from the repository root:

    python derivations/reference_pendulum.py
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import mpmath
from cases import TRAJECTORIES, made_by, write
from mpmath import mpf

DEFAULT_OUTPUT = TRAJECTORIES / "double_pendulum.csv"

GRAVITY_M_S2 = "9.81"
LENGTH_M = 1
MASS_KG = 1
# From hanging straight down, at rest.
START_SWING_RAD = ("1.5", "1.8")
END_S = 10
ROWS_A_SECOND = 4
# Growth of a disturbance is measured with one of this size, in rad and rad/s.
DISTURBANCE = "1e-12"
# The two runs differ by less than this in all rows.
LARGEST_DIFFERENCE = mpf("1e-24")

COLUMNS = ("time_s", "theta_1_rad", "theta_2_rad", "theta_1_rate_rad_s", "theta_2_rate_rad_s")

# θ_1, θ_2 in rad, their rates in rad/s.
State = list[mpf]


@dataclass(frozen=True)
class Settings:
    """One way to integrate: digits of the arithmetic, order of the series, steps a second."""

    digits: int
    order: int
    steps_a_second: int


RUN = Settings(digits=50, order=40, steps_a_second=200)
PROOF = Settings(digits=60, order=50, steps_a_second=240)
# Enough to see how a disturbance grows.
DISTURBED_RUN = Settings(digits=30, order=24, steps_a_second=200)


def product(a: list[mpf], b: list[mpf], i: int) -> mpf:
    """Coefficient i of the product of two series."""
    return mpmath.fdot(a[: i + 1], b[i::-1])


def taylor_step(state: State, order: int, step_s: mpf) -> State:
    """The state after a step, by the series up to this order."""
    gamma = mpf(GRAVITY_M_S2) / LENGTH_M
    third, half = mpf(1) / 3, mpf(1) / 2
    theta = [[state[0]], [state[1]]]
    rate = [[state[2]], [state[3]]]
    cosine = [[mpmath.cos(angle)] for angle in state[:2]]
    sine = [[mpmath.sin(angle)] for angle in state[:2]]
    # C, S, the squares of the rates, a, b, D and the accelerations.
    c, s, squares, a, b, d = [], [], [[], []], [], [], []
    acceleration: list[list[mpf]] = [[], []]
    for i in range(order):
        c.append(product(cosine[0], cosine[1], i) + product(sine[0], sine[1], i))
        s.append(product(sine[0], cosine[1], i) - product(cosine[0], sine[1], i))
        for k in range(2):
            squares[k].append(product(rate[k], rate[k], i))
        a.append(-half * product(s, squares[1], i) - 3 * half * gamma * cosine[0][i])
        b.append(half * product(s, squares[0], i) - half * gamma * cosine[1][i])
        d.append((mpf(4) / 9 if i == 0 else 0) - product(c, c, i) / 4)
        right_sides = (
            third * a[i] - half * product(c, b, i),
            4 * third * b[i] - half * product(c, a, i),
        )
        for k in range(2):
            known = mpmath.fdot(d[1:], acceleration[k][::-1])
            acceleration[k].append((right_sides[k] - known) / d[0])
            theta[k].append(rate[k][i] / (i + 1))
            rate[k].append(acceleration[k][i] / (i + 1))
            cosine[k].append(-product(rate[k], sine[k], i) / (i + 1))
            sine[k].append(product(rate[k], cosine[k], i) / (i + 1))
    return [mpmath.polyval(series[::-1], step_s) for series in (*theta, *rate)]


def start(disturbed: int | None = None) -> State:
    """State at t = 0, one of its values disturbed if asked for."""
    state = [-mpmath.pi / 2 + mpf(swing) for swing in START_SWING_RAD] + [mpf(0), mpf(0)]
    if disturbed is not None:
        state[disturbed] += mpf(DISTURBANCE)
    return state


def run(settings: Settings, disturbed: int | None = None) -> list[State]:
    """The states at the times of the rows."""
    with mpmath.workdps(settings.digits):
        state, step_s = start(disturbed), mpf(1) / settings.steps_a_second
        states = [state]
        for step in range(1, END_S * settings.steps_a_second + 1):
            state = taylor_step(state, settings.order, step_s)
            if step % (settings.steps_a_second // ROWS_A_SECOND) == 0:
                states.append(state)
        return states


def energy_j(state: State) -> mpf:
    """E_kin + E_pot."""
    theta_1, theta_2, rate_1, rate_2 = state
    kinetic = (
        mpf(4) / 3 * rate_1**2 + rate_2**2 / 3 + rate_1 * rate_2 * mpmath.cos(theta_1 - theta_2)
    )
    potential = mpf(GRAVITY_M_S2) * (3 * mpmath.sin(theta_1) + mpmath.sin(theta_2))
    return MASS_KG * LENGTH_M * (LENGTH_M * kinetic + potential) / 2


def difference(states: list[State], others: list[State]) -> list[mpf]:
    """Largest difference of two motions, in rad or rad/s, row by row."""
    return [
        max(abs(x - y) for x, y in zip(state, other, strict=True))
        for state, other in zip(states, others, strict=True)
    ]


def header(error: mpf, energy_error: mpf, growth: list[mpf]) -> str:
    """The comment that says how the file was made and how good it is."""
    described = [
        f"{settings.digits} digits, Taylor series of order {settings.order}, "
        f"{settings.steps_a_second} steps a second"
        for settings in (RUN, PROOF)
    ]
    largest = max(growth)
    return (
        f"# {made_by('reference_pendulum.py', mpmath)}\n"
        f"# Double pendulum of two rods of {LENGTH_M} m, {MASS_KG} kg and 1/12 kg m^2 about the "
        f"centre, {GRAVITY_M_S2} m/s^2 along -y; at rest at -pi/2 + {START_SWING_RAD[0]} and "
        f"-pi/2 + {START_SWING_RAD[1]}.\n"
        f"# Settings: {described[0]}. Absolute angles, counterclockwise from +x.\n"
        f"# Own error: largest difference to a second run with {described[1]}: "
        f"{mpmath.nstr(error, 2)}; the energy changes by {mpmath.nstr(energy_error, 2)} J. "
        "All digits written are right.\n"
        f"# A disturbance of one value by {DISTURBANCE} at the start has grown "
        f"{mpmath.nstr(growth[-1], 3)} times at the end, {mpmath.nstr(largest, 3)} times in the "
        "worst row (the largest of the four values, the worst of the four disturbances).\n"
    )


def table(states: list[State]) -> str:
    """Heading and rows."""
    lines = [",".join(COLUMNS)]
    for row, state in enumerate(states):
        time = f"{row / ROWS_A_SECOND:.2f}"
        lines.append(",".join([time, *(mpmath.nstr(x, 17, strip_zeros=False) for x in state)]))
    return "\n".join(lines) + "\n"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description="Write the motion of a planar double pendulum to 17 digits."
    )
    parser.add_argument("--output", type=Path, default=DEFAULT_OUTPUT, help="CSV file to write")
    parser.add_argument(
        "--check",
        action="store_true",
        help="write nothing; exit with 1 if the rows of the file are others",
    )
    arguments = parser.parse_args()

    states = run(RUN)
    if arguments.check:
        lines = arguments.output.read_text(encoding="utf-8").splitlines(keepends=True)
        if "".join(line for line in lines if not line.startswith("#")) != table(states):
            sys.exit(f"{arguments.output} is stale: run derivations/reference_pendulum.py")
        return
    with mpmath.workdps(PROOF.digits):
        error = max(difference(states, run(PROOF)))
        energies = [energy_j(state) for state in states]
        energy_error = max(abs(energy - energies[0]) for energy in energies)
        if max(error, energy_error) > LARGEST_DIFFERENCE:
            sys.exit(f"the runs differ by {error}, the energy by {energy_error} J: nothing written")
        disturbed = [difference(states, run(DISTURBED_RUN, k)) for k in range(4)]
        growth = [max(row) / mpf(DISTURBANCE) for row in zip(*disturbed, strict=True)]
    text = header(error, energy_error, growth) + table(states)
    write(arguments.output, text)


if __name__ == "__main__":
    main()
