"""The exchange format of derived equations, `bristle-graph` version 3: build it and write it.

Input: operations, one at a time, from a derivation in any algebra system.
Output: a JSON text of kernels. A kernel is a function in single-assignment form: operations
whose operands are earlier operations, input elements and outputs that refer to operations.

This file knows no mechanics. Equal operations are kept once, and operations that no output and no
input needs are dropped. Nothing else is rearranged: the kernels compute what the algebra
system derived.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

# Largest number of binary places and largest size of a float written as an exact rational.
RATIONAL_BINARY_PLACES = 10
LARGEST_RATIONAL = 2**20

COMMUTATIVE = ("add", "mul")
# Its name, the indices of its operands, and its parameters.
Operation = tuple[str | int | float, ...]


@dataclass(frozen=True)
class Input:
    """An argument of a kernel: local names and the operations whose values they are."""

    name: str
    doc: str
    elements: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Output:
    """A result of a kernel; `operations` by rows, `shape` empty for a scalar."""

    name: str
    doc: str
    unit: str
    shape: tuple[int, ...]
    operations: tuple[int, ...]


class Graph:
    """Operations in single-assignment form, equal ones kept once."""

    def __init__(self) -> None:
        self.operations: list[Operation] = []
        self._indices: dict[Operation, int] = {}

    def _index_of(self, operation: Operation) -> int:
        index = self._indices.get(operation)
        if index is None:
            index = self._indices[operation] = len(self.operations)
            self.operations.append(operation)
        return index

    def symbol(self, name: str, notation: str, unit: str) -> int:
        """Adds a named variable."""
        return self._index_of(("symbol", name, notation, unit))

    def number(self, value: float | Fraction) -> int:
        """Adds a constant: a small exact rational as such, others as doubles."""
        if isinstance(value, float):
            exact = Fraction(value)
            if exact.denominator > 2**RATIONAL_BINARY_PLACES or abs(value) > LARGEST_RATIONAL:
                return self._index_of(("float", value))
            value = exact
        value = Fraction(value)
        return self._index_of(("rational", value.numerator, value.denominator))

    def power(self, base: int, exponent: int) -> int:
        """Adds `base` to an integer power."""
        return self._index_of(("powi", base, exponent))

    def operation(self, name: str, *operands: int) -> int:
        """Adds an operation on operations."""
        if name == "mul" and operands[0] == operands[1]:
            return self.power(operands[0], 2)
        if name in COMMUTATIVE:
            operands = tuple(sorted(operands))
        return self._index_of((name, *operands))


def operands_of(operation: Operation) -> tuple[int, ...]:
    """Indices of the operations that `operation` takes."""
    if operation[0] in ("symbol", "rational", "float"):
        return ()
    if operation[0] == "powi":
        return operation[1:2]
    return operation[1:]


def reached(operations: Sequence[Operation], roots: list[int]) -> set[int]:
    """Returns the operations that `roots` need, themselves included."""
    found: set[int] = set()
    while roots:
        index = roots.pop()
        if index not in found:
            found.add(index)
            roots += operands_of(operations[index])
    return found


def renumbered(operation: Operation, indices: dict[int, int]) -> Operation:
    """Returns `operation` with new indices of its operands."""
    operands = operands_of(operation)
    rest = operation[1 + len(operands) :]
    return (operation[0], *(indices[operand] for operand in operands), *rest)


@dataclass(frozen=True)
class Kernel:
    """A function: its arguments, operations and results."""

    name: str
    summary: str
    graph: Graph
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]

    def text(self) -> str:
        """The kernel as JSON, an operation a line; dead operations dropped."""
        operations = self.graph.operations
        given = [index for entry in self.inputs for _, index in entry.elements]
        results = [index for output in self.outputs for index in output.operations]
        live = reached(operations, [*given, *results])
        # Symbols first, then in the order of derivation; operands stay ahead of their users.
        order = sorted(live, key=lambda index: (operations[index][0] != "symbol", index))
        indices = {old: new for new, old in enumerate(order)}
        inputs = [
            vars(entry) | {"elements": [(name, indices[index]) for name, index in entry.elements]}
            for entry in self.inputs
        ]
        outputs = [
            vars(output) | {"operations": [indices[index] for index in output.operations]}
            for output in self.outputs
        ]
        return (
            f'{{"name":{compact(self.name)},\n"summary":{compact(self.summary)},\n'
            f'"inputs":[\n{lines(inputs)}],\n'
            f'"operations":[\n{lines(renumbered(operations[old], indices) for old in order)}],\n'
            f'"outputs":[\n{lines(outputs)}]}}'
        )


def lines(values: Iterable[object]) -> str:
    """Entries of an array, one a line."""
    return ",\n".join(map(compact, values))


def compact(value: object) -> str:
    """JSON without spaces; a float gets the fewest digits that read back as the same double."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def file_text(generator: str, kernels: Sequence[Kernel]) -> str:
    """The whole file."""
    texts = ",\n".join(kernel.text() for kernel in kernels)
    return (
        f'{{"format":"bristle-graph",\n"version":3,\n"generator":{compact(generator)},\n'
        f'"kernels":[\n{texts}]}}\n'
    )
