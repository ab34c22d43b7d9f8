"""Start a localization run, perform it on a bench, and finish it: what the commands are made of."""

import datetime as dt
import json
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.accuracy.dials import levels_of
from experiments.contact_localization.answer import Answer, answer
from experiments.contact_localization.build_model import model_of_run
from experiments.contact_localization.posterior.baselines import geometry_only
from experiments.contact_localization.posterior.estimate import Estimate
from experiments.contact_localization.posterior.levels import Levels
from experiments.contact_localization.report.comparison import compare
from experiments.contact_localization.report.report import report_of
from experiments.contact_localization.report.result import RESULT, Scored, result_of
from experiments.contact_localization.report.trade import trade
from experiments.contact_localization.report.truth import read_truth
from experiments.contact_localization.sound.gate import doubts_of_sound
from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.symmetry import find_symmetries
from harness.basics.whole_file import write_text_whole
from harness.bench.device import Health
from harness.bench.gap import lasting_name
from harness.bench.scene import SceneFile
from harness.bench.station import Bench, RunContext, open_station
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.effects.scene_object import KnownObject, known_object
from harness.recording.recording import Recording, require_unused
from harness.recording.run_folder import RunFiles, create_run, station_acquisition, station_calibration
from harness.recording.session import Progress, perform
from harness.report.page import write_report
from harness.skills.planning import RunPlan, plan_run
from harness.skills.press import ContactLocalization
from harness.skills.strike import Ask, by_hand, somebody
from harness.twin.bench_of import twin_of, way_between

NAME = "contact-localization"


@dataclass(frozen=True, eq=False)
class Started:
    """A run that is planned, rehearsed and on the disk, and has not moved yet."""

    recording: Recording
    plan: RunPlan
    known: KnownObject


def start(
    scene: SceneFile, station: Station, seed: int, gap: str | None, folder: Path | None = None
) -> Started:
    """Take in the object, plan and rehearse the contacts, make the run's folder.

    Raises:
        MeshRefused, WrongUse: of the object, the scene, the gap, or a folder that holds a run.
        MotionRefused: the rehearsal found a motion that must not be made; nothing was created.
    """
    if folder is not None:
        require_unused(folder)
    mock = None if station.mock is None else {"gap": lasting_name(gap or station.mock.gap)}
    if gap is not None and mock is None:
        raise WrongUse("--gap is for a mocked bench; this station is a real one: leave it out")
    known = known_object(scene)
    calibration, acquisition = station_calibration(station), station_acquisition(scene, station)
    plan = plan_run(scene, station, known.mesh, seed)
    described = {
        "contacts": plan.parameters(),
        "pressed": [site.base_from_gel.tolist() for site in plan.sites],
        "warnings": [*known.warnings, *plan.rehearsal.warnings],
    }
    where = folder or _new_folder(scene)
    recording = create_run(
        where, NAME, scene, station, known.mesh, calibration, described, seed, mock, acquisition
    )
    return Started(recording, plan, known)


def perform_on_bench(
    recording: Recording, progress: Progress, ask: Ask | None = None, accuracy: Accuracy | None = None
) -> tuple[bool, dict[str, Health]]:
    """Open the run's bench and perform what is left; False where Ctrl-C ended it early.

    What the readings will be compared with is made while the bench opens, and before anything moves: an
    object whose modes cannot be found is refused while the arm still stands.

    Args:
        recording: of the run.
        progress: is told of each step.
        ask: shows a person what to do, where the station has one strike; None where nobody is there.
        accuracy: of the modes that a sound will be compared with; None for the default levels.

    Raises:
        MeshRefused: the scene calls for sound, and the object's surface cannot be filled.
    """
    run = RunFiles(recording)
    mock = recording.header.mock
    context = RunContext(
        truth=recording.truth_path,
        mesh=run.mesh,
        seed=recording.header.seed,
        gap=None if mock is None else mock["gap"],
    )
    if by_hand(run.scene, run.station):
        somebody(ask)
    ahead = ThreadPoolExecutor(1, "model")
    modelled = ahead.submit(model_of_run, run, accuracy)
    ahead.shutdown(wait=False)  # a bench that does not open says so at once
    with open_station(run.station, run.scene, context) as bench:
        modelled.result()
        return perform_on(bench, recording, progress, ask)


def perform_on(
    bench: Bench, recording: Recording, progress: Progress, ask: Ask | None = None
) -> tuple[bool, dict[str, Health]]:
    """Perform what is left of a run on an open bench; how its instruments did."""
    run = RunFiles(recording)
    twin = twin_of(run.scene, run.station, run.mesh)
    experiment = ContactLocalization(partial(way_between, twin), ask=ask)
    complete = perform(experiment, bench, recording, bench.arm.stop, progress)
    health = {"arm": bench.arm.health(), "gel": bench.gel.health()}
    if bench.hammer is not None:
        health["hammer"] = bench.hammer.health()
    if bench.microphone is not None:
        health["microphone"] = bench.microphone.health()
    return complete, health


def score(recording: Recording, accuracy: Accuracy) -> Scored:
    """Estimate, compare, and look at the truth where there is one."""
    run = RunFiles(recording)
    found = answer(run, levels_of(accuracy), accuracy=accuracy)
    warnings = tuple(recording.header.plan.get("warnings", ())) + _doubts(found)
    return Scored(
        run=run,
        found=found,
        geometry=_without_images(found, len(found.observations)),
        comparison=compare(found, run, accuracy),
        truth=read_truth(recording),
        symmetry=find_symmetries(run.mesh),
        accuracy=accuracy,
        warnings=warnings,
    )


def finish(
    recording: Recording, accuracy: Accuracy, health: Mapping[str, Health] | None, folder: Path | None = None
) -> dict[str, Any]:
    """The result of a run, with its report and ``result.json`` written.

    Args:
        recording: of the run.
        accuracy: of the estimate and of what is simulated.
        health: of the instruments; None for a replay.
        folder: for the report; the run's own where None.
    """
    folder = folder or recording.folder
    scored = score(recording, accuracy)
    page = write_report(
        report_of(scored, _geometry_errors(scored), _trade(scored), health), folder / "report"
    )
    result = result_of(scored, str(page))
    write_text_whole(folder / RESULT, json.dumps(result, indent=1, allow_nan=False) + "\n")
    return result


def _geometry_errors(scored: Scored) -> tuple[float, ...] | None:
    true, found = scored.true_points, scored.found
    if true is None:
        return None
    alone = [_without_images(found, k + 1) for k in range(len(true))]
    return tuple(float(np.linalg.norm(a - b)) for a, b in zip(alone, true, strict=True))


def _without_images(found: Answer, count: int) -> FloatArray:
    """``(3,)`` metres: the last of the first ``count`` contacts, from the arm's translations alone."""
    poses = [observation.base_from_gel for observation in found.observations[:count]]
    return geometry_only(poses, found.model, found.prior, Levels().spacing).position_in_object


def _trade(scored: Scored) -> Any:
    true = scored.true_points
    if true is None:
        return ()
    return trade(scored.found, true[-1], scored.run.recording.header.seed)


def _doubts(found: Answer) -> tuple[str, ...]:
    of_sound = doubts_of_sound(found.observations)
    # Sense by sense the doubt may be the same one.
    of_senses = [estimate.doubts for estimate in found.by_sense.values() if isinstance(estimate, Estimate)]
    of_sound += tuple(dict.fromkeys(doubt for doubts in of_senses for doubt in doubts))
    if len(found.last.modes) < 2:
        return of_sound
    shares = ", ".join(f"{100 * mode.weight:.0f} %" for mode in found.last.modes)
    return (
        *of_sound,
        f"the answer is ambiguous: {len(found.last.modes)} places stay likely ({shares}); "
        "one more contact elsewhere on the object would tell them apart",
    )


def _new_folder(scene: SceneFile) -> Path:
    stamp = dt.datetime.now().astimezone().strftime("%Y%m%d-%H%M%S")
    base = Path("runs") / f"{stamp}-{NAME}-{scene.object.name}"
    candidates = (base, *(base.with_name(f"{base.name}-{k}") for k in range(2, 1000)))
    return next(path for path in candidates if not path.exists())
