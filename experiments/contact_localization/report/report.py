"""The sections of a localization's report, and the inputs of its simulation."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.answer import PROGRAM, Answer, ScoredContact
from experiments.contact_localization.next_contact import EXPECTED
from experiments.contact_localization.posterior.consistency import Gate
from experiments.contact_localization.posterior.estimate import (
    DIALS,
    METHOD,
    PARTICLES,
    ROUNDS,
    SAMPLES,
    Estimate,
    Senses,
)
from experiments.contact_localization.posterior.estimate import SENSES as BY
from experiments.contact_localization.report.result import SENSES, by_translations, flags_of, true_points
from experiments.contact_localization.report.sound_report import posterior_of, show_senses
from experiments.contact_localization.section import Localization
from experiments.contact_localization.settings import setting_name
from harness.basics.arrays import AnyArray, FloatArray, read_only
from harness.basics.errors import FitRefused
from harness.basics.geometry import inverse, transform
from harness.effects.quantities import Quantities
from harness.experiment.compare import Comparison
from harness.experiment.front import front_at_hand
from harness.experiment.lookup import find_experiment
from harness.experiment.report_content import (
    COUNT,
    AnswerValue,
    CaptionedPicture,
    Missing,
    Notice,
    PageBlock,
    PageSection,
    Picture,
    ReportTable,
    RunReport,
    Tiles,
)
from harness.recording.run_folder import RunFiles
from harness.report.figures.charts import ErrorCurve, error_chart
from harness.report.figures.figures import Album
from harness.report.figures.pictures import (
    CLAY,
    Sides,
    arm_parts,
    bench_figure,
    contacts_figure,
    object_sides,
    posterior_figure,
    posterior_strip,
    sensor_parts,
    table_and_pedestal,
)
from harness.report.figures.shading import BenchPart
from harness.report.figures.tiles import DIFFERENCE_GAIN, difference, height_picture, png
from harness.report.wording import millimetres, place, show_estimates, show_value

History = tuple[Estimate | FitRefused, ...]
"""The estimate after each contact, or why there is none."""

SIDE_PIXELS = 460
"""Rows and columns of each view of the object."""


def create_report(scored: ScoredContact, comparison: Comparison, folder: Path) -> RunReport:
    """Return the answer in words and numbers and the sections of the page; write their pictures.

    Args:
        scored: the run and its answer.
        comparison: the observed quantities, simulated at the answer.
        folder: folder of the page and its pictures; it exists.
    """
    run, found, album = scored.run, scored.found, Album(folder)
    history = scored.answering.history(found.last, found.sense)
    poses, sides = object_from_gels(found), object_sides(run.mesh, found.last.position_in_object, SIDE_PIXELS)
    sections = (
        PageSection("Bench and object", _bench(scored, poses, sides, album)),
        PageSection("Posterior of the contacts", tuple(_posterior(scored, history, sides, album))),
        PageSection("Contribution of each sense", tuple(show_senses(scored, poses[-1], sides, album))),
        PageSection("Error", _errors(scored, history, album)),
        PageSection("Contact by contact", tuple(_contacts(scored, comparison, history, album))),
    )
    return RunReport(_sentence(scored), tuple(_values(scored)), sections, found.last.seconds)


def _sentence(scored: ScoredContact) -> str:
    last, true = scored.found.last, true_points(scored)
    sentence = (
        f"The last contact is at {place(last.position_in_object)} mm on the {scored.run.scene.object.name}, "
        f"with 90 % probability within {millimetres(last.credible90, 1)}"
    )
    if true is not None:
        sentence += f"; it is {millimetres(_error(last, true[-1]))} from the true contact"
    if len(last.modes) > 1:
        sentence += f". The readings fit {len(last.modes)} separate positions; this is the likeliest"
    return f"{sentence}."


def _values(scored: ScoredContact) -> Iterator[AnswerValue]:
    result, found = scored.result, scored.found
    senses = {str(sense): f"from {SENSES[sense]}" for sense in (found.sense, *found.others)}
    yield from show_estimates(
        result["estimates"],
        senses,
        {
            "position_m": "position of the last contact",
            "error_m": "error of the last contact",
            "error_symmetric_m": "error modulo the object's symmetry",
            "error_mean_m": "mean error of all contacts",
            "region90_area_m2": "area of the 90 % region",
        },
        lambda estimate: f"90 % within {millimetres(estimate['credible90_m'], 1)}",
    )
    yield AnswerValue("separate likely positions of the last contact", str(len(found.last.modes)), COUNT)
    if result["geometry_baseline_m"] is not None:
        for name, key in (
            ("baseline: error from the arm's translations, without images", "geometry_baseline_m"),
            ("baseline: mean error of a random point of the surface", "random_baseline_m"),
        ):
            yield show_value(name, key, result[key])


def _bench(scored: ScoredContact, poses: FloatArray, sides: Sides, album: Album) -> tuple[PageBlock, ...]:
    run, station, scene = scored.run, scored.run.station, scored.run.scene
    observations, true = scored.found.readings.observations, true_points(scored)
    base_from_object = scene.base_from_object(run.mesh)
    base_from_gels = np.array([observation.base_from_gel for observation in observations])
    joints = run.recording.step(len(observations) - 1).readings["arm.joints"].values[-1]
    in_base = base_from_object[:3, :3] @ run.mesh.bounds.T + base_from_object[:3, 3:]
    parts = (
        BenchPart(run.mesh, base_from_object, CLAY),
        *table_and_pedestal(
            base_from_object, float(in_base[2].min()), 0.5 * scene.support.width, scene.table.height
        ),
        *sensor_parts(station.gel.sensor, base_from_gels[-1], inverse(station.flange_from_gel)),
        *arm_parts(station.arm.model, joints),
    )
    stars = "; green stars are the true contacts." if true is not None else "."
    return (
        f"Symmetry of the object: {scored.answering.symmetry.name}.",
        CaptionedPicture(
            album.photograph("bench", bench_figure(parts, base_from_gels, in_base.mean(axis=1))),
            "The bench as simulated in the twin, with the sensor at the last contact. Arrows are the tool "
            "axes of all contacts and end at the contact; pale arrows end behind the object.",
        ),
        CaptionedPicture(
            album.photograph("contacts", contacts_figure(sides, poses, true)),
            "The object from the side of the answer (left) and from the opposite side (right). Numbered "
            f"arrows are the tool axes at the estimated contacts, pale if they end behind the object{stars}",
        ),
    )


def _posterior(scored: ScoredContact, history: History, sides: Sides, album: Album) -> Iterator[PageBlock]:
    last, true = scored.found.last, true_points(scored)
    truth = None if true is None else true[-1]
    yield CaptionedPicture(
        album.photograph("posterior", posterior_figure(sides, posterior_of(last), truth)),
        "Posterior of the last contact on the object's surface, after all contacts, from the same two sides. "
        "Colour is the density relative to its peak on a square-root scale: bare clay is unlikely, dark is "
        "most likely. Blue cross: the answer. Green star: the truth. Rings: other likely positions. Pale "
        "marks are behind the object.",
    )
    if last.modes:
        yield ReportTable(
            ("likely position", "fraction of the posterior", "position in the object's frame"),
            [
                (str(number), f"{100 * mode.weight:.1f} %", f"{place(mode.position)} mm")
                for number, mode in enumerate(last.modes, start=1)
            ],
            "lrr",
        )
    known = {
        k: posterior_of(after) for k, after in enumerate(history, start=1) if isinstance(after, Estimate)
    }
    yield CaptionedPicture(
        album.photograph("posterior_by_contact", posterior_strip(sides, known, true)),
        "The same after each contact: every column uses the contacts up to its number and shows the position "
        "of that contact; upper row from the side of the answer, lower row from the opposite side.",
    )


def _errors(scored: ScoredContact, history: History, album: Album) -> tuple[PageBlock, ...]:
    true = true_points(scored)
    if true is None:
        return (Missing("the true contacts are unknown"),)
    by_contact = error_chart(_by_contact(scored, history, true), "contacts used", False)
    by_seconds = error_chart(_by_seconds(scored, true), "seconds a contact", True)
    return (
        CaptionedPicture(
            album.drawing("error_by_contact", by_contact),
            "Straight-line error of the newest contact after each contact, and the baseline without images.",
        ),
        CaptionedPicture(
            album.drawing("error_by_seconds", by_seconds),
            "This answer at its levels and, where “touchstone cost” measured these levels, their mean error "
            "and seconds over many runs. One recording is one random sample.",
        ),
    )


def _by_contact(scored: ScoredContact, history: History, true: FloatArray) -> tuple[ErrorCurve, ...]:
    found = scored.found
    counts = tuple(float(k + 1) for k in range(len(true)))
    alone = tuple(float(np.linalg.norm(by_translations(found, k + 1) - at)) for k, at in enumerate(true))
    # The same readings after each contact by each other sense that answered in the end.
    others = [
        _curve(sense, scored.answering.history(last, sense), true)
        for sense, last in found.others.items()
        if not isinstance(last, FitRefused)
    ]
    return (
        _curve(found.sense, history, true),
        *others,
        ErrorCurve("translations alone, no image", counts, alone, by="geometry"),
    )


def _curve(sense: Senses, history: History, true: FloatArray) -> ErrorCurve:
    """M after each contact that has an estimate."""
    known = {
        float(k): _error(after, at)
        for k, (after, at) in enumerate(zip(history, true, strict=True), start=1)
        if isinstance(after, Estimate)
    }
    return ErrorCurve(SENSES[sense], tuple(known), tuple(known.values()), by=sense)


def _by_seconds(scored: ScoredContact, true: FloatArray) -> tuple[ErrorCurve, ...]:
    """Return error and seconds of each sense's answer, and those measured at its levels on other runs."""
    count, front = len(true), front_at_hand(find_experiment(PROGRAM), scored.run)
    unused = (PARTICLES,) if scored.accuracy.of(METHOD) == "grid" else (ROUNDS, SAMPLES)
    curves = []
    for sense, last in {scored.found.sense: scored.found.last, **scored.found.others}.items():
        if isinstance(last, FitRefused):
            continue
        levels = {**scored.accuracy, BY.name: sense}
        label = setting_name({knob.name: levels[knob.name] for knob in DIALS if knob not in unused})
        seconds, error = sum(last.seconds.values()) / count, _error(last, true[-1])
        curves.append(ErrorCurve(SENSES[sense], (seconds,), (error,), (label,), by=sense))
        point = None if front is None else front.at(levels)
        if front is not None and point is not None:
            mean = float(np.exp(np.log(point.wall_seconds).mean())) / front.steps
            name = f"{SENSES[sense]}, mean of {len(point.samples)} measured runs"
            curves.append(ErrorCurve(name, (mean,), (point.error.value,), (point.name,), by=sense))
    return tuple(curves)


def _error(after: Estimate, true: FloatArray) -> float:
    return float(np.linalg.norm(after.position_in_object - true))


def _contacts(
    scored: ScoredContact, comparison: Comparison, history: History, album: Album
) -> Iterator[PageBlock]:
    yield (
        f"Differences are live minus simulated, amplified {DIFFERENCE_GAIN:g} times about middle grey. "
        "Height maps show the indentation of the gel, both of a contact on one scale; dark is none."
    )
    count, true, readings = len(history), true_points(scored), scored.found.readings
    touch = comparison.evaluation.touch
    images, gels = _of_each(touch.image, "touch.image", count), _of_each(touch.gel, "touch.gel", count)
    gates: tuple[Gate | None, ...] = scored.found.last.gates or (None,) * count
    for k, (after, gate) in enumerate(zip(history, gates, strict=True)):
        live, height = readings.observations[k].images[-1], readings.gels[k].height
        blocks: list[PageBlock] = []
        facts: list[str] = []
        if gate is not None:
            blocks += [Notice(flag) for flag in flags_of(gate, readings.gels[k].refusal)]
        if isinstance(after, FitRefused):
            blocks.append(Missing(f"no posterior: {after}"))
        else:
            facts += [f"error {millimetres(_error(after, true[k]))}"] if true is not None else []
            facts.append(f"90 % radius {millimetres(after.credible90, 1)}")
        facts += [f"fit: {_fit(gate)}", *_predict_error(scored.run, k)]
        tiles: dict[str, Picture | Missing] = {"live": album.pixels(f"contact_{k + 1}_live", png(live))}
        if isinstance(images[k], Missing):
            tiles["simulated"] = images[k]
        else:
            rms = float(np.sqrt(np.mean((live.astype(np.float64) - images[k].astype(np.float64)) ** 2)))
            facts.append(f"images differ by {rms:.1f} grey levels rms")
            for name, image in (("simulated", images[k]), ("difference", difference(live, images[k]))):
                tiles[name] = album.pixels(f"contact_{k + 1}_{name}", png(image))
        if not isinstance(gels[k], Missing):
            rms = float(np.sqrt(np.mean((height - gels[k]) ** 2)))
            facts.append(f"height maps differ by {millimetres(rms, 3)} rms")
        heights = {"live": height, "simulated": gels[k]}
        highest = max(float(one.max()) for one in heights.values() if not isinstance(one, Missing))
        for name, one in heights.items():
            title = f"height, {name}: 0 to {millimetres(highest)}"
            if isinstance(one, Missing):
                tiles[title] = one
            else:
                picture = png(height_picture(one, highest))
                tiles[title] = album.pixels(f"contact_{k + 1}_height_{name}", picture)
        shown = Tiles(tuple(tiles.items()))
        yield PageSection(f"Contact {k + 1}", (*blocks, f"{'; '.join(facts)}.", shown))


def _of_each(values: AnyArray | None, name: str, count: int) -> list[Any]:
    """Return a quantity of every contact, or why it was not simulated."""
    if values is not None:
        return list(values)
    return [Missing(f"the scene's observe does not ask for {name}")] * count


def _fit(gate: Gate | None) -> str:
    if gate is None:
        return "the image was not used"
    return "no contact in the image" if gate.fit is None else f"log-likelihood {gate.fit:.1f}"


def _predict_error(run: RunFiles, contact: int) -> Iterator[str]:
    """Yield the error that was predicted when a contact was chosen; nothing for planned contacts."""
    if run.scene.section(Localization).choose != "planned":
        error = run.recording.step(contact).step.parameters.get(EXPECTED)
        if error is not None:
            yield f"error predicted when it was chosen {1e3 * error:.1f} mm"


GIVES = ("contact.gel_from_object",)
"""What an answer gives the simulation."""


def sources(scored: ScoredContact) -> Quantities:
    """Return the answer's part of what the scene's observed quantities are computed from."""
    return {"contact_gel_from_object": inverse(object_from_gels(scored.found))}


def object_from_gels(found: Answer) -> FloatArray:
    """``(contacts, 4, 4)``: each gel as deep behind its estimated contact as its own images say."""
    object_from_base = found.readings.prior.object_from_base(np.array([found.last.yaw]))[0]
    poses = []
    for observation, point, gel in zip(
        found.readings.observations, found.last.contacts, found.readings.gels, strict=True
    ):
        rotation = object_from_base @ observation.base_from_gel[:3, :3]
        rows, columns = gel.height.shape
        middle = gel.height[(rows - 1) // 2 : rows // 2 + 1, (columns - 1) // 2 : columns // 2 + 1]
        poses.append(transform(rotation, point + float(middle.mean()) * rotation[:, 2]))
    return read_only(np.array(poses))
