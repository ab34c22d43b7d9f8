"""A small object with edges and bends, a coarse gel, and codes of the one for the other."""

from functools import cache
from pathlib import Path

import numpy as np
import trimesh

from harness.authoring.touch.data import DEPTHS, MOST_TILT, choose_nodes
from harness.authoring.touch.metrics import PressBench
from harness.authoring.touch.profiles import touch_profile
from harness.authoring.touch.touch import (
    OFF,
    CodedSurface,
    PatchSpec,
    code_surface,
    opened_codes,
    spaced_codes,
)
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.bench.sensor import GELSIGHT_R15, TactileSensor
from harness.objectfile.entries import Provenance
from harness.objectfile.file import ObjectFile, create_object
from harness.objectfile.touch.graph import codes_graph
from harness.objectfile.touch.part import CodesPart, TouchPart, with_touch
from harness.objectfile.touch.touch import CodeMaps
from harness.sim.gel.gel import skirt_for
from harness.sim.gel.height_map import RasterMesh

SENSOR = TactileSensor("coarse", 24, 32, 0.6e-3, 2.5e-3)
SKIRT = skirt_for(SENSOR)
SPACING = 8e-3
SPEC = PatchSpec(SPACING, 0.6e-3)
PROVENANCE = Provenance(licence="CC0-1.0", seeds={"nodes": 0})


@cache
def peg() -> Mesh:
    """A round peg with a dome, 24 mm across and 40 mm tall, off the origin."""
    dome = np.linspace(0.0, np.pi / 2, 13)[1:]
    wall = [[0.0, 0.0], [6e-3, 0.0], *([12e-3, z] for z in np.linspace(0.0, 28e-3, 8))]
    outline = np.array([*wall, *np.stack([12e-3 * np.cos(dome), 28e-3 + 12e-3 * np.sin(dome)], axis=1)])
    outline[-1, 0] = 0.0
    body = trimesh.creation.revolve(outline, sections=32)
    return Mesh(np.asarray(body.vertices) + np.array([0.05, -0.02, 0.01]), np.asarray(body.faces))


@cache
def coded() -> CodedSurface:
    """Codes of the peg."""
    return code_surface(RasterMesh(peg()), choose_nodes(peg(), SPACING), SENSOR, SPEC)


@cache
def bench() -> PressBench:
    """What its maps are measured on."""
    return PressBench(peg(), RasterMesh(peg()), SENSOR, SKIRT, coded().nodes, OFF * SPACING)


@cache
def maps() -> CodeMaps:
    """Its maps by codes."""
    return opened_codes(codes_graph(coded().patches, SENSOR, SKIRT), coded().nodes, OFF * SPACING, SENSOR)


def peg_part() -> TouchPart:
    """Its touch, by codes."""
    graph = codes_graph(coded().patches, SENSOR, SKIRT)
    codes = CodesPart(graph, coded().nodes, OFF * SPACING, {"psnr_db": 50.0})
    return TouchPart(SENSOR, SKIRT, DEPTHS, MOST_TILT, 2e-3, PROVENANCE, codes)


def peg_file(folder: Path) -> ObjectFile:
    """The peg with its touch, written."""
    return with_touch(create_object(folder, "peg", peg(), MATERIALS["steel"], PROVENANCE), peg_part())


@cache
def ball() -> Mesh:
    """A ball, 40 mm across, off the origin."""
    solid = trimesh.creation.icosphere(subdivisions=4, radius=20e-3)
    return Mesh(np.asarray(solid.vertices) + np.array([0.01, 0.02, 0.03]), np.asarray(solid.faces))


def ball_file(folder: Path) -> ObjectFile:
    """The ball with its touch, by codes for the bench's own gel."""
    raster, skirt = RasterMesh(ball()), skirt_for(GELSIGHT_R15)
    found, spacing = spaced_codes(raster, GELSIGHT_R15, touch_profile("smoke").codes, 0)
    codes = CodesPart(
        codes_graph(found.patches, GELSIGHT_R15, skirt), found.nodes, OFF * spacing, {"psnr_db": 50.0}
    )
    part = TouchPart(GELSIGHT_R15, skirt, DEPTHS, MOST_TILT, 2e-3, PROVENANCE, codes)
    return with_touch(create_object(folder, "ball", ball(), MATERIALS["wood"], PROVENANCE), part)
