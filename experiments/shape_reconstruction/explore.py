"""The steps of a shape reconstruction: a look, then presses chosen one by one, or planned on the drawing."""

import math
from pathlib import Path

import numpy as np

from experiments.shape_reconstruction.explorer import DrawnContacts, ShapeExplorer
from experiments.shape_reconstruction.live import live_method
from experiments.shape_reconstruction.section import ShapeRun
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.experiment.experiment import ErrorBound, Helpers, Planned
from harness.recording.run_folder import RunFiles
from harness.skills.exploring.exploration import Exploration, NextContact, kinds
from harness.skills.exploring.surroundings import nowhere
from harness.skills.planning import ContactRequest, plan_run
from harness.skills.sites import PressLimits
from harness.twin.bench_of import twin_of
from harness.twin.rehearsal import rehearse


def steps_of(scene: SceneFile) -> int:
    """How many steps a run of a scene has, if it is not surer before."""
    return int(scene.sensors.camera) + _presses(scene)


def _presses(scene: SceneFile) -> int:
    return scene.section(ShapeRun).presses if scene.sensors.touch else 0


def smallest_error(scene: SceneFile, _mesh: Mesh) -> ErrorBound:
    """Return the mean deviation that all readings would leave if they measured one and the same point."""
    section, count = scene.section(ShapeRun), steps_of(scene)
    readings = f"{_presses(scene)} presses" + (" and a picture" if scene.sensors.camera else "")
    return ErrorBound(
        section.contact_error / math.sqrt(max(count, 1)),
        f"the mean deviation that {readings} leave where each contact is known to "
        f"{1e3 * section.contact_error:g} mm",
        "or take more presses with --presses",
    )


def plan(scene: SceneFile, station: Station, mesh: Mesh, seed: int) -> Planned:
    """A look where there is a camera, then so many presses.

    Those planned on the drawing are rehearsed here; all others are planned and rehearsed one by one, once
    those before are read.

    Raises:
        WrongUse: nothing is to be read; there is no such folder of known shapes; the scene names networks
            that only a table uses; or it says where the mesh file's origin is, which says nothing of where an
            unknown object touches its support.
    """
    if steps_of(scene) == 0:
        raise WrongUse("nothing is to be read: ask for vision, for presses, or for both")
    if scene.object.pose.anchor != "bottom":
        raise WrongUse(
            'an unknown object stands where its bottom is: set object.pose.anchor = "bottom", and its '
            "position to where its middle should be on the support"
        )
    _require_library(scene.section(ShapeRun).library)
    if scene.section(ShapeRun).pcn is not None:
        raise WrongUse(
            "[shape] pcn adds rows to a table and is not used by a run; leave it out of the scene, or "
            "measure with: touchstone tables shape-reconstruction --set pcn=FOLDER"
        )
    settings, looks = scene.section(ShapeRun), scene.sensors.camera
    if settings.choose != "planned" or _presses(scene) == 0:
        place = np.array(scene.object.pose.position)
        bench = twin_of(scene, station, nowhere(place), np.eye(4))
        return Planned(kinds(looks, _presses(scene)), rehearse(bench, []), bench, on_the_way=_presses(scene))
    wanted = ContactRequest(_presses(scene), "spread", PressLimits(tilt=settings.tilt, depth=settings.depth))
    made = plan_run(scene, station, mesh, seed, wanted)
    presses = [{"kind": "contact", **parameters} for parameters in made.parameters()]
    return Planned([*kinds(looks, 0), *presses], made.rehearsal, made.bench)


def _require_library(folder: str | None) -> None:
    """Before anything moves: the answer would find out after the last press."""
    if folder is not None and not Path(folder).is_dir():
        raise WrongUse(
            f"[shape] library = {folder!r}: there is no such folder; name one that holds meshes or "
            "ObjectFiles, or leave the key out"
        )


def performer(run: RunFiles, helpers: Helpers) -> Exploration:
    """Looks, then presses.

    Args:
        run: the folder.
        helpers: what a step may use beside the bench.
    """
    enough = "the shape is known as well as was asked"
    return Exploration(_explorer(run, helpers), helpers.ask, helpers.say, enough)


def _explorer(run: RunFiles, helpers: Helpers) -> NextContact:
    choose = run.scene.section(ShapeRun).choose
    if choose == "planned":
        return DrawnContacts(helpers.twin)
    return ShapeExplorer(run, live_method(choose))
