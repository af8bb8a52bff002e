"""Accelerations from CasADi's C code for M and f in space, with a dense Cholesky solve.

The state's clamp is put in as numbers; q and q̇ are left. LAPACK is the one inside SciPy.
"""

import ctypes
import subprocess
import time
from pathlib import Path

import casadi
import numpy as np
from casadi_contact import shared_library
from casadi_equations import SEGMENTS, ChainExpressions
from scipy.linalg import cython_lapack

HERE = Path(__file__).resolve().parent
SIZE = 2 * SEGMENTS

# Each is compiled and tried; -O2 is generic x86-64, as Bristle's build is.
FLAGS = (("-O2",), ("-O3",), ("-O3", "-march=native"))


def lapack_solver() -> ctypes.c_void_p:
    """LAPACK's dposv as an address."""
    capsule = cython_lapack.__pyx_capi__["dposv"]
    name, pointer = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    name.restype, name.argtypes = ctypes.c_char_p, [ctypes.py_object]
    pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return ctypes.c_void_p(pointer(capsule, name(capsule)))


class Accelerations:
    """The compiled loop: one set of flags, one solver."""

    def __init__(
        self, library: Path, work: tuple[int, int], lapack: ctypes.c_void_p | None, label: str
    ) -> None:
        self.label = label
        self._loop = ctypes.CDLL(str(library)).accelerations
        self._loop.restype = ctypes.c_double
        self._integers = np.zeros(work[0] + 1, dtype=np.int64)
        self._work = np.zeros(work[1] + 1)
        self._lapack = lapack

    def run(self, q: np.ndarray, v: np.ndarray, calls: int) -> tuple[float, np.ndarray]:
        """Seconds a call, and the accelerations."""
        result = np.zeros(SIZE)

        def address(array: np.ndarray) -> ctypes.c_void_p:
            return ctypes.c_void_p(array.ctypes.data)

        seconds = self._loop(
            address(q),
            address(v),
            address(self._work),
            address(self._integers),
            ctypes.c_long(calls),
            self._lapack,
            address(result),
        )
        return seconds, result


def compiled(
    directory: Path, base_angle: float, base_rate: float, base_acceleration: float
) -> tuple[list[Accelerations], dict[str, float]]:
    """All variants, and the seconds that compiling took (0 where it had been done before)."""
    chain = ChainExpressions(
        *(casadi.SX(x) for x in (base_angle, base_rate, base_acceleration)), casadi.SX.zeros(3)
    )
    function = casadi.Function(
        "equations",
        [chain.q, chain.v],
        [casadi.densify(chain.mass_matrix), chain.force],
        {"cse": True},
    )
    generator = casadi.CodeGenerator("casadi_equations.c")
    generator.add(function)
    generator.generate(f"{directory}/")
    # One file, so that one name stands for the text.
    source = directory / "casadi_accelerations.c"
    parts = [directory / "casadi_equations.c", HERE / "casadi_accelerations.c"]
    source.write_text(
        "\n".join(part.read_text(encoding="utf-8") for part in parts), encoding="utf-8"
    )
    variants, seconds = [], {}
    for flags in FLAGS:
        start = time.perf_counter()
        try:
            library = shared_library(source, (*flags, "-fPIC", "-shared", "-w"))
        except subprocess.CalledProcessError:
            continue
        name = " ".join(flags)
        seconds[name] = time.perf_counter() - start
        work = (function.sz_iw(), function.sz_w())
        for lapack, label in ((lapack_solver(), "LAPACK"), (None, "own Cholesky")):
            variants.append(Accelerations(library, work, lapack, f"{name}, {label}"))
    return variants, seconds
