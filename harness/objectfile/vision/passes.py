"""Rays of a picture, a few samples each at a time, until none of them goes on."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.vision.coverage.blocks import composite, sort_samples
from harness.objectfile.vision.march import march, take_surface
from harness.objectfile.vision.network.network import VisionModel
from harness.objectfile.vision.samples import Asker, Samples, Scene
from harness.objectfile.vision.settings import RenderSettings
from harness.objectfile.vision.shell import Shell
from harness.objectfile.vision.threads import Crew, Workspace

_LEAST = 256
"""Rays that another thread is asked to follow: fewer are followed sooner than it wakes."""

_BANDS = 2
"""Of a picture of many rays, for each thread: who is done sooner takes another."""

_MANY = 16_384
"""Rays: of fewer, more bands would leave too few samples to a network."""


_FEW = 64
"""Rays of a band that take more samples at once: to go around once more costs more than some for nothing."""

_LAST = 4
"""Waves that they take at once."""

Aim = Callable[[int, int, Workspace], None]
"""Fills in the rays from one to before another, with a room that arrays may be taken from."""


class PassTimes:
    """Seconds of parts that follow each other."""

    def __init__(self) -> None:
        self.begun = self._last = time.perf_counter()
        self.seconds: dict[str, float] = {}

    def restart(self) -> None:
        """Nothing has passed yet."""
        self._last = time.perf_counter()

    def split(self, part: str, shares: Sequence[Mapping[str, float]]) -> None:
        """Tell a part's seconds as finer ones, in proportion to what threads took for them side by side."""
        whole, sums = self.seconds.pop(part), dict[str, float]()
        for share in shares:
            for name, seconds in share.items():
                sums[name] = sums.get(name, 0.0) + seconds
        every = max(sum(sums.values()), 1e-12)
        for name, seconds in sums.items():
            self.seconds[name] = self.seconds.get(name, 0.0) + whole * seconds / every

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
    optical: FloatArray
    sums: FloatArray

    @classmethod
    def begun(
        cls, eye: FloatArray, ways: FloatArray, surface: FloatArray, scene: Scene, resume: FloatArray
    ) -> "Rays":
        """Rays that have met nothing so far."""
        return cls(eye, ways, surface, scene, resume, np.zeros(len(ways)), np.zeros((len(ways), 5)))

    def part(self, first: int, last: int) -> "Rays":
        """Some of them, of the same arrays."""
        at, scene = slice(first, last), self.scene
        return Rays(
            *(self.eye, self.ways[at], self.surface[at]),
            Scene(scene.views[at], scene.extras[at], scene.light),
            *(self.resume[at], self.optical[at], self.sums[at]),
        )


class Follower:
    """Follows the rays of one picture after another.

    Every thread follows its own band of the picture from its first sample to its last: what it computes
    stays in its own cache, and nobody waits for another before the end.

    Args:
        volume: that they go through.
        crew: shares the bands.
    """

    def __init__(self, volume: Volume, crew: Crew) -> None:
        self._volume, self._crew = volume, crew
        self._rooms = [Workspace() for _ in range(_BANDS * crew.threads)]

    def follow(self, rays: Rays, aim: Aim, asker: Asker, chosen: RenderSettings, watch: PassTimes) -> int:
        """Fill in what rays see; the number of samples that were asked for is returned.

        Args:
            rays: to be followed.
            aim: fills in some of them before they are.
            asker: of the networks.
            chosen: for the picture.
            watch: that is told what parts took.
        """
        asker.light(rays.scene.light)
        count = len(rays.ways)
        bands = self._crew.threads * (_BANDS if count >= _MANY else 1) if count >= 2 * _LEAST else 1
        bands = 1 if self._crew.threads == 1 else bands
        ends = np.linspace(0, count, bands + 1).astype(int).tolist()
        totals, watches = [0] * bands, [PassTimes() for _ in range(bands)]

        def work(first: int, last: int) -> None:
            for band in range(first, last):
                watches[band].restart()
                aim(ends[band], ends[band + 1], self._rooms[band])
                watches[band].lap("rays")
                part = rays.part(ends[band], ends[band + 1])
                totals[band] = self._band(part, asker, chosen, watches[band], self._rooms[band])

        self._crew.share(work, bands, bands)
        watch.lap("follow")
        watch.split("follow", [each.seconds for each in watches])
        return sum(totals)

    def _band(
        self, rays: Rays, asker: Asker, chosen: RenderSettings, watch: PassTimes, room: Workspace
    ) -> int:
        going, total, is_first = np.arange(len(rays.ways), dtype=np.int32), 0, True
        while len(going):
            wave = chosen.wave if len(going) > _FEW else _LAST * chosen.wave
            samples = Samples.room_for(going, wave if chosen.marches else 1, room)
            self._take(rays, samples, chosen, is_first)
            watch.lap("march")
            order, blocks = self._sorted(samples, asker.block, room)
            watch.lap("sort")
            asker(samples, order, blocks, rays.scene)
            watch.lap("networks")
            self._composite(rays, samples, chosen)
            total, is_first = total + len(order), False
            going = going[np.isfinite(rays.resume[going])]
            watch.lap("composite")
        return total

    def _take(self, rays: Rays, samples: Samples, chosen: RenderSettings, is_first: bool) -> None:
        shell, grid, most, going = self._volume.shell, self._volume.model.grid, samples.most, samples.rays
        eye, per_cell = (rays.eye - shell.low) / shell.voxel, self._volume.per_cell
        # The first stretch is the nearest wall, mostly; what is behind it is asked for if light is left.
        stretches, step = 1 if is_first else most, chosen.step * shell.voxel
        filled = (samples.counts, samples.networks, samples.local, samples.lengths, samples.places)
        if chosen.marches:
            march(
                *(going, rays.ways, eye, shell.voxel, per_cell, shell.near, grid.table, grid.cells),
                *(step, most, stretches, rays.resume),
                *filled,
            )
        else:
            take_surface(
                *(going, rays.ways, eye, shell.voxel, per_cell, grid.table, grid.cells, rays.surface),
                *filled,
            )
            rays.resume[going] = np.inf

    def _sorted(self, samples: Samples, block: int, room: Workspace) -> tuple[AnyArray, AnyArray]:
        every = len(self._volume.model.grid)
        order = room.take("order", (len(samples.networks),), np.int32)
        blocks = room.take("blocks", (len(samples.networks) // block + every + 1, 3), np.int32)
        total, made = sort_samples(
            samples.counts, samples.most, samples.networks, every, block, order, blocks
        )
        return order[:total], blocks[:made]

    def _composite(self, rays: Rays, samples: Samples, chosen: RenderSettings) -> None:
        composite(
            *(samples.rays, samples.counts, samples.most, samples.networks, samples.density),
            *(samples.scattered, samples.lengths, samples.places, self._volume.model.weights.density_scale),
            *(chosen.termination, rays.resume, rays.optical, rays.sums),
        )
