"""Equations of motion of the segment chain, derived by CasADi from its energies.

Input: the number of segments, or `--kernels`, or `--operators`; the energies of the project's
model page.
Output: a JSON file of single-assignment operations (`graph_format.py`). It has the whole equations
of a chain (mass matrix, force, energies), in space or in the plane of rotation, or the kernels of
the solver's O(n) loops, or functions that only user-defined energies need.

Run from the repository root:

    python derivations/segment_chain.py --segments 2 --out derivations/graphs/chain_2.json
    python derivations/segment_chain.py --segments 2 --planar --out chain_2_planar.json
    python derivations/segment_chain.py --kernels --out derivations/graphs/kernels.json
    python derivations/segment_chain.py --kernels --out derivations/graphs/kernels.json --check
    python derivations/segment_chain.py --operators --out derivations/graphs/operators.json
"""

import argparse
import sys
from pathlib import Path

from casadi_chain import CASADI_VERSION
from casadi_chain.export import exported
from casadi_chain.expressions import Derived, Motion
from casadi_chain.joints import clamp_kernels, joint_kernels
from casadi_chain.lateral import (
    lateral_clamp_kernels,
    lateral_joint_kernels,
    lateral_segment_kernel,
    lateral_segment_tangent_kernel,
)
from casadi_chain.operators import operators_kernel
from casadi_chain.segments import (
    rigid_rates_kernel,
    segment_energy_kernel,
    segment_kernel,
    segment_tangent_kernel,
)
from casadi_chain.whole import whole_equations
from graph_format import file_text

LARGEST_SEGMENT_COUNT = 400


def solver_kernels() -> list[Derived]:
    """All kernels, in the order in which the solver meets them: in space, planar, lateral."""

    def of_motion(motion: Motion) -> list[Derived]:
        return [
            segment_kernel(motion),
            segment_tangent_kernel(motion),
            segment_energy_kernel(motion),
            *joint_kernels(motion),
            *clamp_kernels(motion),
        ]

    return [
        *of_motion(Motion.SPATIAL),
        rigid_rates_kernel(),
        *of_motion(Motion.PLANAR),
        lateral_segment_kernel(),
        lateral_segment_tangent_kernel(),
        *lateral_joint_kernels(),
        *lateral_clamp_kernels(),
    ]


def main() -> None:
    """Runs the command line."""
    parser = argparse.ArgumentParser(
        description="Derive equations of motion from the chain's energies with CasADi."
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--segments", type=int, help="number of segments of the whole equations")
    what.add_argument("--kernels", action="store_true", help="all kernels of the solver")
    what.add_argument(
        "--operators", action="store_true", help="functions for energies of one's own"
    )
    parser.add_argument(
        "--planar", action="store_true", help="with --segments: in the plane of rotation"
    )
    parser.add_argument("--out", required=True, metavar="FILE", help="- for the standard output")
    parser.add_argument(
        "--check", action="store_true", help="exit with 1 if FILE is not what is derived now"
    )
    arguments = parser.parse_args()
    if arguments.check and arguments.out == "-":
        parser.error("--check compares with a file, so --out cannot be -")
    if arguments.planar and arguments.segments is None:
        parser.error("--kernels derives the planar kernels, too; --planar belongs to --segments")
    if arguments.segments is not None and not 1 <= arguments.segments <= LARGEST_SEGMENT_COUNT:
        parser.error(f"possible are 1 to {LARGEST_SEGMENT_COUNT} segments")

    motion = Motion.PLANAR if arguments.planar else Motion.SPATIAL
    if arguments.kernels:
        choice, derived = "--kernels", solver_kernels()
    elif arguments.operators:
        choice, derived = "--operators", [operators_kernel()]
    else:
        choice = f"--segments {arguments.segments}" + (" --planar" if arguments.planar else "")
        derived = whole_equations(arguments.segments, motion)
    command = f"derivations/segment_chain.py {choice}"
    kernels = [exported(function) for function in derived]
    text = file_text(f"{command}, CasADi {CASADI_VERSION}", kernels)
    if arguments.out == "-":
        sys.stdout.buffer.write(text.encode())
        return
    path = Path(arguments.out)
    try:
        if not arguments.check:
            path.write_text(text, encoding="utf-8", newline="\n")
        elif path.read_bytes() != text.encode():
            sys.exit(f"{path} is stale. To make it again: python {command} --out {path}")
    except OSError as error:
        sys.exit(f"segment_chain.py: {path}: {error.strerror}")


if __name__ == "__main__":
    main()
