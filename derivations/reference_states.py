"""Equations of motion of the spatial segment chain at chosen states, to 60 digits.

What enters: the filament of the paper's case and a seed.
What leaves: a JSON file of states with their accelerations, energies, dissipation and tip
position, and for short chains the mass matrix. The Rust code is compared with them.

The derivation is by hand and shares nothing with other code: no symbolic differentiation,
no recursion along the chain, no series in place of the bending angle. The mass matrix is
written down in closed form and solved densely, in mpmath arithmetic. Entries of the mass matrix
that vanish come out as 1e-70 or so, the rounding of 60 digits; more digits change nothing else.

Model (Uhlmann and Hoyer, Ceramics 2021, Eq. 1, with the choices of the project's model page)
---------------------------------------------------------------------------------------------
SI units, angles in radians, segments k = 1 … n of length h = l_f/n, mass m = ρ A h and
transverse moment of inertia J = m h²/12. Inertial frame with z along the tool axis.

Segment k points along e_k = (sin φ_k cos θ_k, sin φ_k sin θ_k, cos φ_k). The clamp is
e_0 = (cos β, sin β, 0) at the root r_0 = r_g e_0, and turns by β(t), β̇ = ω.

Derivation
----------
1. Kinetic energy. A centre moves with ċ_k = ṙ_0 + h Σ_{j<k} ė_j + (h/2) ė_k, hence
       E_kin = ½ Σ_jk A_jk ė_j·ė_k + Σ_k B_k ṙ_0·ė_k + ½ n m |ṙ_0|²,
       A_jk  = m h² (n − max(j, k) + ½)   for j ≠ k,
       A_kk  = m h² (n − k + ¼) + J,
       B_k   = m h (n − k + ½).
   A and B are constant, so with ∂ the derivative by one of the two angles of segment j,
       d/dt ∂E_kin/∂q̇ − ∂E_kin/∂q = ∂e_j · (Σ_k A_jk ë_k + B_j r̈_0).
   Gravity adds −∂e_j · B_j g on the same side.
2. ë_k = ∂_φ e_k φ̈_k + ∂_θ e_k θ̈_k + b_k with
       b_k = ∂_φφ e_k φ̇_k² + 2 ∂_φθ e_k φ̇_k θ̇_k + ∂_θθ e_k θ̇_k²,
   so that M has the entries A_jk ∂e_j·∂e_k, and the b_k are the gyroscopic terms.
3. Springs, ½ c_k α_k² with α_k = atan2(|e_{k−1} × e_k|, e_{k−1}·e_k). From
   cos α_k = e_{k−1}·e_k follows −∂(½ c_k α_k²) = c_k (α_k / sin α_k) ∂(e_{k−1}·e_k).
   Stiffness c_k = E I/h, but c_1 = 2 E I/h.
4. Dampers, D = Σ_k ½ d_k |ω_k − ω_{k−1}|² with ω_k = e_k × ė_k. As ∂ω_k/∂q̇ = e_k × ∂e_k,
       −∂D/∂q̇ = −d_k (ω_k − ω_{k−1})·(e_k × ∂e_k) + d_{k+1} (ω_{k+1} − ω_k)·(e_k × ∂e_k).
   d_k = (2 ζ/Ω_1) c_k, Ω_1 = λ_1² √(E I/(ρ A l_f⁴)), λ_1 = 1.8751040687.

Run from the repository root:

    python derivations/reference_states.py
"""

import argparse
import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import mpmath
from cases import (
    BODY_RADIUS_M,
    DAMPING_RATIO,
    DATA,
    DENSITY_KG_M3,
    DIAMETER_M,
    FIRST_CANTILEVER_ROOT,
    LENGTH_M,
    SOFT_YOUNGS_MODULUS_PA,
    TOOL_RADIUS_M,
    YOUNGS_MODULUS_PA,
    State,
    compact,
    made_by,
    write,
)
from mpmath import mpf

SEGMENT_COUNTS = (1, 2, 3, 7, 25)
SOFT_SEGMENT_COUNT = 7
RANDOM_STATES_PER_COUNT = 3
SOFT_STATES = 2
# Longer chains would make the file large and test nothing new.
LARGEST_COUNT_WITH_MASS_MATRIX = 3

# Below this sine the bending angle is replaced by the first terms of its series; the relative
# error, of order sin⁴ α = 1e-80, is far below 60 digits.
SMALL_SINE = mpf("1e-20")

Vector = tuple[mpf, mpf, mpf]


@dataclass(frozen=True)
class ChainConstants:
    """Constants of a chain; the lists run over segments or joints, from the root to the tip."""

    segment_length_m: mpf
    segment_mass_kg: mpf
    segment_inertia_kg_m2: mpf
    joint_stiffness_n_m: list[mpf]  # c_k in N m/rad
    joint_damping_n_m_s: list[mpf]  # d_k in N m s/rad


@dataclass(frozen=True)
class Segment:
    """Direction of a segment (or of the clamp), its rate, and its derivatives by φ and θ."""

    direction: Vector  # e_k
    direction_rate: Vector  # ė_k in 1/s
    gradients: tuple[Vector, Vector]  # ∂_φ e_k and ∂_θ e_k
    bias: Vector  # b_k in 1/s²: ë_k where the second derivatives of the angles vanish

    def rate_in_body(self, body_rate: Vector) -> Vector:
        """ω_k = e_k × (ė_k − Ω × e_k) in rad/s, with Ω of the body."""
        rigid = cross(body_rate, self.direction)
        return cross(self.direction, combination((1, self.direction_rate), (-1, rigid)))


@dataclass(frozen=True)
class Clamp:
    """Motion of the root r_0 (m, m/s, m/s²); `segment` has the clamp direction and its rate."""

    segment: Segment
    position: Vector
    velocity: Vector
    acceleration: Vector


def dot(a: Vector, b: Vector) -> mpf:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def combination(*terms: tuple[mpf | int, Vector]) -> Vector:
    """Sum of `factor * vector` over the pairs given."""
    return tuple(sum(factor * vector[i] for factor, vector in terms) for i in range(3))


def chain_constants(segments: int, youngs_modulus_pa: float) -> ChainConstants:
    """Lengths, inertias, stiffnesses and dampings from the paper's constants."""
    length, diameter = mpf(LENGTH_M), mpf(DIAMETER_M)
    area = mpmath.pi * diameter**2 / 4
    bending_stiffness = mpf(youngs_modulus_pa) * mpmath.pi * diameter**4 / 64
    mass_per_length = mpf(DENSITY_KG_M3) * area

    h = length / segments
    mass = mass_per_length * h
    # The clamp joint carries only half a segment's compliance.
    stiffness = [bending_stiffness / h * (2 if joint == 0 else 1) for joint in range(segments)]
    first_frequency = mpf(FIRST_CANTILEVER_ROOT) ** 2 * mpmath.sqrt(
        bending_stiffness / (mass_per_length * length**4)
    )
    damping_time = 2 * mpf(DAMPING_RATIO) / first_frequency
    return ChainConstants(
        segment_length_m=h,
        segment_mass_kg=mass,
        segment_inertia_kg_m2=mass * h**2 / 12,
        joint_stiffness_n_m=stiffness,
        joint_damping_n_m_s=[damping_time * c for c in stiffness],
    )


def clamp_of(state: State) -> Clamp:
    """Motion of a radial clamp on a body that turns about z: e_0 = (cos β, sin β, 0)."""
    angle, rate = mpf(state.base_angle), mpf(state.base_rate)
    radial = (mpmath.cos(angle), mpmath.sin(angle), mpf(0))
    tangential = (-radial[1], radial[0], mpf(0))
    velocity = combination((rate, tangential))
    acceleration = combination((mpf(state.base_acceleration), tangential), (-(rate**2), radial))
    radius = mpf(BODY_RADIUS_M)
    zero = (mpf(0),) * 3
    return Clamp(
        segment=Segment(radial, velocity, (zero, zero), acceleration),
        position=combination((radius, radial)),
        velocity=combination((radius, velocity)),
        acceleration=combination((radius, acceleration)),
    )


def segment_of(polar: mpf, azimuth: mpf, polar_rate: mpf, azimuth_rate: mpf) -> Segment:
    """Direction e(φ, θ) with all derivatives the equations need (step 2 of the derivation)."""
    sin_p, cos_p = mpmath.sin(polar), mpmath.cos(polar)
    sin_a, cos_a = mpmath.sin(azimuth), mpmath.cos(azimuth)
    by_polar = (cos_p * cos_a, cos_p * sin_a, -sin_p)
    by_azimuth = (-sin_p * sin_a, sin_p * cos_a, mpf(0))
    by_polar_twice = (-sin_p * cos_a, -sin_p * sin_a, -cos_p)
    by_both = (-cos_p * sin_a, cos_p * cos_a, mpf(0))
    by_azimuth_twice = (-sin_p * cos_a, -sin_p * sin_a, mpf(0))
    return Segment(
        direction=(sin_p * cos_a, sin_p * sin_a, cos_p),
        direction_rate=combination((polar_rate, by_polar), (azimuth_rate, by_azimuth)),
        gradients=(by_polar, by_azimuth),
        bias=combination(
            (polar_rate**2, by_polar_twice),
            (2 * polar_rate * azimuth_rate, by_both),
            (azimuth_rate**2, by_azimuth_twice),
        ),
    )


def bending_angle(previous: Segment, segment: Segment) -> tuple[mpf, mpf]:
    """Angle α in rad between two directions, and α / sin α, regular at α = 0."""
    normal = cross(previous.direction, segment.direction)
    sine = mpmath.sqrt(dot(normal, normal))
    angle = mpmath.atan2(sine, dot(previous.direction, segment.direction))
    ratio = angle / sine if sine > SMALL_SINE else 1 + sine**2 / 6
    return angle, ratio


def inertia_coefficient(constants: ChainConstants, segments: int, j: int, k: int) -> mpf:
    """A_jk in kg m² (step 1), with j and k counted from 0."""
    m, h = constants.segment_mass_kg, constants.segment_length_m
    if j == k:
        return m * h**2 * (segments - 1 - j + mpf(1) / 4) + constants.segment_inertia_kg_m2
    return m * h**2 * (segments - max(j, k) - mpf(1) / 2)


def mass_matrix_and_inertial_forces(
    state: State, clamp: Clamp, chain: Sequence[Segment], constants: ChainConstants
) -> tuple[mpmath.matrix, mpmath.matrix]:
    """M(q), and the generalised forces of gravity, base acceleration and gyroscopic terms."""
    n = len(chain)
    gravity = tuple(mpf(component) for component in state.gravity)
    mass_matrix, forces = mpmath.matrix(2 * n, 2 * n), mpmath.matrix(2 * n, 1)
    for j in range(n):
        row = [inertia_coefficient(constants, n, j, k) for k in range(n)]
        # B_j in kg m.
        base_coefficient = (
            constants.segment_mass_kg * constants.segment_length_m * (n - j - mpf(1) / 2)
        )
        reaction = combination(
            *((row[k], chain[k].bias) for k in range(n)),
            (base_coefficient, clamp.acceleration),
            (-base_coefficient, gravity),
        )
        for a in range(2):
            gradient = chain[j].gradients[a]
            forces[2 * j + a] = -dot(gradient, reaction)
            for k in range(n):
                for b in range(2):
                    mass_matrix[2 * j + a, 2 * k + b] = row[k] * dot(
                        gradient, chain[k].gradients[b]
                    )
    return mass_matrix, forces


def joint_forces(
    state: State, clamp: Clamp, chain: Sequence[Segment], constants: ChainConstants
) -> tuple[mpmath.matrix, mpmath.matrix, mpf, mpf]:
    """Generalised forces of springs and of dampers (steps 3 and 4), E_spring in J and D in W."""
    n = len(chain)
    spring_forces, damper_forces = mpmath.matrix(2 * n, 1), mpmath.matrix(2 * n, 1)
    spring_energy, dissipation = mpf(0), mpf(0)
    body_rate = (mpf(0), mpf(0), mpf(state.base_rate))
    # The clamp is at rest in the body.
    previous, previous_rate = clamp.segment, (mpf(0),) * 3
    for k, segment in enumerate(chain):
        stiffness, damping = constants.joint_stiffness_n_m[k], constants.joint_damping_n_m_s[k]
        angle, angle_over_sine = bending_angle(previous, segment)
        rate = segment.rate_in_body(body_rate)
        relative_rate = combination((1, rate), (-1, previous_rate))
        spring_energy += stiffness * angle**2 / 2
        dissipation += damping * dot(relative_rate, relative_rate) / 2
        sides = [(k, segment, previous, -1)]
        if k > 0:
            # The clamp has no coordinates.
            sides.append((k - 1, previous, segment, 1))
        for own, side, other, sign in sides:
            for a, gradient in enumerate(side.gradients):
                pull = dot(gradient, other.direction)
                drag = dot(relative_rate, cross(side.direction, gradient))
                spring_forces[2 * own + a] += stiffness * angle_over_sine * pull
                damper_forces[2 * own + a] += sign * damping * drag
        previous, previous_rate = segment, rate
    return spring_forces, damper_forces, spring_energy, dissipation


def kinetic_energy_gravity_energy_tip(
    state: State, clamp: Clamp, chain: Sequence[Segment], constants: ChainConstants
) -> tuple[mpf, mpf, Vector]:
    """E_kin and E_grav in J, segment by segment from the definitions, and the tip r_n in m."""
    m, h = constants.segment_mass_kg, constants.segment_length_m
    gravity = tuple(mpf(component) for component in state.gravity)
    kinetic_energy, gravity_energy = mpf(0), mpf(0)
    node, node_velocity = clamp.position, clamp.velocity
    for segment in chain:
        centre = combination((1, node), (h / 2, segment.direction))
        centre_velocity = combination((1, node_velocity), (h / 2, segment.direction_rate))
        rate = segment.direction_rate
        kinetic_energy += m * dot(centre_velocity, centre_velocity) / 2
        kinetic_energy += constants.segment_inertia_kg_m2 * dot(rate, rate) / 2
        gravity_energy -= m * dot(gravity, centre)
        node = combination((1, node), (h, segment.direction))
        node_velocity = combination((1, node_velocity), (h, segment.direction_rate))
    return kinetic_energy, gravity_energy, node


def evaluated(state: State) -> dict[str, object]:
    """The state as a JSON object, with the results rounded once, to the nearest double."""
    n = len(state.q) // 2
    constants = chain_constants(n, state.youngs_modulus_pa)
    clamp = clamp_of(state)
    q, v = [mpf(x) for x in state.q], [mpf(x) for x in state.v]
    chain = [segment_of(q[2 * k], q[2 * k + 1], v[2 * k], v[2 * k + 1]) for k in range(n)]

    mass_matrix, inertial = mass_matrix_and_inertial_forces(state, clamp, chain, constants)
    springs, dampers, spring_energy, dissipation = joint_forces(state, clamp, chain, constants)
    accelerations = mpmath.lu_solve(mass_matrix, inertial + springs + dampers)
    kinetic_energy, gravity_energy, tip = kinetic_energy_gravity_energy_tip(
        state, clamp, chain, constants
    )
    with_mass_matrix = n <= LARGEST_COUNT_WITH_MASS_MATRIX
    return {
        **vars(state),
        "accelerations": [float(x) for x in accelerations],
        "mass_matrix": (
            [[float(x) for x in row] for row in mass_matrix.tolist()] if with_mass_matrix else None
        ),
        "kinetic_energy_j": float(kinetic_energy),
        "potential_energy_j": float(spring_energy + gravity_energy),
        "dissipation_w": float(dissipation),
        "tip_position_m": [float(x) for x in tip],
    }


def bent_shape(rng: random.Random, segments: int, base_angle: float) -> list[float]:
    """Random angles, away from the poles, with every bending angle between 0.05 and 1.5 rad."""
    q: list[float] = []
    previous = (math.cos(base_angle), math.sin(base_angle), 0.0)
    previous_azimuth = base_angle
    while len(q) < 2 * segments:
        polar = rng.uniform(0.5, 2.6)
        azimuth = previous_azimuth + rng.uniform(-1.4, 1.4)
        direction = (
            math.sin(polar) * math.cos(azimuth),
            math.sin(polar) * math.sin(azimuth),
            math.cos(polar),
        )
        cosine = sum(a * b for a, b in zip(direction, previous, strict=True))
        if 0.05 < math.acos(max(-1.0, min(1.0, cosine))) < 1.5:
            q += [polar, azimuth]
            previous, previous_azimuth = direction, azimuth
    return q


def moving_base(rng: random.Random) -> dict[str, float]:
    """A random base motion in the range of the paper's rates and beyond."""
    return {
        "base_angle": rng.uniform(-3.0, 3.0),
        "base_rate": rng.uniform(-180.0, 180.0),
        "base_acceleration": rng.uniform(-5e3, 5e3),
    }


def uniform_list(rng: random.Random, count: int, bound: float) -> list[float]:
    """`count` numbers between −bound and bound."""
    return [rng.uniform(-bound, bound) for _ in range(count)]


def random_state(rng: random.Random, segments: int) -> State:
    """A strongly bent chain with rates, base motion and gravity all at random."""
    base = moving_base(rng)
    return State(
        kind="random",
        youngs_modulus_pa=YOUNGS_MODULUS_PA,
        **base,
        gravity=uniform_list(rng, 3, 10.0),
        q=bent_shape(rng, segments, base["base_angle"]),
        v=uniform_list(rng, 2 * segments, 200.0),
    )


def straight_state(rng: random.Random, segments: int) -> State:
    """Straight along the clamp, where α/sin α is 0/0, with random rates."""
    base = moving_base(rng)
    return State(
        kind="straight",
        youngs_modulus_pa=YOUNGS_MODULUS_PA,
        **base,
        gravity=[1.5, -9.81, 2.0],
        q=[math.pi / 2, base["base_angle"]] * segments,
        v=uniform_list(rng, 2 * segments, 200.0),
    )


def rigid_rotation_state(rng: random.Random, segments: int) -> State:
    """Straight, turning with the body at v_b = 30 m/s: no dissipation (D = 0)."""
    base_angle, rate = rng.uniform(-3.0, 3.0), 30.0 / TOOL_RADIUS_M
    return State(
        kind="rigid_rotation",
        youngs_modulus_pa=YOUNGS_MODULUS_PA,
        base_angle=base_angle,
        base_rate=rate,
        base_acceleration=1000.0,
        gravity=[0.0, -9.81, 3.0],
        q=[math.pi / 2, base_angle] * segments,
        v=[0.0, rate] * segments,
    )


def nearly_straight_state(rng: random.Random, segments: int) -> State:
    """Bent by about 1e-7 rad a joint: an acos of the scalar product would lose it."""
    base = moving_base(rng)
    straight = [math.pi / 2, base["base_angle"]] * segments
    return State(
        kind="nearly_straight",
        youngs_modulus_pa=YOUNGS_MODULUS_PA,
        **base,
        gravity=[0.0, -9.81, 0.0],
        q=[angle + rng.uniform(-1e-7, 1e-7) for angle in straight],
        v=[0.0, 0.0] * segments,
    )


def soft_state(rng: random.Random, segments: int) -> State:
    """A random bend of a very soft filament, slow enough that every term counts."""
    return replace(
        random_state(rng, segments),
        kind="soft",
        youngs_modulus_pa=SOFT_YOUNGS_MODULUS_PA,
        base_rate=rng.uniform(-5.0, 5.0),
        base_acceleration=rng.uniform(-20.0, 20.0),
        gravity=uniform_list(rng, 3, 1.0),
        v=uniform_list(rng, 2 * segments, 20.0),
    )


def chosen_states(rng: random.Random) -> list[State]:
    """All states of the file, in its order."""
    makers: list[Callable[[random.Random, int], State]] = [
        *[random_state] * RANDOM_STATES_PER_COUNT,
        straight_state,
        rigid_rotation_state,
        nearly_straight_state,
    ]
    states = [make(rng, segments) for segments in SEGMENT_COUNTS for make in makers]
    return states + [soft_state(rng, SOFT_SEGMENT_COUNT) for _ in range(SOFT_STATES)]


def reference_file(seed: int, digits: int) -> str:
    """Text of the JSON file: the header, then one state a line."""
    mpmath.mp.dps = digits
    origin = made_by(f"reference_states.py --seed {seed} --digits {digits}", mpmath)
    parameters = {
        "body_radius_m": BODY_RADIUS_M,
        "length_m": LENGTH_M,
        "diameter_m": DIAMETER_M,
        "density_kg_m3": DENSITY_KG_M3,
        "damping_ratio": DAMPING_RATIO,
        "first_cantilever_root": FIRST_CANTILEVER_ROOT,
    }

    lines = ",\n".join(compact(evaluated(state)) for state in chosen_states(random.Random(seed)))
    return (
        f'{{"made_by": {compact(origin)},\n'
        f'"parameters": {compact(parameters)},\n'
        f'"states": [\n{lines}\n]}}\n'
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description="Write the equations of motion at chosen spatial states, to 60 digits."
    )
    parser.add_argument("--seed", type=int, default=20210, help="of the random states")
    parser.add_argument("--digits", type=int, default=60, help="decimal digits of the arithmetic")
    parser.add_argument(
        "--output",
        type=Path,
        default=DATA / "reference_states.json",
        help="JSON file to write (default: tests/data/reference_states.json)",
    )
    arguments = parser.parse_args()
    write(arguments.output, reference_file(arguments.seed, arguments.digits))


if __name__ == "__main__":
    main()
