"""What the card of a network says."""

from collections.abc import Mapping

from harness.basics.errors import DataRefused


def held_out_error(card: Mapping[str, object]) -> float:
    """M, mean Chamfer-L1 from points to points on shapes that the network was not fitted to.

    Raises:
        DataRefused: the card does not say it.
    """
    held = card.get("held_out")
    error = held.get("mean_chamfer_points_m") if isinstance(held, Mapping) else None
    if not isinstance(error, float):
        raise DataRefused(
            'the network\'s card has no "held_out" with "mean_chamfer_points_m" in metres; train it again'
        )
    return error
