"""From a file to an ObjectFile with a touch: intake, codes, measurement, writing."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from harness.authoring.object_source import PartRequest, created_object, provenance_of, source_of
from harness.authoring.touch.data import DEPTHS, MOST_TILT
from harness.authoring.touch.profiles import touch_profile
from harness.authoring.touch.touch import AuthoredTouch, author_touch
from harness.authoring.training import Report
from harness.bench.sensor import GELSIGHT_R15, TactileSensor
from harness.objectfile.file import ObjectFile
from harness.objectfile.touch.part import TouchPart, with_touch
from harness.sim.gel.gel import skirt_for
from harness.sim.gel.press_pose import MOST_MOVED
from harness.sim.solid.intake import surface_of


@dataclass(frozen=True, eq=False)
class TouchRequest(PartRequest):
    """What is to be built, by a profile of ``touch_profiles.TOUCH_PROFILES``."""

    sensor: TactileSensor = GELSIGHT_R15  #: a flat gel.


@dataclass(frozen=True, eq=False)
class BuiltTouch:
    """An ObjectFile and how it came about."""

    object: ObjectFile  #: on disk.
    touch: AuthoredTouch  #: its codes and errors.
    said: tuple[str, ...]  #: what was done to the mesh and what to look at.
    seconds: Mapping[str, float]  #: s on the clock of each stage.


def build_touch(wanted: TouchRequest, out: Path, report: Report, threads: int = 1) -> BuiltTouch:
    """Build an object's touch into the folder ``out``, which keeps its other modalities and its mesh.

    Raises:
        WrongUse: options that conflict or are out of range.
        MeshRefused: a mesh that is no solid object.
        DataRefused: the folder has an ObjectFile of another object.
    """
    chosen = touch_profile(wanted.profile)
    begun = time.perf_counter()
    report("reading the mesh", 0.0)
    source = source_of(wanted.mesh, wanted.licence)
    surface = surface_of(wanted.mesh, wanted.units, wanted.wall, wanted.up_axis)
    mesh, taken = surface.mesh, time.perf_counter() - begun
    created = created_object(wanted.mesh, wanted.licence, wanted.material, mesh, out, source)
    skirt = skirt_for(wanted.sensor)
    touch = author_touch(mesh, wanted.sensor, skirt, chosen, wanted.seed, report, threads)
    begun = time.perf_counter()
    report("writing", 0.0)
    part = TouchPart(
        sensor=wanted.sensor,
        skirt=skirt,
        depths=DEPTHS,
        most_tilt=MOST_TILT,
        near_surface=MOST_MOVED,
        provenance=provenance_of(wanted, "touch", touch.settings, (source,)),
        codes=touch.codes,
    )
    made = with_touch(created, part)
    seconds = {"mesh": taken, **touch.seconds, "write": time.perf_counter() - begun}
    return BuiltTouch(made, touch, surface.said, seconds)
