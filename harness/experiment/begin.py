"""Begin a run: take in the object, plan, rehearse in the twin, refuse what cannot be, make the folder."""

import datetime as dt
from dataclasses import dataclass
from pathlib import Path

from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.gap import lasting_name
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.effects.scene_object import KnownObject, known_object
from harness.experiment.compare import require_sources
from harness.experiment.experiment import Experiment, Planned, Procedure
from harness.experiment.lookup import new_runs_folder
from harness.experiment.perform import IN_PROCESS
from harness.experiment.solving import TARGET, Target
from harness.recording.recording import Recording, require_unused
from harness.recording.run_folder import create_run, station_acquisition, station_calibration


@dataclass(frozen=True, eq=False)
class Begun:
    """A run that is planned, rehearsed and on the disk, and has not moved yet."""

    recording: Recording
    plan: Planned
    known: KnownObject


def begin(
    procedure: Procedure,
    scene: SceneFile,
    station: Station,
    seed: int | None = None,
    gap: str | None = None,
    folder: Path | None = None,
    bench: str | None = None,
    target: Target | None = None,
) -> Begun:
    """Take in the object, plan and rehearse every step, make the run's folder.

    Args:
        procedure: an experiment, or what a calibration does.
        scene: on the table.
        station: the bench.
        seed: of all that is drawn; the scene's where None.
        gap: reality gap of a mocked bench; the experiment's or the station's where None.
        folder: of the run; a dated one under ``runs/`` where None.
        bench: how a mocked station runs, ``in-process`` or ``wires``; in process if None.
        target: of the answer, beside its levels; stored with the plan.

    Raises:
        MeshRefused, WrongUse: of the object, the scene, the gap, or a folder that holds a run; or the scene
            observes what this run cannot give.
        MotionRefused: the rehearsal found a motion that must not be made; nothing was created.
    """
    if folder is not None:
        require_unused(folder)
    if scene.object.is_hidden and procedure.assumed.get("object", {}).get("scale") != "hidden":
        raise WrongUse(
            f"{procedure.name} needs to know how large the object is, and its size is unknown (--range, or "
            'scale = "hidden" in the scene): give its scale, or find it first with touchstone run '
            "scale-estimation"
        )
    mock = None  # how the mocked bench is started; None at a real one, which has no such options
    if station.mock is not None:
        gap = lasting_name(gap or procedure.gap or station.mock.gap)
        mock = {"gap": gap, "bench": bench or IN_PROCESS}
    else:
        for option, value in (("--gap", gap), ("--bench", bench)):
            if value is not None:
                raise WrongUse(f"{option} is for a mocked bench; this station is a real one: leave it out")
    known = known_object(scene)
    calibration, acquisition = station_calibration(station), station_acquisition(scene, station)
    if isinstance(procedure, Experiment):
        if not procedure.gives and scene.observe == SceneFile.model_fields["observe"].default:
            scene = scene.model_copy(update={"observe": ()})
        require_sources(procedure, scene, station, calibration)
    if procedure.section is not None:
        section = scene.section(procedure.section)
        scene, seed = scene.with_section(section), section.seed if seed is None else seed
        require_reachable(procedure, scene, known.mesh)
    seed = 0 if seed is None else seed
    plan = procedure.plan(scene, station, known.mesh, seed)
    described = {
        procedure.plan_key: list(plan.steps),
        **plan.described,
        **({} if target is None else {TARGET: target.as_json()}),
        "warnings": [*known.warnings, *plan.rehearsal.warnings],
    }
    run = procedure.name, scene, station, known.mesh, calibration, described, seed, mock, acquisition
    if folder is not None:
        return Begun(create_run(folder, *run), plan, known)
    stamp = dt.datetime.now().astimezone().strftime("%Y%m%d-%H%M%S")
    with new_runs_folder(procedure.name, scene.object.name, stamp) as own:
        return Begun(create_run(own, *run), plan, known)


def require_reachable(procedure: Procedure, scene: SceneFile, mesh: Mesh) -> None:
    """Refuse an ``--error`` that no run of this scene can state.

    Args:
        procedure: the experiment; nothing is refused if its ``--error`` chooses levels.
        scene: with the experiment's table.
        mesh: of the object, in m.

    Raises:
        WrongUse: the error is below the bound, which the message states.
    """
    if procedure.section is None or procedure.error_key is None or procedure.smallest_error is None:
        return
    wanted = vars(scene.section(procedure.section))[procedure.error_key]
    if wanted is None:
        return
    bound = procedure.smallest_error(scene, mesh)
    if wanted < bound.error:
        raise WrongUse(
            f"an error of {1e3 * wanted:g} mm cannot be reached: this run can state "
            f"{1e3 * bound.error:.2g} mm at best, {bound.reason}; allow more with --error, {bound.advice}"
        )
