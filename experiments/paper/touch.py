"""Tables 1 and 2 of touch: presses and their reference, 1.0's network, the paper's, ours.

1.0's network goes from a place and a pixel to the colour that the sensor's camera sees. One picture a place,
pressed along the normal: it knows no tilt, no depth and no gel. 1.0 drew its pictures as a DIGIT's; here they
are the sensor's of all rows of the table.
"""

import time
from collections.abc import Mapping
from dataclasses import astuple, dataclass
from functools import cached_property
from typing import Final, Literal, Self

import numpy as np

from experiments.paper.rendering import (
    Column,
    FitSpec,
    MadeMethod,
    Render,
    RenderingMethod,
    RenderingWork,
    Sense,
    grid_points,
    picture_scores,
    train_network,
)
from harness.authoring.touch.data import (
    DEPTHS,
    MOST_TILT,
    choose_nodes,
    pressed,
    reference_maps,
    smooth_normals,
)
from harness.authoring.touch.metrics import PressBench
from harness.authoring.touch.profiles import TOUCH_PROFILES, CodesSpec
from harness.authoring.touch.touch import opened_codes, spaced_codes
from harness.basics.arrays import AnyArray, ByteArray, FloatArray, IntArray
from harness.basics.errors import OutOfDomain
from harness.basics.mesh import Mesh
from harness.basics.store import digest
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.touch import prepare_optics
from harness.objectfile.entries import Domain, Input, Tensor
from harness.objectfile.file import ObjectFile
from harness.objectfile.runtime import Network
from harness.objectfile.surface_search import SurfaceSearch
from harness.objectfile.touch.graph import codes_graph
from harness.objectfile.touch.nodes import NodeSearch
from harness.objectfile.touch.touch import Maps, ReferenceMaps, open_touch
from harness.objectfile.touch_entries import GelEntry
from harness.objectfile.vision_tensors import graph_input
from harness.sim.gel.height_map import RasterMesh
from harness.sim.gel.press_pose import Presses
from harness.sim.optics.optics import Optics
from harness.sim.optics.tactile_calibration import TactileCalibration, shipped_calibration

COLOURS: Final = FitSpec(octaves=6, steps=200)
"""1.0's TouchNet: 4 layers of 256, and 6 octaves for its 10, of which the last are noise between places."""

TOUCHNET: Final = FitSpec(depth=8, skip=5, steps=150, batch=4096)
"""2.0's TouchNet, with the published layers."""

TOUCHNET_PRESSES: Final = 1200
"""Presses whose maps 2.0's network learns from; those that are impossible are left out."""

SMALL_CODES: Final = CodesSpec(most_bytes=1_000_000, pitch=0.8e-3)
"""Ours, smaller than the profile ``smoke``."""

PRESS_SEED = 11
"""Random seed of points and presses."""

NETWORK_SEED = 0
"""Random seed of the codes and of 2.0's network."""

SPACING = 5e-3
"""m between places that networks of the table may learn from."""

NEAR = 6.5e-3
"""m: a press farther from all of them is left out, as by the codes of that spacing."""

MIDDLE = float(np.mean(DEPTHS))
"""m: how deep 1.0's one picture of a place is pressed, which knows no other depth."""

Kind = Literal["any", "upright"]


@dataclass(frozen=True, eq=False)
class TouchBench:
    """Presses of 2.0's range at random places, without yaw, or of 1.0's: upright and equally deep."""

    places: PressBench  #: where networks learn, with the rasteriser.
    presses: Presses  #: that are possible.
    maps: FloatArray  #: ``(n, rows, columns)`` m, of the reference.
    calibration: TactileCalibration  #: of the colours.

    sense: Sense = "touch"

    @property
    def count(self) -> int:
        """Presses."""
        return len(self.presses)

    @cached_property
    def identity(self) -> str:
        """Of the object, the presses and the sensor."""
        return digest([self.lesson, self.presses.object_from_gel, self.presses.depths, self.maps])

    @cached_property
    def lesson(self) -> str:
        """Of all that networks learn from."""
        places, known = self.places, self.calibration
        return digest([places.mesh.vertices, places.nodes.points, known.background, known.table])

    @cached_property
    def optics(self) -> Optics:
        """From maps to pictures, for the reference and for every map of a method alike."""
        return prepare_optics(self.calibration, "fast", self.places.sensor)

    def picture(self, indentation: AnyArray) -> ByteArray:
        """``(rows, columns, 3)`` of ``(rows, columns)`` m."""
        drawn: ByteArray = self.optics.render(np.asarray(indentation, np.float64)[None]).images[0]
        return drawn

    def scores(self, number: int, rendered: AnyArray) -> Mapping[str, float]:
        """PSNR and SSIM of the whole picture."""
        return picture_scores(rendered, self.picture(self.maps[number]))


def touch_bench(
    mesh: Mesh, presses: int, kind: Kind, work: RenderingWork, codes: NodeSearch | None = None
) -> TouchBench:
    """Sample presses of an object, without those that are impossible or outside the domain of its codes.

    Raises:
        OutOfDomain: no press is possible.
    """
    work.report("touch: simulating presses", 0.0)
    calibration = shipped_calibration("gelsight_r15_bench")
    nodes, skirt = choose_nodes(mesh, SPACING), calibration.header.skirt
    places = PressBench(mesh, RasterMesh(mesh), GELSIGHT_R15, skirt, nodes, NEAR)
    points = SurfaceSearch(mesh).spread(presses, PRESS_SEED)[0]
    normals, nothing = smooth_normals(mesh, points), np.zeros(len(points))
    if kind == "upright":
        drawn = Presses(points, normals, nothing + MIDDLE, nothing, nothing, nothing)
    else:
        posed = pressed(points, normals, PRESS_SEED, DEPTHS, MOST_TILT)
        drawn = Presses(points, normals, posed.depths, posed.tilts, posed.azimuths, nothing)
    searches = [NodeSearch(places.nodes, NEAR), *([] if codes is None else [codes])]
    near = np.all([each.nearest(drawn)[1] <= each.most for each in searches], axis=0)
    reference = reference_maps(places.raster, drawn, places.sensor, places.skirt)
    chosen = np.flatnonzero(reference.possible & near)
    if not len(chosen):
        raise OutOfDomain(f"none of {presses} presses is possible; is the mesh inside out?")
    return TouchBench(places, drawn[chosen], reference.maps[chosen], calibration)


COLOURS_FILE = "touch_colours.onnx"


def colours_pair() -> tuple[Input, Tensor]:
    """Describe the input and the output tensor of the network."""
    box = Domain(low=(0.0, 0.0, 0.0, -1.0, -1.0), high=(1.0,) * 5)
    meaning = "x y z, 0 to 1; row and column, -1 to 1"
    place = graph_input("place", "float64", ("n", 5), "1", meaning, box)
    meaning = "red green blue, -1 to 1"
    return place, Tensor(name="colours", dtype="float32", shape=("n", 3), unit="1", meaning=meaning)


TOUCHNET_FILE = "touch_perceptron.onnx"


@dataclass(frozen=True, eq=False)
class PressInputs:
    """The inputs of 2.0's network (ObjectFolder 2.0, Gao et al., CVPR 2022, section 4.3).

    Place, tilt, cosine and sine of its azimuth, depth, row and column, each from 0 to 1 but for cosine and
    sine. There is no yaw among them.
    """

    least: FloatArray  #: ``(9,)`` that becomes 0: m, rad and pixels.
    factor: FloatArray  #: ``(9,)`` one over the range.
    columns: int  #: of the gel.

    @classmethod
    def of(cls, places: PressBench) -> Self:
        """The inputs of an object's presses."""
        low, high = places.mesh.bounds
        sensor = places.sensor
        least = np.array([*low, 0.0, 0.0, 0.0, DEPTHS[0], 0.0, 0.0])
        most = np.array([*high, MOST_TILT, 1.0, 1.0, DEPTHS[1], sensor.rows - 1.0, sensor.columns - 1.0])
        return cls(least, 1.0 / (most - least), sensor.columns)

    def rows(self, presses: Presses, pixels: IntArray) -> FloatArray:
        """Return ``(k, 9)`` inputs for ``(k,)`` row-major pixel indices, one press each or one for all."""
        rows = np.empty((len(pixels), 9))
        rows[:, :3], rows[:, 3] = presses.points, presses.tilts
        rows[:, 4], rows[:, 5] = np.cos(presses.azimuths), np.sin(presses.azimuths)
        rows[:, 6] = presses.depths
        rows[:, 7], rows[:, 8] = np.divmod(pixels, self.columns)
        return (rows - self.least) * self.factor


def touchnet_pair() -> tuple[Input, Tensor]:
    """Describe the input and the output tensor of the network."""
    box = Domain(low=(0.0,) * 4 + (-1.0,) * 2 + (0.0,) * 3, high=(1.0,) * 9)
    meaning = "place x y z, tilt, cosine and sine of its azimuth, depth, row, column"
    pixel = graph_input("pixel", "float64", ("n", 9), "1", meaning, box)
    meaning = "how far the gel is pressed in"
    return pixel, Tensor(name="depth", dtype="float32", shape=("n", 1), unit="m", meaning=meaning)


_REACH = 2.0
"""Spacings that a press may be from a code: more than an ObjectFile allows, so that no press is refused."""


def first_touch(bench: TouchBench, work: RenderingWork, suffix: str = "") -> RenderingMethod:
    """Return 1.0's network, trained at the bench's training points; ``suffix`` is added to its name."""

    def make() -> MadeMethod:
        what, shape = "the tactile network of 1.0", (bench.places.sensor.rows, bench.places.sensor.columns)
        data, seconds = train_network(work, "colours", what, bench, COLOURS, bench.lesson)
        place, colours = colours_pair()
        network, (low, high) = Network(data, COLOURS_FILE, [place], [colours]), bench.places.mesh.bounds

        def picture(number: int) -> ByteArray:
            point = (bench.presses.points[number] - low) / (high - low)
            pixels = grid_points(-1.0, shape)
            rows = np.concatenate([np.broadcast_to(point, (len(pixels), 3)), pixels], axis=1)
            grey = np.clip(np.rint(127.5 * (network({"place": rows})["colours"] + 1.0)), 0.0, 255.0)
            return grey.astype(np.uint8).reshape(*shape, 3)

        return MadeMethod(picture, seconds)

    column: Column = "other" if suffix else "1.0 here"
    note = "one picture a place, whatever the tilt and depth"
    return RenderingMethod(f"DIGIT-like TouchNet (1.0){suffix}", column, astuple(COLOURS), make, note)


def second_touch(bench: TouchBench, work: RenderingWork) -> RenderingMethod:
    """Return 2.0's network, trained at the bench's training points."""

    def make() -> MadeMethod:
        what, settings = "TouchNet", TOUCHNET_PRESSES
        data, seconds = train_network(work, "touchnet", what, bench, TOUCHNET, bench.lesson, settings)
        pixel, depth = touchnet_pair()
        network = Network(data, TOUCHNET_FILE, [pixel], [depth])
        inputs, shape = PressInputs.of(bench.places), bench.maps.shape[1:]
        pixels = np.arange(bench.maps[0].size)

        def maps(presses: Presses) -> AnyArray:
            return network({"pixel": inputs.rows(presses, pixels)})["depth"].reshape(1, *shape)

        return MadeMethod(_drawn(bench, maps), seconds)

    note = f"its layers; trained here for {TOUCHNET.steps} steps alone"
    return RenderingMethod("TouchNet (2.0)", "2.0 here", astuple(TOUCHNET), make, note)


def untouched(bench: TouchBench, suffix: str = "") -> RenderingMethod:
    """The background alone, whatever is pressed."""
    nothing = np.zeros_like(bench.maps[0])
    made = MadeMethod(lambda _: bench.picture(nothing))
    return RenderingMethod(f"untouched gel{suffix}", "other", (), lambda: made, "costs nothing")


def touch_methods(bench: TouchBench, of: ObjectFile, work: RenderingWork) -> list[RenderingMethod]:
    """Return every method of touch; the object's own codes are included if it has some."""
    largest = TOUCH_PROFILES["standard"].codes
    own, entry = [], of.description.touch
    if entry is not None and entry.codes is not None:
        network = entry.codes.network
        own = [
            RenderingMethod(
                f"codes of the ObjectFile, {network.bytes / 1e6:.1f} MB",
                "ours",
                (network.sha256,),
                lambda: MadeMethod(_drawn(bench, open_touch(of, "codes").at)),
            )
        ]
    gel = GelEntry.of(bench.places.sensor, bench.places.skirt)
    return [
        untouched(bench),
        first_touch(bench, work),
        second_touch(bench, work),
        _codes("codes of 1 MB", SMALL_CODES, "ours, smallest", bench),
        *own,
        _codes("codes of 18 MB, profile standard", largest, "ours, largest", bench),
        RenderingMethod(
            "the mesh itself, rasterised",
            "other",
            (),
            lambda: MadeMethod(_drawn(bench, ReferenceMaps(bench.places.raster, gel))),
            "the reference: no error by definition",
        ),
    ]  # fmt: skip


def _codes(name: str, spec: CodesSpec, column: Column, bench: TouchBench) -> RenderingMethod:
    def make() -> MadeMethod:
        places, begun = bench.places, time.process_time()
        coded, spacing = spaced_codes(places.raster, places.sensor, spec, NETWORK_SEED)
        graph = codes_graph(coded.patches, places.sensor, places.skirt)
        maps = opened_codes(graph, coded.nodes, _REACH * spacing, places.sensor)
        return MadeMethod(_drawn(bench, maps), time.process_time() - begun)

    return RenderingMethod(name, column, astuple(spec), make)


def _drawn(bench: TouchBench, maps: Maps) -> Render:
    def observe(number: int) -> AnyArray:
        return bench.picture(maps(bench.presses[number : number + 1])[0])

    return observe
