"""Readings made from shapes of the family itself, and such shapes a little changed."""

from dataclasses import replace

import numpy as np

from experiments.shape_reconstruction.evidence import GuardedTouch, ShapeEvidence
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.distance import distances
from experiments.shape_reconstruction.family.freedom import basis_of
from experiments.shape_reconstruction.family.kind import FamilyShape
from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing, transform
from tests.support.family_shapes import drawn, surface_of
from tests.support.shape_readings import look_at, missed, shape_readings, touches_on


def made(name: str) -> tuple[FamilyShape, ShapeEvidence]:
    """A shape of a class, six touches of it and a picture."""
    shape = drawn(name)
    mesh = surface_of(shape)
    return shape, shape_readings(touches_on(mesh, 6, seed=1), look_at(mesh))


def nudged(shape: FamilyShape, by: float, seed: int = 0) -> FloatArray:
    """The vector of a shape, every free number moved at random, those of the bench by less."""
    basis = basis_of(shape.code, True, True)
    step = by * np.random.default_rng(seed).standard_normal(len(basis))
    own = basis[:, layout.POSE_SIZE :].any(axis=1)
    return np.asarray(shape.theta + np.where(own, step, 0.05 * step) @ basis)


def ended_at(name: str, gap: float) -> tuple[FamilyShape, ShapeEvidence]:
    """A shape, and ways from above and aside that ended where the housing's face is so far before it."""
    shape = drawn(name)
    mesh = surface_of(shape)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    evidence = shape_readings(touches_on(mesh, 3, seed=1), look_at(mesh))
    ways = []
    for k, axis in enumerate(([0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0])):
        ways.append(stopped(shape, evidence, np.array(axis), 0.5 * (low + high), gap, k))
    return shape, replace(evidence, touches=(*evidence.touches, *ways))


def stopped(
    shape: FamilyShape, evidence: ShapeEvidence, axis: FloatArray, aim: FloatArray, gap: float, index: int
) -> GuardedTouch:
    """A way along an axis that its housing ended, m before the shape or, below zero, within it."""
    frame = frame_facing(axis, 0.0)
    half = 0.5 * np.array(evidence.housing)
    x, y = np.meshgrid(half[0] * np.linspace(-1, 1, 69), half[1] * np.linspace(-1, 1, 61))
    face = aim + x.reshape(-1, 1) * frame[:, 0] + y.reshape(-1, 1) * frame[:, 1]
    back = 0.3  # m, from outside on
    while (off := float(distances(shape.code, shape.theta, face - back * axis).min())) > 0.05e-3:
        back -= max(0.02e-3, 0.9 * off)
    end = aim - (back + gap) * axis + evidence.gel_thickness * axis
    touch = missed(evidence.touches[0], transform(frame, end))
    return replace(touch, index=10 + index, stopped=True)
