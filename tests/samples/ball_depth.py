"""Recovered height maps of ball presses held against the ball."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from calibration.taxim.gates import CONTACT, check_set, refusals, sightings
from calibration.taxim.held_out import colour_misfit, held_out, teach
from calibration.taxim.mark_free import Identity, calibration_of
from calibration.taxim.pictures import Pictures, PressPack
from calibration.taxim.smooth_fit import changes
from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.sim.optics.depth_reading import HeightErrors
from harness.sim.optics.tactile_calibration import TactileCalibration

R15 = Identity("GelSight R1.5", "ObjectFolder 2.0", "CC BY 4.0", "2026-01-01", 0.1245e-3, 2.0e-3)
FOTS = Identity("GelSight", "FOTS", "MIT", "2026-01-01", 1e-3 / 19.58, 2.35e-3)

WITHIN = 0.95
"""Of the contact's radius: as held-out presses are scored in colour."""

_TURNS = 3


@dataclass(frozen=True, eq=False)
class BallFit:
    """A sphere of known radius laid under a recovered height map; metres and pixels."""

    centre: FloatArray  #: ``(2,)`` pixels (column, row), fitted.
    top: float  #: metres, height of the sphere's top, fitted.
    inside: BoolArray  #: ``(rows, columns)`` the pixels that were compared.
    sphere: FloatArray  #: ``(rows, columns)`` metres, the sphere, its lower half left out as flat.
    rmse: float  #: metres, recovered less sphere.
    flat: float  #: metres, the same of the plane that fits the sphere best.

    def fitted(self, ball: float) -> FloatArray:
        """``(n, 3)`` by how much offset and centre change the sphere inside; ``ball`` in pixels."""
        row, column = np.nonzero(self.inside)
        right, down = column - self.centre[0], row - self.centre[1]
        drop = np.sqrt(ball**2 - right**2 - down**2)
        return np.column_stack([np.ones_like(drop), right / drop, down / drop])


def fit_ball(height: FloatArray, near: FloatArray, contact: float, pitch: float, ball: float) -> BallFit:
    """Fit centre and offset of a ball, nothing else.

    Args:
        height: ``(rows, columns)`` metres.
        near: ``(2,)`` pixels (column, row) where the contact is about.
        contact: pixels, radius of what is compared.
        pitch: metres a pixel.
        ball: metres, its radius.
    """
    y, x = np.mgrid[: height.shape[0], : height.shape[1]].astype(np.float64)
    found = np.array([near[0], near[1], float(height.max()) * 1e3])

    def sphere(at: FloatArray) -> FloatArray:
        away = ((x - at[0]) ** 2 + (y - at[1]) ** 2) * pitch**2
        return np.asarray(np.sqrt(np.maximum(ball**2 - away, 0.0)) - ball + at[2] * 1e-3)

    for _ in range(_TURNS):
        inside = np.hypot(x - found[0], y - found[1]) <= contact

        def apart(at: FloatArray, inside: BoolArray = inside) -> FloatArray:
            return np.asarray(1e3 * (height - sphere(at))[inside])

        found = np.asarray(least_squares(apart, found).x)
    truth = sphere(found)[inside]
    plane = np.column_stack([x[inside], y[inside], np.ones(int(inside.sum()))])
    level = plane @ np.linalg.lstsq(plane, truth, rcond=None)[0]
    return BallFit(
        found[:2],
        float(found[2]) * 1e-3,
        inside,
        sphere(found),
        float(np.sqrt(np.mean((height[inside] - truth) ** 2))),
        float(np.sqrt(np.mean((level - truth) ** 2))),
    )


@dataclass(frozen=True, eq=False)
class Taught:
    """A calibration and what held-out presses need of its presses."""

    calibration: TactileCalibration  #: the artefact.
    bias: FloatArray  #: ``(2,)`` pixels from where the detector finds a centre to where the fit does.
    contact: float  #: pixels, radius of the contact line.


def usable(pictures: Pictures, ball: float) -> PressPack:
    """The presses that no gate refuses, with their circles as detected; ``ball`` in pixels."""
    seen = sightings(pictures, ball)
    verdicts = refusals(pictures, seen, ball)
    check_set(pictures, verdicts, seen, ball)
    kept = np.array([k for k, verdict in enumerate(verdicts) if verdict is None])
    return PressPack(
        pictures.background,
        read_only(pictures.images[kept]),
        read_only(np.array([seen[k].found.centre for k in kept])),
        read_only(np.full(len(kept), CONTACT * ball)),
        read_only(kept),
        pictures.sha256,
    )


def taught(
    pack: PressPack, change: FloatArray | None, which: IntArray, who: Identity, misfit: bool = False
) -> Taught:
    """Calibrate from some of the presses, as ``calibration.taxim.mark_free`` does from all.

    Args:
        pack: the presses.
        change: of all of them; None where it is not known yet.
        which: of them the calibration is made of.
        who: names, pitch and ball.
        misfit: whether the calibration states what folds of these presses show of its misfit.
    """
    change = changes(pack) if change is None else change
    model = teach(pack.of(which), change[which], who.ball)
    made_from = f"sha256 {pack.sha256}, {len(which)} presses"
    calibration: TactileCalibration = calibration_of(pack.background, model, who, made_from)
    if misfit:
        radius = WITHIN * model.fit.edge
        out = held_out(pack.of(which), change[which], who.ball, radius)
        found = colour_misfit(pack.of(which), change[which], out, who.ball, radius)
        calibration = replace(calibration, header=replace(calibration.header, misfit=found))
    return Taught(calibration, model.bias, model.fit.edge)


def sigma_without(errors: HeightErrors, terms: FloatArray, inside: BoolArray) -> FloatArray:
    """``(n,)`` metres of one deviation where some of the error has been fitted away, as by a known shape.

    Args:
        errors: of a height map.
        terms: ``(n, terms)`` what was fitted at the pixels of ``inside``: ones for an offset, say.
        inside: ``(rows, columns)``.
    """
    basis = np.linalg.qr(terms)[0]
    there = errors.draws[:, inside]
    left = there - (there @ basis) @ basis.T
    return np.asarray(np.hypot(np.sqrt(np.mean(left**2, axis=0)), errors.floor))
