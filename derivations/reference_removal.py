"""Rounding of an edge by a brush, by SciPy, for an invented work on the edge.

1. Preston's law: per turn of the tool dA/dN = k_P (N_f/b) W_e(R), with W_e = W_0 exp(a x + b x²),
   x = ln(R/R_0). It is given at some radii, too.
2. A(R) = [cot(Θ/2) − (π − Θ)/2] R² is the area between the faces of a corner and the arc that
   touches both. It is also integrated from these, across the bisector.
3. R(N) from dR/dN = (dA/dN)/(dA/dR), by SciPy's DOP853.

Run from the repository root:

    python derivations/reference_removal.py
"""

import json
import math

import numpy as np
import scipy
from cases import FILAMENT_COUNT, WIDTH_M
from files import DATA, made_by, rounded, write_cases
from scipy.integrate import quad, solve_ivp

PRESTON_M2_N = 1e-13
START_RADIUS_M = 1e-5
# Constants of W_e, close to the work of the paper's brush on an edge.
WORK_J, WORK_RADIUS_M, SLOPE, BEND = 1.7e-4, 1e-4, 0.02, -0.03
RADII_M = (1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3)
TURNS = (10.0, 100.0, 1e3, 1e4)
TOLERANCE = 1e-12


def work_j(radius_m: float) -> float:
    """Returns W_e(R)."""
    x = math.log(radius_m / WORK_RADIUS_M)
    return WORK_J * math.exp(SLOPE * x + BEND * x**2)


def area_per_square(angle_rad: float) -> float:
    """Returns A(R)/R²."""
    return 1 / math.tan(angle_rad / 2) - (math.pi - angle_rad) / 2


def area_by_quadrature(angle_rad: float) -> float:
    """Returns A(1), twice the area between face and arc, from the bisector to their contact."""
    half = angle_rad / 2

    def between(across: float) -> float:
        return 1 / math.sin(half) - math.sqrt(1 - across**2) - across / math.tan(half)

    return 2 * quad(between, 0.0, math.cos(half), epsabs=0.0, epsrel=1e-12)[0]


def radii_m(angle_rad: float) -> np.ndarray:
    """Returns R(N)."""
    growth = PRESTON_M2_N * FILAMENT_COUNT / WIDTH_M
    square = area_per_square(angle_rad)
    solution = solve_ivp(
        lambda _, radius: growth * work_j(radius[0]) / (2 * square * radius),
        (0.0, max(TURNS)),
        [START_RADIUS_M],
        method="DOP853",
        t_eval=TURNS,
        rtol=TOLERANCE,
        atol=1e-3 * TOLERANCE * START_RADIUS_M,
    )
    if not solution.success:
        raise RuntimeError(solution.message)
    return solution.y[0]


def result(angle_rad: float) -> dict[str, object]:
    """Returns the entry of a corner in the file."""
    square, area = area_per_square(angle_rad), area_by_quadrature(angle_rad)
    assert abs(area / square - 1) < 1e-11, (area, square)
    return {
        "included_angle_rad": angle_rad,
        "area_over_square": rounded(area),
        "turns": TURNS,
        "radii_m": rounded(radii_m(angle_rad)),
    }


def main() -> None:
    """Writes the file."""
    constants = {
        "preston_m2_n": PRESTON_M2_N,
        "filament_count": FILAMENT_COUNT,
        "width_m": WIDTH_M,
        "start_radius_m": START_RADIUS_M,
    }
    work = {
        "formula": "work_j exp(slope x + bend x²), x = ln(R/radius_m)",
        "work_j": WORK_J,
        "radius_m": WORK_RADIUS_M,
        "slope": SLOPE,
        "bend": BEND,
        "radii_m": RADII_M,
        "edge_sliding_works_j": rounded([work_j(radius) for radius in RADII_M]),
    }
    command = made_by("reference_removal.py", np, scipy)
    write_cases(
        DATA / "reference_removal.json",
        f"{command}: DOP853, relative tolerance {TOLERANCE:g}",
        [result(math.radians(degrees)) for degrees in (30, 60, 90, 120, 150)],
        constants=json.dumps(constants),
        work_on_edge=json.dumps(work, ensure_ascii=False),
    )


if __name__ == "__main__":
    main()
