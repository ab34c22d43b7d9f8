"""CalculiX as a peer: its input written from our mesh, its eigenvalues read back.

Dhondt and Wittig's finite-element program, ``ccx``; Debian's package is calculix-ccx.
"""

import os
import re
import shutil
import subprocess
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.materials import Material
from harness.sim.solid.tetrahedra import QuadraticMesh

WHY_NOT = "CalculiX is not installed (no ccx on the path; on Debian: apt-get install calculix-ccx)"


def needed() -> str:
    """Where ccx is; the test is skipped with a reason where it is not."""
    found = shutil.which("ccx")
    if found is None:
        pytest.skip(WHY_NOT)
    return found


def write_input(
    path: Path,
    mesh: QuadraticMesh,
    material: Material,
    count: int,
    held: IntArray | None = None,
    quiet: bool = False,
) -> None:
    """The lowest ``count`` modes, rigid ones among them, with the nodes ``held`` fixed.

    Numbers have 20 characters at most, as the program reads no more.
    """
    lines = ["*NODE, NSET=ALL"]
    lines += [
        f"{number + 1}, {x:.12e}, {y:.12e}, {z:.12e}" for number, (x, y, z) in enumerate(mesh.nodes.tolist())
    ]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=SOLID")
    lines += [
        ", ".join(map(str, (number + 1, *cell))) for number, cell in enumerate((mesh.cells + 1).tolist())
    ]
    lines += [
        "*MATERIAL, NAME=M", "*ELASTIC", f"{material.young:.12e}, {material.poisson:.12e}",
        "*DENSITY", f"{material.density:.12e}", "*SOLID SECTION, ELSET=SOLID, MATERIAL=M",
        "*STEP", "*FREQUENCY", f"{count}",
    ]  # fmt: skip
    if held is not None:
        lines[-3:-3] = ["*BOUNDARY", *(f"{node + 1}, 1, 3" for node in held.tolist())]
    lines += [] if quiet else ["*NODE FILE", "U"]
    path.write_text("\n".join([*lines, "*END STEP", ""]))


class Run(NamedTuple):
    """What one run gave and took."""

    values: FloatArray  #: ``(rad/s)^2``, ascending.
    seconds: float  #: of CPU time, on one thread.
    peak: float  #: MB of memory at most.


def run(program: str, folder: Path, job: str) -> Run:
    """Solve what ``write_input`` wrote."""
    alone = {**os.environ, "OMP_NUM_THREADS": "1", "CCX_NPROC_STIFFNESS": "1", "OPENBLAS_NUM_THREADS": "1"}
    said, table, peak = folder / f"{job}.out", folder / f"{job}.dat", 0.0
    with said.open("w") as out:
        process = subprocess.Popen([program, job], cwd=folder, env=alone, stdout=out, stderr=out)
        while True:
            # Its own peak: what wait4 says counts this process's memory before the program took its place.
            peak = max(peak, _peak(process.pid))
            done, status, used = os.wait4(process.pid, os.WNOHANG)
            if done:
                break
            time.sleep(0.02)
        process.returncode = os.waitstatus_to_exitcode(status)
    values = eigenvalues(table.read_text()) if table.is_file() else np.zeros(0)
    if len(values) == 0:
        raise AssertionError(f"CalculiX gave no eigenvalues: {said.read_text()[-400:]}")
    return Run(values, used.ru_utime + used.ru_stime, peak)


def _peak(process: int) -> float:
    """MB so far; zero once it has ended, or before it is the program."""
    try:
        text = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0.0
    most = re.search(r"VmHWM:\s+(\d+)", text)
    return int(most[1]) / 1024.0 if most and "Name:\tccx" in text else 0.0


def eigenvalues(text: str) -> FloatArray:
    """The second column of the first table of its result file."""
    first = text.split("P A R T I C I P A T I O N")[0]
    rows = re.findall(r"^\s+(\d+)((?:\s+[-+.\dE]+){4})\s*$", first, flags=re.MULTILINE)
    return np.array([float(columns.split()[0]) for _, columns in rows])
