"""CalculiX as a peer: its input written from our mesh, its eigenvalues read back.

Dhondt and Wittig's finite-element program, ``ccx``; Debian's package is calculix-ccx.
"""

import os
import re
import resource
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from harness.arrays import FloatArray, IntArray
from harness.materials import Material
from harness.sim.modal_mesh import QuadraticMesh

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


def run(program: str, folder: Path, job: str) -> tuple[FloatArray, float]:
    """``(rad/s)^2``, ascending, and the CPU seconds it took on one thread."""
    alone = {**os.environ, "OMP_NUM_THREADS": "1", "CCX_NPROC_STIFFNESS": "1", "OPENBLAS_NUM_THREADS": "1"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, job], cwd=folder, env=alone, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    table = folder / f"{job}.dat"
    values = eigenvalues(table.read_text()) if table.is_file() else np.zeros(0)
    if len(values) == 0:
        raise AssertionError(f"CalculiX gave no eigenvalues: {done.stdout[-400:]}")
    took = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return values, took


def eigenvalues(text: str) -> FloatArray:
    """The second column of the first table of its result file."""
    first = text.split("P A R T I C I P A T I O N")[0]
    rows = re.findall(r"^\s+(\d+)((?:\s+[-+.\dE]+){4})\s*$", first, flags=re.MULTILINE)
    return np.array([float(columns.split()[0]) for _, columns in rows])
