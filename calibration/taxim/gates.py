"""What makes a press, or a set of presses, no use for a calibration; each with its reason and the way out."""

from dataclasses import dataclass

import numpy as np

from calibration.taxim.detect import Detector, Found
from calibration.taxim.pictures import Pictures, Refused
from harness.basics.arrays import BoolArray, ByteArray, FloatArray, block_means
from harness.basics.errors import CalibrationRefused, PictureRefused
from harness.sim.optics.check.faults import require_whole

CONTACT = 0.8
"""Ball radii: what a contact is taken to be until the fit has found its edge."""

LEAST_PRESSES = 15
LEAST_STRENGTH = 8.0
"""Grey levels rms within the contact below which nothing was pressed; noise alone gives 2."""

LEAST_SHARE = 0.35
"""Of the change that ramps across a ball explain; real presses half in shadow reach 0.42, others 0.8."""

LEAST_IN_VIEW = 0.75
"""Of the contact's disc that must lie in the picture."""

MOST_CLIPPED = 0.5
"""Of the pixels that changed much, with a channel at its end; published sets have at most 0.3."""

_LOUD = 15.0
"""Grey levels, mean over the channels, that count as much."""

MOST_DRIFT = 40.0
"""Grey levels that the untouched gel may have changed; it is 4 and 13 in published sets, at most 32."""

LEAST_COVERED = 0.12
"""Of the picture that some contact must reach; published sets reach 0.44 and 0.33."""

LEAST_SPREAD = 0.05
"""Standard deviation of the centres as a share of the picture's side; published sets have 0.09 and more."""

_CHANGED = 0.2
"""Of a contact's pixels that must have changed much for something to have been pressed at all."""

_SWAP = 0.5
"""A press whose untouched gel comes twice as near the background with red and blue exchanged is exchanged."""

_SWAP_LEAST = 6.0
"""Grey levels from the background below which nothing can be said of the order."""

_TWIN = 1.8
"""Grey levels rms between averages over an eighth of the ball; the nearest published pair differs by 2.3."""

_TWIN_APART = 0.1
_CLIPPED_AT = (1, 254)


@dataclass(frozen=True, eq=False)
class Sighting:
    """A press as the detector sees it.

    Attributes:
        found: the disc.
        drift: ``(3,)`` grey levels, of the untouched gel against the background.
        in_view: share of the contact that lies in the picture.
        clipped: share with a channel at 0 or 255 among the pixels that changed much.
        changed: pixels that changed much, as a share of a contact's.
        exchanged: whether the untouched gel fits the background far better with red and blue exchanged.
        small: ``(rows, columns, 3)`` the change, averaged over blocks.
        lost: why part of the picture is none; None where it is whole.
    """

    found: Found
    drift: FloatArray
    in_view: float
    clipped: float
    changed: float
    exchanged: bool
    small: FloatArray
    lost: str | None


def sightings(pictures: Pictures, ball: float) -> list[Sighting]:
    """Find every press, and what speaks against it; ``ball`` in pixels."""
    rows, columns = pictures.background.shape[:2]
    detector = Detector(rows, columns, ball)
    return [_sighting(image, pictures.background, detector, ball) for image in pictures.images]


def refusals(pictures: Pictures, seen: list[Sighting], ball: float) -> list[Refused | None]:
    """Why each press is not used; None where it is."""
    verdicts = [_verdict(name, one) for name, one in zip(pictures.names, seen, strict=True)]
    block = max(1, round(ball / 8.0))
    for k in range(len(seen)):
        for earlier in range(k):
            if (
                verdicts[k] is None
                and verdicts[earlier] is None
                and _twins(seen[earlier], seen[k], ball, block)
            ):
                verdicts[k] = Refused(
                    pictures.names[k],
                    "twice",
                    f"the same press as {pictures.names[earlier]}: keep one, or it vouches for itself when "
                    "held out",
                )
    return verdicts


def check_set(pictures: Pictures, verdicts: list[Refused | None], seen: list[Sighting], ball: float) -> None:
    """Refuse a set too damaged to be used.

    Raises:
        CalibrationRefused: mostly refused presses, too few, or all at one place.
    """
    refused = [one for one in verdicts if one is not None] + list(pictures.refused)
    total = len(verdicts) + len(pictures.refused)
    if 2 * len(refused) > total:
        kinds = [one.kind for one in refused]
        most = max(sorted(set(kinds)), key=kinds.count)
        example = next(one for one in refused if one.kind == most)
        raise CalibrationRefused(
            f"{len(refused)} of {total} presses are refused, {kinds.count(most)} for the same reason; "
            f"{example.name}: {example.reason}"
        )
    kept = [one for one, verdict in zip(seen, verdicts, strict=True) if verdict is None]
    if len(kept) < LEAST_PRESSES:
        raise CalibrationRefused(
            f"{len(kept)} presses can be used; take at least {LEAST_PRESSES}, all over the gel"
        )
    centres = np.array([one.found.centre for one in kept])
    rows, columns = pictures.background.shape[:2]
    covered = float(reached(centres, CONTACT * ball, rows, columns).any(axis=0).mean())
    spread = float((centres.std(axis=0) / (columns, rows)).min())
    if covered < LEAST_COVERED or spread < LEAST_SPREAD:
        raise CalibrationRefused(
            f"the presses reach {covered:.0%} of the picture (at least {LEAST_COVERED:.0%} is wanted) and "
            f"their centres spread by {spread:.1%} of a side (at least {LEAST_SPREAD:.0%}): press all over "
            "the gel"
        )


def reached(centres: FloatArray, radius: float, rows: int, columns: int) -> BoolArray:
    """``(presses, rows, columns)`` whether each press's contact reaches a pixel."""
    x, y = np.arange(columns)[None, None, :], np.arange(rows)[None, :, None]
    away = np.hypot(x - centres[:, 0, None, None], y - centres[:, 1, None, None])
    return np.asarray(away <= radius)


def _sighting(image: ByteArray, background: ByteArray, detector: Detector, ball: float) -> Sighting:
    change = image.astype(np.float64) - background
    found = detector.find(change - np.median(change.reshape(-1, 3), axis=0))
    rows, columns = background.shape[:2]
    away = np.hypot(np.arange(columns)[None, :] - found.centre[0], np.arange(rows)[:, None] - found.centre[1])
    inside, far = away <= CONTACT * ball, away > 2.5 * CONTACT * ball
    drift = np.median(change[far], axis=0) if far.any() else np.median(change.reshape(-1, 3), axis=0)
    clipped = np.any((image <= _CLIPPED_AT[0]) | (image >= _CLIPPED_AT[1]), axis=2)
    loud = np.abs(change - drift).mean(axis=2) > _LOUD
    rest = far if far.any() else np.ones((rows, columns), np.bool_)
    straight = float(np.abs(change[rest]).mean())
    crossed = float(np.abs(image[rest][:, ::-1].astype(np.float64) - background[rest]).mean())
    return Sighting(
        found,
        drift,
        float(inside.sum() / (np.pi * (CONTACT * ball) ** 2)),
        float(np.mean(clipped[loud])) if loud.any() else 0.0,
        float(loud.sum() / (np.pi * (CONTACT * ball) ** 2)),
        straight > _SWAP_LEAST and crossed < _SWAP * straight,
        block_means(change - drift, max(1, round(ball / 8.0))),
        _lost(image, background),
    )


def _lost(image: ByteArray, background: ByteArray) -> str | None:
    try:
        require_whole(image, background)
    except PictureRefused as refusal:
        return str(refusal)
    return None


def _verdict(name: str, one: Sighting) -> Refused | None:
    x, y = one.found.centre
    worst = float(np.abs(one.drift).max())
    if one.exchanged:
        return Refused(
            name,
            "channels",
            "its untouched gel fits the background only with red and blue exchanged: save all pictures in "
            "one order and say which with --channels",
        )
    if worst > MOST_DRIFT:
        return Refused(
            name,
            "drift",
            f"the untouched gel changed by {worst:.0f} grey levels against the background (at most "
            f"{MOST_DRIFT:.0f}): fix exposure and white balance, and take a fresh background",
        )
    if one.clipped > MOST_CLIPPED:
        return Refused(
            name,
            "saturated",
            f"{one.clipped:.0%} of what changed is at 0 or 255 in some channel (at most {MOST_CLIPPED:.0%}): "
            "shorten the exposure or dim the lights",
        )
    if one.lost is not None:
        return Refused(name, "lost", one.lost)
    if one.found.strength < LEAST_STRENGTH and one.changed > _CHANGED:
        return Refused(
            name,
            "no ball",
            "its colours change, but nowhere as a ball's do: something else was pressed, or the gel slipped",
        )
    if one.found.strength < LEAST_STRENGTH:
        return Refused(
            name,
            "no press",
            f"the colours change by {one.found.strength:.1f} grey levels at most (at least "
            f"{LEAST_STRENGTH:.0f} are wanted): nothing was pressed, or hardly",
        )
    if one.found.share < LEAST_SHARE:
        return Refused(
            name,
            "no ball",
            f"a ball explains {one.found.share:.0%} of its change of colour (at least {LEAST_SHARE:.0%}): "
            "something else was pressed, or the gel slipped",
        )
    if one.in_view < LEAST_IN_VIEW:
        return Refused(
            name,
            "off the image",
            f"its centre ({x:.0f}, {y:.0f}) leaves {one.in_view:.0%} of the contact in the picture (at least "
            f"{LEAST_IN_VIEW:.0%}): press further in",
        )
    return None


def _twins(one: Sighting, other: Sighting, ball: float, block: int) -> bool:
    centre = np.array(one.found.centre)
    if float(np.hypot(*(centre - other.found.centre))) > _TWIN_APART * ball:
        return False
    rows, columns = one.small.shape[:2]
    x, y = np.arange(columns)[None, :] * block, np.arange(rows)[:, None] * block
    near = np.hypot(x - centre[0], y - centre[1]) < ball
    return float(np.sqrt(np.mean((one.small - other.small)[near] ** 2))) < _TWIN
