"""Rays of a picture, a few samples each at a time, until none of them goes on."""

import time
from dataclasses import dataclass, field

import numpy as np

from harness.arrays import AnyArray, FloatArray
from harness.objectfile.vision_blocks import composite, sort_samples
from harness.objectfile.vision_march import march, take_surface
from harness.objectfile.vision_network import VisionModel
from harness.objectfile.vision_samples import Asker, Samples, Scene
from harness.objectfile.vision_settings import RenderSettings
from harness.objectfile.vision_shell import Shell
from harness.objectfile.vision_work import Crew, Room

_LEAST = 256
"""Rays that another thread is asked to follow: fewer are followed sooner than it wakes."""


class Watch:
    """Seconds of parts that follow each other."""

    def __init__(self) -> None:
        self.begun = self._last = time.perf_counter()
        self.seconds: dict[str, float] = {}

    def lap(self, part: str) -> None:
        """What passed since the last lap belongs to ``part``."""
        now = time.perf_counter()
        self.seconds[part] = self.seconds.get(part, 0.0) + now - self._last
        self._last = now


@dataclass(frozen=True, eq=False)
class Volume:
    """What is marched through.

    Attributes:
        model: of the object.
        shell: where its networks are asked.
        per_cell: voxels along a cell.
    """

    model: VisionModel
    shell: Shell
    per_cell: int


@dataclass(frozen=True, eq=False)
class Rays:
    """Of a picture; the last three are filled in as they are followed.

    Attributes:
        eye: ``(3,)`` m, where all begin, object frame.
        ways: ``(r, 3)`` unit.
        surface: ``(r,)`` m along each where the mesh is; inf where that is not known.
        scene: what the networks are told.
        resume: ``(r,)`` m, from where each goes on; inf for nowhere.
        optical: ``(r,)`` density times length so far.
        sums: ``(r, 5)`` red, green, blue, opacity, opacity times m along the ray.
    """

    eye: FloatArray
    ways: FloatArray
    surface: FloatArray
    scene: Scene
    resume: FloatArray
    optical: FloatArray = field(init=False)
    sums: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "optical", np.zeros(len(self.ways)))
        object.__setattr__(self, "sums", np.zeros((len(self.ways), 5)))


class Follower:
    """Follows the rays of one picture after another.

    Args:
        volume: that they go through.
        crew: shares the work.
        room: that arrays are taken from.
    """

    def __init__(self, volume: Volume, crew: Crew, room: Room) -> None:
        self._volume, self._crew, self._room = volume, crew, room

    def follow(self, rays: Rays, asker: Asker, chosen: RenderSettings, watch: Watch) -> int:
        """Fill in what rays see; the number of samples that were asked for is returned."""
        going, total, is_first = np.arange(len(rays.ways), dtype=np.int32), 0, True
        while len(going):
            samples = Samples.room_for(going, chosen.wave if chosen.marches else 1, self._room)
            self._take(rays, samples, chosen, is_first)
            watch.lap("march")
            order, blocks = self._sorted(samples, asker.block)
            watch.lap("sort")
            asker(samples, order, blocks, rays.scene, self._crew)
            watch.lap("networks")
            self._composite(rays, samples, chosen)
            total, is_first = total + len(order), False
            going = going[np.isfinite(rays.resume[going])]
            watch.lap("composite")
        return total

    def _take(self, rays: Rays, samples: Samples, chosen: RenderSettings, is_first: bool) -> None:
        shell, grid, most = self._volume.shell, self._volume.model.grid, samples.most
        eye, per_cell = (rays.eye - shell.low) / shell.voxel, self._volume.per_cell
        # The first stretch is the nearest wall, mostly; what is behind it is asked for if light is left.
        stretches, step = 1 if is_first else most, chosen.step * shell.voxel

        def work(first: int, last: int) -> None:
            at, going = slice(first * most, last * most), samples.rays[first:last]
            counts, networks, local = samples.counts[first:last], samples.networks[at], samples.local[at]
            lengths, places, table, cells = samples.lengths[at], samples.places[at], grid.table, grid.cells
            if chosen.marches:
                march(
                    *(going, rays.ways, eye, shell.voxel, per_cell, shell.near, table, cells, step, most),
                    *(stretches, rays.resume, counts, networks, local, lengths, places),
                )
            else:
                take_surface(
                    *(going, rays.ways, eye, shell.voxel, per_cell, table, cells, rays.surface),
                    *(counts, networks, local, lengths, places),
                )
                rays.resume[going] = np.inf

        self._crew.share(work, len(samples.rays), 4 * self._crew.threads, _LEAST)

    def _sorted(self, samples: Samples, block: int) -> tuple[AnyArray, AnyArray]:
        every, room = len(self._volume.model.grid), self._room
        order = room.take("order", (len(samples.networks),), np.int32)
        blocks = room.take("blocks", (len(samples.networks) // block + every + 1, 3), np.int32)
        total, made = sort_samples(
            samples.counts, samples.most, samples.networks, every, block, order, blocks
        )
        return order[:total], blocks[:made]

    def _composite(self, rays: Rays, samples: Samples, chosen: RenderSettings) -> None:
        most, scale = samples.most, self._volume.model.weights.density_scale

        def work(first: int, last: int) -> None:
            at = slice(first * most, last * most)
            going, counts, networks = samples.rays[first:last], samples.counts[first:last], samples.networks
            composite(
                going,
                counts,
                most,
                networks[at],
                samples.density[at],
                samples.scattered[at],
                samples.lengths[at],
                samples.places[at],
                scale,
                chosen.termination,
                rays.resume,
                rays.optical,
                rays.sums,
            )

        self._crew.share(work, len(samples.rays), 2 * self._crew.threads, 4 * _LEAST)
