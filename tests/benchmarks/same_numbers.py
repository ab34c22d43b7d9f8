"""Whether this checkout computes, to the bit, what commit 488cc9b computed: ``python
tests/benchmarks/same_numbers.py``.

A surface is filled with other tetrahedra every time it is filled, so modes that each side solved for itself
would differ, as they do between two runs of one checkout. This checkout is therefore given the reference's
cache, under the names that dataclasses had there; modes of given tetrahedra are compared as well.

Under ``--folder`` it keeps a clone of that commit with its own environment, and what that clone made: the
rows of the localization table (nine objects, two spacings, struck too), three runs over the wires and one
calibration run of the arm, and an ObjectFile of each sense. Whatever is missing there is made first (about
fifteen minutes on two cores). Then this checkout makes the table and the ObjectFiles anew, replays the four
runs, and everything is compared: estimates and hashes to the bit, results in all but paths, versions and
seconds. Ends with 1 where anything differs.
"""

import argparse
import itertools
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any

BEFORE = "488cc9b"
"""The commit whose numbers are the reference."""

ROOT = Path(__file__).resolve().parents[2]

RUNS = {
    "mug": ["--scene", "{code}/scenes/mug_both.toml", "--seed", "11"],
    "bowl": ["--scene", "{code}/scenes/bowl_touch.toml", "--seed", "12"],
    "wrench": ["--object", "builtin:wrench", "--sense", "both", "--spacing", "spread", "--seed", "13"],
}
"""Runs over the wires, by name."""

OBJECTFILES = {
    "audio": ["builtin:bowl", "--material", "ceramic", "--only", "audio"],
    "touch": ["builtin:mug", "--material", "ceramic", "--only", "touch"],
    "vision": ["builtin:mug", "--material", "ceramic", "--only", "vision"],
}
"""ObjectFiles of profile smoke, by sense."""

PASSING = {
    "recording", "report", "command", "folder", "versions", "git", "made", "created", "calls", "answered",
    "from_store", "schema", "seconds", "seconds_by_stage", "stage_seconds", "cores", "machine", "out", "page",
    "page_html", "artefact", "objectfile", "size_bytes", "code",
}  # fmt: skip
"""Keys whose values are paths, versions and times, in which two computations may differ."""


ADDED = {"observed", "answered_after_s", "agreement"}
"""Keys of a result that the reference does not have yet."""


MAIN = "import sys; from harness.cli import main; sys.exit(main())"

RENAMED = """
import json, os
from harness.basics import store
names = json.loads(os.environ["OLD_NAMES"])
store.type_name = lambda kind: f"{names.get(kind.__module__, kind.__module__)}.{kind.__qualname__}"
"""


class Side:
    """One checkout, the environment that runs it, and the folder of what it made.

    Args:
        code: the checkout.
        made: what it makes goes here, its cache too.
        old_names: modules of the reference by what they are called in this checkout.
    """

    def __init__(self, code: Path, made: Path, old_names: dict[str, str] | None = None) -> None:
        self.code, self.made, self.old_names = code, made, old_names
        made.mkdir(parents=True, exist_ok=True)

    def touchstone(self, *arguments: str) -> str:
        """Standard output of a command of this checkout."""
        environment = {**os.environ, "TOUCHSTONE_CACHE": str(self.made / "cache")}
        python = self.code / ".venv" / "bin" / "python"
        environment["PYTHONPATH"] = str(self.code)
        program = MAIN
        if self.old_names is not None:
            environment["OLD_NAMES"] = json.dumps(self.old_names)
            program = RENAMED + MAIN
        done = subprocess.run(
            [str(python), "-c", program, *arguments],
            cwd=self.made,
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
            check=False,
        )
        if done.returncode:
            raise SystemExit(f"{self.code}: touchstone {' '.join(arguments)} ended with {done.returncode}")
        return done.stdout

    def table(self, name: str) -> None:
        """Rows of nine objects, close and spread, touched and struck, one file each."""
        shared = os.environ.get("TOUCHSTONE_DATA", str(ROOT.parent / "shared" / "data"))
        # One run at a time: of two that meet an object at once each solves modes of its own, and one is kept;
        # and workers that are started anew would not know the old names.
        options = ["--seeds", "1", "--gap", "default", "--yaw", "known", "--data", shared, "--json"]
        options += ["--workers", "1"]
        self.once("table.json", "tables", name, *options, "--out", "table")

    def once(self, name: str, *arguments: str) -> None:
        """Write what a command prints into the file ``name``, unless it is there."""
        path = self.made / name
        if not path.exists():
            sys.stderr.write(f"making {path}\n")
            path.write_text(self.touchstone(*arguments))

    def solid_modes(self) -> None:
        """Modes of given tetrahedra, to the last bit of every frequency."""
        mesh = self.made / "box.msh"
        mesh.write_text(box_of_tetrahedra(6, 4, 3))
        options = ["--material", "steel", "--units", "m", "--modes", "40", "--json"]
        self.once("modes.json", "sim", "modes", str(mesh), *options)

    def objectfiles(self) -> None:
        """An ObjectFile of each sense, of profile smoke."""
        for sense, named in OBJECTFILES.items():
            options = ["--profile", "smoke", "--threads", "1", "--out", f"objects/{sense}", "--json"]
            self.once(f"object_{sense}.json", "object", "build", *named, *options)


def record(before: Side) -> None:
    """Everything that the reference commit makes, where it is not there yet."""
    if not (before.code / ".venv" / ".installed").exists():
        _program("git", "clone", "--quiet", str(ROOT), str(before.code))
        _program("git", "-C", str(before.code), "checkout", "--quiet", BEFORE)
        _program("make", "-C", str(before.code), "install")
    for name, options in RUNS.items():
        filled = [option.format(code=before.code) for option in options]
        command = [
            "run",
            "contact-localization",
            "--station",
            "mock",
            *filled,
            "--out",
            f"runs/{name}",
            "--json",
        ]
        before.once(f"run_{name}.json", *command)
        before.once(f"replay_{name}.json", *replay(before, name))
    options = [
        "--station",
        "mock",
        "--ball-radius",
        "2mm",
        "--presses",
        "20",
        "--run",
        "runs/taxim",
        "--json",
    ]
    before.once("run_taxim.json", "calibrate", "taxim", *options)
    before.once("replay_taxim.json", *calibration(before))
    before.table("localization")
    before.solid_modes()
    before.objectfiles()


def replay(before: Side, name: str) -> tuple[str, ...]:
    """The command that answers a run of the reference again."""
    return ("replay", str(before.made / "runs" / name), "--out", f"replays/{name}", "--json")


def calibration(before: Side) -> tuple[str, ...]:
    """The command that fits a gel to the reference's presses of a ball again."""
    return ("calibrate", "taxim", str(before.made / "runs" / "taxim"), "--out", "fitted.npz", "--json")


def make_anew(now: Side, before: Side, table: str) -> None:
    """Everything that is compared, made by this checkout."""
    for name in RUNS:
        now.once(f"replay_{name}.json", *replay(before, name))
    now.once("replay_taxim.json", *calibration(before))
    now.table(table)
    now.solid_modes()
    now.objectfiles()


def differences(before: Side, now: Side) -> Iterator[str]:
    """Every value in which the two differ, with where it stands."""
    for name in [*(f"replay_{run}.json" for run in (*RUNS, "taxim")), "modes.json", *_objects()]:
        yield from _unlike(_json(before.made / name), _json(now.made / name), name)
    tables = sorted(path.name for path in (before.made / "table").glob("*.json"))
    for name in tables:
        yield from _unlike(_json(before.made / "table" / name), _json(now.made / "table" / name), name)
    for name in OBJECTFILES:
        yield from _files(before.made / "objects" / name, now.made / "objects" / name)


def _objects() -> list[str]:
    return [f"object_{sense}.json" for sense in OBJECTFILES]


def _files(before: Path, now: Path) -> Iterator[str]:
    """ONNX graphs, tables and meshes by their hashes; the description by its values."""
    names = {
        p.relative_to(before) for p in before.rglob("*") if p.suffix in (".onnx", ".npy", ".ply", ".npz")
    }
    if not names:
        yield f"{before}: holds nothing to compare"
    for name in sorted(names):
        same = (now / name).exists() and _hash(before / name) == _hash(now / name)
        if not same:
            yield f"{now / name}: not the bytes of {before / name}"
    yield from _unlike(_json(before / "object.json"), _json(now / "object.json"), str(now / "object.json"))


def _unlike(before: Any, now: Any, where: str) -> Iterator[str]:
    if isinstance(before, dict) and isinstance(now, dict):
        for key in sorted(before.keys() | now.keys()):
            if (
                (key in before or key not in ADDED)
                and key not in PASSING
                and not key.endswith("_seconds")
                and not key.startswith("seconds")
            ):
                yield from _unlike(before.get(key), now.get(key), f"{where}: {key}")
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for index, (one, other) in enumerate(zip(before, now, strict=True)):
            yield from _unlike(one, other, f"{where}[{index}]")
    elif before != now:
        yield f"{where}: {before!r} before, {now!r} now"


def _program(name: str, *arguments: str) -> str:
    found = shutil.which(name)
    if found is None:
        raise SystemExit(f"{name} is not installed")
    return subprocess.run([found, *arguments], stdout=subprocess.PIPE, text=True, check=True).stdout


def _old_names() -> dict[str, str]:
    """Modules of the reference by what they are called now, as git finds them again."""
    found = _program(
        "git", "-C", str(ROOT), "diff", "-M40%", "-l0", "--name-status", "--diff-filter=R", BEFORE
    )
    moves = [line.split("\t")[1:] for line in found.splitlines() if line.endswith(".py")]
    return {_module(new): _module(old) for old, new in moves}


def _module(path: str) -> str:
    return path.removesuffix(".py").replace("/", ".")


def box_of_tetrahedra(*cells: int) -> str:
    """A Gmsh file (version 2.2) of a box, 10 mm a cell, every cell cut into six tetrahedra."""
    counts = [n + 1 for n in cells]
    places = list(itertools.product(*(range(n) for n in counts)))
    number = {place: k + 1 for k, place in enumerate(places)}
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(places))]
    lines += [f"{number[p]} {0.01 * p[0]} {0.01 * p[1]} {0.01 * p[2]}" for p in places]
    solids = []
    for corner in itertools.product(*(range(n) for n in cells)):
        for order in itertools.permutations(range(3)):
            at, path = list(corner), [tuple(corner)]
            for axis in order:
                at[axis] += 1
                path.append(tuple(at))
            # An odd order of the axes makes a cell of the other hand.
            odd = sum(a > b for a, b in itertools.combinations(order, 2)) % 2
            path[2:] = path[2:] if not odd else path[:1:-1]
            solids.append(path)
    lines += ["$EndNodes", "$Elements", str(len(solids))]
    lines += [f"{k + 1} 4 2 0 1 {' '.join(str(number[p]) for p in s)}" for k, s in enumerate(solids)]
    return "\n".join([*lines, "$EndElements", ""])


def _json(path: Path) -> Any:
    return json.loads(path.read_text())


def _hash(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()


def main() -> int:
    """Record what is missing, compute anew, compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, default=ROOT.parent / "proof", help="what the reference made")
    parser.add_argument(
        "--now", type=Path, help="what this checkout makes; a new folder under --folder if left out"
    )
    parser.add_argument("--table", default="contact-localization", help="name of the table")
    parser.add_argument("--record", action="store_true", help="only record the reference")
    given = parser.parse_args()
    folder: Path = given.folder.resolve()
    before = Side(folder / "before", folder / "recorded")
    record(before)
    if given.record:
        return 0
    described = ("-C", str(ROOT), "describe", "--always", "--dirty=-changed", "--abbrev=9")
    commit = _program("git", *described).strip()
    now = Side(ROOT, given.now or folder / f"now-{commit}-{os.getpid()}", _old_names())
    shutil.copytree(before.made / "cache", now.made / "cache", dirs_exist_ok=True)
    make_anew(now, before, given.table)
    found = list(differences(before, now))
    for line in found:
        sys.stdout.write(f"{line}\n")
    sys.stdout.write(f"{len(found)} differences between {BEFORE} and this checkout; {now.made}\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
