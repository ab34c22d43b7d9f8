"""What bounds an answer: contacts near its ends, what a picture looks across, and a class that fits."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from experiments.shape_reconstruction.family.estimate import beyond_contacts, not_bounded
from experiments.shape_reconstruction.thresholds import MAX_BEYOND_LAST
from harness.basics.mesh import Mesh
from tests.support.shape_readings import look_at, shape_readings, touch_at

SIDES = (0.08, 0.06, 0.05)


def box(longer: float = 0.0) -> Mesh:
    """Of ``SIDES``, ``longer`` m longer towards +x, standing on the support."""
    made = trimesh.creation.box((SIDES[0] + longer, *SIDES[1:])).subdivide_to_size(8e-3)
    return Mesh(np.asarray(made.vertices) + np.array([0.5 * longer, 0.0, 0.5 * SIDES[2]]), made.faces)


def touched(facing: str, look: SeenMask | None = None) -> ShapeEvidence:
    """Touches in the middles of the box's sides, named by axis and sign."""
    touches = []
    for index, name in enumerate(facing.split()):
        axis, sign = "xyz".index(name[1]), 1.0 if name[0] == "+" else -1.0
        normal = sign * np.eye(3)[axis]
        place = 0.5 * sign * np.array(SIDES) * np.abs(normal) + np.array([0.0, 0.0, 0.5 * SIDES[2]])
        touches.append(touch_at(box(), place, normal, index))
    return shape_readings(tuple(touches), look)


@pytest.mark.parametrize(("longer", "expected"), [(0.0, ()), (0.6, ()), (1.4, ("x",)), (8.0, ("x",))])
def test_an_answer_far_beyond_its_contacts_is_not_bounded_there(longer: float, expected: tuple[str]) -> None:
    evidence, by = touched("+x -x +y -y +z"), longer * MAX_BEYOND_LAST
    assert not_bounded(evidence, box(by), outside=False) == expected
    assert beyond_contacts(box(by).vertices, evidence)[:, 0].max() == pytest.approx(by, abs=1e-9)


def test_a_side_that_nothing_looks_towards_is_not_bounded() -> None:
    assert not_bounded(touched("+x +y -y +z"), box(), outside=False) == ("x",)
    assert not_bounded(touched("+x -x +y -y"), box(), outside=False) == ("z",)


def test_a_picture_bounds_what_it_looks_across_and_a_class_that_fits_the_rest() -> None:
    look = look_at(box())
    along = "xyz"[int(np.argmax(np.abs(look.stand_from_camera[:3, 2])))]
    few = touched("+z", look)
    assert not_bounded(few, box(), outside=False) == ()
    assert along in not_bounded(few, box(), outside=True)
    all_around = touched("+x -x +y -y +z", look)
    assert not_bounded(all_around, box(), outside=True) == ()
    assert not_bounded(replace(few, touches=()), box(), outside=False) == ()
