"""From a surface to the networks of its touch, and what they are worth on presses they never saw."""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from onnx import ModelProto
from threadpoolctl import threadpool_limits

from harness.authoring.touch.codes import CodedSurface, PatchSpec, code_surface, patch_bytes
from harness.authoring.touch.data import choose_nodes
from harness.authoring.touch.metrics import PressBench
from harness.authoring.touch.profiles import CodesSpec, TouchPerceptronSpec, TouchProfile
from harness.authoring.training import Report, median_seconds, train
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.sensor import TactileSensor
from harness.objectfile.runtime import Network
from harness.objectfile.touch.graph import codes_graph
from harness.objectfile.touch.nodes import NodeSearch, SurfaceNodes
from harness.objectfile.touch.part import CODES, CodesPart, PerceptronPart, codes_tensors
from harness.objectfile.touch.touch import CodeMaps
from harness.sim.gel.gel import GelSkirt
from harness.sim.gel.height_map import RasterMesh

CHECKPOINT = ".touch_training.npz"
"""Beside ``object.json`` until the training is over."""

SPACINGS = tuple(1e-3 * each for each in (4, 5, 6, 7, 8, 10, 12, 14, 17, 20))
"""m between nodes: the closest that a file has room for is taken."""

OFF = 1.3
"""Spacings that a press may be from its node: nodes are closer; smooth normals lean from a face's."""

COARSENED = (1.0, 4.0 / 3.0, 5.0 / 3.0, 2.0)
"""Times the profile's pitch that a patch's pixels may be, where no spacing leaves room for finer ones."""

_TIMED = 20

Settings = dict[str, str | float | int | bool | None]


@dataclass(frozen=True, eq=False)
class AuthoredTouch:
    """Networks and their worth.

    Attributes:
        codes: to be written.
        perceptron: to be written; None where the profile has none.
        errors: ``"trained_places"``, ``"unseen_places"`` and ``"any_press"``, of the codes and of what costs
            nothing to compare with: by a name with its unit.
        settings: how they were made.
        seconds: s on the clock of each stage.
    """

    codes: CodesPart
    perceptron: PerceptronPart | None
    errors: Mapping[str, Mapping[str, Mapping[str, float]]]
    settings: Settings
    seconds: Mapping[str, float]


def author_touch(
    mesh: Mesh,
    sensor: TactileSensor,
    skirt: GelSkirt,
    profile: TouchProfile,
    seed: int,
    folder: Path,
    report: Report,
    threads: int = 1,
) -> AuthoredTouch:
    """Make and measure the networks of one object's touch.

    Args:
        mesh: of the object.
        sensor: a flat gel.
        skirt: of the gel, in its pixels.
        profile: which networks.
        seed: of nodes, presses, first weights and orders.
        folder: where a checkpoint is kept; a training that was killed goes on from it.
        report: told of progress.
        threads: of a training; with one, a resumed training gives the same network bit for bit.

    Raises:
        WrongUse: a file too small for any codes of this object.
        DataRefused: a checkpoint in the folder that cannot be gone on from.
    """
    begun = time.perf_counter()
    report("coding the surface", 0.0)
    raster = RasterMesh(mesh)
    with threadpool_limits(limits=threads, user_api="blas"):
        coded, spacing = spaced_codes(raster, sensor, profile.codes, seed)
    graph = codes_graph(coded.patches, sensor, skirt)
    coding = time.perf_counter() - begun
    bench = PressBench(mesh, raster, sensor, skirt, coded.nodes, OFF * spacing)
    errors, seconds = {}, {"codes": coding}
    maps = opened_codes(graph, coded.nodes, bench.most_off, sensor)
    kinds = {
        "trained_places": bench.at_nodes,
        "unseen_places": bench.between_nodes,
        "any_press": bench.of_any_press,
    }
    for kind, measure in kinds.items():
        report(f"measuring at {kind.replace('_', ' ')}", 0.0)
        begun = time.perf_counter()
        found = measure(maps, profile.presses, seed)
        errors[kind] = found.rows() | {"presses": {"asked": found.asked, "possible": len(found.presses)}}
        seconds[f"measure {kind}"] = time.perf_counter() - begun
    measured = {
        f"{kind}_{key}": value for kind, rows in errors.items() for key, value in rows["level"].items()
    }
    press = found.presses[:1]
    measured["seconds_per_map"] = median_seconds(lambda: maps(press), _TIMED)
    settings: Settings = {
        "network": "codes",
        **asdict(profile.codes),
        "pitch": coded.patches.pitch,
        "spacing": spacing,
        "nodes": len(coded.nodes),
        "variance_kept": coded.kept,
    }
    perceptron = None
    if profile.perceptron is not None:
        begun = time.perf_counter()
        perceptron, more = _trained(bench, profile.perceptron, seed, folder, report, threads)
        settings |= more
        seconds["perceptron"] = time.perf_counter() - begun
    codes = CodesPart(graph, coded.nodes, bench.most_off, measured)
    return AuthoredTouch(codes, perceptron, errors, settings, seconds)


def opened_codes(graph: ModelProto, nodes: SurfaceNodes, most_off: float, sensor: TactileSensor) -> CodeMaps:
    """Codes that can be asked, before they are part of an ObjectFile."""
    inputs, outputs = codes_tensors(len(nodes), most_off + sensor.gel_thickness, sensor)
    return CodeMaps(Network(graph.SerializeToString(), CODES, inputs, outputs), NodeSearch(nodes, most_off))


def spaced_codes(
    raster: RasterMesh, sensor: TactileSensor, spec: CodesSpec, seed: int
) -> tuple[CodedSurface, float]:
    """Codes of a surface, with nodes as dense as the file allows; and the spacing.

    Pixels are those of ``spec`` wherever any spacing leaves room for them, and else the finest of
    ``COARSENED`` for which one does: a large object in a small file is seen less sharply.

    Raises:
        WrongUse: it allows none of ``SPACINGS`` with pixels of any pitch.
    """
    for coarsened in COARSENED:
        patches = [PatchSpec(spacing, coarsened * spec.pitch, spec.width) for spacing in SPACINGS]
        for patch in patches:
            each = patch_bytes(sensor, patch)
            # Whoever needs more room than a node for each square of the spacing need not be counted.
            if raster.mesh.face_areas.sum() / patch.spacing**2 * each > 4.0 * spec.most_bytes:
                continue
            nodes = choose_nodes(raster.mesh, patch.spacing, seed)
            if len(nodes) * each <= spec.most_bytes:
                return code_surface(raster, nodes, sensor, patch, seed), patch.spacing
    raise WrongUse(
        f"the object's surface, {raster.mesh.face_areas.sum() * 1e4:.4g} cm^2, does not fit into codes of "
        f"{spec.most_bytes / 1e6:.3g} MB even with nodes {SPACINGS[-1] * 1e3:g} mm apart and pixels of "
        f"{COARSENED[-1] * spec.pitch * 1e3:.2g} mm; take a profile with a larger file"
    )


def _trained(
    bench: PressBench, spec: TouchPerceptronSpec, seed: int, folder: Path, report: Report, threads: int
) -> tuple[PerceptronPart, Settings]:
    # Heavy, and only here: codes are made without it.
    import torch

    from harness.authoring.touch.mlp import TouchTraining, learned_from

    torch.set_num_threads(threads)
    report("simulating presses", 0.0)
    training = TouchTraining(spec, learned_from(bench, spec.presses, seed), seed)
    train(training, spec.epochs, folder / CHECKPOINT, report)
    settings: Settings = {f"perceptron_{key}": value for key, value in asdict(spec).items()}
    return training.finish(), settings | {"perceptron_last_loss": training.losses[-1]}
