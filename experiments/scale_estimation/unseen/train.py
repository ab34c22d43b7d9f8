"""Train all that answers for objects never drawn: ``python -m experiments.scale_estimation.unseen.train``.

Shapes are split, not samples: what is held out is of shapes that nothing was fitted to. The errors there are
printed and written on the cards, and the width of the answers is made to hold there. Sound and touch need
torch: ``pip install '.[author]'``. Modes that were solved are kept, so that a run that was stopped goes on.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from experiments.scale_estimation.size import STEP, Belief, SizeRange
from experiments.scale_estimation.unseen.network import by_ways
from experiments.scale_estimation.unseen.regression import by_outline
from experiments.scale_estimation.unseen.training.contact_samples import TouchableShape, contact_sample
from experiments.scale_estimation.unseen.training.outlines import picture, train_outlines
from experiments.scale_estimation.unseen.training.samples import SIZES, draw_size
from harness.authoring.network_program import (
    chosen_networks,
    exit_code,
    require_torch,
    training_parser,
    write_network,
)
from harness.authoring.profiles import find_profile
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused
from harness.basics.mesh import Mesh, hull_of
from harness.experiment.subjects import REAL
from harness.sim.solid.mesh_read import read_mesh

READINGS = 8
"""Number of readings of each object, standing and lying."""

SIGMAS = tuple(0.02 * k for k in range(26))
"""Standard deviations of the logarithm of the size to compare."""

_KINDS = ("*.obj", "*.stl", "*.ply")
_LEAST = 6
_FLAT = 0.8
"""An object is only laid down if its height is then below this fraction of its standing height."""

Reading = tuple[Belief, float]
"""Estimate of one sense for an object, and the true size in m."""


NETWORKS = ("sound", "touch", "imprints")
REAL_SHAPES = "real-shapes"
SENSES = ("outline", *NETWORKS, REAL_SHAPES)


@dataclass(frozen=True)
class Profile:
    """How much is made and for how long it is learnt."""

    outlines: int  #: shapes whose outlines are fitted.
    shapes: int  #: whose strikes and contacts are learnt.
    strikes: int  #: samples of strikes of each.
    contacts: int  #: explorations of each.
    epochs: tuple[int, int]  #: of sound, of touch and imprints.
    members: int = 3  #: networks of each sense.


PROFILES = MappingProxyType(
    {
        "smoke": Profile(260, 26, 4, 8, (2, 2)),
        "standard": Profile(1300, 520, 40, 48, (30, 60)),
    }
)


def main(arguments: list[str] | None = None) -> int:
    """Make the samples, fit, print what is reached on shapes that were held out, write."""
    parser = training_parser(str(__doc__), "standard")
    parser.add_argument("--meshes", type=Path, help="folder of scanned things, for real-shapes")
    return exit_code(partial(_train, parser.parse_args(arguments)))


def _train(options: argparse.Namespace) -> None:
    paper = "; the paper's networks: python -m experiments.paper.train scale --to FOLDER"
    profile = find_profile(PROFILES, options.profile, "scale", advice=paper)
    senses = chosen_networks(options.only, SENSES)
    fitted = [sense for sense in senses if sense in NETWORKS]
    if fitted:
        require_torch(", or add --only outline")
    folder: Path = options.to or Path(__file__).parent / "data"
    folder.mkdir(parents=True, exist_ok=True)
    if "outline" in senses:
        sys.stdout.write(train_outlines(profile.outlines, options.seed, folder) + "\n")
    for sense in fitted:
        from experiments.scale_estimation.unseen.training.train_network import train_network  # needs torch

        train = partial(train_network, sense, profile, options.seed, options.processes)
        write_network(sense, train, folder, options.profile)
    if REAL_SHAPES not in senses:
        return
    if options.meshes is None:
        sys.stdout.write("real shapes: left out; add --meshes FOLDER of scanned things\n")
        return
    # How much wider answers about scanned things are, by the networks that came with the program.
    widths = train_real_shapes(options.meshes, options.seed)
    (folder / "real_shapes.json").write_text(json.dumps(widths, indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(f"real shapes: {json.dumps(widths)}\n")


if __name__ == "__main__":
    sys.exit(main())


def meshes_in(folder: Path) -> list[Path]:
    """Every mesh of a folder and those in it, but those that tables are measured on and collision hulls.

    Raises:
        DataRefused: too few.
    """
    tabled = {folder / Path(file).relative_to("meshes") for file, _, _ in REAL.values()}
    found = sorted(path for kind in _KINDS for path in folder.rglob(kind))
    found = [path for path in found if path not in tabled and "collision" not in path.name]
    if len(found) < _LEAST:
        raise DataRefused(f"{folder} holds {len(found)} meshes ({', '.join(_KINDS)}); {_LEAST} are needed")
    return found


def resting(mesh: Mesh) -> Iterator[Mesh]:
    """One long, its lowest point on z = 0 below its middle: as in its file, and lying if that is lower."""
    yield _standing(mesh.vertices, mesh)
    lengths = np.ptp(mesh.bounds, axis=0)
    if lengths.min() < _FLAT * lengths[2]:
        order = np.roll([0, 1, 2], 2 - int(lengths.argmin()))  # an even permutation keeps it the same thing
        yield _standing(mesh.vertices[:, order], mesh)


def _standing(places: FloatArray, mesh: Mesh) -> Mesh:
    low, high = places.min(axis=0), places.max(axis=0)
    middle = np.array([*(0.5 * (low + high))[:2], low[2]])
    return Mesh((places - middle) / (high - low).max(), mesh.faces)


def readings(path: Path, seed: int) -> dict[str, list[Reading]]:
    """Looks at a thing and explorations of it, as senses answer them where nobody knows its shape."""
    raw, sizes = read_mesh(path), SizeRange(*SIZES)
    found: dict[str, list[Reading]] = {"vision": [], "touch": []}
    for way, mesh in enumerate(resting(Mesh(raw.vertices, raw.faces))):
        random = np.random.default_rng((seed, way, 6))
        shape, corners = TouchableShape(mesh), hull_of(mesh.vertices)
        for _ in range(READINGS):
            size = draw_size(random)
            found["vision"].append((by_outline(*picture(corners, size, random), sizes), size))
            found["touch"].append((by_ways(contact_sample(shape, size, random), sizes)[0], size))
    return found


def log_densities(read: Sequence[Reading]) -> FloatArray:
    """``(n, SIGMAS)`` of the true size, were a deviation added to what is said."""
    return np.array(
        [[_log_density(belief.widened(sigma), size) for sigma in SIGMAS] for belief, size in read]
    )


def likeliest_sigma(densities: FloatArray) -> float:
    """The deviation with which the true sizes are likeliest, of ``log_densities``."""
    return SIGMAS[int(densities.mean(axis=0).argmax())]


def _log_density(belief: Belief, size: float) -> float:
    logs = belief.range.logs
    return float(belief.log_density[round((np.log(size) - logs[0]) / STEP)])


def _held(read: Sequence[Reading], sigma: float) -> float:
    intervals = [(belief.widened(sigma).interval, size) for belief, size in read]
    return round(float(np.mean([low <= size <= high for (low, high), size in intervals])), 3)


def train_real_shapes(folder: Path, seed: int) -> dict[str, Any]:
    """The deviation of each sense, and what its intervals hold on things that it was not found with."""
    paths, per_thing = meshes_in(folder), []
    for path in paths:
        sys.stderr.write(f"real shapes: {path.name}\n")
        per_thing.append(readings(path, seed))
    found: dict[str, Any] = {"meshes": [str(path.relative_to(folder)) for path in paths]}
    for sense in ("vision", "touch"):
        found[sense] = _widths([one[sense] for one in per_thing])
    return found


def _widths(per_thing: Sequence[Sequence[Reading]]) -> dict[str, Any]:
    densities = [log_densities(read) for read in per_thing]
    left_out = [
        _held(own, likeliest_sigma(np.concatenate([d for k, d in enumerate(densities) if k != row])))
        for row, own in enumerate(per_thing)
    ]
    together = [reading for read in per_thing for reading in read]
    return {
        "sigma": round(likeliest_sigma(np.concatenate(densities)), 2),
        "readings": len(together),
        "held_before": _held(together, 0.0),
        "held_left_out": round(float(np.mean(left_out)), 3),
        "mean_error_cm": round(float(np.mean([1e2 * abs(b.size - s) for b, s in together])), 2),
    }
