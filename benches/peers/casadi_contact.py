"""One contact by CasADi's equations with SUNDIALS' CVODES, in one call.

CasADi writes dy/dt and its Jacobian (casadi_equations.py) as C, with an LDLᵀ decomposition of the
dense M. CVODES (BDF of variable order, Newton) integrates these, with the impulse as one more state,
across the kinks of the contact force.
"""

import hashlib
import subprocess
import time
from pathlib import Path

import casadi
import numpy as np
from casadi_equations import IMPULSE_UNIT, RATE_UNIT, Planar, Spatial
from paper_case import Case, Pass

Equations = Planar | Spatial

# Number of columns for which CasADi asks for the given Jacobian once: all of them.
casadi.GlobalOptions.setMaxNumDir(2 * Spatial.coordinates + 1)

# CasADi's default and its other direct solvers for the Newton matrix; the fastest here is used.
LINEAR_SOLVERS = ("qr", "lapacklu", "lapackqr", "csparse")

FLAGS = ("-march=native", "-fPIC", "-shared", "-w")
# -O3 takes minutes for the tangents in space, and does not help these.
OPTIMISATION = {"planar": "-O3", "spatial": "-O2"}


def derivative(
    equations: Equations, instant: casadi.MX, y: casadi.MX, parameters: casadi.MX
) -> casadi.MX:
    """Returns dy/dt."""
    mass_matrix, force, rates, contact_force = equations.motion(instant, y, parameters)
    accelerations = casadi.solve(mass_matrix, force, "ldl")
    return casadi.vertcat(rates, accelerations / RATE_UNIT, contact_force / IMPULSE_UNIT)


def jacobian(
    equations: Equations, instant: casadi.MX, y: casadi.MX, parameters: casadi.MX
) -> casadi.MX:
    """∂(dy/dt)/∂y; from M q̈ = f follows ∂q̈ = −M⁻¹ ∂(M q̈ − f) at the q̈ of the state."""
    n = equations.coordinates
    mass_matrix, force, _, _ = equations.motion(instant, y, parameters)
    accelerations = casadi.solve(mass_matrix, force, "ldl")
    right_sides, force_by_q = equations.tangents(instant, y, parameters, accelerations)
    by_state = casadi.solve(mass_matrix, right_sides, "ldl")
    zeros = casadi.MX(n, 1)
    return casadi.vertcat(
        casadi.horzcat(casadi.MX(n, n), casadi.MX(RATE_UNIT * casadi.DM.eye(n)), zeros),
        casadi.horzcat(by_state[:, :n] / RATE_UNIT, by_state[:, n:], zeros),
        casadi.horzcat(force_by_q / IMPULSE_UNIT, casadi.MX(1, n + 1)),
    )


def shared_library(source: Path, flags: tuple[str, ...]) -> Path:
    """Compiles a file of C unless that has been done with the same text and flags."""
    text = source.read_bytes() + " ".join(flags).encode()
    library = source.with_name(f"{source.stem}-{hashlib.sha256(text).hexdigest()[:16]}.so")
    if not library.exists():
        fresh = library.with_suffix(".part")
        subprocess.run(["cc", *flags, source, "-o", fresh, "-lm"], check=True)
        fresh.rename(library)
    return library


class Library:
    """The compiled dy/dt of (t, y, p), which holds its Jacobian beside it."""

    def __init__(self, kind: type[Equations], directory: Path) -> None:
        self.kind = kind
        equations, n = kind(), 2 * kind.coordinates + 1
        instant, y, parameters = casadi.MX.sym("t"), casadi.MX.sym("y", n), casadi.MX.sym("p", 3)
        arguments = [instant, y, parameters]
        name = f"contact_{kind.name}"
        generator = casadi.CodeGenerator(f"{name}.c")
        ode = derivative(equations, *arguments)
        generator.add(casadi.Function(name, arguments, [ode], ["t", "y", "p"], ["ode"]))
        # CasADi finds the Jacobian by name and signature; it does not ask for those by t and p.
        generator.add(
            casadi.Function(
                f"jac_{name}",
                [*arguments, casadi.MX(n, 1)],
                [casadi.MX(n, 1), jacobian(equations, *arguments), casadi.MX(n, 3)],
                ["t", "y", "p", "out_ode"],
                ["jac_ode_t", "jac_ode_y", "jac_ode_p"],
            )
        )
        generator.generate(f"{directory}/")
        source = directory / f"{name}.c"
        self.path = shared_library(source, (OPTIMISATION[kind.name], *FLAGS))
        self.load()

    def load(self) -> None:
        """Loads the function; also in another process."""
        self.function = casadi.external(f"contact_{self.kind.name}", str(self.path))

    def __getstate__(self) -> dict[str, object]:
        return {"kind": self.kind, "path": self.path}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self.load()

    def start(self, contact_pass: Pass) -> np.ndarray:
        """y at t = 0: straight, turning rigidly with the body."""
        q, v = self.kind.straight(contact_pass.start_angle_rad, contact_pass.rate_rad_s)
        return np.array([*q, *(rate / RATE_UNIT for rate in v), 0.0])

    @staticmethod
    def parameters(contact_pass: Pass) -> np.ndarray:
        """Returns p."""
        return np.array(
            [
                contact_pass.rate_rad_s,
                contact_pass.start_angle_rad,
                contact_pass.penetration_depth_m,
            ]
        )


class Contact:
    """One pass by CVODES; as `plain`, without the compiled code and its Jacobian.

    CasADi then evaluates the equations and differentiates them, through the solve, by itself.
    """

    def __init__(
        self,
        library: Library,
        case: Case,
        tolerance: float,
        linear_solver: str,
        plain: bool = False,
    ) -> None:
        contact_pass = Pass(case)
        self._parameters = library.parameters(contact_pass)
        self._start = library.start(contact_pass)
        instant, p = casadi.MX.sym("t"), casadi.MX.sym("p", 3)
        y = casadi.MX.sym("y", len(self._start))
        ode = (
            derivative(library.kind(), instant, y, p) if plain else library.function(instant, y, p)
        )
        self._integrator = casadi.integrator(
            "pass",
            "cvodes",
            {"t": instant, "x": y, "p": p, "ode": ode},
            0.0,
            contact_pass.end_s,
            {
                "reltol": tolerance,
                "abstol": 0.1 * tolerance,
                "max_num_steps": 10_000_000,
                "linear_solver": linear_solver,
            },
        )

    def run(self) -> tuple[float, float]:
        """Returns seconds, and the impulse p_n in N s."""
        start = time.perf_counter()
        end = self._integrator(x0=self._start, p=self._parameters)["xf"]
        seconds = time.perf_counter() - start
        return seconds, float(end[-1]) * IMPULSE_UNIT
