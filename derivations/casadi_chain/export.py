"""Functions of CasADi as single-assignment operations."""

import math
from itertools import count, islice

import casadi
from graph_format import Graph, Input, Kernel, Output

from casadi_chain.expressions import Derived

# CasADi's instructions on operands, and the format's operations.
INSTRUCTIONS = {
    casadi.OP_ADD: "add",
    casadi.OP_SUB: "sub",
    casadi.OP_MUL: "mul",
    casadi.OP_DIV: "div",
    casadi.OP_NEG: "neg",
    casadi.OP_SQRT: "sqrt",
    casadi.OP_SIN: "sin",
    casadi.OP_COS: "cos",
    casadi.OP_ASIN: "asin",
    casadi.OP_EXP: "exp",
    casadi.OP_LOG: "ln",
    casadi.OP_TANH: "tanh",
    casadi.OP_FABS: "abs",
    casadi.OP_ATAN2: "atan2",
    casadi.OP_POW: "pow",
    casadi.OP_CONSTPOW: "pow",
    casadi.OP_LT: "less_than",
}


def exported(derived: Derived) -> Kernel:
    """Converts CasADi's instructions to single-assignment form.

    The expressions of the arguments' elements are outputs of the function, too, so that their
    operations are known.
    """
    elements = [expression for argument in derived.arguments for _, expression in argument.elements]
    # CasADi stores by columns, the format by rows.
    values = [casadi.vec(casadi.densify(result.value).T) for result in derived.results]
    function = casadi.Function(
        derived.name,
        [casadi.vertcat(*(variable for variable, _, _ in derived.symbols.entries))],
        [casadi.vertcat(*elements), casadi.vertcat(*values)],
    )

    graph = Graph()
    symbols = [
        graph.symbol(variable.name(), notation, unit)
        for variable, notation, unit in derived.symbols.entries
    ]
    registers: dict[int, int] = {}
    # The operations of both outputs.
    found: tuple[dict[int, int], dict[int, int]] = {}, {}
    for k in range(function.n_instructions()):
        code = function.instruction_id(k)
        operands, targets = function.instruction_input(k), function.instruction_output(k)
        if code == casadi.OP_OUTPUT:
            found[targets[0]][targets[1]] = registers[operands[0]]
            continue
        if code == casadi.OP_INPUT:
            operation = symbols[operands[1]]
        elif code == casadi.OP_CONST:
            operation = graph.number(float(function.instruction_constant(k)))
        else:
            nodes = [registers[operand] for operand in operands]
            if code in INSTRUCTIONS:
                operation = graph.operation(INSTRUCTIONS[code], *nodes)
            elif code == casadi.OP_SQ:
                operation = graph.power(nodes[0], 2)
            elif code == casadi.OP_TWICE:
                operation = graph.operation("mul", graph.number(2.0), nodes[0])
            elif code == casadi.OP_INV:
                operation = graph.operation("div", graph.number(1.0), nodes[0])
            elif code == casadi.OP_SIGN:
                zero = graph.number(0.0)
                positive = graph.operation("less_than", zero, nodes[0])
                negative = graph.operation("less_than", nodes[0], zero)
                operation = graph.operation("sub", positive, negative)
            else:
                reason = f"the format has no operation for CasADi's instruction {code}"
                raise RuntimeError(f"kernel {derived.name}: {reason}")
        registers[targets[0]] = operation

    inputs, outputs = [], []
    of_elements, of_values = (map(each.__getitem__, count()) for each in found)
    for argument in derived.arguments:
        bound = tuple((name, next(of_elements)) for name, _ in argument.elements)
        inputs.append(Input(argument.name, argument.doc, bound))
    for result in derived.results:
        operations = tuple(islice(of_values, math.prod(result.shape)))
        outputs.append(Output(result.name, result.doc, result.unit, result.shape, operations))
    return Kernel(derived.name, derived.summary, graph, tuple(inputs), tuple(outputs))
