"""Times of Bristle beside those of other codes on the same chain and the same contact: one table.

What enters: nothing but this repository, the registries of Rust and Python, a C and a C++ compiler.
What leaves: a table in Markdown, printed and written to --out.

This makes the virtual environment and builds the programs, below Cargo's target directory;
measure.py measures.

Run from anywhere:

    python3 benches/peers/run.py --out peers.md
    python3 benches/peers/run.py --quick
"""

import argparse
import json
import os
import subprocess
import sys
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]

# Of libpinocchio's CMake configuration.
PINOCCHIO_FLAGS = (
    "-DPINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION",
    "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
    "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    "-DBOOST_FUSION_INVOKE_MAX_ARITY=12",
)


def environment(directory: Path) -> Path:
    """Python of a virtual environment with the pinned packages."""
    python = directory / "bin" / "python"
    requirements = (HERE / "requirements.txt").read_text(encoding="utf-8")
    stamp = directory / "installed.txt"
    if not stamp.exists() or stamp.read_text(encoding="utf-8") != requirements:
        venv.create(directory, with_pip=True, clear=True)
        subprocess.run(
            [python, "-m", "pip", "install", "--quiet", "-r", HERE / "requirements.txt"],
            check=True,
        )
        stamp.write_text(requirements, encoding="utf-8")
    return python


def bristle() -> Path:
    """The timing program of Bristle, built as a release."""
    command = ["cargo", "build", "--release", "--example", "peers", "--message-format=json"]
    output = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    messages = [json.loads(line) for line in output.splitlines() if line.startswith("{")]
    programs = [
        message["executable"]
        for message in messages
        if message.get("executable") and message["target"]["name"] == "peers"
    ]
    return Path(programs[-1])


def pinocchio_loop(python: Path, directory: Path) -> Path | None:
    """The timing program of Pinocchio, or None if the packages' headers do not serve here."""
    source, program = HERE / "pinocchio_aba.cpp", directory / "venv" / "pinocchio_aba"
    if program.exists() and program.stat().st_mtime > source.stat().st_mtime:
        return program
    where = [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    packages = Path(
        subprocess.run(where, check=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    )
    prefix = packages / "cmeel.prefix"
    command = [
        *("c++", "-std=c++17", "-O3", "-DNDEBUG", "-w", *PINOCCHIO_FLAGS),
        *(source, "-o", program),
        # CasADi brings the headers of Eigen with it.
        *("-I", prefix / "include", "-isystem", packages / "casadi" / "include" / "eigen3"),
        *("-L", prefix / "lib", "-lpinocchio_default", f"-Wl,-rpath,{prefix / 'lib'}"),
    ]
    with (directory / "pinocchio_aba.log").open("w", encoding="utf-8") as log:
        try:
            result = subprocess.run(command, stdout=log, stderr=log, check=False)
        except FileNotFoundError:
            return None
    return program if result.returncode == 0 else None


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Measure Bristle and its peers; print one table.")
    parser.add_argument("--out", type=Path, help="file for the table, beside the standard output")
    parser.add_argument("--quick", action="store_true", help="few rounds, no study: two minutes")
    parser.add_argument(
        "--full", action="store_true", help="all 120 cases of the study on the peer"
    )
    arguments = parser.parse_args()

    directory = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "peers"
    directory.mkdir(parents=True, exist_ok=True)
    python = environment(directory / "venv")
    command = [python, HERE / "measure.py", "--bristle", bristle(), "--directory", directory]
    if loop := pinocchio_loop(python, directory):
        command += ["--pinocchio", loop]
    if arguments.out:
        command += ["--out", arguments.out]
    command += [f"--{name}" for name in ("quick", "full") if getattr(arguments, name)]
    sys.exit(subprocess.run(command, check=False).returncode)


if __name__ == "__main__":
    main()
