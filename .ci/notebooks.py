"""Executes the notebooks of examples/notebooks, and fails if one raises, hangs, or is stored with outputs.

Needs the packages of `pip install "./python[all,notebooks]"`. `python .ci/notebooks.py DIR` also writes the executed copies to DIR.
"""

import sys
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError, DeadKernelError

NOTEBOOKS = Path(__file__).resolve().parent.parent / "examples" / "notebooks"
# A notebook takes about a minute.
HANGS_AFTER_S = 900.0


class Failure(Exception):
    """Failure of a notebook."""


def is_stored_clean(notebook: nbformat.NotebookNode) -> bool:
    return not any(cell.outputs or cell.execution_count is not None for cell in notebook.cells if cell.cell_type == "code")


def execute(notebook: nbformat.NotebookNode) -> float:
    """Runs the cells in the directory of the notebooks, and returns the seconds that this took."""
    client = NotebookClient(
        notebook,
        kernel_name="python3",
        # Kernels warn that connections have no encryption; these do not leave the machine.
        extra_arguments=["--log-level=ERROR"],
        resources={"metadata": {"path": str(NOTEBOOKS)}},
    )
    begun = time.monotonic()
    with client.setup_kernel():
        for index, cell in enumerate(notebook.cells):
            client.timeout = max(1, round(HANGS_AFTER_S - (time.monotonic() - begun)))
            try:
                client.execute_cell(cell, index)
            except CellTimeoutError:
                raise Failure(f"cell {cell.id}: hangs for {HANGS_AFTER_S:.0f} s") from None
            except (CellExecutionError, DeadKernelError) as error:
                raise Failure(f"cell {cell.id}: {error}") from None
    return time.monotonic() - begun


def main() -> None:
    copies = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    paths = sorted(NOTEBOOKS.glob("*.ipynb"))
    if not paths:
        sys.exit(f"error: no notebook in {NOTEBOOKS}")
    failures = []
    for path in paths:
        notebook = nbformat.read(path, as_version=4)
        try:
            nbformat.validate(notebook)
            if not is_stored_clean(notebook):
                raise Failure("is stored with outputs: clear them before you commit")
            seconds = execute(notebook)
        except (Failure, nbformat.ValidationError) as failure:
            failures.append(f"{path.name}, {failure}")
            continue
        finally:
            if copies is not None:
                copies.mkdir(parents=True, exist_ok=True)
                nbformat.write(notebook, copies / path.name)
        print(f"{path.name}: {seconds:.1f} s", flush=True)
    if failures:
        sys.exit("error: " + "\n".join(failures))


if __name__ == "__main__":
    main()
