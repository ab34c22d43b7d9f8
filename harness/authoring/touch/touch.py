"""Create the touch codes of a surface and measure their errors on presses that were held out.

``code_surface`` makes the codes: heights around the nodes, over their mean.
"""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np
from onnx import ModelProto
from threadpoolctl import threadpool_limits

from harness.authoring.touch.data import MOST_TILT, choose_nodes
from harness.authoring.touch.metrics import PressBench
from harness.authoring.touch.profiles import CodesSpec, TouchProfile
from harness.authoring.training import Report, median_seconds
from harness.basics.arrays import BoolArray, ByteArray, FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import inverse
from harness.basics.mesh import Mesh
from harness.bench.sensor import TactileSensor
from harness.objectfile.runtime import Network
from harness.objectfile.touch.graph import PatchCodes, codes_graph
from harness.objectfile.touch.nodes import BEND, NodeSearch, SurfaceNodes
from harness.objectfile.touch.part import CODES, CodesPart, codes_tensors
from harness.objectfile.touch.touch import CodeMaps
from harness.sim.gel.gel import GelSkirt
from harness.sim.gel.height_map import RasterMesh, height_maps

SPACINGS = tuple(1e-3 * each for each in (4, 5, 6, 7, 8, 10, 12, 14, 17, 20))
"""m between nodes: the closest that a file has room for is taken."""

OFF = 1.3
"""Spacings that a press may be from its node: nodes are closer; smooth normals lean from a face's."""

COARSENED = (1.0, 4.0 / 3.0, 5.0 / 3.0, 2.0)
"""Times the profile's pitch that a patch's pixels may be, where no spacing leaves room for finer ones."""

_TIMED = 20

_MARGIN = 1.5e-3
"""m beyond window and spacing that a patch reaches: a leant ray wanders that far."""

_VISIBLE = 1e-4
"""m by which a node may lie behind what is met first: more, and something hides it."""

_RAYS = 3
"""Along each side of a patch's pixel, that say how much of it is covered; odd, so one is its middle."""

_CONTINUED = 2
"""Pixels that a surface is continued beyond its edge, so that a look-up at the edge mixes in nothing else."""

_CHUNK = 16


@dataclass(frozen=True, eq=False)
class AuthoredTouch:
    """Touch codes and their measured errors."""

    codes: CodesPart  #: to be written.
    errors: Mapping[str, Mapping[str, Mapping[str, float]]]
    """``"trained_places"``, ``"unseen_places"`` and ``"any_press"``, of the codes and of what costs nothing
    to compare with: by a name with its unit."""
    settings: Mapping[str, str | float | int | bool | None]  #: how they were made.
    seconds: Mapping[str, float]  #: s on the clock of each stage.


def author_touch(
    mesh: Mesh,
    sensor: TactileSensor,
    skirt: GelSkirt,
    profile: TouchProfile,
    seed: int,
    report: Report,
    threads: int = 1,
) -> AuthoredTouch:
    """Compute and measure the codes of one object's touch, for a flat gel and its border width in pixels.

    Raises:
        WrongUse: a size limit too small for any codes of this object.
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
    settings = {
        "network": "codes",
        **asdict(profile.codes),
        "pitch": coded.patches.pitch,
        "spacing": spacing,
        "nodes": len(coded.nodes),
    }
    codes = CodesPart(graph, coded.nodes, bench.most_off, measured)
    return AuthoredTouch(codes, errors, settings, seconds)


def opened_codes(graph: ModelProto, nodes: SurfaceNodes, most_off: float, sensor: TactileSensor) -> CodeMaps:
    """Codes that can be asked, before they are part of an ObjectFile."""
    inputs, outputs = codes_tensors(len(nodes), most_off + sensor.gel_thickness, sensor)
    return CodeMaps(Network(graph.SerializeToString(), CODES, inputs, outputs), NodeSearch(nodes, most_off))


@dataclass(frozen=True, eq=False)
class CodedSurface:
    """Codes and where they belong."""

    nodes: SurfaceNodes  #: those of a surface that a gel can come to.
    patches: PatchCodes  #: their codes.


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
        patches = [PatchSpec(spacing, coarsened * spec.pitch) for spacing in SPACINGS]
        for patch in patches:
            each = patch_bytes(sensor, patch)
            # Whoever needs more room than a node for each square of the spacing need not be counted.
            if raster.mesh.face_areas.sum() / patch.spacing**2 * each > 4.0 * spec.most_bytes:
                continue
            nodes = choose_nodes(raster.mesh, patch.spacing, seed)
            if len(nodes) * each <= spec.most_bytes:
                return code_surface(raster, nodes, sensor, patch), patch.spacing
    raise WrongUse(
        f"the object's surface, {raster.mesh.face_areas.sum() * 1e4:.4g} cm^2, does not fit into codes of "
        f"{spec.most_bytes / 1e6:.3g} MB even with nodes {SPACINGS[-1] * 1e3:g} mm apart and pixels of "
        f"{COARSENED[-1] * spec.pitch * 1e3:.2g} mm; take a profile with a larger file"
    )


@dataclass(frozen=True)
class PatchSpec:
    """How surfaces are coded."""

    spacing: float  #: m between nodes.
    pitch: float  #: m, of a patch's pixels.


def code_surface(
    raster: RasterMesh, nodes: SurfaceNodes, sensor: TactileSensor, spec: PatchSpec
) -> CodedSurface:
    """Code the surface around its nodes (``choose_nodes`` with the same spacing).

    Patches cover the window of the sensor at any yaw.

    Raises:
        WrongUse: no node is visible.
    """
    viewer = _Viewer(raster, sensor, spec)
    probe = TactileSensor("probe", 1, 1, 1e-6, 1.0)
    gap = height_maps(raster, inverse(nodes.object_from_node), probe)[:, 0, 0]
    seen: BoolArray = np.abs(gap) < _VISIBLE
    nodes = nodes[seen]
    if len(nodes) == 0:
        raise WrongUse("no place of the surface can be touched from outside; is the mesh inside out?")
    heights, cover = viewer.seen(nodes, np.arange(len(nodes)))
    mean = heights.mean(axis=0)
    patches = PatchCodes(heights - mean, mean, cover, viewer.inside, viewer.outside, viewer.pitch)
    return CodedSurface(nodes, patches)


def patch_bytes(sensor: TactileSensor, spec: PatchSpec) -> float:
    """Bytes of one code in a file: heights in half precision, and covers."""
    pixels = np.pi * (_radius(sensor, spec) / spec.pitch) ** 2
    return float(3.0 * pixels)


class _Viewer:
    """Looks at a surface from its nodes, as far as a gel at any of them reaches."""

    def __init__(self, raster: RasterMesh, sensor: TactileSensor, spec: PatchSpec) -> None:
        radius = _radius(sensor, spec)
        size = 2 * int(np.ceil(radius / spec.pitch))
        at = (np.arange(size) + 0.5 - size / 2) * spec.pitch
        distance = np.hypot(at[None, :], at[:, None])
        self.inside = distance <= radius
        # What is farther from the tangent plane is out of reach of any gel, or in the way of every one.
        limit = sensor.gel_thickness + np.tan(MOST_TILT + spec.spacing / BEND) * distance
        self._limit, self.outside = limit[self.inside], float(limit[self.inside].max())
        fine = (np.arange(size * _RAYS) + 0.5 - size * _RAYS / 2) * spec.pitch / _RAYS
        slope = np.tan(MOST_TILT + spec.spacing / BEND)
        self._far = sensor.gel_thickness + slope * np.hypot(fine[None, :], fine[:, None])
        self._raster, self._size, self.pitch = raster, size, spec.pitch
        side = size * _RAYS
        self._camera = TactileSensor("patch", side, side, spec.pitch / _RAYS, sensor.gel_thickness)

    def seen(self, nodes: SurfaceNodes, which: IntArray) -> tuple[FloatArray, ByteArray]:
        """``(k, pixels)`` m over the tangent planes of some nodes, and how much is covered, of 255."""
        found = np.empty((len(which), len(self._limit)))
        cover = np.empty(found.shape, np.uint8)
        poses = inverse(nodes[which].object_from_node)
        for first in range(0, len(which), _CHUNK):
            part = slice(first, first + _CHUNK)
            gap = height_maps(self._raster, poses[part], self._camera)
            in_reach = gap < self._far
            blocks = in_reach.reshape(len(gap), self._size, _RAYS, self._size, _RAYS)
            share = blocks.mean(axis=(2, 4))[:, self.inside]
            cover[part] = np.rint(255.0 * share)
            middle = np.s_[:, _RAYS // 2 :: _RAYS, _RAYS // 2 :: _RAYS]
            whole = np.where(in_reach[middle], gap[middle], np.nan)
            # Heights go on straight beyond where they end, a pixel a step.
            for _ in range(_CONTINUED):
                padded = np.pad(whole, ((0, 0), (2, 2), (2, 2)), constant_values=np.nan)
                rows, columns = whole.shape[1:]
                total, weight = np.zeros_like(whole), np.zeros_like(whole)
                for i, j in ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (-1, 1), (1, -1), (1, 1)):
                    near = padded[:, 2 + i : 2 + i + rows, 2 + j : 2 + j + columns]
                    next_one = padded[:, 2 + 2 * i : 2 + 2 * i + rows, 2 + 2 * j : 2 + 2 * j + columns]
                    straight = 2.0 * near - next_one
                    known = ~np.isnan(straight)
                    total += np.where(known, straight, 0.0)
                    weight += known
                fill = np.isnan(whole) & (weight > 0.0)
                whole[fill] = total[fill] / weight[fill]
            flat = whole[:, self.inside]
            found[part] = np.clip(np.where(np.isnan(flat), self._limit, flat), -self._limit, self._limit)
        return found, cover


def _radius(sensor: TactileSensor, spec: PatchSpec) -> float:
    return 0.5 * float(np.hypot(*sensor.window)) + spec.spacing + _MARGIN
