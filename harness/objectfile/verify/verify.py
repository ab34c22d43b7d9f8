"""Whether an ObjectFile is what it says: every file, every graph, every number that can be checked."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from harness.basics.errors import DataRefused, TouchstoneError
from harness.basics.files.lock_file import FOLDER_LOCK
from harness.objectfile.audio.audio import open_audio
from harness.objectfile.entries import FileEntry
from harness.objectfile.file import ObjectFile
from harness.objectfile.published.entries import PublishedObject
from harness.objectfile.surface_search import SurfaceSearch
from harness.objectfile.verify.network import look_at_domain, look_at_graph, look_at_self_test, opened_once
from harness.objectfile.verify.touch import look_at_codes
from harness.objectfile.verify.vision import look_at_looks, look_at_networks
from harness.objects.builtin import DESCRIPTION

_SAMPLES = 256
"""Places of the surface where network and table are compared."""

_AGREE = 1.0
"""Median over points of the difference of network and table, relative to the table's gains: a
network beyond it knows nothing of this object."""


@dataclass(frozen=True)
class Check:
    """One thing that was looked at."""

    name: str  #: of it.
    passed: bool  #: whether it holds.
    said: str  #: what was found; where it does not hold, what to do.


def verify(of: ObjectFile | PublishedObject) -> list[Check]:
    """Look at everything; a failure ends its own check alone. An import has no mesh to look at."""
    checks = []
    for name, look in _looks(of):
        try:
            checks.append(Check(name, True, look()))
        except TouchstoneError as error:
            checks.append(Check(name, False, str(error)))
    return checks


def _looks(of: ObjectFile | PublishedObject) -> Iterator[tuple[str, Callable[[], str]]]:
    for entry in of.description.files:
        yield f"{entry.file}: bytes", partial(_bytes, of, entry)
    yield "folder: nothing else", partial(_no_others, of)
    if isinstance(of, ObjectFile):
        yield "mesh", partial(_mesh, of)
    for modality, network in of.description.networks.items():
        run = opened_once(of, network)
        yield f"{modality}: graph", partial(look_at_graph, run)
        yield f"{modality}: domain", partial(look_at_domain, of, run)
        yield f"{modality}: self-test", partial(look_at_self_test, run, network.self_test)
    if isinstance(of, PublishedObject):
        return
    audio = of.description.audio
    if audio is not None and audio.table is not None:
        yield "audio: table", partial(_table, of)
        if audio.network is not None:
            yield "audio: network and table", partial(_agreement, of)
    touch = of.description.touch
    if touch is not None and touch.codes is not None:
        yield "touch: codes and mesh", partial(look_at_codes, of, touch.codes)
    vision = of.description.vision
    if vision is not None:
        yield "vision: networks", partial(look_at_networks, of, vision)
        yield "vision: networks and surface", partial(look_at_looks, of, vision)


def _bytes(of: ObjectFile | PublishedObject, entry: FileEntry) -> str:
    return f"{len(of.read(entry))} bytes, of the hash that object.json says"


def _no_others(of: ObjectFile | PublishedObject) -> str:
    known = {DESCRIPTION, FOLDER_LOCK, *(entry.file for entry in of.description.files)}
    others = sorted(path.name for path in of.folder.iterdir() if path.name not in known)
    stopped = [name for name in others if name.startswith(".") and name.endswith("_training.npz")]
    if stopped:
        raise DataRefused(
            f"{', '.join(stopped)}: a training was stopped; go on with it by the same "
            "`touchstone object build`, or delete it"
        )
    if others:
        raise DataRefused(
            f"{', '.join(others[:5])}: in the folder and not in object.json; "
            "nothing reads it: move it elsewhere"
        )
    return "every file is one that object.json names"


def _mesh(of: ObjectFile) -> str:
    mesh, entry = of.mesh, of.description.mesh
    found = (len(mesh.vertices), len(mesh.faces), *mesh.bounds.ravel().tolist())
    said = (entry.vertices, entry.faces, *entry.low_m, *entry.high_m)
    if not np.allclose(found, said, rtol=0.0, atol=1e-9):
        raise DataRefused(f"{entry.file} holds {found}, object.json says {said}; build the object again")
    size = " x ".join(f"{side * 1e3:.4g}" for side in mesh.bounds[1] - mesh.bounds[0])
    return f"{len(mesh.vertices)} vertices, {len(mesh.faces)} faces, {size} mm"


def _table(of: ObjectFile) -> str:
    modes = open_audio(of, "table").as_modes()
    return f"{len(modes.frequencies)} modes at {len(modes.points)} nodes, finite"


def _agreement(of: ObjectFile) -> str:
    points = SurfaceSearch(of.mesh).spread(_SAMPLES)[0]
    exact, learned = (open_audio(of, level).at(points) for level in ("table", "network"))
    with np.errstate(divide="ignore", invalid="ignore"):  # a place at rest in every mode agrees with nothing
        gaps = np.linalg.norm(learned - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
    middle, high = float(np.median(gaps)), float(np.quantile(gaps, 0.95))
    if not middle <= _AGREE:
        raise DataRefused(
            f"network and table differ by {middle:.0%} of the gains in the median; they belong to different "
            "objects, frames or units: build the object again"
        )
    return f"they differ by {middle:.2%} of the gains in the median, {high:.2%} at 95 % of {_SAMPLES} places"
