"""The estimators that learn nothing, by their names; those that answer in points stand apart."""

from collections.abc import Callable
from types import MappingProxyType

from experiments.shape_reconstruction.estimators.average import by_average
from experiments.shape_reconstruction.estimators.hermite import by_hermite
from experiments.shape_reconstruction.estimators.plain_bodies import by_box, by_hull, by_visual_hull
from experiments.shape_reconstruction.estimators.point_answer import PointEstimate, by_raw_points
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.surface import ShapeEstimate

SURFACES: MappingProxyType[str, Callable[[ShapeEvidence], ShapeEstimate]] = MappingProxyType(
    {
        "average": by_average,
        "box": by_box,
        "hull": by_hull,
        "visual hull": by_visual_hull,
        "rbf": by_hermite,
    }
)
"""Evidence to a closed surface."""

POINTS: MappingProxyType[str, Callable[[ShapeEvidence], PointEstimate]] = MappingProxyType(
    {"points": by_raw_points}
)
"""Evidence to points without a surface; the point completion network answers so too."""
