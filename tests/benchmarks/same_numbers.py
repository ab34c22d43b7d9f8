"""Compare the numbers of this checkout with those of a reference commit, bit by bit.

``python tests/benchmarks/same_numbers.py`` keeps, under ``--folder``, a clone of the reference with its own
environment, and the results of that clone: a recorded run of each experiment and of an arm calibration over
the wires, their replays, a calibration from pictures and a ``depth`` with it, a table of nine objects, the
modes of fixed tetrahedra, and an ObjectFile of each sense. What is missing there is made first (about half an
hour on two cores). This checkout then repeats everything that needs no bench: it replays the recordings and
makes the rest again, from a copy of the reference's cache, since a surface is filled with other tetrahedra
every time.

Values and files must be equal to the bit, except for paths, versions and times, and for the declared rebases.
Exits with 1 where anything else differs.
"""

import argparse
import itertools
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from fnmatch import fnmatch
from hashlib import sha256
from pathlib import Path
from typing import Any

REFERENCE = "fce45a51"
"""Commit whose numbers are the reference."""

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("TOUCHSTONE_DATA", str(ROOT.parent / "shared" / "data")))
PRESSES = DATA / "tactile" / "gelsight_mini_ball_presses"

_RECORDED = "docs/decisions/0024-tables-answer-recordings.md"

REBASED: dict[str, str] = {
    "table/*: rows: audio: *": _RECORDED,
    "table/*: rows: both: *": _RECORDED,
    "table/*: rows: paper's MFCC filter: *": _RECORDED,
    "*.json: notes: None before, *": "CHANGELOG.md",
}
"""Patterns of places that may differ, such as ``object_vision.json: *``, with the page that declares it."""

RUNS = {
    "mug": ("contact-localization", "--scene", "mug_both", "--seed", "11"),
    "bowl": ("contact-localization", "--scene", "bowl_touch", "--seed", "12"),
    "wrench": (
        *("contact-localization", "--object", "builtin:wrench", "--sense", "both"),
        *("--spacing", "spread", "--seed", "13"),
    ),
    "size": ("scale-estimation", "--scene", "mug_size", "--seed", "14"),
    "shape": ("shape-reconstruction", "--scene", "mug_shape", "--seed", "15"),
}
"""Runs over the wires, by name."""

OBJECTFILES = {
    "audio": ("builtin:bowl", "--material", "ceramic", "--only", "audio"),
    "touch": ("builtin:mug", "--material", "ceramic", "--only", "touch"),
    "vision": ("builtin:mug", "--material", "ceramic", "--only", "vision"),
}
"""ObjectFiles of profile smoke, by sense."""

UNCOMPARED = {
    "recording", "report", "command", "folder", "versions", "git", "made", "created", "calls", "answered",
    "from_store", "schema", "seconds", "seconds_by_stage", "stage_seconds", "cores", "machine", "out", "page",
    "page_html", "artefact", "objectfile", "size_bytes", "code",
}  # fmt: skip
"""Keys of paths, versions and times, in which two computations may differ."""

MAIN = "import sys; from harness.cli import main; sys.exit(main())"


class Side:
    """One checkout with its environment, and the folder of its results."""

    def __init__(self, code: Path, made: Path) -> None:
        self.code = code
        self.made = made  #: folder of the results, with the checkout's own cache
        made.mkdir(parents=True, exist_ok=True)

    def write_once(self, name: str, *arguments: str) -> None:
        """Write the standard output of a command of this checkout to ``name``, unless it is there."""
        path = self.made / name
        if path.exists():
            return
        sys.stderr.write(f"making {path}\n")
        environment = {
            **os.environ,
            "TOUCHSTONE_CACHE": str(self.made / "cache"),
            "PYTHONPATH": str(self.code),
        }
        done = subprocess.run(
            [str(self.code / ".venv" / "bin" / "python"), "-c", MAIN, *arguments],
            cwd=self.made,
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
            check=False,
        )
        if done.returncode:
            raise SystemExit(
                f"{self.code}: touchstone {' '.join(arguments)} exited with code {done.returncode}"
            )
        path.write_text(done.stdout)

    def repeat(self, recorded: Path) -> None:
        """Make everything that needs no bench: replays of the runs in ``recorded``, and the rest again."""
        for name in RUNS:
            self.write_once(
                f"replay_{name}.json",
                "replay",
                str(recorded / "runs" / name),
                "--out",
                f"replays/{name}",
                "--json",
            )
        self.write_once(
            "replay_taxim.json",
            "calibrate",
            "taxim",
            str(recorded / "runs" / "taxim"),
            "--out",
            "fitted.npz",
            "--json",
        )
        if PRESSES.is_dir():
            ball = (
                *(str(PRESSES / "ball_6.310mm"), "--background", str(PRESSES / "background.png")),
                *("--ball-radius", "3.155mm", "--pitch", "0.0634mm", "--sensor", "gelsight-mini"),
            )
            self.write_once("taxim_mini.json", "calibrate", "taxim", *ball, "--out", "mini.npz", "--json")
            press = str(PRESSES / "ball_6.310mm" / "05.png")
            depth = ("--calibration", "mini.npz", "--sensor", "gelsight-mini", "--out", "depth.npz", "--json")
            self.write_once("depth.json", "depth", press, *depth)
        # One worker: of two that meet an object at once, each solves modes of its own and one is kept.
        table = ("--seeds", "1", "--gap", "default", "--yaw", "known", "--data", str(DATA), "--workers", "1")
        self.write_once("table.json", "tables", "contact-localization", *table, "--json", "--out", "table")
        (self.made / "box.msh").write_text(box_of_tetrahedra(6, 4, 3))
        steel = ("--material", "steel", "--units", "m", "--modes", "40", "--json")
        self.write_once("modes.json", "sim", "modes", "box.msh", *steel)
        for sense, options in OBJECTFILES.items():
            smoke = ("--profile", "smoke", "--threads", "1", "--out", f"objects/{sense}", "--json")
            self.write_once(f"object_{sense}.json", "object", "build", *options, *smoke)


def record(reference: Side) -> None:
    """Record the runs of the reference commit and everything that they are compared by."""
    if not (reference.code / ".venv" / ".installed").exists():
        _program("git", "clone", "--quiet", str(ROOT), str(reference.code))
        _program("git", "-C", str(reference.code), "checkout", "--quiet", REFERENCE)
        _program("make", "-C", str(reference.code), "install")
    wires = ("--station", "mock", "--bench", "wires", "--json")
    for name, (experiment, *options) in RUNS.items():
        reference.write_once(f"run_{name}.json", "run", experiment, *wires, *options, "--out", f"runs/{name}")
    presses = ("--ball-radius", "2mm", "--presses", "20", "--run", "runs/taxim")
    reference.write_once("run_taxim.json", "calibrate", "taxim", *wires, *presses)
    reference.repeat(reference.made)


def differences(before: Path, now: Path) -> Iterator[str]:
    """Yield every value and file in which two folders of results differ, with its place."""
    for path in sorted(before.glob("*.json")):
        if not path.name.startswith(("run_", "table.json")):
            yield from _value_differences(_json(path), _json(now / path.name), path.name)
    for path in sorted((before / "table").glob("*.json")):
        yield from _value_differences(_json(path), _json(now / "table" / path.name), f"table/{path.name}")
    files = [
        p for p in (before / "objects").rglob("*") if p.suffix in (".onnx", ".npy", ".ply", ".npz", ".json")
    ]
    files += list(before.glob("*.npz"))
    if not files:
        yield f"{before}: no ObjectFile to compare"
    for path in sorted(files):
        name = path.relative_to(before)
        other = now / name
        if not other.exists():
            yield f"{name}: missing"
        elif path.suffix == ".json":
            yield from _value_differences(_json(path), _json(other), str(name))
        elif sha256(path.read_bytes()).digest() != sha256(other.read_bytes()).digest():
            yield f"{name}: other bytes"


def _value_differences(before: Any, now: Any, where: str) -> Iterator[str]:
    if isinstance(before, dict) and isinstance(now, dict):
        for key in sorted(before.keys() | now.keys()):
            if key not in UNCOMPARED and not key.endswith("_seconds") and not key.startswith("seconds"):
                yield from _value_differences(before.get(key), now.get(key), f"{where}: {key}")
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        for index, (one, other) in enumerate(zip(before, now, strict=True)):
            yield from _value_differences(one, other, f"{where}[{index}]")
    elif before != now:
        yield f"{where}: {before!r} before, {now!r} now"


def _program(name: str, *arguments: str) -> str:
    found = shutil.which(name)
    if found is None:
        raise SystemExit(f"{name} is not installed")
    return subprocess.run([found, *arguments], stdout=subprocess.PIPE, text=True, check=True).stdout


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


def main() -> int:
    """Record what is missing, compute again, compare."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--folder", type=Path, default=ROOT.parent / "proof", help="results of the reference")
    parser.add_argument(
        "--now", type=Path, help="results of this checkout; default: a new folder under --folder"
    )
    parser.add_argument("--record", action="store_true", help="only record the reference")
    options = parser.parse_args()
    folder: Path = options.folder.resolve()
    reference = Side(folder / "reference", folder / "recorded")
    record(reference)
    if options.record:
        return 0
    described = ("-C", str(ROOT), "describe", "--always", "--dirty=-changed", "--abbrev=9")
    commit = _program("git", *described).strip()
    now = Side(ROOT, options.now or folder / f"now-{commit}-{os.getpid()}")
    shutil.copytree(reference.made / "cache", now.made / "cache", dirs_exist_ok=True)
    now.repeat(reference.made)
    found = list(differences(reference.made, now.made))
    rebased = [line for line in found if any(fnmatch(line, pattern) for pattern in REBASED)]
    for line in found:
        sys.stdout.write(f"{line}{' (declared rebase)' if line in rebased else ''}\n")
    sys.stdout.write(
        f"{len(found) - len(rebased)} differences between {REFERENCE} and this checkout, "
        f"and {len(rebased)} in declared rebases; {now.made}\n"
    )
    return 1 if len(found) > len(rebased) else 0


if __name__ == "__main__":
    sys.exit(main())
