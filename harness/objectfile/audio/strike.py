"""What a strike at a place of an object sounds like."""

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from harness.basics.arrays import BoolArray, FloatArray, read_only
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.basics.mesh import Mesh
from harness.objectfile.audio.audio import CHUNK, ObjectAudio
from harness.objectfile.audio.blow import HammerBlow
from harness.objectfile.surface_search import SurfaceSearch, checked_points
from harness.sim.sound.contact_pulse import struck
from harness.sim.sound.modal_sound import audible, check_rate
from harness.sim.sound.synthesis import SynthesisLevel, synthesize

MOST_SAMPLES = 2**27
"""Of one sound: 50 minutes at 44.1 kHz, a gigabyte while it is computed."""

MOST_TOUCHING = 2**16
"""Samples while a pulse lasts: each is an integral for every mode."""

_CREASE = 0.8
"""Cosine between the normals of a face and of its corner, below which there is an edge."""


@dataclass(frozen=True, eq=False)
class Place:
    """A place of a surface."""

    point: FloatArray  #: ``(3,)`` m, in the object's frame, on the surface.
    normal: FloatArray  #: ``(3,)`` of unit length, outward.
    moved: float = 0.0  #: m, from where it was asked for.
    vertex: int | None = None  #: of the mesh, where it was asked for by its number.


@dataclass(frozen=True, eq=False)
class StruckSound:
    """A sound and what it is made of."""

    sound: FloatArray  #: ``(t,)`` of the surface's modes: kg^(1/2) m/s; Pa where ``loudness`` was given.
    rate: float  #: samples per second.
    gains: FloatArray  #: ``(m,)`` 1/sqrt(kg), of each mode along the force.
    amplitudes: FloatArray  #: ``(m,)`` in the sound's unit, of each mode from the blow on.
    left_out: BoolArray  #: ``(m,)`` modes at or above half of the rate.
    error: float  #: dB against the sound's own peak: of the sum, see ``Synthesis.error``.
    seconds: Mapping[str, float]  #: s on the clock: ``"gains"``, ``"synthesis"``.

    @property
    def peak(self) -> float:
        """The loudest sample of either sign."""
        return max(float(self.sound.max()), -float(self.sound.min()))


def place_near(surface: SurfaceSearch, point: ArrayLike, most: float) -> Place:
    """Find the point of a surface nearest to a ``(3,)`` point, at a distance of at most ``most`` m.

    Its normal is that of its face.

    Raises:
        WrongUse: the point is not three finite numbers.
        OutOfDomain: the surface is farther; the message states distance and limit.
    """
    asked = checked_points(np.array(point, dtype=np.float64)[None])
    low, high = surface.mesh.bounds
    outside = float(np.maximum(low - asked[0], asked[0] - high).max())
    size = float(np.linalg.norm(high - low))
    # What lies far out of the box is not searched for: its squares may overflow.
    if outside > size + most:
        raise _too_far(f"{outside * 1e3:.3g} mm or more", most, "move it onto the surface")
    places, faces = surface.nearest(asked, 2.0 * (size + most))
    moved = float(np.linalg.norm(places[0] - asked[0]))
    if moved > most:
        x, y, z = np.round(places[0], 6) + 0.0  # no -0
        raise _too_far(f"{moved * 1e3:.3g} mm", most, f"say the nearest place, {x:g} {y:g} {z:g}")
    return Place(read_only(places[0]), surface.mesh.face_normals[faces[0]], moved)


def _too_far(gap: str, most: float, instead: str) -> OutOfDomain:
    return OutOfDomain(
        f"the place to strike is {gap} off the surface; the limit is {most * 1e3:.3g} mm. Is it in metres "
        f"and in the mesh's frame? Else {instead}"
    )


def place_of_vertex(mesh: Mesh, vertex: int) -> Place:
    """A vertex of a mesh, counted from 0; its normal is the mean of its faces' by area.

    Raises:
        OutOfDomain: there is no vertex of that number, or none of its faces has an area.
    """
    count = len(mesh.vertices)
    if not 0 <= vertex < count:
        raise OutOfDomain(f"there is no vertex {vertex}; the mesh has {count}, say 0 to {count - 1}")
    normal = mesh.vertex_normals[vertex]
    if not normal.any():
        raise OutOfDomain(f"vertex {vertex} is of no face that has an area; say another, or a place")
    return Place(mesh.vertices[vertex], normal, vertex=vertex)


def strike(
    audio: ObjectAudio,
    place: Place,
    blow: HammerBlow,
    duration: float,
    rate: float,
    loudness: FloatArray | None = None,
    level: SynthesisLevel = "fast",
) -> StruckSound:
    """The sound of a blow.

    ``S(t) = sum_i g_i (F * h_i)(t)`` with ``h_i`` the answer of each mode to an impulse
    (``harness.sim.sound.synthesis``), ``g_i`` its shape at the place along the force.

    Args:
        audio: the object's sound, at a level.
        place: on its surface.
        blow: that strikes there; its first touch is at the first sample.
        duration: s.
        rate: samples per second; modes at or above half of it are left out and named.
        loudness: ``(m,)`` factor of each mode, as ``modal_sound.radiation`` gives it; None for the modes
            themselves.
        level: of the sum.

    Raises:
        WrongUse: a duration or a rate that makes no sound, or so many samples that none should be
            made; a blow to which no mode below half of the rate answers.
        OutOfDomain: a place off the surface.
        DataRefused: gains that are not finite, or a sound too loud or too faint for its numbers.
    """
    _check_length(duration, rate, blow)
    begun = time.perf_counter()
    gains: FloatArray = audio.at(place.point[None])[0] @ blow.direction
    found = time.perf_counter() - begun
    heard = gains if loudness is None else gains * loudness
    _require_heard(audio.frequencies, heard, rate)
    modes = audio.frequencies, audio.dampings
    if blow.pulse is None:
        made = synthesize(*modes, blow.impulse * heard[None], duration, rate, level)
    else:
        made = struck(*modes, heard[None], blow.pulse, duration, rate, level)
    sound = made.sound[0]
    if not (np.isfinite(sound).all() and sound.any()):
        raise DataRefused(
            "the sound's numbers leave double precision; the modes or the force are out of all proportion: "
            "run `touchstone object verify`"
        )
    return StruckSound(
        sound=sound,
        rate=rate,
        gains=read_only(gains),
        amplitudes=read_only(heard * blow.given_to(audio.frequencies)),
        left_out=made.left_out,
        error=made.error,
        seconds={"gains": found, "synthesis": made.seconds},
    )


def pushes(audio: ObjectAudio, mesh: Mesh, count: int) -> FloatArray:
    """Compute gains of the lowest modes for a unit push into the surface, at the corners of each face.

    Returns:
        ``(f, 3, k)`` 1/sqrt(kg).
    """
    lowest = [
        audio.at(mesh.vertices[first : first + CHUNK])[:, :count]
        for first in range(0, len(mesh.vertices), CHUNK)
    ]
    # Normals of the vertices where a face is part of a bend, the face's own next to an edge.
    at_vertices, own = mesh.vertex_normals[mesh.faces], mesh.face_normals[:, None]
    bent = np.einsum("fcd,fcd->fc", at_vertices, np.broadcast_to(own, at_vertices.shape)) > _CREASE
    normals = np.where(bent[..., None], at_vertices, own)
    return np.asarray(-np.einsum("fckd,fcd->fck", np.concatenate(lowest)[mesh.faces], normals))


def _check_length(duration: float, rate: float, blow: HammerBlow) -> None:
    check_rate(rate)
    if not (np.isfinite(duration) and duration > 0.0):
        raise WrongUse(f"a sound of {duration:g} s is none; say a length above 0 s")
    if duration * rate > MOST_SAMPLES:
        raise WrongUse(
            f"{duration:g} s at {rate:g} Hz are more than {MOST_SAMPLES} samples; say at most "
            f"{MOST_SAMPLES / rate:.4g} s, or a lower rate"
        )
    if blow.pulse is not None and blow.pulse.duration * rate > MOST_TOUCHING:
        raise WrongUse(
            f"a contact of {blow.pulse.duration:g} s has more than {MOST_TOUCHING} samples at {rate:g} Hz; "
            "say a shorter one, or a lower rate"
        )


def _require_heard(frequencies: FloatArray, amplitudes: FloatArray, rate: float) -> None:
    heard = audible(frequencies, rate)
    if not heard.any():
        raise WrongUse(
            f"the lowest mode, of {frequencies[0]:.5g} Hz, is not below half of {rate:g} samples per second, "
            f"so nothing is heard; say a rate above {2.0 * frequencies[0]:.5g}"
        )
    if not amplitudes[heard].any():
        raise WrongUse(
            "no mode moves along that force at that place, so nothing is heard; strike another place, or "
            "along another direction"
        )
