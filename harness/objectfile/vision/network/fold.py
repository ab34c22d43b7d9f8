"""Weights as the fast kernel reads them: float32, tile after tile, with all that is constant folded in."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.vision.network.network import NetworkSize, VisionWeights
from harness.objectfile.vision.network.plain import encoded, looks, scatter_rows
from harness.objectfile.vision.network.tiles import OUTPUTS


@dataclass(frozen=True, eq=False)
class FoldedWeights:
    """What is computed once for an object, and again for another light.

    Attributes:
        size: of each network.
        density_scale: 1/m.
        looks: whether any network answers otherwise from another side.
        packed: ``(networks, numbers)`` float32: of each network ``first_bias``, ``first``, ``second_bias``,
            ``second``, ``density_bias``, ``density``, the feature folded into ``scatter`` with the rows of
            view (where one ``looks``) and extras, ``colour_bias`` and ``colour`` padded to four columns.
            Matrices are tiles of ``OUTPUTS`` columns.
        light_rows: ``(networks, direction, width)`` float32, of ``scatter``.
        bias: ``(networks, width)`` float32, of ``scatter`` without a light.
    """

    size: NetworkSize
    density_scale: float
    looks: bool
    packed: AnyArray
    light_rows: AnyArray
    bias: AnyArray

    def seen(self, views: AnyArray) -> AnyArray:
        """``(r, 3)`` float32 views as the kernel takes them: ``(r, 0)`` where no network looks at them."""
        return views if self.looks else np.empty((len(views), 0), np.float32)

    def lit(self, light: FloatArray) -> AnyArray:
        """``(networks, width)`` float32: the bias of ``scatter`` under a light that comes from far away.

        Args:
            light: ``(3,)`` unit, towards the lamp.
        """
        code = encoded(light, self.size.turns).astype(np.float32)
        return self.bias + code @ self.light_rows


def folded(weights: VisionWeights) -> FoldedWeights:
    """Weights as the fast kernel reads them."""
    size, at = weights.size, scatter_rows(weights.size)
    w = {name: array.astype(np.float32) for name, array in weights.arrays()}
    of_feature = w["scatter"][:, at["feature"]]
    of_view = w["scatter"][:, at["view"]]
    looked = looks(weights)
    scatter = [w["feature"] @ of_feature, *([of_view] if looked else []), w["scatter"][:, at["extras"]]]
    bias = w["scatter_bias"] + (w["feature_bias"][:, None] @ of_feature)[:, 0]
    parts = [
        *(w["first_bias"], _tiled(w["first"]), w["second_bias"], _tiled(w["second"])),
        *(w["density_bias"], w["density"], _tiled(np.concatenate(scatter, axis=1))),
        *(_padded(w["colour_bias"][:, None]), _padded(w["colour"])),
    ]
    packed = np.concatenate([part.reshape(len(weights), -1) for part in parts], axis=1)
    light_rows = np.ascontiguousarray(w["scatter"][:, at["light"]])
    return FoldedWeights(size, weights.density_scale, looked, np.ascontiguousarray(packed), light_rows, bias)


def _tiled(matrices: AnyArray) -> AnyArray:
    """``(n, inputs, outputs)`` as ``(n, outputs / OUTPUTS, inputs, OUTPUTS)``."""
    count, inputs, outputs = matrices.shape
    return matrices.reshape(count, inputs, outputs // OUTPUTS, OUTPUTS).swapaxes(1, 2)


def _padded(columns: AnyArray) -> AnyArray:
    """Three columns to four."""
    return np.pad(columns, ((0, 0), (0, 0), (0, 1)))
