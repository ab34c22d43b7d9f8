"""What a picture's cost can be traded by: one knob turned from the default, and networks in fewer bits."""

from dataclasses import dataclass, replace

import numpy as np

from harness.authoring.vision.profiles import CellsSpec
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import WrongUse
from harness.objectfile.vision.network.network import NetworkSize, VisionModel, VisionWeights
from harness.objectfile.vision.network.plain import scatter_rows
from harness.objectfile.vision.network.weights_codec import kept_weights
from harness.objectfile.vision.settings import COVERS, RenderSettings, VisionLevel
from harness.objectfile.vision_tensors import Kind

HALF = 16
"""Bits of a weight in the file: float16."""

_LEVELS: tuple[VisionLevel, ...] = ("fused", "onnx", "one_sample")
_KINDS: tuple[Kind, ...] = ("osf-v", "osf")
_BITS = (HALF, 8, 6, 4)
_STEPS = (4.0, 2.0, 1.0, 0.5, 0.25)
_TERMINATIONS = (0.3, 0.1, 0.03, 0.01, 0.0)
_LEADS = (0.5, 1.0, 2.0, float("inf"))
_CELLS = (8, 12, 16, 24)
_WIDTHS = (16, 32, 64)
_RAYS = (1, 2, 3)
_SIDES = (64, 128, 256, 400)


@dataclass(frozen=True)
class Networks:
    """Which networks: how they are trained, and in how many bits each weight is kept.

    Attributes:
        spec: of their training.
        bits: 16 for the file's float16, less for whole numbers with a scale for every column.
    """

    spec: CellsSpec
    bits: int = HALF


@dataclass(frozen=True)
class Variation:
    """One way to a picture.

    Attributes:
        networks: that are asked.
        settings: of the renderer.
        side: pixels.
    """

    networks: Networks
    settings: RenderSettings
    side: int


@dataclass(frozen=True)
class Trade:
    """A knob at one of its levels, all others at their default.

    Attributes:
        knob: its name, with a unit where it has one.
        level: for people.
        way: to the picture.
    """

    knob: str
    level: str
    way: Variation


def trades(spec: CellsSpec, side: int) -> tuple[Trade, ...]:
    """Every knob at every level; the default is a level of each.

    Args:
        spec: of the networks that all but the knobs of networks ask.
        side: pixels of all pictures but those of the knob of that name.
    """
    plain = Variation(Networks(spec), RenderSettings(), side)
    drawn: list[tuple[str, str, RenderSettings]] = [
        *(("level", level, RenderSettings(level=level)) for level in _LEVELS),
        *(("step, voxels", f"{step:g}", RenderSettings(step=step)) for step in _STEPS),
        *(("termination", f"{end:g}", RenderSettings(termination=end)) for end in _TERMINATIONS),
        *(("coverage, sub-pixels", str(of), RenderSettings(coverage=of)) for of in COVERS),
        *(("rays, along a pixel", str(rays), RenderSettings(rays=rays)) for rays in _RAYS),
        *(("lead, voxels", f"{lead:g}", RenderSettings(lead=lead)) for lead in _LEADS),
    ]
    made: list[tuple[str, str, Networks]] = [
        *(("grid, cells", str(cells), Networks(replace(spec, cells=cells))) for cells in _CELLS),
        *(("width", str(wide), _sized(spec, replace(spec.size, width=wide))) for wide in _WIDTHS),
        *(("told", kind, _sized(spec, replace(spec.size, kind=kind))) for kind in _KINDS),
        *(("weights, bits", str(bits), Networks(spec, bits)) for bits in _BITS),
    ]
    sides = sorted({*_SIDES, side})
    return (
        *(Trade(knob, level, replace(plain, settings=settings)) for knob, level, settings in drawn),
        *(Trade("side, pixels", str(each), replace(plain, side=each)) for each in sides),
        *(Trade(knob, level, replace(plain, networks=networks)) for knob, level, networks in made),
    )


def _sized(spec: CellsSpec, size: NetworkSize) -> Networks:
    return Networks(replace(spec, size=size))


def every_sample(settings: RenderSettings) -> RenderSettings:
    """Many samples of the whole shell, no ray ended: what skipping, ending and thinning out leave out.

    Pixels are cut up as they were, which is no networks' matter: it tells in the errors against exact
    pictures.
    """
    return RenderSettings(step=0.125, termination=0.0, coverage=settings.coverage, rays=settings.rays)


def in_bits(model: VisionModel, bits: int) -> VisionModel:
    """The networks with each matrix in whole numbers of so many bits, one scale for every column.

    Biases stay as they are: they are few. What is 0 and what is the identity comes back the same.

    Raises:
        WrongUse: not 2 to 16 bits.
    """
    if not 2 <= bits <= HALF:
        raise WrongUse(f"weights of {bits} bits were asked for; 2 to {HALF} are made")
    if bits == HALF:
        return model
    arrays: dict[str, AnyArray] = {}
    for name, array in model.weights.arrays():
        parts = scatter_rows(model.weights.size).values() if name == "scatter" else (slice(None),)
        coarse = [_in_whole_numbers(np.asarray(array[:, rows], np.float64), bits) for rows in parts]
        arrays[name] = array if name.endswith("bias") else np.concatenate(coarse, axis=1)
    weights = VisionWeights(model.weights.size, model.weights.density_scale, **arrays).rounded()
    return VisionModel(model.grid, weights)


def _in_whole_numbers(matrices: FloatArray, bits: int) -> FloatArray:
    """``(n, rows, columns)``, each column rounded to multiples of its greatest over ``2^(bits-1) - 1``."""
    if not matrices.size:
        return matrices
    most = 2.0 ** (bits - 1) - 1.0
    scale = np.abs(matrices).max(axis=1, keepdims=True) / most
    scale[scale == 0.0] = 1.0
    return np.asarray(np.round(matrices / scale) * scale)


def kept_bytes(model: VisionModel, bits: int) -> int:
    """Bytes of the weights in so many bits, scales and biases in float16; without the graph around them."""
    whole = 0
    for name, array in kept_weights(model.weights.rounded()).items():
        columns = 0 if name.endswith("bias") or bits == HALF else array.shape[0] * array.shape[-1]
        each = HALF if name.endswith("bias") else bits
        whole += array.size * each + columns * HALF
    return -(-whole // 8)
