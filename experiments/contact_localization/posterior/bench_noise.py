"""The noise of every term at a bench whose errors are stated.

The terms were fitted to runs on a bench with the usual errors. On another each is as much wider or narrower
as what makes it: the same figures to the bit where the usual errors are stated.
"""

from dataclasses import replace

import numpy as np

from experiments.contact_localization.posterior.hypotheses import Noise
from experiments.contact_localization.posterior.likelihood import GeometryNoise
from experiments.contact_localization.posterior.shared_errors import SharedNoise
from experiments.contact_localization.touch.touch import TouchNoise
from harness.bench.bench_errors import USUAL, BenchErrors


def noise_at(errors: BenchErrors) -> Noise:
    """The noise of the terms, and of what all contacts share.

    Args:
        errors: of the bench, as its station states them.
    """
    noise, place, turn = Noise(), _ratio(errors, "arm", "gel_centre"), _turn(errors)
    return replace(
        noise,
        geometry=_geometry(noise.geometry, errors, place, turn),
        unread=_geometry(noise.unread, errors, place, turn),
        touch=_touch(noise.touch, errors, place, turn),
        shared=_shared(noise.shared, errors),
        floor=noise.floor * _ratio(errors, "arm"),
    )


def _ratio(errors: BenchErrors, *names: str) -> float:
    """Of errors that add in squares, over the usual ones."""
    ours, usual = (np.linalg.norm([getattr(some, name) for name in names]) for some in (errors, USUAL))
    return float(ours / usual)


def _turn(errors: BenchErrors) -> float:
    """Of all that turns the gel against the object's surface."""
    return _ratio(errors, "yaw", "tilt", "gel_tilt", "arm_tilt")


def _geometry(noise: GeometryNoise, errors: BenchErrors, place: float, turn: float) -> GeometryNoise:
    reach = _ratio(errors, "scale", "tilt")
    return replace(
        noise,
        gap=noise.gap * place,
        gap_per_metre=noise.gap_per_metre * reach,
        angle=noise.angle * turn,
    )


def _touch(noise: TouchNoise, errors: BenchErrors, place: float, turn: float) -> TouchNoise:
    return replace(
        noise,
        rms=noise.rms * _ratio(errors, "gel_depth"),
        tilt=noise.tilt * turn,
        spin=noise.spin * _ratio(errors, "gel_yaw"),
        shift=noise.shift * place,
        depth=noise.depth * place,
    )


def _shared(noise: SharedNoise, errors: BenchErrors) -> SharedNoise:
    own = _ratio(errors, "arm")
    return replace(
        noise,
        tilt=errors.tilt,
        scale=errors.scale,
        gel_centre=errors.gel_centre,
        shift=noise.shift * own,
        depth=noise.depth * own,
        per_metre=noise.per_metre * own,
    )
