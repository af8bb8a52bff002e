"""One contact by CasADi and SUNDIALS: the planar chain as compiled C, with its analytic Jacobian.

The energies are those of derivations/reference_contacts.py. CasADi differentiates them, solves
M(q) q̈ = f by an LDLᵀ decomposition and writes all of it as C. Brushing velocity and penetration
depth are parameters, so one library serves every contact. CVODES (BDF, Newton) integrates in one
call, with the impulse as one more state, across the kinks of the contact force.
"""

import importlib.util
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType, SimpleNamespace

import casadi
import numpy as np


def load_reference() -> ModuleType:
    """derivations/reference_contacts.py."""
    path = Path(__file__).resolve().parents[2] / "derivations" / "reference_contacts.py"
    spec = importlib.util.spec_from_file_location("reference_contacts", path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


reference = load_reference()
SEGMENTS = reference.SEGMENTS
RATE_UNIT, IMPULSE_UNIT = reference.RATE_UNIT_RAD_S, reference.IMPULSE_UNIT_N_S
STATES = 2 * SEGMENTS + 1

# CasADi's default and its other direct solvers for the Newton matrix; the fastest here is used.
LINEAR_SOLVERS = ("qr", "lapacklu", "lapackqr", "csparse")

FLAGS = ("-O3", "-march=native", "-fPIC", "-shared")


class Equations(reference.PlanarFilament):
    """The planar chain with ω, β_0, a_e as symbols; y is (θ, θ̇, ∫ F_n dt) in its units."""

    def __init__(self) -> None:
        parameters = casadi.SX.sym("p", 3)
        rate, start, depth = (parameters[i] for i in range(3))
        self.contact_pass = SimpleNamespace(
            rate_rad_s=rate, start_angle_rad=start, penetration_depth_m=depth
        )
        instant = casadi.SX.sym("t")
        y = casadi.SX.sym("y", STATES)
        angles, rates = casadi.SX.sym("theta", SEGMENTS), casadi.SX.sym("theta_rate", SEGMENTS)
        accelerations = casadi.SX.sym("theta_acceleration", SEGMENTS)
        kinetic, springs, dissipation, gaps = self._energies_and_gaps(instant, angles, rates)
        penetrations = casadi.fmax(0, -gaps)
        contact_energy = reference.CONTACT_STIFFNESS_N_M / 2 * casadi.sumsqr(penetrations)
        contact_force = reference.CONTACT_STIFFNESS_N_M * casadi.sum1(penetrations)
        # Inertia by Appell's equations, the same in other words: O(n) operations, where the second
        # derivatives of E_kin take O(n²).
        appell = self._appell_function(instant, angles, rates, accelerations)
        residual = (
            casadi.gradient(appell, accelerations)
            + casadi.gradient(springs + contact_energy, angles)
            + casadi.gradient(dissipation, rates)
        )
        force = -casadi.substitute(residual, accelerations, casadi.SX.zeros(SEGMENTS))
        mass_matrix = casadi.hessian(kinetic, rates)[0]
        arguments = [instant, angles, rates, parameters]

        def of_state(
            name: str, extra: list[casadi.SX], results: list[casadi.SX]
        ) -> casadi.Function:
            """A function of (t, y, p) and `extra` from expressions in angles and rates."""
            function = casadi.Function("inner", [*arguments, *extra], results)
            called = function.call(
                [instant, y[:SEGMENTS], y[SEGMENTS:-1] * RATE_UNIT, parameters, *extra]
            )
            return casadi.Function(name, [instant, y, parameters, *extra], called)

        # ∂q̈ = −M⁻¹ ∂(M q̈ − f), at the q̈ of the state.
        self.motion = of_state("motion", [], [mass_matrix, force, rates, contact_force])
        self.tangents = of_state(
            "tangents",
            [accelerations],
            [
                casadi.densify(
                    -casadi.horzcat(
                        casadi.jacobian(residual, angles), casadi.jacobian(residual, rates)
                    )
                ),
                casadi.jacobian(contact_force, angles),
            ],
        )

    def _appell_function(
        self, instant: casadi.SX, angles: casadi.SX, rates: casadi.SX, accelerations: casadi.SX
    ) -> casadi.SX:
        """S = Σ ½ m |c̈|² + ½ J θ̈²: its gradient by q̈ is d/dt ∂E_kin/∂q̇ − ∂E_kin/∂q."""
        h = reference.LENGTH_M / SEGMENTS
        mass = reference.DENSITY_KG_M3 * casadi.pi * reference.DIAMETER_M**2 / 4 * h
        rate = self.contact_pass.rate_rad_s
        body_angle = self.contact_pass.start_angle_rad + rate * instant
        inward = -casadi.vertcat(casadi.cos(body_angle), casadi.sin(body_angle))
        node, total = reference.BODY_RADIUS_M * rate**2 * inward, 0
        for k in range(SEGMENTS):
            along = casadi.vertcat(casadi.cos(angles[k]), casadi.sin(angles[k]))
            across = casadi.vertcat(-along[1], along[0])
            turning = accelerations[k] * across - rates[k] ** 2 * along
            total += mass / 2 * casadi.sumsqr(node + h / 2 * turning)
            total += mass * h**2 / 24 * accelerations[k] ** 2
            node = node + h * turning
        return total

    def derivative(self, instant: casadi.MX, y: casadi.MX, parameters: casadi.MX) -> casadi.MX:
        """dy/dt."""
        mass_matrix, force, rates, contact_force = self.motion(instant, y, parameters)
        accelerations = casadi.solve(mass_matrix, force, "ldl")
        return casadi.vertcat(rates, accelerations / RATE_UNIT, contact_force / IMPULSE_UNIT)

    def jacobian(self, instant: casadi.MX, y: casadi.MX, parameters: casadi.MX) -> casadi.MX:
        """∂(dy/dt)/∂y."""
        mass_matrix, force, _, _ = self.motion(instant, y, parameters)
        accelerations = casadi.solve(mass_matrix, force, "ldl")
        right_sides, force_by_angles = self.tangents(instant, y, parameters, accelerations)
        by_state = casadi.solve(mass_matrix, right_sides, "ldl")
        zero_to_one = casadi.MX(SEGMENTS, 1)
        return casadi.vertcat(
            casadi.horzcat(
                casadi.MX(SEGMENTS, SEGMENTS),
                casadi.MX(RATE_UNIT * casadi.DM.eye(SEGMENTS)),
                zero_to_one,
            ),
            casadi.horzcat(by_state[:, :SEGMENTS] / RATE_UNIT, by_state[:, SEGMENTS:], zero_to_one),
            casadi.horzcat(force_by_angles / IMPULSE_UNIT, casadi.MX(1, SEGMENTS + 1)),
        )


def compiled(directory: Path) -> casadi.Function:
    """dy/dt of (t, y, p) as a library, which holds its Jacobian beside it."""
    instant, y, parameters = casadi.MX.sym("t"), casadi.MX.sym("y", STATES), casadi.MX.sym("p", 3)
    equations = Equations()
    arguments = [instant, y, parameters]
    generator = casadi.CodeGenerator("contact.c")
    generator.add(
        casadi.Function(
            "contact", arguments, [equations.derivative(*arguments)], ["t", "y", "p"], ["ode"]
        )
    )
    # By the name and the signature CasADi finds the Jacobian; those by t and p are not asked for.
    generator.add(
        casadi.Function(
            "jac_contact",
            [*arguments, casadi.MX(STATES, 1)],
            [casadi.MX(STATES, 1), equations.jacobian(*arguments), casadi.MX(STATES, 3)],
            ["t", "y", "p", "out_ode"],
            ["jac_ode_t", "jac_ode_y", "jac_ode_p"],
        )
    )
    generator.generate(f"{directory}/")
    library = directory / "contact.so"
    source = directory / "contact.c"
    subprocess.run(["cc", *FLAGS, source, "-o", library, "-lm"], check=True)
    return casadi.external("contact", str(library))


class Contact:
    """One pass by CVODES."""

    def __init__(
        self,
        function: casadi.Function,
        case: tuple[float, float],
        tolerance: float,
        linear_solver: str,
    ) -> None:
        contact_pass = reference.Pass(*case)
        self._parameters = [
            contact_pass.rate_rad_s,
            contact_pass.start_angle_rad,
            contact_pass.penetration_depth_m,
        ]
        self._start = np.concatenate(
            [
                np.full(SEGMENTS, contact_pass.start_angle_rad),
                np.full(SEGMENTS, contact_pass.rate_rad_s / RATE_UNIT),
                [0.0],
            ]
        )
        instant, y, p = casadi.MX.sym("t"), casadi.MX.sym("y", STATES), casadi.MX.sym("p", 3)
        self._integrator = casadi.integrator(
            "pass",
            "cvodes",
            {"t": instant, "x": y, "p": p, "ode": function(instant, y, p)},
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
        """Seconds, and the impulse p_n in N s."""
        start = time.perf_counter()
        end = self._integrator(x0=self._start, p=self._parameters)["xf"]
        seconds = time.perf_counter() - start
        return seconds, float(end[-1]) * IMPULSE_UNIT
