"""Functions that only user-defined energies need."""

import casadi

from casadi_chain.expressions import Argument, Derived, Result, Symbols


def operators_kernel() -> Derived:
    """`operators`: functions that only user-defined energies need, with their gradients."""
    symbols = Symbols()
    a, b = (symbols.scalar(name, name, "1") for name in "ab")
    values = casadi.vertcat(
        casadi.exp(a),
        casadi.log(a),
        casadi.tanh(a),
        casadi.fabs(a - b),
        casadi.atan2(a, b),
        a**b,
        a**2.5,
    )
    variables = casadi.vertcat(a, b)
    return Derived(
        "operators",
        "Functions of `a` and `b`: `exp a, ln a, tanh a, |a − b|, atan2(a, b), a^b, a^(5/2)`.",
        symbols,
        [Argument.of_symbols("variables", "a, b", variables)],
        [
            Result.vector("values", "their values", "1", values),
            Result.matrix("gradients", "by `a, b`", "1", casadi.jacobian(values, variables)),
        ],
    )
