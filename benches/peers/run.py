"""Times of Bristle beside those of other codes on the same chain and the same contact: one table.

Input: this repository, the registries of Rust and Python, a C and a C++ compiler.
Output: a table in Markdown, printed and written to --out, and all rounds as JSON to --json.

This makes the virtual environment and builds the programs, below Cargo's target directory;
measure.py measures. Programs that are missing on this machine are reported and have no lines.

Run from anywhere:

    python3 benches/peers/run.py --out peers.md --json peers.json
    python3 benches/peers/run.py --only accelerations --quick
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
LEAST_PYTHON = (3, 11)

GROUPS = ("accelerations", "contact", "row", "study")

# Flags of libpinocchio's CMake configuration.
PINOCCHIO_FLAGS = (
    "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
    "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    "-DBOOST_FUSION_INVOKE_MAX_ARITY=12",
)
# The compiled algorithm of the package's library; and its headers, compiled for this processor.
PINOCCHIO_BUILDS = {
    "pinocchio_aba": ("-DPINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION",),
    "pinocchio_aba_native": ("-march=native",),
}


def tell(text: str) -> None:
    """Writes to standard error: the table is the output."""
    print(f"peers: {text}", file=sys.stderr, flush=True)


def environment(directory: Path) -> Path:
    """Returns the Python of a virtual environment with the available pinned packages."""
    python = directory / "bin" / "python"
    requirements = (HERE / "requirements.txt").read_text(encoding="utf-8")
    stamp = directory / "installed.txt"
    if stamp.exists() and stamp.read_text(encoding="utf-8") == requirements:
        return python
    tell(f"making a virtual environment in {directory}")
    try:
        venv.create(directory, with_pip=True, clear=True)
    except (subprocess.CalledProcessError, OSError) as error:
        sys.exit(f"Python's venv does not work here (Debian: apt install python3-venv): {error}")
    install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    if subprocess.run([*install, "-r", HERE / "requirements.txt"], check=False).returncode == 0:
        stamp.write_text(requirements, encoding="utf-8")
        return python
    # Some may be unavailable: each is installed on its own, with the others as constraints. The
    # next run tries again.
    for requirement in requirements.split():
        command = [*install, requirement, "-c", HERE / "requirements.txt"]
        if subprocess.run(command, check=False).returncode:
            tell(f"{requirement} cannot be installed here; its lines will be left out")
    return python


def bristle() -> Path:
    """Builds Bristle's timing program as a release."""
    if shutil.which("cargo") is None:
        sys.exit("cargo is not installed: https://rustup.rs")
    tell("building Bristle")
    command = ["cargo", "build", "--release", "--example", "peers", "--message-format=json"]
    result = subprocess.run(command, cwd=ROOT, check=False, stdout=subprocess.PIPE, text=True)
    if result.returncode:
        sys.exit(f"{' '.join(command)} failed")
    messages = [json.loads(line) for line in result.stdout.splitlines() if line[:1] == "{"]
    programs = [message["executable"] for message in messages if message.get("executable")]
    return Path(programs[-1])


def pinocchio_loops(python: Path, directory: Path) -> list[Path]:
    """Builds the timing programs of Pinocchio, as far as the package's headers allow."""
    where = [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    packages = Path(
        subprocess.run(where, check=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    )
    prefix, source = packages / "cmeel.prefix", HERE / "pinocchio_aba.cpp"
    programs = []
    for name, flags in PINOCCHIO_BUILDS.items():
        # The program is beside the packages, whose library it needs.
        program, log = packages / name, directory / f"{name}.log"
        if not program.exists() or program.stat().st_mtime < source.stat().st_mtime:
            tell(f"compiling {name}, a minute")
            command = [
                *("c++", "-std=c++17", "-O3", "-DNDEBUG", "-w", *PINOCCHIO_FLAGS, *flags),
                *(source, "-o", program),
                # CasADi brings the headers of Eigen with it.
                *("-I", prefix / "include"),
                *("-isystem", packages / "casadi" / "include" / "eigen3"),
                *("-L", prefix / "lib", "-lpinocchio_default", f"-Wl,-rpath,{prefix / 'lib'}"),
            ]
            program.unlink(missing_ok=True)
            with log.open("w", encoding="utf-8") as output:
                try:
                    subprocess.run(command, stdout=output, stderr=output, check=True)
                except (OSError, subprocess.CalledProcessError) as error:
                    tell(f"{name} cannot be compiled ({type(error).__name__}, see {log})")
                    continue
        programs.append(program)
    return programs


def main() -> None:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description="Measure Bristle and its peers; print one table.")
    parser.add_argument("--out", type=Path, help="file for the table, beside the standard output")
    parser.add_argument("--json", type=Path, help="file for all rounds")
    parser.add_argument(
        "--only", choices=GROUPS, action="append", help="this group; may be repeated"
    )
    parser.add_argument("--quick", action="store_true", help="few rounds")
    parser.add_argument(
        "--full", action="store_true", help="time all 120 cases of the study on the peer, not 11"
    )
    arguments = parser.parse_args()
    if sys.version_info < LEAST_PYTHON:
        sys.exit("this takes Python 3.11 or newer")
    for compiler in ("cc", "c++"):
        if shutil.which(compiler) is None:
            tell(f"there is no {compiler}; what needs it will be left out")

    directory = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "peers"
    directory.mkdir(parents=True, exist_ok=True)
    python = environment(directory / "venv")
    command = [python, HERE / "measure.py", "--bristle", bristle(), "--directory", directory]
    if not arguments.only or "accelerations" in arguments.only:
        for loop in pinocchio_loops(python, directory):
            command += ["--loop", loop]
    for name in ("out", "json"):
        if path := getattr(arguments, name):
            command += [f"--{name}", path]
    for group in arguments.only or ():
        command += ["--only", group]
    command += [f"--{name}" for name in ("quick", "full") if getattr(arguments, name)]
    # Small matrices: threads inside the peers' linear algebra would only be in each other's way.
    one_thread = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    sys.exit(subprocess.run(command, env={**os.environ, **one_thread}, check=False).returncode)


if __name__ == "__main__":
    main()
