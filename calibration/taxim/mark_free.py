"""Calibrate a tactile camera from pictures of ball presses alone: nobody marks anything.

Presses are found (``detect``), damaged ones refused with their reason (``gates``), colours and centres
fitted in turns (``smooth_fit``), and the result scored on presses left out (``held_out``). A ball's known
radius turns a place within a contact into a slope; the radius of the contact line is its depth.
"""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from threadpoolctl import threadpool_limits

from calibration.taxim.artefact import calibration_of
from calibration.taxim.colour_misfit import colour_misfit
from calibration.taxim.explained import contact_radius, too_large, unexplained
from calibration.taxim.gates import CONTACT, LEAST_PRESSES, check_set, reached, refusals, sightings
from calibration.taxim.held_out import WITHIN, FittedModel, Score, held_out, teach
from calibration.taxim.likeness import check_order
from calibration.taxim.pack import PressPack
from calibration.taxim.pictures import Pictures, Refused, in_order_of_content
from calibration.taxim.shadow.fit import ShadowFit, fit_shadow
from calibration.taxim.shadow.score import ShadowScore, score_shadow
from calibration.taxim.smooth_fit import changes
from calibration.taxim.table_error import table_error
from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import CalibrationRefused
from harness.picture.square_pixels import MADE_SQUARE
from harness.sim.optics.lit_calibration import LitCalibration, with_shadow
from harness.sim.optics.tactile_calibration import ColourMisfit, Float32Array, TactileCalibration

LEAST_GAIN = 12.0
"""dB over predicting nothing that presses left out must gain in the median; published sets gain 19."""

_SMALLEST_BALL = 5.0
"""Pixels of radius."""


@dataclass(frozen=True)
class Identity:
    """What the presses cannot say of themselves.

    Attributes:
        sensor: make.
        serial: of the sensor.
        licence: of the pictures.
        date: ISO 8601.
        pitch: metres a pixel.
        ball_radius: metres.
    """

    sensor: str
    serial: str
    licence: str
    date: str
    pitch: float
    ball_radius: float

    @property
    def ball(self) -> float:
        """Radius of the ball in pixels."""
        return self.ball_radius / self.pitch


@dataclass(frozen=True)
class UsedPress:
    """A press of the calibration.

    Attributes:
        name: of its picture.
        centre: pixels (column, row).
        radius: pixels, of its contact line.
        depth: metres, of the ball in the gel, by its contact line.
        score: by the presses of the other folds.
    """

    name: str
    centre: tuple[float, float]
    radius: float
    depth: float
    score: Score


@dataclass(frozen=True, eq=False)
class MarkFree:
    """A calibration, and what it was made of.

    Attributes:
        calibration: the artefact.
        used: the presses it stands on, in the order of the set.
        refused: the others.
        contact_radius: pixels, of the contact line of all presses laid over one another.
        roundness: pixels that this line strays from a circle.
        lean: rad by which slopes lean against the contact line where a contact's own dimming has no place
            in the model, as in the array ``smooth`` that the inverse starts from.
        depth: metres that the balls reach past the untouched gel, by the contact line and the skirt.
        left: ``(rows, columns)`` grey levels rms left over on held-out presses, NaN where none was scored.
        coverage: ``(rows, columns)`` how many contacts reached a pixel.
        shadow: what the presses show of shadows.
        shadow_score: of them, on presses held out; None where the presses show none.
        background_from: in words.
        seconds: from pictures in memory to the artefact.
    """

    calibration: LitCalibration
    used: tuple[UsedPress, ...]
    refused: tuple[Refused, ...]
    contact_radius: float
    roundness: float
    lean: float
    depth: float
    left: FloatArray
    coverage: IntArray
    shadow: ShadowFit
    shadow_score: ShadowScore | None
    background_from: str
    seconds: float

    @property
    def shadow_missing(self) -> str:
        """Why no shadow is drawn; empty where one is."""
        if self.shadow.table is None:
            return "; ".join(f"{one.colour}: {one.missing}" for one in self.shadow.colours)
        score = self.shadow_score
        return "" if score is None or score.worth else score.sentence

    def median(self, which: str) -> float:
        """dB, median over the presses of one of the scores: table, smooth, unrefitted or nothing."""
        return float(np.median([vars(press.score)[which] for press in self.used]))


def calibrate(
    pictures: Pictures,
    identity: Identity,
    use_marks: bool = False,
    like: TactileCalibration | None = None,
) -> MarkFree:
    """Fit a calibration to presses.

    Args:
        pictures: the presses.
        identity: pitch, ball and names.
        use_marks: start from the circles that came with a data pack instead of finding the presses.
        like: of the same make, mounted alike; where given, the order of the colours is held to it.

    Raises:
        CalibrationRefused: a set too damaged, or a fit too poor.
    """
    began = perf_counter()
    # Products of a few hundred rows: threads cost more in waiting for one another than they compute.
    with threadpool_limits(limits=1, user_api="blas"):
        made = _calibrated(pictures, identity, use_marks, like)
    return replace(made, seconds=perf_counter() - began)


def _calibrated(
    pictures: Pictures, identity: Identity, use_marks: bool, like: TactileCalibration | None
) -> MarkFree:
    ball = identity.ball
    _check_ball(identity, pictures)
    ordered = in_order_of_content(pictures)
    pack, kept, refused = _usable(ordered, ball, use_marks)
    change = changes(pack)
    model = teach(pack, change, ball)
    if like is not None:
        check_order(model.plain.colours, like)
    worse = unexplained(pack, change, model, ball, [ordered.names[k] for k in kept])
    if worse:
        fine = np.array([k not in worse for k in range(len(kept))])
        refused = [*refused, *worse.values()]
        pack, change, kept = pack.of(np.nonzero(fine)[0]), change[fine], kept[fine]
        _still_enough(pack, refused)
        model = teach(pack, change, ball)
    radius = WITHIN * model.fit.edge
    out = held_out(pack, change, ball, radius)
    scores = out.scores
    names = [ordered.names[k] for k in kept]
    used = [
        _used(names[k], change[k] - model.rest, model.fit.centres[k], identity, scores[k])
        for k in range(len(names))
    ]
    _check_gain(scores)
    misfit = colour_misfit(pack, change, out, ball, radius)
    error = table_error(pack, change - model.rest, model.fit, ball)
    shadow = fit_shadow(pack, change - model.rest, model.fit.centres, model.light)
    worth = None if shadow.table is None else score_shadow(pack, change, out, identity.pitch, ball)
    drawn = None if worth is None or not worth.worth else shadow
    return MarkFree(
        _artefact(pictures, len(pack.images), model, identity, scores, drawn, error, misfit),
        tuple(sorted(used, key=lambda press: pictures.names.index(press.name))),
        tuple(sorted([*refused, *pictures.refused], key=lambda one: one.name)),
        model.fit.edge,
        model.circle.scatter,
        _lean(model, ball),
        model.light.depth * identity.pitch,
        read_only(np.sqrt(out.left / np.where(out.count > 0.0, out.count, np.nan))),
        reached(model.fit.centres, model.fit.edge, *pictures.background.shape[:2]).sum(axis=0),
        shadow,
        worth,
        pictures.background_from,
        0.0,
    )


def _lean(model: FittedModel, ball: float) -> float:
    apart = np.median(model.plain.centres - model.fit.centres, axis=0)
    return float(np.arcsin(min(1.0, float(np.hypot(*apart)) / ball)))


def _check_ball(identity: Identity, pictures: Pictures) -> None:
    smallest = min(pictures.background.shape[:2])
    if not _SMALLEST_BALL <= identity.ball <= 0.5 * smallest:
        raise CalibrationRefused(
            f"a ball of {1e3 * identity.ball_radius:g} mm at {1e3 * identity.pitch:g} mm a pixel has a "
            f"radius of {identity.ball:.1f} px; between {_SMALLEST_BALL:g} px and half the picture "
            f"({smallest / 2:g} px) is wanted: check radius (not diameter) and pitch"
        )


def _usable(pictures: Pictures, ball: float, use_marks: bool) -> tuple[PressPack, IntArray, list[Refused]]:
    """The presses that can be used, with their circles; their places in the set; and the others."""
    seen = sightings(pictures, ball)
    verdicts = refusals(pictures, seen, ball)
    circles = np.array([[*one.found.centre, CONTACT * ball] for one in seen])
    if use_marks:
        if pictures.marks is None:
            raise CalibrationRefused("these pictures came without marks; leave --marks out")
        circles = pictures.marks
        verdicts = [
            first if first is not None else too_large(name, radius, ball, "its marked circle")
            for first, name, radius in zip(verdicts, pictures.names, circles[:, 2], strict=True)
        ]
    check_set(pictures, verdicts, seen, ball)
    kept = np.array([k for k, verdict in enumerate(verdicts) if verdict is None])
    pack = PressPack(
        pictures.background,
        pictures.images[kept],
        read_only(circles[kept, :2]),
        read_only(circles[kept, 2]),
        read_only(kept),
        pictures.sha256,
    )
    return pack, kept, [verdict for verdict in verdicts if verdict is not None]


def _still_enough(pack: PressPack, refused: list[Refused]) -> None:
    if len(pack.images) < max(LEAST_PRESSES, len(refused)):
        raise CalibrationRefused(
            f"{len(refused)} presses are refused and {len(pack.images)} left; at least {LEAST_PRESSES}, and "
            f"half of the set, are wanted; {refused[-1].name}: {refused[-1].reason}"
        )


def _used(name: str, clean: FloatArray, centre: FloatArray, identity: Identity, score: Score) -> UsedPress:
    ball = identity.ball
    radius = min(contact_radius(clean, centre, ball), ball)
    depth = identity.pitch * (ball - np.sqrt(ball**2 - radius**2))
    return UsedPress(name, (float(centre[0]), float(centre[1])), radius, float(depth), score)


def _check_gain(scores: list[Score]) -> None:
    gain = float(np.median([one.table - one.nothing for one in scores]))
    if gain < LEAST_GAIN:
        raise CalibrationRefused(
            f"presses left out are predicted {gain:.1f} dB better than nothing in the median (at least "
            f"{LEAST_GAIN:g}); clean the gel, check ball and pitch, and take the presses again"
        )


def _artefact(
    pictures: Pictures,
    presses: int,
    model: FittedModel,
    identity: Identity,
    scores: list[Score],
    shadow: ShadowFit | None,
    error: Float32Array,
    misfit: ColourMisfit,
) -> LitCalibration:
    squared = "" if pictures.aspect == 1.0 else f", {MADE_SQUARE} {pictures.aspect:.6f}"
    made_from = f"sha256 {pictures.sha256}, {presses} presses without marks{squared}"
    made = calibration_of(pictures.background, model, identity, made_from, error)
    header = replace(
        made.header,
        held_out_db=float(np.median([one.smooth for one in scores])),
        held_out_table_db=float(np.median([one.table for one in scores])),
        misfit=misfit,
    )
    scored = replace(made, header=header)
    table = None if shadow is None else shadow.in_metres(identity.pitch)
    if shadow is None or table is None:
        return scored
    return with_shadow(scored, table, shadow.rim * identity.pitch)
