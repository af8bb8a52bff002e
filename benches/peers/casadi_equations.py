"""The chain's equations in CasADi, with dense matrices, in the plane and in space.

Each chain has two functions of (t, y, p). y is (q, q̇, ∫ F_n dt) in units that fit (`RATE_UNIT`,
`IMPULSE_UNIT`); p is (ω, β_0, a_e), so that one library serves every contact.

`motion` gives M, f, q̇ and F_n, with M q̈ = f. `tangents` gives −∂(M q̈ − f)/∂(q, q̇) and ∂F_n/∂q for
the Jacobian of q̈ = M⁻¹ f. CasADi's own differentiation through the solve would form it from one
pass for each column, ten times as slowly.
"""

import math

import casadi
from paper_case import SEGMENTS

# isort: split
# From derivations, which paper_case puts on the path.
import cases
from casadi_chain.energies import direction_about_z
from casadi_chain.expressions import Motion
from casadi_chain.whole import whole_equations
from motion import INTEGRAL_UNIT, RATE_UNIT_RAD_S
from filaments import Clamp, chain

RATE_UNIT, IMPULSE_UNIT = RATE_UNIT_RAD_S, INTEGRAL_UNIT


class Planar:
    """The planar chain of derivations/filaments.py: one azimuth a segment."""

    name = "planar"
    coordinates = SEGMENTS

    def __init__(self) -> None:
        parameters = casadi.SX.sym("p", 3)
        rate, start, depth = (parameters[i] for i in range(3))
        instant = casadi.SX.sym("t")
        y = casadi.SX.sym("y", 2 * SEGMENTS + 1)
        angles, rates = casadi.SX.sym("theta", SEGMENTS), casadi.SX.sym("theta_rate", SEGMENTS)
        accelerations = casadi.SX.sym("theta_acceleration", SEGMENTS)
        angle = start + rate * instant
        radial = casadi.vertcat(casadi.cos(angle), casadi.sin(angle), 0)
        body_rate = casadi.vertcat(0, 0, rate)
        clamp = Clamp(cases.BODY_RADIUS_M * radial, radial, angle, body_rate)
        stated = chain((instant, angles, rates), angles, clamp, cases.Filament(SEGMENTS))
        kinetic, springs, dissipation = stated.kinetic, stated.springs, stated.dissipation
        penetrations = casadi.fmax(0, depth - cases.TOOL_RADIUS_M - stated.nodes[1, 1:].T)
        contact_energy = cases.CONTACT_STIFFNESS_N_M / 2 * casadi.sumsqr(penetrations)
        contact_force = cases.CONTACT_STIFFNESS_N_M * casadi.sum1(penetrations)
        # Appell's equations give the same inertia in O(n) operations, where the second derivatives
        # of E_kin take O(n²).
        motion = angles, rates, accelerations
        appell = self._appell_function(angle, rate, *motion)
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

    @staticmethod
    def _appell_function(
        body_angle: casadi.SX,
        rate: casadi.SX,
        angles: casadi.SX,
        rates: casadi.SX,
        accelerations: casadi.SX,
    ) -> casadi.SX:
        """S = Σ ½ m |c̈|² + ½ J θ̈²: its gradient by q̈ is d/dt ∂E_kin/∂q̇ − ∂E_kin/∂q."""
        h = cases.LENGTH_M / SEGMENTS
        mass = cases.DENSITY_KG_M3 * casadi.pi * cases.DIAMETER_M**2 / 4 * h
        inward = -casadi.vertcat(casadi.cos(body_angle), casadi.sin(body_angle))
        node, total = cases.BODY_RADIUS_M * rate**2 * inward, 0
        for k in range(SEGMENTS):
            along = casadi.vertcat(casadi.cos(angles[k]), casadi.sin(angles[k]))
            across = casadi.vertcat(-along[1], along[0])
            turning = accelerations[k] * across - rates[k] ** 2 * along
            total += mass / 2 * casadi.sumsqr(node + h / 2 * turning)
            total += mass * h**2 / 24 * accelerations[k] ** 2
            node = node + h * turning
        return total

    @staticmethod
    def straight(angle: float, rate: float) -> tuple[list[float], list[float]]:
        """q and q̇ of the filament that turns rigidly with the body."""
        return [angle] * SEGMENTS, [rate] * SEGMENTS


class Spatial:
    """The spatial chain of derivations/casadi_chain: φ, θ of each segment."""

    name = "spatial"
    coordinates = 2 * SEGMENTS

    def __init__(self) -> None:
        parameters = casadi.SX.sym("p", 3)
        rate, start, depth = (parameters[i] for i in range(3))
        instant = casadi.SX.sym("t")
        body_angle = start + rate * instant
        chain = ChainExpressions(body_angle, rate)
        q, v = chain.q, chain.v

        height = cases.BODY_RADIUS_M * casadi.sin(body_angle)
        gaps = []
        for k in range(SEGMENTS):
            direction = direction_about_z(q[2 * k], q[2 * k + 1])
            height += cases.LENGTH_M / SEGMENTS * direction[1]
            gaps.append(height + cases.TOOL_RADIUS_M - depth)
        penetrations = casadi.fmax(0, -casadi.vertcat(*gaps))
        stiffness = cases.CONTACT_STIFFNESS_N_M
        contact_force = stiffness * casadi.sum1(penetrations)
        pressing = casadi.gradient(stiffness / 2 * casadi.sumsqr(penetrations), q)

        y = casadi.SX.sym("y", 2 * self.coordinates + 1)
        accelerations = casadi.SX.sym("a", self.coordinates)
        residual = chain.residual(accelerations) + pressing
        by_state = casadi.horzcat(casadi.jacobian(residual, q), casadi.jacobian(residual, v))
        states = [q, v]
        values = [y[: self.coordinates], y[self.coordinates : -1] * RATE_UNIT]

        def of_state(
            name: str, extra: list[casadi.SX], results: list[casadi.SX]
        ) -> casadi.Function:
            """A function of (t, y, p) and `extra` from expressions in q and q̇."""
            results = casadi.substitute(results, states, values)
            arguments = [instant, y, parameters, *extra]
            return casadi.Function(name, arguments, results, {"cse": True})

        self.motion = of_state(
            "motion", [], [chain.mass_matrix, chain.force - pressing, v, contact_force]
        )
        self.tangents = of_state(
            "tangents",
            [accelerations],
            [casadi.densify(-by_state), casadi.jacobian(contact_force, q)],
        )

    @staticmethod
    def straight(angle: float, rate: float) -> tuple[list[float], list[float]]:
        """q and q̇ of the filament that turns rigidly with the body."""
        return [math.pi / 2, angle] * SEGMENTS, [0.0, rate] * SEGMENTS


class ChainExpressions:
    """M, f and M q̈ − f of casadi_chain for the round tool's clamp and the paper's filament."""

    def __init__(self, angle: casadi.SX, rate: casadi.SX) -> None:
        derived = whole_equations(SEGMENTS, Motion.SPATIAL)
        self._results = {
            result.name: result.value for function in derived for result in function.results
        }
        self._arguments = {
            argument.name: casadi.vertcat(*(variable for _, variable in argument.elements))
            for argument in derived[0].arguments
        }
        radial = casadi.vertcat(casadi.cos(angle), casadi.sin(angle), 0)
        radius, filament = cases.BODY_RADIUS_M, cases.Filament(SEGMENTS)
        self._values = {
            "root_position": radius * radial,
            "root_acceleration": -radius * rate**2 * radial,
            "clamp_direction": radial,
            "angular_velocity": casadi.vertcat(0, 0, rate),
            "gravity": casadi.SX.zeros(3),
            "segment_length": filament.segment_m,
            "segment_mass": casadi.DM(filament.masses_kg),
            "segment_inertia": casadi.DM(filament.inertias_kg_m2),
            "joint_stiffness": casadi.DM(filament.stiffnesses_n_m),
            "joint_damping": casadi.DM(filament.dampings_n_m_s),
            "relaxed_angle": casadi.DM.zeros(SEGMENTS),
            # ṙ_0 drops out of the equations, see casadi_chain.
            "root_velocity": casadi.SX.zeros(3),
        }
        self.q, self.v = self._arguments["q"], self._arguments["v"]
        self.mass_matrix = self._with_values(self._results["mass_matrix"])
        self.force = self._with_values(self._results["force"])

    def residual(self, accelerations: casadi.SX) -> casadi.SX:
        """M q̈ − f in O(n) operations, where the product with the dense M takes O(n²)."""
        kinetic = self._results["kinetic"]
        root_velocity = self._arguments["root_velocity"]
        momenta = casadi.gradient(kinetic, self.v)
        momenta_rate = casadi.jtimes(
            momenta,
            casadi.vertcat(self.q, root_velocity, self.v),
            casadi.vertcat(self.v, self._arguments["root_acceleration"], accelerations),
        )
        potential = self._results["spring"] + self._results["gravity"]
        return self._with_values(
            momenta_rate
            - casadi.gradient(kinetic - potential, self.q)
            + casadi.gradient(self._results["dissipation"], self.v)
        )

    def _with_values(self, expression: casadi.SX) -> casadi.SX:
        symbols = [self._arguments[name] for name in self._values]
        values = [casadi.SX(value) for value in self._values.values()]
        return casadi.substitute([expression], symbols, values)[0]
