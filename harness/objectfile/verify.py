"""Verify an ObjectFile: every file, every graph, every number that can be checked."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused, TouchstoneError
from harness.basics.files.lock_file import FOLDER_LOCK
from harness.objectfile.audio.audio import open_audio
from harness.objectfile.entries import FileEntry, Input, NetworkEntry, SelfTest, Tensor
from harness.objectfile.file import ObjectFile
from harness.objectfile.published.entries import PublishedObject
from harness.objectfile.runtime import Network
from harness.objectfile.self_test import require_self_test
from harness.objectfile.surface_search import SurfaceSearch
from harness.objectfile.touch.nodes import nodes_from
from harness.objectfile.touch.touch import open_touch
from harness.objectfile.touch_entries import CodesEntry
from harness.objectfile.vision.graph import VisionNetworks
from harness.objectfile.vision.render import open_vision, require_described
from harness.objectfile.vision.view import camera_for, light_for, turned
from harness.objectfile.vision_entry import VisionEntry
from harness.objects.builtin import DESCRIPTION
from harness.sim.gel.press_pose import Presses

Either = ObjectFile | PublishedObject

_SAMPLES = 256
"""Places of the surface where network and table are compared."""

_AGREE = 1.0
"""Median over points of the difference of network and table, relative to the table's gains: a
network beyond it knows nothing of this object."""

_INSIDE = 256
"""Random queries within the domain, and as many at its very edge."""

_AT_ONCE = 16
"""Queries in one run: an image for each is large within a graph."""

_PRESSES = 16

_PRESSES_AGREE = 0.2
"""Largest median rms difference of codes and mesh over the presses, as a fraction of the gel's thickness:
codes with a larger difference belong to another object."""

_VIEWS = 3
_PIXELS = 48

_OPAQUE = 0.5
"""Minimum median opacity at points of the surface; networks of another object stay below it."""


@dataclass(frozen=True)
class ObjectCheck:
    """One check of an ObjectFile."""

    check: str  #: name of the check.
    passed: bool
    said: str  #: finding; where the check failed, what to do.


def verify(of: Either) -> list[ObjectCheck]:
    """Look at everything; a failure ends its own check alone. An import has no mesh to look at."""
    checks = []
    for name, look in _list_checks(of):
        try:
            checks.append(ObjectCheck(name, True, look()))
        except TouchstoneError as error:
            checks.append(ObjectCheck(name, False, str(error)))
    return checks


def _list_checks(of: Either) -> Iterator[tuple[str, Callable[[], str]]]:
    for entry in of.description.files:
        yield f"{entry.file}: bytes", partial(_check_bytes, of, entry)
    yield "folder: nothing else", partial(_check_extra_files, of)
    if isinstance(of, ObjectFile):
        yield "mesh", partial(_mesh, of)
    for modality, network in of.description.networks.items():
        run = cache(partial(_open, of, network))
        yield f"{modality}: graph", partial(_check_graph, run)
        yield f"{modality}: domain", partial(check_domain, of, run)
        yield f"{modality}: self-test", partial(check_self_test, run, network.self_test)
    if isinstance(of, PublishedObject):
        return
    audio = of.description.audio
    if audio is not None and audio.table is not None:
        yield "audio: table", partial(_table, of)
        if audio.network is not None:
            yield "audio: network and table", partial(_agreement, of)
    touch = of.description.touch
    if touch is not None and touch.codes is not None:
        yield "touch: codes and mesh", partial(check_codes, of, touch.codes)
    vision = of.description.vision
    if vision is not None:
        yield "vision: networks", partial(_check_networks, of, vision)
        yield "vision: networks and surface", partial(_check_views, of, vision)


def _check_bytes(of: Either, entry: FileEntry) -> str:
    return f"{len(of.read(entry))} bytes, of the hash that object.json says"


def _check_extra_files(of: Either) -> str:
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


Opened = Callable[[], Network]


def _open(of: Either, entry: NetworkEntry) -> Network:
    return Network(of.read(entry), entry.file, entry.inputs, entry.outputs)


def _check_graph(run: Opened) -> str:
    run()
    return "valid ONNX of known operations, weights inside and finite, inputs and outputs as described"


def check_domain(of: Either, run: Opened) -> str:
    """Query a network at random inputs of its stated domain.

    Raises:
        DataRefused: an output is not finite, or has another shape than described.
    """
    network, random = run(), np.random.default_rng(0)
    queries = {item.name: _queries(of, item, random) for item in network.inputs}
    for first in range(0, 2 * _INSIDE, _AT_ONCE):
        outputs = network({name: rows[first : first + _AT_ONCE] for name, rows in queries.items()})
        for tensor in network.outputs:
            values, wanted = outputs[tensor.name], _shape(tensor, _AT_ONCE)
            if values.shape != wanted:
                raise DataRefused(
                    f"{network.name} gives {tensor.name!r} of shape {values.shape} where object.json "
                    f"says {wanted}; build the object again"
                )
            bad = int(np.count_nonzero(~np.isfinite(values)))
            if bad:
                raise DataRefused(
                    f"{network.name} gives {bad} of {values.size} numbers {tensor.name!r} that are not "
                    "finite within its stated domain; train it again, or state a smaller domain"
                )
    return f"finite at {2 * _INSIDE} places of the domain, half of them at its edge"


def check_self_test(run: Opened, test: SelfTest) -> str:
    """Repeat the queries of the network's self-test.

    Raises:
        DataRefused: the outputs differ by more than the tolerance, or the test is empty.
    """
    worst = require_self_test(run(), test)
    return f"as when it was made, to {worst:.1e} of the greatest number ({test.tolerance:g} is allowed)"


def _queries(of: Either, item: Input, random: np.random.Generator) -> AnyArray:
    """``2 _INSIDE`` queries of one input, half inside of its domain, half at the edge."""
    domain, count = item.domain, 2 * _INSIDE
    shares = random.random((count, int(np.prod(_shape(item, 1)))))
    shares[_INSIDE:] = np.round(shares[_INSIDE:])
    if domain.near_surface_m is not None:
        if isinstance(of, PublishedObject):
            raise DataRefused(
                f"the domain of {item.name!r} is near a surface, which an import does not have; import it "
                "again"
            )
        places, normals = SurfaceSearch(of.mesh).spread(count)
        lifts = domain.near_surface_m * (2.0 * shares[:, :1] - 1.0)
        return np.asarray((places + lifts * normals).astype(item.dtype))
    low, high = np.array(domain.low, np.float64), np.array(domain.high, np.float64)
    if low.size != shares.shape[1]:
        raise DataRefused(
            f"the domain of {item.name!r} has {low.size} numbers for queries of {shares.shape[1]}; build it "
            "again"
        )
    queries = low + shares * (high - low)
    return np.asarray(queries.reshape(_shape(item, count)).astype(item.dtype))


def _shape(tensor: Tensor, rows: int) -> tuple[int, ...]:
    return tuple(rows if size == "n" else size for size in tensor.shape)


def check_codes(of: ObjectFile, entry: CodesEntry) -> str:
    """Compare maps of upright presses at some coded points with the rasterised mesh.

    Raises:
        DataRefused: the maps are not of one object.
    """
    nodes = nodes_from(of.read(entry.nodes), entry.nodes.file)
    chosen = np.unique(np.linspace(0, len(nodes) - 1, _PRESSES).astype(np.int64))
    codes, mesh = open_touch(of, "codes"), open_touch(of, "reference")
    nothing = np.zeros(len(chosen))
    depths = np.full(len(chosen), float(np.mean(codes.entry.depth_m)))
    presses = Presses(nodes.points[chosen], nodes.normals[chosen], depths, nothing, nothing, nothing)
    gaps = np.sqrt(((codes.at(presses) - mesh.at(presses)) ** 2).mean(axis=(1, 2)))
    middle, limit = float(np.median(gaps)), _PRESSES_AGREE * codes.entry.gel.thickness_m
    if not middle <= limit:
        raise DataRefused(
            f"codes and mesh differ by {middle * 1e3:.3g} mm in the median press, where {limit * 1e3:.3g} mm "
            "is the limit; they belong to different objects, frames or units: build the object again"
        )
    worst = gaps.max() * 1e6
    return f"they differ by {middle * 1e6:.3g} um in the median of {len(chosen)} presses, {worst:.3g} at most"


def _check_networks(of: ObjectFile, entry: VisionEntry) -> str:
    networks = VisionNetworks(of.read(entry.network), entry.network.file)
    require_described(networks, entry)
    return (
        f"{len(networks.grid)} of {networks.size.parameters} numbers, in cubes of "
        f"{entry.grid.cell_m * 1e3:.4g} mm; {networks.size.width} wide, {networks.size.kind}"
    )


def _check_views(of: ObjectFile, entry: VisionEntry) -> str:
    """Check from views around the object that the networks are opaque at the surface."""
    vision, medians = open_vision(of, threads=1), []
    camera = camera_for(vision.surface, _PIXELS, _PIXELS)
    middle = vision.surface.bounds.mean(axis=0)
    depth = entry.shell.deep_voxels * entry.grid.cell_m / entry.shell.voxels_per_cell
    for step in range(_VIEWS):
        view, light = turned(camera, light_for(camera), middle, 2.0 * np.pi * step / _VIEWS)
        medians.append(float(np.median(vision.renderer.opacities(view, light, depth))))
    least = min(medians)
    if not least >= _OPAQUE:
        raise DataRefused(
            f"the networks stop {least:.0%} of the light where the surface is, in the median point, and "
            f"{_OPAQUE:.0%} or more would be a surface; they belong to different objects, frames or units: "
            "build the object again"
        )
    return f"opaque to {least:.1%} in the median point of {_VIEWS} views"
