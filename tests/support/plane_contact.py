"""The simplest thing to touch: a horizontal plane that pushes back like a spring."""

from collections.abc import Sequence

from mocks.ur.hooks import Six


class PlaneContact:
    """A plane under the flange's centre.

    Args:
        height: m in base.
        stiffness: N/m.
    """

    def __init__(self, height: float, stiffness: float) -> None:
        self._height = height
        self._stiffness = stiffness

    def wrench(self, base_from_flange: Sequence[Sequence[float]], time: float) -> Six:
        """``(6,)`` N and N m on the flange, in base."""
        depth = self._height - base_from_flange[2][3]
        return 0.0, 0.0, self._stiffness * max(depth, 0.0), 0.0, 0.0, 0.0
