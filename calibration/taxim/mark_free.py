"""Calibrate a tactile camera from pictures of ball presses alone: nobody marks anything.

Presses are found and damaged ones refused with their reason (``gates``), colours and centres
fitted in turns (``smooth_fit``), and the result scored on presses left out (``held_out``). A ball's known
radius turns a place within a contact into a slope; the radius of the contact line is its depth.
"""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from threadpoolctl import threadpool_limits

from calibration.taxim.gates import CONTACT, LEAST_PRESSES, check_set, reached, refusals, sightings
from calibration.taxim.held_out import WITHIN, FittedModel, Score, colour_misfit, decibels, held_out, teach
from calibration.taxim.pictures import Pictures, PressPack, Refused, in_order_of_content
from calibration.taxim.shadow import ShadowFit, ShadowScore, fit_shadow, score_shadow
from calibration.taxim.smooth_fit import changes, residual, strength_by_radius
from calibration.taxim.table import table_error
from harness.basics.arrays import ByteArray, FloatArray, IntArray, read_only
from harness.basics.errors import CalibrationRefused
from harness.picture.square_pixels import MADE_SQUARE
from harness.sim.optics.lit_calibration import LitCalibration, with_shadow
from harness.sim.optics.shading import design
from harness.sim.optics.tactile_calibration import (
    CalibrationHeader,
    ColourMisfit,
    Float32Array,
    TactileCalibration,
    smooth_terms,
)

LEAST_GAIN = 12.0
"""dB over predicting nothing that presses left out must gain in the median; published sets gain 19."""

_SMALLEST_BALL = 5.0
"""Pixels of radius."""

LEAST_OWN_GAIN = 6.0
"""dB that a press must gain in its own fit: less than half of its change explained away is not the ball's."""

_TURNS = 24
_SLOPE = 0.4
"""Sine of the slope at which colours are compared; every press reaches it."""

_CLEAR = 0.1
"""By which the correlations of the two orders must differ for either to be believed."""


@dataclass(frozen=True)
class Identity:
    """What the presses cannot say of themselves."""

    sensor: str  #: make.
    serial: str  #: of the sensor.
    licence: str  #: of the pictures.
    date: str  #: ISO 8601.
    pitch: float  #: metres a pixel.
    ball_radius: float  #: metres.

    @property
    def ball(self) -> float:
        """Radius of the ball in pixels."""
        return self.ball_radius / self.pitch


@dataclass(frozen=True)
class UsedPress:
    """A press of the calibration."""

    name: str  #: of its picture.
    centre: tuple[float, float]  #: pixels (column, row).
    radius: float  #: pixels, of its contact line.
    depth: float  #: metres, of the ball in the gel, by its contact line.
    score: Score  #: by the presses of the other folds.


def contact_radius(clean: FloatArray, centre: FloatArray, ball: float) -> float:
    """Pixels from the centre at which one press changes the colour most."""
    rings = strength_by_radius(clean, centre, ball)
    smooth = np.convolve(rings, (0.25, 0.5, 0.25), mode="valid")
    return float(np.argmax(smooth)) + 1.5


@dataclass(frozen=True, eq=False)
class MarkFree:
    """A calibration, and what it was made of."""

    calibration: LitCalibration  #: the artefact.
    used: tuple[UsedPress, ...]  #: the presses it stands on, in the order of the set.
    refused: tuple[Refused, ...]  #: the others.
    contact_radius: float  #: pixels, of the contact line of all presses laid over one another.
    roundness: float  #: pixels that this line strays from a circle.
    lean: float
    """rad by which slopes lean against the contact line where a contact's own dimming has no place in the
    model, as in the array ``smooth`` that the inverse starts from."""
    depth: float  #: metres that the balls reach past the untouched gel, by the contact line and the skirt.
    left: FloatArray
    """``(rows, columns)`` grey levels rms left over on held-out presses, NaN where none was scored."""
    coverage: IntArray  #: ``(rows, columns)`` how many contacts reached a pixel.
    shadow: ShadowFit  #: what the presses show of shadows.
    shadow_score: ShadowScore | None  #: of them, on presses held out; None where the presses show none.
    background_from: str  #: in words.
    seconds: float  #: from pictures in memory to the artefact.

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
    smallest = min(pictures.background.shape[:2])
    if not _SMALLEST_BALL <= identity.ball <= 0.5 * smallest:
        raise CalibrationRefused(
            f"a ball of {1e3 * identity.ball_radius:g} mm at {1e3 * identity.pitch:g} mm a pixel has a "
            f"radius of {identity.ball:.1f} px; between {_SMALLEST_BALL:g} px and half the picture "
            f"({smallest / 2:g} px) is wanted: check radius (not diameter) and pitch"
        )
    # Products of a few hundred rows: threads cost more in waiting for one another than they compute.
    with threadpool_limits(limits=1, user_api="blas"):
        made = _calibrated(pictures, identity, use_marks, like)
    return replace(made, seconds=perf_counter() - began)


def _calibrated(
    pictures: Pictures, identity: Identity, use_marks: bool, like: TactileCalibration | None
) -> MarkFree:
    ball = identity.ball
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
        if len(pack.images) < max(LEAST_PRESSES, len(refused)):
            raise CalibrationRefused(
                f"{len(refused)} presses are refused and {len(pack.images)} left; at least {LEAST_PRESSES}, "
                f"and half of the set, are wanted; {refused[-1].name}: {refused[-1].reason}"
            )
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
    apart = np.median(model.plain.centres - model.fit.centres, axis=0)
    return MarkFree(
        _artefact(pictures, len(pack.images), model, identity, scores, drawn, error, misfit),
        tuple(sorted(used, key=lambda press: pictures.names.index(press.name))),
        tuple(sorted([*refused, *pictures.refused], key=lambda one: one.name)),
        model.fit.edge,
        model.circle.scatter,
        float(np.arcsin(min(1.0, float(np.hypot(*apart)) / ball))),
        model.light.depth * identity.pitch,
        read_only(np.sqrt(out.left / np.where(out.count > 0.0, out.count, np.nan))),
        reached(model.fit.centres, model.fit.edge, *pictures.background.shape[:2]).sum(axis=0),
        shadow,
        worth,
        pictures.background_from,
        0.0,
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


def calibration_of(
    background: ByteArray,
    model: FittedModel,
    identity: "Identity",
    made_from: str,
    error: Float32Array | None = None,
) -> LitCalibration:
    """The artefact of a model, which says nothing of its quality yet.

    Args:
        background: ``(rows, columns, 3)`` RGB of the untouched gel, before the presses corrected it.
        model: of the presses.
        identity: pitch, ball and names.
        made_from: in words.
        error: of the table's colours, see ``table_error``; None where it was not asked for.
    """
    header = CalibrationHeader(
        sensor=identity.sensor,
        serial=identity.serial,
        date=identity.date,
        made_from=made_from,
        licence=identity.licence,
        pitch=identity.pitch,
        ball_radius=identity.ball_radius,
        slope_limit=model.plain.edge / identity.ball,
        held_out_db=0.0,
        held_out_table_db=0.0,
        residual_rms=model.plain.residual_rms,
        condition=model.plain.condition,
        skirt=model.light.skirt,
    )
    seen = np.clip(np.round(background + model.rest), 0.0, 255.0).astype(np.uint8)
    lit = model.light.lit.copy()
    lit[smooth_terms() :] /= identity.pitch  # the light in grey levels a metre instead of a pixel
    made = LitCalibration(header, seen, model.table, model.support, model.plain.colours, lit)
    return made if error is None else replace(made, uncertainty=error)


def too_large(name: str, radius: float, ball: float, what: str) -> Refused | None:
    """Refuse a press whose ``what`` is no smaller than the ball; both in pixels."""
    if radius < ball:
        return None
    return Refused(
        name,
        "radius",
        f"{what} has a radius of {radius:.1f} px and the ball one of {ball:.1f} px: no contact is larger "
        "than the ball; check the ball, the pitch, and what was pressed",
    )


def unexplained(
    pack: PressPack, change: FloatArray, model: FittedModel, ball: float, names: list[str]
) -> dict[int, Refused]:
    """Presses that are not this ball after all, by their place in the pack."""
    worse: dict[int, Refused] = {}
    for k, name in enumerate(names):
        centre, clean = model.fit.centres[k], change[k] - model.rest
        radius = contact_radius(clean, centre, ball)
        large = too_large(name, radius, ball, "its contact")
        edge = WITHIN * model.fit.edge
        left = residual(pack, clean, centre, model.fit.colours, edge, ball)
        nothing = residual(pack, clean, centre, np.zeros_like(model.fit.colours), edge, ball)
        gain = decibels(left) - decibels(nothing)
        if large is not None:
            worse[k] = large
        elif gain < LEAST_OWN_GAIN:
            worse[k] = Refused(
                name,
                "not explained",
                f"the other presses' colours explain it by {gain:.1f} dB only (at least {LEAST_OWN_GAIN:g}): "
                "another object, a slip, or dirt; press again",
            )
    return worse


def check_order(smooth: FloatArray, like: TactileCalibration) -> None:
    """Refuse presses whose red and blue are exchanged against a calibration of the same make.

    Presses and background saved alike in the wrong order contradict nothing among themselves.

    Args:
        smooth: ``(120, 3)`` coefficients of the new presses.
        like: calibrated from pictures known to be right, the camera mounted the same way.

    Raises:
        CalibrationRefused: exchanged, or unlike in either order.
    """
    if len(like.smooth) == 0:
        raise CalibrationRefused(
            "the calibration to compare with has only a table; give one with a smooth model"
        )
    ours, theirs = _wheel(smooth), _wheel(like.smooth)
    straight, crossed = _correlation(ours, theirs), _correlation(ours[:, ::-1], theirs)
    if crossed > straight + _CLEAR:
        raise CalibrationRefused(
            f"colours correlate with {like.header.sensor} by {straight:.2f} as they are and by {crossed:.2f} "
            "with red and blue exchanged: the pictures are in the wrong order; say --channels bgr (or rgb)"
        )
    if straight < crossed + _CLEAR:
        raise CalibrationRefused(
            f"colours correlate with {like.header.sensor} by {straight:.2f} as they are and by {crossed:.2f} "
            "with red and blue exchanged: too close to tell the order; compare with a sensor of the same make"
        )


def _wheel(smooth: FloatArray) -> FloatArray:
    turns = 2.0 * np.pi * np.arange(_TURNS) / _TURNS
    normals = _SLOPE * np.column_stack([np.cos(turns), np.sin(turns)])
    shown: FloatArray = design(normals, np.zeros((_TURNS, 2))) @ smooth
    return shown


def _correlation(one: FloatArray, other: FloatArray) -> float:
    left, right = (part - part.mean(axis=0) for part in (one, other))
    return float((left * right).sum() / max(float(np.sqrt((left**2).sum() * (right**2).sum())), 1e-12))
