"""Kernels of one segment."""

from collections.abc import Sequence

import casadi
from casadi import SX

from casadi_chain.energies import Segment, gravity_energy, kinetic_energy, rigid_rate
from casadi_chain.expressions import Argument, Derived, Motion, Result, Symbols, kernel


class FreeSegment:
    """One segment whose inner end x moves freely."""

    def __init__(self, symbols: Symbols, segment: Segment) -> None:
        """Adds all variables but those of the inner end's motion."""
        self.symbols, self.segment = symbols, segment
        # For differentiation; an argument of the energies only.
        self.base_velocity = SX.sym("base_velocity", segment.sides[0].shape[0])
        self.length = symbols.scalar("segment_length", "h", "m")
        self.mass = symbols.scalar("segment_mass", "m", "kg")
        self.inertia = symbols.scalar("segment_inertia", "J", "kg m^2")

    @classmethod
    def new(cls, motion: Motion) -> "FreeSegment":
        """Creates a segment in space or in the plane."""
        symbols = Symbols()
        return cls(symbols, Segment.new(symbols, motion))

    @property
    def kinetic(self) -> SX:
        """E_kin in J."""
        direction_rate = self.segment.sides[1]
        centre_velocity = self.base_velocity + self.length / 2 * direction_rate
        return kinetic_energy(self.mass, self.inertia, centre_velocity, direction_rate)

    @property
    def reach(self) -> tuple[SX, SX]:
        """h e and h ė."""
        direction, direction_rate = self.segment.sides
        return self.length * direction, self.length * direction_rate

    def at_rest(self, expression: SX) -> SX:
        """Changes to the inertial frame in which the inner end rests at the moment."""
        rest = SX.zeros(self.base_velocity.shape[0])
        return casadi.substitute(expression, self.base_velocity, rest)

    def inverse_dynamics(
        self, accelerations: SX, base_acceleration: SX, outer_force: SX
    ) -> tuple[SX, SX, SX]:
        """The torques τ, the force p at the inner end, and the acceleration of the outer end."""
        q, v = self.segment.coordinates, self.segment.rates

        def time_derivative(expression: SX) -> SX:
            return casadi.jtimes(
                expression,
                casadi.vertcat(q, v, self.base_velocity),
                casadi.vertcat(v, accelerations, base_acceleration),
            )

        reach, reach_rate = self.reach
        torque = (
            time_derivative(casadi.gradient(self.kinetic, v))
            - casadi.gradient(self.kinetic, q)
            # Gᵀ F: the outer force does work on δ(h e).
            + casadi.gradient(casadi.dot(reach, outer_force), q)
        )
        base_force = time_derivative(casadi.gradient(self.kinetic, self.base_velocity))
        outer_acceleration = base_acceleration + time_derivative(reach_rate)
        return self.at_rest(torque), self.at_rest(base_force), self.at_rest(outer_acceleration)

    def constants(self) -> list[Argument]:
        """h, m and J as arguments."""
        return [
            Argument.of_symbols("segment_length", "h in m", self.length),
            Argument.of_symbols("segment_mass", "m in kg", self.mass),
            Argument.of_symbols("segment_inertia", "J in kg m²", self.inertia),
        ]


def segment_kernel(motion: Motion) -> Derived:
    """`segment`: kinematics and inertia of one segment."""
    free = FreeSegment.new(motion)
    q, v = free.segment.coordinates, free.segment.rates
    size, axes = len(motion.angles), len(motion.axes)
    reach, reach_rate = free.reach
    base_momentum = casadi.gradient(free.kinetic, free.base_velocity)
    inertia, momentum = casadi.hessian(free.kinetic, v)
    bias = free.at_rest(casadi.jtimes(momentum, q, v) - casadi.gradient(free.kinetic, q))
    bias_doc = "`τ_0 = d/dt(∂E_kin/∂q̇) − ∂E_kin/∂q` for `ẍ = 0`, `q̈ = 0`"
    coupling, base_bias = casadi.jacobian(base_momentum, v), casadi.jtimes(base_momentum, q, v)
    base_bias_doc = "`p_0 = d/dt(∂E_kin/∂ẋ)` for `ẍ = 0`, `q̈ = 0`"
    slopes, reach_bias = casadi.jacobian(reach, q), casadi.jtimes(reach_rate, q, v)
    results = [
        Result.matrix("inertia", f"`I = ∂²E_kin/∂q̇²`, {size} × {size}", "kg m^2", inertia),
        Result.matrix("coupling", f"`C = ∂²E_kin/∂ẋ∂q̇`, {axes} × {size}", "kg m", coupling),
        Result.vector("bias", bias_doc, "N m", bias),
        Result.vector("base_bias", base_bias_doc, "N", base_bias),
        Result.vector("reach", "`h e`, outer end less inner end", "m", reach),
        Result.vector("reach_rate", "`h ė`", "m s^-1", reach_rate),
        Result.matrix("reach_jacobian", f"`G = ∂(h e)/∂q`, {axes} × {size}", "m", slopes),
        Result.vector("reach_bias", "`b = h ë` for `q̈ = 0`", "m s^-2", reach_bias),
    ]
    arguments = [
        free.segment.trigonometry("angles"),
        free.segment.rates_argument("rates"),
        *free.constants(),
    ]
    summary = (
        "Kinematics and inertia of one segment, seen from its inner end `x`:\n"
        "`p = m ẍ + C q̈ + p_0 + F`, `τ = Cᵀ ẍ + I q̈ + τ_0 + Gᵀ F`, `ẍ' = ẍ + G q̈ + b`,\n"
        "from `E_kin = ½ m |ẋ + ½ h ė|² + ½ J |ė|²`."
    )
    return kernel(motion, "segment", summary, free.symbols, arguments, results)


def along_step(expression: SX, variables: Sequence[tuple[SX, SX | int]], coordinates: int) -> SX:
    """Returns derivatives along the acceleration of each coordinate; a column a coordinate.

    `variables` has vectors with one element a coordinate, and their weights of the acceleration.
    """
    of_all = casadi.vertcat(*(variable for variable, _ in variables))
    unit_steps = casadi.horzsplit(SX.eye(coordinates))
    steps = [casadi.vertcat(*(weight * step for _, weight in variables)) for step in unit_steps]
    return casadi.horzcat(*(casadi.jtimes(expression, of_all, step) for step in steps))


def step_weights(symbols: Symbols) -> tuple[SX, SX, list[Argument]]:
    """w_q and w_v: δq = w_q δq̈, δq̇ = w_v δq̈."""
    coordinate_weight = symbols.scalar("coordinate_weight", "w_q", "s^2")
    rate_weight = symbols.scalar("rate_weight", "w_v", "s")
    arguments = [
        Argument.of_symbols("coordinate_weight", "w_q in s²: δq = w_q δq̈", coordinate_weight),
        Argument.of_symbols("rate_weight", "w_v in s: δq̇ = w_v δq̈", rate_weight),
    ]
    return coordinate_weight, rate_weight, arguments


def segment_tangent_kernel(motion: Motion) -> Derived:
    """`segment_tangent`: derivatives of a segment's torques and forces by its acceleration."""
    free = FreeSegment.new(motion)
    symbols = free.symbols
    q, v = free.segment.coordinates, free.segment.rates
    size, axes = len(motion.angles), len(motion.axes)
    accelerations = casadi.vertcat(
        *(
            symbols.scalar(f"{name}_acceleration", f"{letter}̈", "rad s^-2")
            for name, letter in motion.angles
        )
    )
    base_acceleration = symbols.vector("base_acceleration", "ẍ", "m s^-2", motion)
    outer_force = symbols.vector("outer_force", "F", "N", motion)
    coordinate_weight, rate_weight, weights = step_weights(symbols)
    torque, base_force, outer_acceleration = free.inverse_dynamics(
        accelerations, base_acceleration, outer_force
    )

    def tangent(expression: SX) -> SX:
        step = [(q, coordinate_weight), (v, rate_weight), (accelerations, 1)]
        return along_step(expression, step, size)

    results = [
        Result.matrix("torque", f"`∂τ/∂q̈`, {size} × {size}", "kg m^2", tangent(torque)),
        Result.matrix("base_force", f"`∂p/∂q̈`, {axes} × {size}", "kg m", tangent(base_force)),
        Result.matrix(
            "outer_acceleration", f"`∂ẍ'/∂q̈`, {axes} × {size}", "m", tangent(outer_acceleration)
        ),
    ]
    spatial = motion is Motion.SPATIAL
    name = "accelerations" if spatial else "theta_acceleration"
    doc = "φ̈, θ̈ in rad/s²" if spatial else "θ̈ in rad/s²"
    arguments = [
        free.segment.trigonometry("angles"),
        free.segment.rates_argument("rates"),
        Argument.of_symbols(name, doc, accelerations),
        Argument.of_symbols("base_acceleration", "ẍ in m/s²", base_acceleration),
        Argument.of_symbols("outer_force", "F in N", outer_force),
        *free.constants(),
        *weights,
    ]
    summary = (
        f"Tangent of one segment: how `τ`, `p` and `ẍ'` of [`{motion.named('segment')}`] change "
        "with its own `q̈` when\n"
        "`δq = w_q δq̈` and `δq̇ = w_v δq̈`, for fixed `ẍ` and `F`."
    )
    return kernel(motion, "segment_tangent", summary, symbols, arguments, results)


def segment_energy_kernel(motion: Motion) -> Derived:
    """`segment_energy`: kinetic and potential energy of one segment."""
    free = FreeSegment.new(motion)
    base_position = free.symbols.vector("base_position", "x", "m", motion)
    base_velocity = free.symbols.vector("base_velocity", "ẋ", "m s^-1", motion)
    gravity = free.symbols.vector("gravity", "g", "m s^-2", motion)
    centre = base_position + free.length / 2 * free.segment.sides[0]
    kinetic = casadi.substitute(free.kinetic, free.base_velocity, base_velocity)
    results = [
        Result.scalar("kinetic", "`E_kin`", "J", kinetic),
        Result.scalar("gravity", "`E_grav`", "J", gravity_energy(free.mass, gravity, centre)),
    ]
    arguments = [
        free.segment.trigonometry("angles"),
        free.segment.rates_argument("rates"),
        Argument.of_symbols("base_position", "x in m", base_position),
        Argument.of_symbols("base_velocity", "ẋ in m/s", base_velocity),
        Argument.of_symbols("gravity", "g in m/s²", gravity),
        *free.constants(),
    ]
    summary = "Energies of one segment: `½ m |ẋ + ½ h ė|² + ½ J |ė|²` and `−m g·(x + ½ h e)`."
    return kernel(motion, "segment_energy", summary, free.symbols, arguments, results)


def rigid_rates_kernel() -> Derived:
    """`rigid_rates`: motion of a segment that turns rigidly with the body."""
    symbols = Symbols()
    segment = Segment.new(symbols, Motion.SPATIAL)
    body_rate = symbols.vector("angular_velocity", "Ω", "rad s^-1", Motion.SPATIAL)
    direction = segment.sides[0]
    # Ω × e = (∂e/∂q) q̇_r. The columns of ∂e/∂q are perpendicular, of the lengths 1 and sin φ.
    by_coordinates = casadi.jacobian(direction, segment.coordinates)
    along = by_coordinates.T @ rigid_rate(body_rate, direction)
    sine = casadi.sin(segment.coordinates[0])
    rates = casadi.vertcat(along[0], along[1] / sine**2)
    slopes = casadi.jacobian(rates, segment.coordinates)
    return Derived(
        "rigid_rates",
        "Rates of a segment that turns rigidly with the body, `Ω × e = (∂e/∂q) q̇_r`, and how they "
        "change with its coordinates.\n"
        "In the chart about x the components of `Ω` are in the order y, z, x.",
        symbols,
        [
            segment.trigonometry("angles"),
            Argument.of_symbols("angular_velocity", "Ω of the body in rad/s", body_rate),
        ],
        [
            Result.vector("rates", "`q̇_r`", "rad s^-1", rates),
            Result.matrix("slopes", "`∂q̇_r/∂q`, 2 × 2", "rad s^-1", slopes),
        ],
    )
