"""Equations of motion of short spatial chains, derived by SymPy's LagrangesMethod.

What enters: the number of segments, 1 or 2.
What leaves: mass matrix, force and energies as a JSON file of single-assignment operations
(`graph_format.py`), under the names that `segment_chain.py` gives them.

How it is done:

1. Coordinates φ_k(t), θ_k(t), root r_0(t) and clamp direction e_0(t) are functions of time.
   Positions are vectors of sympy.physics.mechanics; it differentiates them by time in the inertial
   frame. L = E_kin − E_spring − E_grav goes to LagrangesMethod.
2. The dampers enter as loads, not by the dissipation function: between segments, which turn with
   ω_k = e_k × ė_k, acts the torque −d_k (ω_k − ω_{k−1}) and its reaction. That −∂D/∂q̇ gives the
   same is thereby tested, too.
3. The bending angle is α = acos(e·e'), with the inner side e turned about z by the relaxed angle.
   Its derivatives are singular where the joint is relaxed, so these files are of no use there.
4. Nothing is simplified but what SymPy does by itself. acos(x) is written π/2 − asin(x).

SI units, angles in radians. For the notation see `segment_chain.py`.

Run from the repository root:

    python derivations/sympy_lagrange.py --segments 2 --out derivations/graphs/sympy_2.json
"""

import argparse
import math
import sys
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import sympy
from chain_interface import ChainFunction, Motion, chain_arguments, chain_functions
from graph_format import Graph, Input, Kernel, Output, file_text, staleness, write_whole
from sympy.physics.mechanics import (
    LagrangesMethod,
    ReferenceFrame,
    Vector,
    dot,
    dynamicsymbols,
)

LARGEST_SEGMENT_COUNT = 2
TIME = dynamicsymbols._t

Expression = sympy.Expr


class UnknownExpressionError(Exception):
    """An expression that the format has no operation for."""


class ChainSymbols:
    """Functions of time and constants, each with the name under which it is exported."""

    def __init__(self, segments: int) -> None:
        """Of a chain of so many segments."""
        self.frame = frame = ReferenceFrame("N")
        self.names: dict[Expression, str] = {}
        self.coordinates = [
            self._of_time(f"{angle}_{k}", f"{angle}_rate_{k}")
            for k in range(1, segments + 1)
            for angle in ("phi", "theta")
        ]
        roots = [
            (f"root_position_{x}", f"root_velocity_{x}", f"root_acceleration_{x}") for x in "xyz"
        ]
        self.root = in_frame(frame, *(self._of_time(*names) for names in roots))
        self.clamp_direction = in_frame(
            frame, *(self._of_time(f"clamp_direction_{axis}") for axis in "xyz")
        )
        # The arguments of `chain_interface.py` that do not depend on time.
        self.constants = {
            name: sympy.Symbol(name, real=True)
            for argument in chain_arguments(segments, Motion.SPATIAL)
            for name, _, _ in argument.symbols
            if name not in self.names.values()
        }
        self.names |= {symbol: name for name, symbol in self.constants.items()}
        self.body_rate, self.gravity = (
            in_frame(frame, *(self.constants[f"{name}_{axis}"] for axis in "xyz"))
            for name in ("angular_velocity", "gravity")
        )

    def _of_time(self, *names: str) -> Expression:
        """A function of time; the others are the names of its derivatives."""
        function = dynamicsymbols(names[0])
        self.names |= {function.diff(TIME, order): name for order, name in enumerate(names)}
        return function


def in_frame(frame: ReferenceFrame, x: Expression, y: Expression, z: Expression) -> Vector:
    """The vector with these components."""
    return x * frame.x + y * frame.y + z * frame.z


def equations(segments: int) -> tuple[ChainSymbols, dict[str, list[Expression]]]:
    """The results of the three functions, by rows, from Lagrange's equations."""
    chain = ChainSymbols(segments)
    frame, constants = chain.frame, chain.constants
    length = constants["segment_length"]
    half = sympy.Rational(1, 2)

    kinetic = spring = gravity = dissipation = sympy.Integer(0)
    torques: dict[ReferenceFrame, Vector] = {}
    node, inner_direction, inner_frame = chain.root, chain.clamp_direction, None
    # The clamp is at rest in the body.
    inner_rotation = in_frame(frame, sympy.Integer(0), sympy.Integer(0), sympy.Integer(0))
    for k in range(segments):
        phi, theta = chain.coordinates[2 * k : 2 * k + 2]
        direction = in_frame(
            frame,
            sympy.sin(phi) * sympy.cos(theta),
            sympy.sin(phi) * sympy.sin(theta),
            sympy.cos(phi),
        )
        direction_rate = direction.dt(frame)
        centre = node + half * length * direction
        velocity = centre.dt(frame)
        mass, inertia = constants[f"segment_mass_{k + 1}"], constants[f"segment_inertia_{k + 1}"]
        kinetic += half * mass * dot(velocity, velocity)
        kinetic += half * inertia * dot(direction_rate, direction_rate)
        gravity -= mass * dot(chain.gravity, centre)

        # Turned about z by the relaxed angle, which is a rotation about an axis at rest.
        relaxed_angle = constants[f"relaxed_angle_{k + 1}"]
        turned = (
            sympy.cos(relaxed_angle) * inner_direction
            + sympy.sin(relaxed_angle) * frame.z.cross(inner_direction)
            + (1 - sympy.cos(relaxed_angle)) * dot(frame.z, inner_direction) * frame.z
        )
        bending_angle = sympy.acos(dot(turned, direction))
        spring += half * constants[f"joint_stiffness_{k + 1}"] * bending_angle**2

        # A frame that turns with the segment, without spin about its axis.
        segment_frame = ReferenceFrame(f"S{k + 1}")
        segment_frame.set_ang_vel(frame, direction.cross(direction_rate))
        # Dampers see it from the body.
        rotation = direction.cross(direction_rate - chain.body_rate.cross(direction))
        damping = constants[f"joint_damping_{k + 1}"]
        relative = rotation - inner_rotation
        dissipation += half * damping * dot(relative, relative)
        torques[segment_frame] = -damping * relative
        if inner_frame is not None:
            torques[inner_frame] += damping * relative

        node += length * direction
        inner_direction, inner_rotation, inner_frame = direction, rotation, segment_frame

    method = LagrangesMethod(
        kinetic - spring - gravity,
        chain.coordinates,
        forcelist=list(torques.items()),
        frame=frame,
    )
    method.form_lagranges_equations()
    return chain, {
        "mass_matrix": list(method.mass_matrix),
        "force": list(method.forcing),
        "kinetic": [kinetic],
        "spring": [spring],
        "gravity": [gravity],
        "dissipation": [dissipation],
    }


@dataclass
class Exporter:
    """Writes expressions into a graph, each expression once."""

    graph: Graph
    symbols: dict[Expression, int]
    _indices: dict[Expression, int] = field(default_factory=dict)

    def index_of(self, expression: Expression) -> int:
        """The operation whose value the expression is."""
        index = self._indices.get(expression)
        if index is None:
            index = self._indices[expression] = self._written(expression)
        return index

    def _written(self, expression: Expression) -> int:
        if expression in self.symbols:
            return self.symbols[expression]
        if expression.is_Rational:
            return self.graph.number(Fraction(int(expression.p), int(expression.q)))
        if expression.is_Add:
            return self._sum(expression)
        if expression.is_Mul:
            return self._product(expression)
        if expression.is_Pow and expression.exp.is_Rational and expression.exp.q in (1, 2):
            base = self.index_of(expression.base)
            if expression.exp.q == 2:
                base = self.graph.operation("sqrt", base)
            return base if expression.exp.p == 1 else self.graph.power(base, int(expression.exp.p))
        if isinstance(expression, sympy.acos):
            arcsine = self.graph.operation("asin", self.index_of(expression.args[0]))
            return self.graph.operation("sub", self.graph.number(math.pi / 2), arcsine)
        for function in (sympy.sin, sympy.cos):
            if isinstance(expression, function):
                argument = self.index_of(expression.args[0])
                return self.graph.operation(function.__name__, argument)
        raise UnknownExpressionError(
            f"the format has no operation for SymPy's {type(expression).__name__}: {expression}"
        )

    def _sum(self, expression: Expression) -> int:
        terms = sorted(expression.args, key=sympy.default_sort_key)
        # Begin with a term without minus sign, if there is one.
        terms.sort(key=sympy.Expr.could_extract_minus_sign)
        result = self.index_of(terms[0])
        for term in terms[1:]:
            if term.is_Mul and term.args[0].is_Rational and term.args[0] < 0:
                result = self.graph.operation("sub", result, self.index_of(-term))
            else:
                result = self.graph.operation("add", result, self.index_of(term))
        return result

    def _product(self, expression: Expression) -> int:
        coefficient, factors = expression.as_coeff_mul()
        upper, lower = [], []
        for factor in sorted(factors, key=sympy.default_sort_key):
            if factor.is_Pow and factor.exp.is_Rational and factor.exp < 0:
                lower.append(1 / factor)
            else:
                upper.append(factor)
        negative = coefficient == -1
        if not upper or coefficient not in (1, -1):
            upper.insert(0, abs(coefficient) if negative else coefficient)
        result = self._multiplied(upper)
        if lower:
            result = self.graph.operation("div", result, self._multiplied(lower))
        return self.graph.operation("neg", result) if negative else result

    def _multiplied(self, factors: list[Expression]) -> int:
        result = self.index_of(factors[0])
        for factor in factors[1:]:
            result = self.graph.operation("mul", result, self.index_of(factor))
        return result


def exported(
    function: ChainFunction,
    segments: int,
    names: dict[Expression, str],
    values: dict[str, list[Expression]],
) -> Kernel:
    """One of the three functions in the format."""
    graph = Graph()
    indices, inputs = {}, []
    for argument in chain_arguments(segments, Motion.SPATIAL):
        elements = []
        for name, notation, unit in argument.symbols:
            indices[name] = graph.symbol(name, notation, unit)
            elements.append((name, indices[name]))
        inputs.append(Input(argument.name, argument.doc, tuple(elements)))
    exporter = Exporter(graph, {symbol: indices[name] for symbol, name in names.items()})
    outputs = tuple(
        Output(
            output.name,
            output.doc,
            output.unit,
            output.shape,
            tuple(exporter.index_of(value) for value in values[output.name]),
        )
        for output in function.outputs
    )
    return Kernel(function.name, function.summary, graph, tuple(inputs), outputs)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description="Derive the whole equations of a short chain with SymPy's LagrangesMethod."
    )
    parser.add_argument(
        "--segments", type=int, required=True, choices=range(1, LARGEST_SEGMENT_COUNT + 1)
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="file to write")
    parser.add_argument(
        "--check",
        action="store_true",
        help="write nothing; exit with 1 if FILE is not what is derived now, to the byte",
    )
    arguments = parser.parse_args()

    segments = arguments.segments
    chain, values = equations(segments)
    try:
        kernels = [
            exported(function, segments, chain.names, values)
            for function in chain_functions(segments, Motion.SPATIAL)
        ]
    except UnknownExpressionError as error:
        sys.exit(f"sympy_lagrange.py: {error}")
    command = f"derivations/sympy_lagrange.py --segments {segments}"
    text = file_text(f"{command}, SymPy {sympy.__version__}", kernels)
    if arguments.check:
        if reason := staleness(arguments.out, text):
            sys.exit(f"{reason}. To make it again: python {command} --out {arguments.out}")
        return
    write_whole(arguments.out, text)


if __name__ == "__main__":
    main()
