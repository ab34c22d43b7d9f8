"""What graphs of completion take and give, in words that a file is held against."""

from harness.objectfile.entries import Domain, Input, Tensor

GREATEST = 30.0
"""Of any number of a touched place: beyond it nothing was learnt."""


def touched_or_seen(name: str, shape: tuple[int, ...]) -> Input:
    """An input of ``(n, *shape)`` numbers: ``"touched"`` places, or the ``"window"`` of a silhouette."""
    meaning, low, high = {
        "touched": ("touched places over how far they reach", -GREATEST, GREATEST),
        "window": ("the silhouette", 0.0, 1.0),
    }[name]
    return Input(
        name=name,
        dtype="float32",
        shape=("n", *shape),
        unit="1",
        meaning=meaning,
        domain=Domain(low=(low,), high=(high,)),
        normaliser="in the graph",
    )


def completed_places(count: int) -> Tensor:
    """The output: so many places all over the object."""
    return Tensor(
        name="completed",
        dtype="float32",
        shape=("n", count, 3),
        unit="1",
        meaning="places all over the object in the same frame",
    )
