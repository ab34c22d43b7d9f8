"""What makes a press, or a set of presses, no use for a calibration; each with its reason and the way out.

``Detector`` finds a press in the picture alone. Across a ball the change of colour is, to first order, linear
in the place: each channel is a ramp through zero at the centre. The detector looks for the disc that such
ramps explain best,

    score(c) = explained(c) - price * (energy(c) - explained(c)),    summed over the channels

where ``explained`` is the energy of the least-squares ramp without a constant over the disc about ``c``.
A halo is bright and no ramp through zero, so it costs and gains nothing.
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft2, next_fast_len, rfft2

from calibration.taxim.pictures import Pictures, Refused
from harness.basics.arrays import AnyArray, BoolArray, ByteArray, FloatArray, block_means
from harness.basics.errors import CalibrationRefused, PictureRefused
from harness.sim.optics.check.picture_check import require_whole

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

REACH = 0.85
"""Ball radii out to which the ramp is looked for."""

_PIXELS = 8.0
"""A ball's radius in pixels that is fine enough; larger pictures are averaged down to about it."""

_PRICE = 0.5
"""Of energy that is no ramp: at 1, a press half in shadow loses to a faint one that is not there."""

_LEAST_SEEN = 0.25
"""Share of a disc that must lie in the picture for its centre to be a candidate."""


@dataclass(frozen=True)
class Found:
    """A disc of changed colour."""

    centre: tuple[float, float]  #: pixels (column, row); may lie outside the picture by less than the disc.
    strength: float  #: grey levels rms over the disc; hardly more than the noise where nothing was pressed.
    share: float  #: of the disc's energy that the ramps explain, 0 to 1.


@dataclass(frozen=True, eq=False)
class Sighting:
    """A press as the detector sees it."""

    found: Found  #: the disc.
    drift: FloatArray  #: ``(3,)`` grey levels, of the untouched gel against the background.
    in_view: float  #: share of the contact that lies in the picture.
    clipped: float  #: share with a channel at 0 or 255 among the pixels that changed much.
    changed: float  #: pixels that changed much, as a share of a contact's.
    exchanged: bool  #: whether the untouched gel fits the background far better with red and blue exchanged.
    small: FloatArray  #: ``(rows, columns, 3)`` the change, averaged over blocks.
    lost: str | None  #: why part of the picture is none; None where it is whole.


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


class Detector:
    """Finds presses of one ball in pictures of one shape.

    Args:
        rows: of the pictures.
        columns: of the pictures.
        ball: radius in pixels, more than 3.
    """

    def __init__(self, rows: int, columns: int, ball: float) -> None:
        self._block = max(1, round(ball / _PIXELS))
        radius = REACH * ball / self._block
        self._pad = int(np.ceil(radius))
        reach = self._pad
        y, x = (axis.astype(np.float64) for axis in np.mgrid[-reach : reach + 1, -reach : reach + 1])
        disc = (np.hypot(x, y) <= radius).astype(np.float64)
        small = (rows // self._block, columns // self._block)
        self._shape = [next_fast_len(size + 4 * self._pad, real=True) for size in small]
        self._ramps = [self._of_kernel(kernel) for kernel in (disc * x, disc * y)]
        self._disc = self._of_kernel(disc)
        seen = rfft2(np.pad(np.ones(small), self._pad), self._shape)
        self._area = self._correlated(seen, self._disc, small)
        self._usable = self._area >= _LEAST_SEEN * disc.sum()
        xx, xy, yy = (
            self._correlated(seen, self._of_kernel(disc * one), small) for one in (x * x, x * y, y * y)
        )
        # The inverse of each place's moments: near the border only a part of the disc is seen.
        determinant = np.where(self._usable, xx * yy - xy**2, 1.0)
        self._inverse = (yy / determinant, xy / determinant, xx / determinant)

    def find(self, change: FloatArray) -> Found:
        """The disc that looks most like a ball in ``(rows, columns, 3)`` grey levels against rest."""
        small = block_means(change, self._block)
        size = (small.shape[0], small.shape[1])
        explained = np.zeros(self._area.shape)
        for c in range(3):
            spectrum = rfft2(np.pad(small[..., c], self._pad), self._shape)
            right, down = (self._correlated(spectrum, ramp, size) for ramp in self._ramps)
            yy, xy, xx = self._inverse
            explained += yy * right**2 - 2.0 * xy * right * down + xx * down**2
        power = np.pad((small**2).sum(axis=2), self._pad)
        energy = self._correlated(rfft2(power, self._shape), self._disc, size)
        left = np.maximum(energy - explained, 0.0)
        score = np.where(self._usable, explained - _PRICE * left, -np.inf)
        i, j = np.unravel_index(int(np.argmax(score)), score.shape)
        there = max(float(energy[i, j]), 1e-9)
        x, y = j + _vertex(score[i, j - 1 : j + 2]), i + _vertex(score[i - 1 : i + 2, j])
        return Found(
            centre=(
                float((x - self._pad + 0.5) * self._block - 0.5),
                float((y - self._pad + 0.5) * self._block - 0.5),
            ),
            strength=float(np.sqrt(there / (3.0 * self._area[i, j]))),
            share=float(explained[i, j]) / there,
        )

    def _of_kernel(self, kernel: FloatArray) -> AnyArray:
        return np.asarray(np.conj(rfft2(kernel, self._shape)))

    def _correlated(self, spectrum: AnyArray, kernel: AnyArray, size: tuple[int, int]) -> FloatArray:
        """Of the padded picture, at every place of it where a disc's centre may lie."""
        every = irfft2(spectrum * kernel, self._shape)
        # A kernel's middle is its reach in from its corner: roll it back there.
        reach = self._pad
        rolled = np.roll(every, (reach, reach), axis=(0, 1))
        return np.asarray(rolled[: size[0] + 2 * reach, : size[1] + 2 * reach], dtype=np.float64)


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
    lost = None
    try:
        require_whole(image, background)
    except PictureRefused as refusal:
        lost = str(refusal)
    return Sighting(
        found,
        drift,
        float(inside.sum() / (np.pi * (CONTACT * ball) ** 2)),
        float(np.mean(clipped[loud])) if loud.any() else 0.0,
        float(loud.sum() / (np.pi * (CONTACT * ball) ** 2)),
        straight > _SWAP_LEAST and crossed < _SWAP * straight,
        block_means(change - drift, max(1, round(ball / 8.0))),
        lost,
    )


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


def _vertex(three: FloatArray) -> float:
    """Where the parabola through the middle, which is the highest, and its neighbours has its top."""
    if len(three) < 3 or not np.isfinite(three).all():
        return 0.0
    bend = three[0] - 2.0 * three[1] + three[2]
    return 0.0 if bend >= 0.0 else float(0.5 * (three[0] - three[2]) / bend)
