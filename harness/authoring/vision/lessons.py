"""What tiny networks learn from: places along views, and lamps.

A network that is told whether the lamp is seen needs no ray towards it: under any lamp on its side a matt
surface shines albedo times cosine, and nothing where the lamp is hidden. So its places are drawn once and
lit anew at every step. One that is not told gets places with lamps of their own, each by a ray.

Each place is moved along the view that sees it, before and behind the surface, as samples of a ray are:
there the networks must answer with the same colour, and with a density that the ray stops at.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from harness.authoring.vision.data import FACING, LEAST_YIELD, HeldOutViews
from harness.authoring.vision.places import sphere, surface_places, uniform_about
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import OutOfDomain
from harness.objectfile.vision_tensors import Kind
from harness.sim.light.direct_image import LitObject
from harness.sim.light.lambert import Places, cosines, places_seen, radiance
from harness.sim.solid.mesh_repair import is_watertight

AHEAD = 0.25
"""Voxels before the surface at which the density begins, along the normal: what networks err by."""

OPAQUE = 40.0
"""Optical thickness of a voxel as deep behind the surface as a voxel is wide."""

_LAMPS = 1 << 14
"""That are drawn from, for networks that are told visibility."""

_LAMPS_OF_A_PLACE = 4
"""Of networks that are not: a ray for each."""

_CHUNK = 1 << 16

_NEAR, _BEHIND, _BEFORE = 0.75, 0.5, 4.0
"""Voxels along a view: before and behind the surface whose colours count, and farthest before it."""

_SHALLOW = 1.8
"""Voxels along the normal: farther before the surface the shell has no voxel."""


@dataclass(frozen=True, eq=False)
class Lessons:
    """Places that are asked, n of each."""

    points: FloatArray  #: ``(n, 3)`` m, object frame: beside the surface.
    normals: AnyArray  #: ``(n, 3)`` float32 unit, of the surface there, on the side that is seen.
    colours: AnyArray  #: ``(n, 3)`` float32, linear: albedo; what leaves it where it has a lamp of its own.
    depth: AnyArray
    """``(n,)`` float32, voxels behind where the density begins, -1 to 1: below zero is empty."""
    weight: AnyArray  #: ``(n,)`` float32, of the colour; 0 where no ray takes it from.
    views: AnyArray  #: ``(n, 3)`` float32 unit, from the camera.
    lamps: AnyArray  #: ``(n, 3)`` float32 unit, towards a lamp of its own; ``(n, 0)`` without.
    seen: AnyArray
    """``(n, 1)`` float32, 1 where that lamp is said to be seen; ``(n, 0)`` where nothing is said."""

    def __len__(self) -> int:
        return len(self.points)


def draw_for(
    kind: Kind, lit: LitObject, count: int, voxel: float, seed: int, held_out: HeldOutViews
) -> tuple[Lessons, AnyArray]:
    """Lessons of so many places for networks of a kind, and the ``(m, 3)`` lamps that they are lit by anew.

    A kind that is told no visibility has lamps with its lessons, and none besides; see ``draw_lessons`` and
    ``draw_lamps`` for the rest.
    """
    told = kind == "osf-v"
    lessons = draw_lessons(lit, count, voxel, seed, held_out, 0 if told else _LAMPS_OF_A_PLACE)
    return lessons, draw_lamps(_LAMPS if told else 0, seed, held_out)


def draw_lessons(
    lit: LitObject, count: int, voxel: float, seed: int, held_out: HeldOutViews, lamps: int = 0
) -> Lessons:
    """So many places, as dense as pixels of pictures from everywhere far away.

    Args:
        lit: the object.
        count: one or more.
        voxel: m, of the shell.
        seed: of all that is drawn.
        held_out: no place is drawn as one of its cameras sees it, and no lamp near one of its lights.
        lamps: of its own that each place is asked with, one after the other; 0 for albedo in their stead.

    Raises:
        OutOfDomain: next to nothing of the surface can be seen from outside, clear of what is kept back.
    """
    random, mesh = np.random.default_rng([seed, 74]), lit.appearance.mesh
    # A surface is closed where it has no border, seams of textures aside.
    _, place_of = np.unique(mesh.vertices, axis=0, return_inverse=True)
    corners = place_of.reshape(-1)[mesh.faces]
    whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    both, drawn = not is_watertight(corners[whole]), 0
    parts: list[Lessons] = []
    while drawn < count or not parts:
        part = _chunk(lit, voxel, random, held_out, both, lamps)
        if len(part) < LEAST_YIELD * _CHUNK:
            raise OutOfDomain(
                f"{len(part)} of {_CHUNK} places drawn can be seen from outside and are clear of what is "
                "kept back; turn the mesh inside out, or keep back less"
            )
        parts.append(part)
        drawn += len(part)
    names = [field.name for field in fields(Lessons)]
    return Lessons(*(np.concatenate([part.__dict__[name] for part in parts])[:count] for name in names))


def draw_lamps(count: int, seed: int, held_out: HeldOutViews) -> AnyArray:
    """``(count, 3)`` float32 unit directions: neither one of them nor its opposite is near one kept back.

    Raises:
        OutOfDomain: what is kept back leaves no room.
    """
    random, found = np.random.default_rng([seed, 75]), np.empty((0, 3))
    for _ in range(1000):
        if len(found) >= count:
            return found[:count].astype(np.float32)
        drawn = sphere(count, random)
        clear = held_out.clear_of_lights(drawn) & held_out.clear_of_lights(-drawn)
        found = np.concatenate([found, drawn[clear]])
    raise OutOfDomain(
        f"{len(found)} of {count} lamps are clear of {len(held_out.lights)} kept back by "
        f"{np.degrees(held_out.apart):g} deg; keep back fewer, or a smaller angle"
    )


def _chunk(
    lit: LitObject, voxel: float, random: np.random.Generator, held_out: HeldOutViews, both: bool, lamps: int
) -> Lessons:
    mesh = lit.appearance.mesh
    faces, weights = surface_places(mesh, _CHUNK, random)
    side = np.where(random.random(_CHUNK) < 0.5, -1.0, 1.0) if both else np.ones(_CHUNK)
    normals = side[:, None] * mesh.face_normals[faces]
    # A unit normal plus a place on the unit ball is a direction sampled with the cosine as density.
    total = normals + (1.0 - 1e-6) * sphere(len(normals), random)
    views = -(total / np.linalg.norm(total, axis=1, keepdims=True))
    corners = mesh.corners[faces]
    points = corners[:, 0] + np.einsum("nk,nkx->nx", weights, corners[:, 1:] - corners[:, :1])
    # Which kind of place along the view, and where of its kind, 0 to 1.
    offsets = random.random((_CHUNK, 2))
    clear = np.flatnonzero(held_out.clear_of_views(points, views))
    seen = clear[lit.rays.free(points[clear], -views[clear], faces[clear])] if len(clear) else clear
    places = places_seen(lit.appearance, faces[seen], weights[seen], views[seen])
    slope = np.maximum(-np.einsum("nx,nx->n", views[seen], places.flat), 1e-3)
    # Voxels behind the surface along the view, and how much the colour there counts: most are where rays
    # take their colour from, some before it, some behind.
    kind, share = offsets[seen].T
    near = -_NEAR + (_NEAR + _BEHIND) * share
    before = -np.minimum(_SHALLOW * share / slope, _BEFORE)
    along = np.where(kind < 0.65, near, np.where(kind < 0.85, before, _BEHIND + 0.5 * share))
    weight = np.where(along < -_NEAR, 0.0, np.where(along <= _BEHIND, 1.0, 0.3))
    lessons = Lessons(
        places.points + (along * voxel)[:, None] * views[seen],
        places.normals.astype(np.float32),
        places.albedo.astype(np.float32),
        np.clip(AHEAD + along * slope, -1.0, 1.0).astype(np.float32),
        weight.astype(np.float32),
        views[seen].astype(np.float32),
        *(np.empty((len(seen), 0), np.float32) for _ in range(2)),
    )
    return _lit(lit, places, lessons, random, held_out, lamps) if lamps else lessons


def _lit(
    lit: LitObject,
    places: Places,
    lessons: Lessons,
    random: np.random.Generator,
    held_out: HeldOutViews,
    lamps: int,
) -> Lessons:
    """Each place so many times, under a lamp of its own each time; those near one kept back are left out."""
    at = np.repeat(np.arange(len(places)), lamps)
    ways = np.where(
        random.random((len(at), 1)) < FACING, uniform_about(places.flat[at], random), sphere(len(at), random)
    )
    kept = held_out.clear_of_lights(ways)
    at, ways = at[kept], ways[kept]
    again = Places(*(getattr(places, field.name)[at] for field in fields(Places)))
    cosine = cosines(again, ways, lit.appearance.mesh.diagonal)
    faced = np.flatnonzero(cosine > 0.0)
    free = lit.rays.free(again.lifted[faced], ways[faced], again.faces[faced]) if len(faced) else faced > 0
    cosine[faced[~free]] = 0.0
    colours = radiance(again, np.pi * cosine).astype(np.float32)
    repeated = {field.name: getattr(lessons, field.name)[at] for field in fields(Lessons)}
    return replace(Lessons(**repeated), colours=colours, lamps=ways.astype(np.float32))
