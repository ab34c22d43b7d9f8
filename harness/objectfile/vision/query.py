"""What the graph of the networks takes of blocks of samples, and where its answers go."""

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.compiled import compiled


@compiled
def fill_asked(
    blocks: AnyArray,
    order: AnyArray,
    local: AnyArray,
    rays: AnyArray,
    most: int,
    low: FloatArray,
    cell: float,
    cells: AnyArray,
    views: AnyArray,
    extras: AnyArray,
    network: AnyArray,
    points: FloatArray,
    seen: AnyArray,
    told: AnyArray,
) -> None:
    """What blocks ask; one that is not full asks for its last sample again, so that all there is is asked.

    Args:
        blocks: ``(m, 3)``: network, first place in ``order``, samples.
        order: of samples, so that those of a block are next to each other.
        local: ``(n, 3)`` float32, -1 to 1 in each sample's cell.
        rays: of each ``most`` samples.
        most: places for samples of a ray.
        low: ``(3,)`` m, of the grid.
        cell: m.
        cells: ``(networks, 3)``.
        views: ``(r, 3)`` float32, of each ray.
        extras: ``(r, 0)`` or ``(r, 4)`` float32.
        network: ``(m, 1)`` int64, written.
        points: ``(m, b, 3)`` m, written.
        seen: ``(m, b, 3)`` float32, written: views.
        told: ``(m, b, 0)`` or ``(m, b, 4)`` float32, written: extras.
    """
    for m in range(len(blocks)):
        network[m, 0] = blocks[m, 0]
        for lane in range(points.shape[1]):
            sample = order[blocks[m, 1] + min(lane, blocks[m, 2] - 1)]
            ray = rays[sample // most]
            for axis in range(3):
                share = 0.5 * (local[sample, axis] + 1.0)
                points[m, lane, axis] = low[axis] + cell * (cells[blocks[m, 0], axis] + share)
                seen[m, lane, axis] = views[ray, axis]
            for each in range(extras.shape[1]):
                told[m, lane, each] = extras[ray, each]


@compiled
def take_answers(
    blocks: AnyArray,
    order: AnyArray,
    found: AnyArray,
    shone: AnyArray,
    scale: float,
    density: AnyArray,
    scattered: AnyArray,
) -> None:
    """Where the graph's answers go.

    Args:
        blocks: as in ``fill_asked``, and so is ``order``.
        order: of samples.
        found: ``(m, b, 1)`` 1/m.
        shone: ``(m, b, 3)``.
        scale: 1/m, that a density of 1 stands for.
        density: ``(n,)`` float32, written.
        scattered: ``(n, 3)`` float32, written.
    """
    for m in range(len(blocks)):
        for lane in range(blocks[m, 2]):
            sample = order[blocks[m, 1] + lane]
            density[sample] = found[m, lane, 0] / scale
            for c in range(3):
                scattered[sample, c] = shone[m, lane, c]
