"""Lessons as a teacher answers them: for networks that are distilled, not shown the surface."""

from dataclasses import fields, replace

import numpy as np

from harness.authoring.vision.lessons import Lessons
from harness.authoring.vision.teacher_pictures import Answers
from harness.basics.arrays import AnyArray


def distilled(ask: Answers, lessons: Lessons) -> Lessons:
    """Lessons with the teacher's colours and depths in place of the surface's.

    Args:
        ask: the teacher, told what the lessons tell.
        lessons: with lamps of their own.
    """
    extras = np.hstack([lessons.seen, lessons.normals]) if lessons.seen.shape[1] else lessons.seen
    density, colours = ask(lessons.points, lessons.views, lessons.lamps, extras)
    return replace(lessons, colours=colours, depth=np.clip(density, -1.0, 1.0))


def with_lamps(lessons: Lessons, lamps: AnyArray, each: int, hidden: float, seed: int) -> Lessons:
    """Each place so many times, with a lamp of its own on its side that is said to be seen, or a hidden one.

    As ``vision_batch`` draws them at every step where nobody is asked for the light; colours are left.

    Args:
        lessons: without lamps.
        lamps: ``(m, 3)`` float32 unit, to draw from.
        each: lamps of a place.
        hidden: share of lamps that are said to be hidden.
        seed: of what is drawn.
    """
    random, count = np.random.default_rng([seed, 80]), each * len(lessons)
    at = np.repeat(np.arange(len(lessons)), each)
    repeated = {field.name: getattr(lessons, field.name)[at] for field in fields(Lessons)}
    drawn, seen = lamps[random.integers(len(lamps), size=count)], random.random(count) >= hidden
    away = np.einsum("nx,nx->n", drawn, repeated["normals"]) < 0.0
    turned = np.where((seen & away)[:, None], -drawn, drawn)
    return Lessons(**repeated | {"lamps": turned, "seen": seen[:, None].astype(np.float32)})
