"""Real ball presses drawn by calibrations that never saw them: pose fitted, everything else as taught."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from calibration.taxim.gates import CONTACT, check_set, refusals, sightings
from calibration.taxim.held_out import FOLDS, WITHIN, FittedModel, decibels, teach
from calibration.taxim.light_fit import depth_of, pressed_ball
from calibration.taxim.mark_free import Identity, calibration_of
from calibration.taxim.pictures import Pictures, PressPack, read_pictures
from calibration.taxim.shadow import fit_shadow
from calibration.taxim.smooth_fit import changes, distance, refined_centre
from harness.basics.arrays import BoolArray, ByteArray, FloatArray, IntArray, read_only
from harness.picture.image_metrics import ssim
from harness.sim.gel.gel import R15_SKIRT, GelSkirt, deform
from harness.sim.optics.lit_calibration import LitCalibration
from harness.sim.optics.optics import Optics
from harness.sim.optics.shadow import ShadowTable

R15 = Identity("GelSight R1.5", "ObjectFolder 2.0", "CC BY 4.0", "2026-01-01", 0.1245e-3, 2.0e-3)
FOTS = Identity("GelSight", "FOTS", "MIT", "2026-01-01", 1e-3 / 19.58, 2.35e-3)

REGION = 1.6
"""Contact radii about a press: by these pixels its pose is fitted, and it is scored over them too."""

_SETTLE = 12
_EVALUATIONS = 60

Drawing = Callable[[FloatArray], FloatArray]
"""From ``(rows, columns)`` metres that a ball reaches into the gel to ``(rows, columns, 3)`` grey levels."""


def set_of(data: Path, word: str) -> Pictures:
    """The pictures of ``r15`` or ``fots``."""
    if word == "r15":
        return read_pictures(data / "tactile/objectfolder_calibs")
    folder = data / "tactile/fots_ball_presses"
    return read_pictures(folder / "gelsight", folder / "gelsight_bg.png")


@dataclass(frozen=True, eq=False)
class HeldOut:
    """A press, and what the other folds' presses teach."""

    name: str  #: of its picture.
    live: ByteArray  #: ``(rows, columns, 3)``.
    model: FittedModel  #: of the other folds.
    calibration: LitCalibration  #: of that model, light and skirt included; its background is theirs too.
    start: FloatArray  #: ``(2,)`` pixels (column, row), from the detector and two numbers refined.
    ball: float  #: pixels, radius.
    drift: FloatArray
    """``(3,)`` grey levels by which the light of this picture differs, from where it is untouched."""
    shadow: ShadowTable | None  #: as the other folds' presses show it; None where they show none.

    def region(self, radii: float) -> BoolArray:
        """``(rows, columns)`` the pixels within so many contact radii."""
        shape = (self.live.shape[0], self.live.shape[1])
        near: BoolArray = distance(shape, self.start) <= radii * self.model.fit.edge
        return near


@dataclass(frozen=True, eq=False)
class Drawn:
    """A drawing at the pose that explains the press best."""

    image: ByteArray  #: ``(rows, columns, 3)`` rounded.
    pose: FloatArray  #: column and row of the centre in pixels, depth in pixels.
    contact: float  #: dB within 0.95 of the contact's radius.
    around: float  #: dB within ``REGION``.
    frame: float  #: dB over the picture.
    alike: float  #: structural similarity over the picture.


def held_out_presses(pictures: Pictures, who: Identity, folds: int = FOLDS) -> Iterator[HeldOut]:
    """Every usable press, with a calibration of the other folds' presses alone."""
    seen = sightings(pictures, who.ball)
    verdicts = refusals(pictures, seen, who.ball)
    check_set(pictures, verdicts, seen, who.ball)
    kept = np.array([k for k, verdict in enumerate(verdicts) if verdict is None])
    pack = PressPack(
        pictures.background,
        pictures.images[kept],
        read_only(np.array([seen[k].found.centre for k in kept], dtype=np.float64)),
        read_only(np.full(len(kept), CONTACT * who.ball)),
        read_only(kept),
        pictures.sha256,
    )
    change = changes(pack)
    for fold in range(folds):
        out = np.arange(len(change)) % folds == fold
        taught: IntArray = np.nonzero(~out)[0]
        model = teach(pack.of(taught), change[taught], who.ball)
        calibration = calibration_of(pictures.background, model, who, "presses of other folds")
        clean = change[taught] - model.rest
        shadow = fit_shadow(pack.of(taught), clean, model.fit.centres, model.light).in_metres(who.pitch)
        for k in np.nonzero(out)[0]:
            raw = pack.images[k].astype(np.float64) - pictures.background
            clean = change[k] - model.rest
            start = refined_centre(
                pack,
                clean,
                pack.centres[k] + model.bias,
                model.fit.colours,
                model.fit.edge,
                who.ball,
                _SETTLE,
            )
            drift = np.median((raw - change[k]).reshape(-1, 3), axis=0)
            name = pictures.names[pack.number[k]]
            yield HeldOut(name, pack.images[k], model, calibration, start, who.ball, drift, shadow)


def drawing(optics: Optics, skirt: GelSkirt) -> Drawing:
    """A drawing by the simulator: the gel's skirt, then its colours."""

    def draw(reached: FloatArray) -> FloatArray:
        seen: FloatArray = optics.render(deform(reached[None], skirt)).images[0].astype(np.float64)
        return seen

    return draw


def over_background(calibration: LitCalibration, background: ByteArray) -> LitCalibration:
    """The same colours over another picture of the untouched gel, and the skirt as before it was fitted."""
    return replace(calibration, background=background, header=replace(calibration.header, skirt=R15_SKIRT))


def fitted(press: HeldOut, draw: Drawing, skirt: GelSkirt) -> Drawn:
    """Draw a press at the pose, three numbers, that leaves least over within ``REGION``."""
    shape, pitch = (press.live.shape[0], press.live.shape[1]), press.calibration.header.pitch
    near = press.region(REGION)
    depth = depth_of(skirt, press.model.fit.edge, press.ball)
    start = np.array([*press.start, depth])

    def drawn(pose: FloatArray) -> FloatArray:
        return draw(pressed_ball(distance(shape, pose[:2]), pose[2], press.ball) * pitch)

    def left(pose: FloatArray) -> float:
        return float(np.mean((drawn(pose) - press.live)[near] ** 2))

    corners = start + np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.1 * depth]])
    found = minimize(
        left,
        start,
        method="Nelder-Mead",
        options={"initial_simplex": corners, "maxfev": _EVALUATIONS, "xatol": 0.02, "fatol": 0.05},
    )
    pose = np.asarray(found.x)
    return judged(press, drawn(pose), pose)


def judged(press: HeldOut, shown: FloatArray, pose: FloatArray) -> Drawn:
    """Score a drawing of a press."""
    image = np.clip(np.rint(shown), 0.0, 255.0).astype(np.uint8)
    apart = image.astype(np.float64) - press.live
    return Drawn(
        image,
        pose,
        decibels(apart[press.region(WITHIN)]),
        decibels(apart[press.region(REGION)]),
        decibels(apart),
        ssim(image, press.live),
    )
