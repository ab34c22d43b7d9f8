"""One cell of the table of sizes: a mocked run in process, answered by every method, trivial ones too."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.scale_estimation.answer import ScaleAnswering, SizeAnswer
from experiments.scale_estimation.baselines import (
    by_area,
    by_box,
    by_contacts_box,
    by_first_peak,
    constant,
    random_error,
)
from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.size import Belief, fused
from experiments.scale_estimation.touch.touch import by_touch
from experiments.scale_estimation.unseen.answer import imprints_alone
from experiments.scale_estimation.unseen.paper.network import PaperNetwork, paper_networks
from experiments.scale_estimation.unseen.paper.rows import PAPER_ROWS, PaperReadings, paper_sizes
from harness.basics.arrays import ByteArray
from harness.basics.clock import now
from harness.basics.errors import DataRefused, FitRefused
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import Station
from harness.experiment.experiment import Experiment
from harness.experiment.levels import chosen_levels
from harness.experiment.lookup import named
from harness.experiment.plain import perform_in_process
from harness.experiment.truth import read_truth
from harness.picture.outline import SeenOutline
from harness.recording.observation import look_pictures
from harness.recording.run_folder import RunFiles

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
METHODS = (*TRIVIAL, *PAPER_ROWS.values(), *OURS)

GROSS = 0.1
"""Of the size: an error beyond is a failure."""

LOOKING = ("yes", "no")
"""Whether the camera looks first; where it does not, the first contacts are made blindly."""

DRAWN = ("known", "unknown")
"""Whether the arm explores an object whose shape it knows. Where it does, the rows of objects never drawn are
answered from the same readings; where not, they are from contacts that nobody could plan on a drawing."""

PAPER_CM = {"vision": (5.08,), "audio": (4.68,), "touch": (3.51,)}
"""Mean errors on real objects, of networks that do not know the object: ObjectFolder 2.0, table 3."""

FEW = 3


@dataclass(frozen=True)
class ScaleCell:
    """Which run."""

    object: str
    gap: str
    seed: int
    look: str
    shape: str = "known"

    @property
    def name(self) -> str:
        """Of the run's file; a gap may be a path."""
        drawn = "" if self.shape == "known" else f"-{self.shape}"
        return f"{self.object}-{self.gap.replace('/', '_')}-{self.look}{drawn}-{self.seed}"

    @property
    def conditions(self) -> dict[str, str]:
        """What was varied."""
        return {"gap": self.gap, "look": self.look, "shape": self.shape}


def cells(
    objects: Sequence[str], seeds: Sequence[int], chosen: Mapping[str, Sequence[str]]
) -> list[ScaleCell]:
    """All of them, an object's after the other's of one seed."""
    return [
        ScaleCell(name, gap, seed, look, shape)
        for seed in seeds
        for gap in chosen["gap"]
        for look in chosen["look"]
        for shape in chosen["shape"]
        for name in objects
    ]


def scene_of(scene: SceneFile, cell: ScaleCell) -> SceneFile:
    """The scene of a table's object, its size hidden and every sense asked for."""
    tree = scene.model_dump(mode="json", by_alias=True)
    tree["object"]["scale"] = "hidden"
    tree["sensors"].update(camera=cell.look == "yes", sound=True, touch=True)
    # The paper's networks answer a run and change nothing of it: recordings do not depend on them.
    tree.setdefault(Scale.table, {}).update(shape=cell.shape, paper_networks=None)
    return scene_from_json(tree, cell.name)


def run_cell(
    cell: ScaleCell, scene: SceneFile, station: Station, recordings: Path | None = None
) -> dict[str, Any]:
    """Perform and answer one run; the result as JSON values.

    Raises:
        DataRefused: nothing was read, or ``[scale] paper_networks`` has no network that may be run.
    """
    experiment: Experiment = named("scale-estimation")
    stated = scene.section(Scale).paper_networks
    networks = {} if stated is None else paper_networks(Path(stated))
    here = scene_of(scene, cell)
    with closing(perform_in_process(experiment, cell, here, station, recordings)) as case:
        recording = case.run.recording
        truth = read_truth(recording)
        if truth is None:
            raise DataRefused("no instrument read anything in this run: no way to the object was free")
        run = RunFiles(recording)
        answering = ScaleAnswering(run, chosen_levels(experiment.knobs, (), run.network_levels))
        answering.load()  # as a run does while the arm moves: the seconds of a row are of readings alone
        pictures = None
        for record in recording.steps():
            answering.read(record)
            pictures = look_pictures(record) or pictures
        true = float(truth.differences["longest_side_m"])
        rows = _rows(answering, answering.answer(), true)
        rows.update(_paper_rows(networks, answering, pictures, true))
        return {"schema": 1, "cell": vars(cell), "steps": recording.committed, "size_m": true, "rows": rows}


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


def _paper_rows(
    networks: Mapping[str, PaperNetwork],
    answering: ScaleAnswering,
    pictures: tuple[ByteArray, ByteArray] | None,
    true: float,
) -> dict[str, Any]:
    """What the paper's networks answer from the same readings."""
    camera = answering.model.station.camera
    focal_px = 0.0 if camera is None else camera.focal_length
    readings = PaperReadings(pictures, focal_px, answering.strikes, answering.patches)
    rows = {}
    for name, (size, seconds) in paper_sizes(networks, readings).items():
        if isinstance(size, FitRefused):
            rows[name] = _refused(size, answering, true, seconds)
        else:
            rows[name] = _value(size, true, seconds)
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
