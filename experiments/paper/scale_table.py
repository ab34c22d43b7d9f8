"""The paper's table of sizes: a mocked run in process, answered by every method, trivial ones too."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from experiments.paper.scale_networks import (
    SIZE_INPUTS,
    PaperNetwork,
    crop_of,
    paper_networks,
    sequence_of,
    spectrogram_of,
)
from experiments.scale_estimation.answer import ScaleAnswering, SizeAnswer
from experiments.scale_estimation.experiment import ScaleMeasurement
from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.size import Belief, SizeRange, fused
from experiments.scale_estimation.sound.peaks import Peaks, RingingModel
from experiments.scale_estimation.touch.fit import Patch
from experiments.scale_estimation.touch.touch import by_touch
from experiments.scale_estimation.unseen.answer import imprints_alone
from experiments.scale_estimation.unseen.spectrogram import response_of
from experiments.scale_estimation.vision.vision import View
from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.clock import now
from harness.basics.errors import DataRefused, FitRefused
from harness.bench.acquisition import Strike
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.experiment.in_process import RunCell, open_run
from harness.experiment.levels import chosen_levels
from harness.experiment.truth import read_truth
from harness.picture.object_mask import mask_by_background
from harness.picture.outline import SeenOutline, directions
from harness.recording.observation import look_pictures

TRIVIAL = ("random", "constant", "first peak", "outline's area", "outline's box", "contacts' box")
UNSEEN = (
    "vision, shape unknown",
    "audio, shape unknown",
    "imprints, no poses, shape unknown",
    "touch, shape unknown",
    "fused, shape unknown",
)
OURS = (
    *UNSEEN,
    "vision",
    "audio",
    "touch",
    "touch, 3 contacts",
    "audio + touch, 3 contacts",
    "audio + touch",
    "fused",
)
PAPER_ROWS = MappingProxyType(
    {
        "picture": "ResNet-18, picture",
        "spectrogram": "ResNet-18, spectrogram",
        "imprints": "GRU, imprints without poses",
    }
)
"""Names of rows, by sense."""

METHODS = (*TRIVIAL, *PAPER_ROWS.values(), *OURS)

GROSS = 0.1
"""Of the size: an error beyond is a failure."""

PAPER_CM = {"vision": (5.08,), "audio": (4.68,), "touch": (3.51,)}
"""Mean errors on real objects, of networks that do not know the object: ObjectFolder 2.0, table 3."""

FEW = 3


def _rows(answering: ScaleAnswering, found: SizeAnswer, true: float) -> dict[str, Any]:
    sizes = answering.model.sizes
    rows: dict[str, Any] = {"random": {"error_m": random_error(sizes, true), "seconds": 0.0}}
    if not answering.shape_known:
        return {
            **rows,
            "constant": _value(constant(sizes), true, 0.0),
            **_shapeless_rows(answering, found, true),
        }
    for name, method in _trivial(answering).items():
        began = now()
        value = method()
        if value is not None:
            rows[name] = _value(value, true, now() - began)
    for sense in ("vision", "audio", "touch"):
        if sense in found.by_sense:
            rows[sense] = _answered(found.by_sense[sense], answering, true, found.seconds[sense])
    without = answering.answered(shape_known=False)
    rows.update(_shapeless_rows(answering, without, true))
    rows.update(_pairs(answering, found, true))
    rows["fused"] = _belief(found.fused, true, sum(found.seconds.values()))
    return rows


def _trivial(answering: ScaleAnswering) -> dict[str, Callable[[], float | None]]:
    model = answering.model

    def first_peak() -> float | None:
        peaks = answering.peaks()
        if peaks is None:
            return None
        return by_first_peak(peaks, model.ringing(answering.accuracy), model.nominal)

    methods: dict[str, Callable[[], float | None]] = {
        "constant": lambda: constant(model.sizes),
        "first peak": first_peak,
    }
    outline = answering.outline
    if isinstance(outline, SeenOutline):
        methods["outline's area"] = lambda: by_area(outline, model.view, model.nominal)
        methods["outline's box"] = lambda: by_box(outline, model.view)
    if answering.patches:
        methods["contacts' box"] = lambda: by_contacts_box(answering.patches, model)
    return methods


def _shapeless_rows(answering: ScaleAnswering, found: SizeAnswer, true: float) -> dict[str, Any]:
    """What the readings say where nobody knows the shape."""
    rows = {}
    with suppress(FitRefused):
        began = now()
        imprints = imprints_alone(answering.patches, answering.model.sizes).belief
        rows["imprints, no poses, shape unknown"] = _belief(imprints, true, now() - began)
    for sense, one in found.by_sense.items():
        rows[f"{sense}, shape unknown"] = _answered(one, answering, true, found.seconds[sense])
    rows["fused, shape unknown"] = _belief(found.fused, true, sum(found.seconds.values()))
    return rows


def _pairs(answering: ScaleAnswering, found: SizeAnswer, true: float) -> dict[str, Any]:
    """What some of the readings say together."""
    model, rows = answering.model, {}
    began, heard = now(), found.by_sense.get("audio")
    few: FitRefused | Any
    met = [index for index, touched in enumerate(answering.met) if touched]
    ways = met[FEW - 1] + 1 if len(met) >= FEW else len(answering.met)
    try:
        few = by_touch(
            model.stand, answering.patches[:FEW], model.nominal, model.sizes, free=answering.free[:ways]
        )
    except FitRefused as refusal:
        few = refusal
    seconds = now() - began
    rows["touch, 3 contacts"] = _answered(few, answering, true, seconds)
    for name, touched in (
        ("audio + touch, 3 contacts", few),
        ("audio + touch", found.by_sense.get("touch")),
    ):
        answered = [
            one.belief for one in (heard, touched) if one is not None and not isinstance(one, FitRefused)
        ]
        together = fused(answered) if answered else Belief.ignorant(model.sizes)
        rows[name] = _belief(together, true, seconds)
    return rows


def _answered(one: Any, answering: ScaleAnswering, true: float, seconds: float) -> dict[str, Any]:
    if isinstance(one, FitRefused):
        return _refused(one, answering, true, seconds)
    return _belief(one.belief, true, seconds)


def _refused(why: FitRefused, answering: ScaleAnswering, true: float, seconds: float) -> dict[str, Any]:
    """A refusal counts as the middle of the range, and claims no more than the range."""
    return {**_value(constant(answering.model.sizes), true, seconds), "refused": str(why)}


def _belief(belief: Belief, true: float, seconds: float) -> dict[str, Any]:
    low, high = belief.interval
    claimed = {"in_region90": bool(low <= true <= high), "low90_m": low, "high90_m": high}
    return {**_value(belief.size, true, seconds), **claimed}


def _value(size: float, true: float, seconds: float) -> dict[str, Any]:
    error = abs(size - true)
    return {"size_m": size, "error_m": error, "gross": bool(error > GROSS * true), "seconds": seconds}


_TURNS = 8


def random_error(sizes: SizeRange, true: float) -> float:
    """Return the mean error in m of a size sampled from the range, uniform in its logarithm."""
    inside = np.exp(sizes.logs[sizes.inside.astype(bool)])
    return float(np.abs(inside - true).mean())


def constant(sizes: SizeRange) -> float:
    """Return the geometric mean of the range in m."""
    return float(np.sqrt(sizes.low * sizes.high))


def by_first_peak(peaks: Peaks, model: RingingModel, nominal: float) -> float:
    """Return the size in m at which the lowest mode has the frequency of the lowest peak."""
    return float(nominal * model.frequencies[0] / peaks.frequencies[0])


def by_area(outline: SeenOutline, view: View, nominal: float) -> float:
    """M, from the area of the outline's hull over the model's, over turns, at its nominal place."""
    stands = np.zeros((_TURNS, len(view.sigmas)))
    stands[:, 3] = np.arange(_TURNS) * 2.0 * np.pi / _TURNS
    reach = view.project(stands, view.corners) @ directions().T
    mean = float(np.mean([_area(one) for one in reach.max(axis=1)]))
    return float(nominal * np.sqrt(_area(outline.extents) / mean))


def by_box(outline: SeenOutline, view: View) -> float:
    """M, the longer side of the outline's box at the distance of where the object stands; no model of it."""
    count = len(outline.extents)
    widths = outline.extents + np.roll(outline.extents, -(count // 2))
    distance = (view.base_from_camera[:3, 2] @ (view.place - view.base_from_camera[:3, 3])) / view.focal_px
    return float(max(widths[0], widths[count // 4]) * distance)


def by_contacts_box(patches: list[Patch], model: ObjectModel) -> float:
    """M, from the area of the outline's hull over the model's, averaged over turns."""
    places = np.concatenate([patch.points for patch in patches])
    low = np.minimum(places.min(axis=0), [np.inf, np.inf, model.place[2]])
    return float((places.max(axis=0) - low).max())


def _area(extents: FloatArray) -> float:
    """Px^2, of the polygon whose sides stand so far out in evenly spaced directions."""
    step = 2.0 * np.pi / len(extents)
    before, after = np.roll(extents, 1), np.roll(extents, -1)
    sides = (before + after - 2.0 * extents * np.cos(step)) / np.sin(step)
    return float(0.5 * np.sum(extents * sides))


@dataclass(frozen=True, eq=False)
class PaperReadings:
    """The readings of a run as the paper has them: no poses, no material."""

    pictures: tuple[ByteArray, ByteArray] | None
    """``(rows, columns, 3)`` RGB with the object and without it; None without a look."""
    focal_px: float  #: pixels of the camera's focal length.
    strikes: Sequence[Strike]  #: all that were made.
    patches: Sequence[Patch]  #: of the contacts that met the object, in their order.

    def views(self, sense: str) -> list[dict[str, FloatArray]]:
        """Compute one or more inputs of a sense's network.

        Raises:
            FitRefused: the run has no reading of the sense.
        """
        if sense == "picture":
            if self.pictures is None:
                raise FitRefused("the camera has not looked yet")
            live, bare = self.pictures
            return [{"crop": crop_of(live, mask_by_background(live, bare), self.focal_px)}]
        if sense == "spectrogram":
            found = response_of(self.strikes)
            if found is None:
                raise FitRefused("no strike may be used: none was made, or none excited anything")
            responses, rate, band = found
            return [{"spectrogram": spectrogram_of(response, rate, band)} for response in responses]
        rows, last = sequence_of([patch.points for patch in self.patches])
        return [{"imprints": rows, "last": last}]


def paper_sizes(
    networks: Mapping[str, PaperNetwork], readings: PaperReadings
) -> dict[str, tuple[float | FitRefused, float]]:
    """By row: the size in m, or why there is none; and the seconds that it took."""
    found: dict[str, tuple[float | FitRefused, float]] = {}
    for sense in SIZE_INPUTS:
        if sense in networks:
            began = now()
            size: float | FitRefused
            try:
                size = networks[sense].size(readings.views(sense))
            except FitRefused as refusal:
                size = refusal
            found[PAPER_ROWS[sense]] = size, now() - began
    return found


class ScaleTable(ScaleMeasurement):
    """The paper's table of sizes."""

    methods = METHODS
    regions = OURS
    published = PAPER_CM

    def run_cell(
        self, cell: RunCell, scene: SceneFile, station: Station, recordings: Path | None = None
    ) -> dict[str, Any]:
        """Perform a run, or open it in ``recordings``, and answer it by every method.

        Raises:
            DataRefused: the run has no readings, or ``[scale] paper_networks`` has no usable network.
        """
        stated = scene.section(Scale).paper_networks
        networks = {} if stated is None else paper_networks(Path(stated))
        own = cell.create_scene(scene)
        with open_run(self.experiment, cell, own, station, recordings) as run:
            recording = run.recording
            truth = read_truth(recording)
            if truth is None:
                raise DataRefused("no instrument read anything in this run: no way to the object was free")
            answering = ScaleAnswering(run, chosen_levels(self.experiment.knobs, (), run.network_levels))
            answering.load()  # as in a run while the arm moves: the seconds of a row are of readings alone
            pictures = None
            for record in recording.steps():
                answering.read(record)
                pictures = look_pictures(record) or pictures
            true = float(truth.differences["longest_side_m"])
            rows = _rows(answering, answering.answer(), true)
            # Sizes by the paper's networks from the same readings.
            camera = answering.model.station.camera
            focal_px = 0.0 if camera is None else camera.focal_length
            readings = PaperReadings(pictures, focal_px, answering.strikes, answering.patches)
            for name, (size, seconds) in paper_sizes(networks, readings).items():
                if isinstance(size, FitRefused):
                    rows[name] = _refused(size, answering, true, seconds)
                else:
                    rows[name] = _value(size, true, seconds)
            steps = recording.committed
            return {"schema": 1, "cell": vars(cell), "steps": steps, "size_m": true, "rows": rows}
