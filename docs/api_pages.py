"""Makes the API pages of the Python package from its docstrings: `python docs/api_pages.py DIR`.

Needs the packages of `pip install "./python[docs]"`. Fails on a warning, and on a public name without a docstring, which the pages
would not have.
"""

import importlib
import sys
import types
import warnings
from pathlib import Path

import numpy.typing
import pdoc
import pdoc.doc
import pdoc.render


class ArrayLike:
    """Stands for the union of NumPy, whose members would fill several lines of each signature."""

    __module__ = "numpy.typing"


class NDArray:
    """Stands for the array type of NumPy, which would be written with the type of its shape."""

    __module__ = "numpy.typing"
    __class_getitem__ = classmethod(types.GenericAlias)


def undocumented(namespace: pdoc.doc.Namespace) -> list[str]:
    """Full names of the public members of a module, and of its classes, without a docstring."""
    found = []
    for member in namespace.own_members if isinstance(namespace, pdoc.doc.Class) else namespace.members.values():
        if member.name.startswith("_"):
            continue
        if not member.docstring:
            found.append(member.fullname)
        if isinstance(member, pdoc.doc.Class):
            found += undocumented(member)
    return found


def main() -> None:
    if len(sys.argv) != 2:
        sys.exit(f"usage: {sys.argv[0]} DIR")
    warnings.simplefilter("error")
    numpy.typing.ArrayLike, numpy.typing.NDArray = ArrayLike, NDArray
    modules = [importlib.import_module(name) for name in ("bristle", "bristle.distributed")]
    missing = [name for module in modules for name in undocumented(pdoc.doc.Module(module))]
    if missing:
        sys.exit("error: no docstring: " + ", ".join(missing))
    pdoc.render.configure(docformat="google", show_source=False, include_undocumented=False)
    directory = Path(sys.argv[1])
    pdoc.pdoc(*(module.__name__ for module in modules), output_directory=directory)
    pages = [directory / f"{module.__name__.replace('.', '/')}.html" for module in modules]
    print(", ".join(f"{page}: {page.stat().st_size // 1000} kB" for page in pages))


if __name__ == "__main__":
    main()
