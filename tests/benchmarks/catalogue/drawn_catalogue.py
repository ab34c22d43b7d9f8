"""A catalogue of procedural household objects, and how a build of it is run and read back."""

import csv
import hashlib
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from harness.basics.materials import MATERIALS
from harness.sim.solid.household.families import FAMILIES, draw


def write_catalogue(folder: Path, objects: int, poisoned: bool = False, seed: int = 29) -> Path:
    """Draw objects of 8 to 20 cm, one family after another; with one more that is no mesh, if wanted."""
    folder.mkdir(parents=True, exist_ok=True)
    names, kinds = list(FAMILIES), list(MATERIALS)
    rows = [["name", "material", "units"]]
    for number in range(objects):
        random = np.random.default_rng([seed, number])
        surface = draw(names[number % len(names)], random).surface
        size = random.uniform(0.08, 0.2)
        name = f"{names[number % len(names)]}_{number:04d}"
        trimesh.Trimesh(surface.vertices * size, surface.faces, process=False).export(folder / f"{name}.stl")
        rows.append([name, kinds[number % len(kinds)], "m"])
    if poisoned:
        (folder / "poisoned.stl").write_bytes(b"solid nothing\nendsolid\n")
        rows.append(["poisoned", "steel", "m"])
    path = folder / f"objects_{objects}.csv"
    with path.open("w", newline="") as stream:
        csv.writer(stream).writerows(rows)
    return path


def command(catalogue: Path, out: Path, *more: str) -> list[str]:
    """The command line of a build in the smallest profile."""
    program = str(Path(sys.executable).with_name("touchstone"))
    arguments = ["--out", str(out), "--profile", "smoke", "--json", *more]
    return [program, "catalogue", "build", str(catalogue), *arguments]


def answer(catalogue: Path, out: Path, *more: str) -> dict[str, Any]:
    """What a build that runs to its end says."""
    done = subprocess.run(command(catalogue, out, *more), stdout=subprocess.PIPE, check=False)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def built(out: Path) -> int:
    """Objects whose records are there."""
    return len(list((out / "records").glob("*.json")))


def hashes(out: Path) -> dict[str, str]:
    """Of every file of every ObjectFile."""
    files = sorted(path for path in (out / "objects").rglob("*") if path.is_file())
    return {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def times_made(out: Path) -> Counter[tuple[str, str]]:
    """How often each sense of each object was made, by their logs."""
    made: Counter[tuple[str, str]] = Counter()
    for log in (out / "logs").glob("*.txt"):
        for line in log.read_text(errors="replace").splitlines():
            if line.endswith(" is made (100%)"):
                made[log.stem, line.split()[1]] += 1
    return made
