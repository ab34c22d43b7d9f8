"""The paper's completion networks in torch, their graphs, and their training.

Touch: Yuan et al., PCN: point completion network, 3DV 2018, with its published widths: a coarse cloud, of
which each point is folded into a small patch. Picture: the code is that of a ResNet-18. Both: each stream
gives a coarse cloud, one fully connected layer makes one of the two, and that is folded.
"""

from functools import partial
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from experiments.paper.shape_network import DENSE, INPUTS, TAKEN
from experiments.paper.shape_samples import PRESSES, sense_samples
from experiments.shape_reconstruction.prior.network import SIDE
from experiments.shape_reconstruction.prior.samples import CompletionProfile
from experiments.shape_reconstruction.prior.training import linear, train_completion
from harness.authoring.resnet import ResNet18
from harness.objectfile.graph import Nodes, float_value

CODE = 1024
FOLD = 512

COARSE = {"touch": 1024, "picture": 1024, "both": 512}
"""Points of the coarse cloud; half as many for both senses, whose merging layer has as many weights as both
clouds times the merged one."""

REACH = 0.05
"""Half the width of a patch before it is folded, relative to the frame's reach, as published."""


class PointEncoder(nn.Module):
    """From ``(n, points, 3)`` to ``(n, code)``, independent of the order of the points.

    Args:
        first: width of the first layer on each point.
        second: width of the second layer; its maximum over all points joins each point.
        third: width of the first layer on both.
        code: width of the code.
    """

    def __init__(self, first: int, second: int, third: int, code: int) -> None:
        super().__init__()
        self.points = nn.ModuleList([nn.Linear(3, first), nn.Linear(first, second)])
        # The two halves of a layer on a point and the maximum side by side: their sum is the same.
        self.beside = nn.Linear(second, third)
        self.greatest = nn.Linear(second, third, bias=False)
        self.code = nn.Linear(third, code)

    def forward(self, touched: Tensor) -> Tensor:
        """Encode point sets as ``(n, code)``."""
        each = self.points[1](torch.relu(self.points[0](touched)))
        over_all = each.max(dim=1, keepdim=True).values
        each = torch.relu(self.beside(each) + self.greatest(over_all))
        return torch.as_tensor(self.code(each).max(dim=1).values)

    def write(self, nodes: Nodes, touched: str) -> str:
        """Write the layers to a graph."""
        first = nodes.add("Relu", linear(nodes, touched, self.points[0]))
        each = linear(nodes, first, self.points[1])
        over_all = nodes.add("ReduceMax", each, axes=[1], keepdims=1)
        both = nodes.add("Add", linear(nodes, each, self.beside), linear(nodes, over_all, self.greatest))
        inner = linear(nodes, nodes.add("Relu", both), self.code)
        return nodes.add("ReduceMax", inner, axes=[1], keepdims=0)


class SenseStream(nn.Module):
    """The code of one sense, and the coarse cloud from it.

    Args:
        encoder: network that gives ``(n, CODE)``.
        coarse: number of points.
    """

    def __init__(self, encoder: PointEncoder | ResNet18, coarse: int) -> None:
        super().__init__()
        self.encoder = encoder
        self.decoder = nn.ModuleList(
            [nn.Linear(CODE, CODE), nn.Linear(CODE, CODE), nn.Linear(CODE, 3 * coarse)]
        )

    def forward(self, given: Tensor) -> tuple[Tensor, Tensor]:
        """``(n, CODE)`` and ``(n, 3 coarse)``."""
        code = self.encoder(given)
        hidden = torch.relu(self.decoder[1](torch.relu(self.decoder[0](code))))
        return code, self.decoder[2](hidden)

    def write(self, nodes: Nodes, given: str) -> tuple[str, str]:
        """Write the layers to a graph."""
        code = self.encoder.write(nodes, given)
        hidden = code
        for layer in list(self.decoder)[:-1]:
            hidden = nodes.add("Relu", linear(nodes, hidden, layer))
        return code, linear(nodes, hidden, self.decoder[2])


class Folding(nn.Module):
    """Fold a grid about each point of a coarse cloud to the points of a dense one.

    Args:
        codes: width of all codes together.
        coarse: number of points of the coarse cloud.
    """

    def __init__(self, codes: int, coarse: int) -> None:
        super().__init__()
        self.coarse, self.patch = coarse, DENSE // coarse
        # The three parts of one layer on point, grid and code: that of the code is computed once.
        self.of_point, self.of_grid = nn.Linear(3, FOLD), nn.Linear(2, FOLD, bias=False)
        self.of_code = nn.Linear(codes, FOLD, bias=False)
        self.inner, self.last = nn.Linear(FOLD, FOLD), nn.Linear(FOLD, 3)
        self.grid: Tensor
        # Points of a patch, in rows of equal length.
        across = 1 << (self.patch.bit_length() - 1) // 2
        x, y = np.meshgrid(
            np.linspace(-REACH, REACH, across), np.linspace(-REACH, REACH, self.patch // across)
        )
        grid = np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float32)
        self.register_buffer("grid", torch.from_numpy(grid), persistent=False)

    def forward(self, code: Tensor, coarse: Tensor) -> Tensor:
        """``(n, DENSE, 3)`` of ``(n, codes)`` and ``(n, coarse, 3)``."""
        of_point = self.of_point(coarse) + self.of_code(code)[:, None]
        hidden = torch.relu(of_point[:, :, None] + self.of_grid(self.grid))
        moved = self.last(torch.relu(self.inner(hidden)))
        return (coarse[:, :, None] + moved).reshape(-1, DENSE, 3)

    def write(self, nodes: Nodes, code: str, coarse: str) -> str:
        """Write the layers to a graph; ``coarse`` is ``(n, coarse, 3)``."""
        whole = nodes.constant(np.array([-1, 1, FOLD], np.int64))
        of_code = nodes.add("Reshape", linear(nodes, code, self.of_code), whole)
        of_point = nodes.add("Add", linear(nodes, coarse, self.of_point), of_code)
        apart = nodes.add("Reshape", of_point, nodes.constant(np.array([-1, self.coarse, 1, FOLD], np.int64)))
        of_grid = linear(nodes, nodes.constant(self.grid.numpy()), self.of_grid)
        hidden = nodes.add("Relu", nodes.add("Add", apart, of_grid))
        moved = linear(nodes, nodes.add("Relu", linear(nodes, hidden, self.inner)), self.last)
        points = nodes.add("Reshape", coarse, nodes.constant(np.array([-1, self.coarse, 1, 3], np.int64)))
        both = nodes.add("Add", points, moved)
        return nodes.add(
            "Reshape", both, nodes.constant(np.array([-1, DENSE, 3], np.int64)), name="completed"
        )


class PaperCompletionNetwork(nn.Module):
    """The network of one sense or of both.

    Args:
        sense: key of ``INPUTS``.
    """

    def __init__(self, sense: str) -> None:
        super().__init__()
        self.sense, self.coarse = sense, COARSE[sense]
        self.streams = nn.ModuleList()
        for name, _ in INPUTS[sense]:
            encoder: PointEncoder | ResNet18
            encoder = PointEncoder(128, 256, 512, CODE) if name == "touched" else ResNet18(1, CODE)
            self.streams.append(SenseStream(encoder, self.coarse))
        count = len(self.streams)
        self.merge = nn.Linear(3 * self.coarse * count, 3 * self.coarse) if count > 1 else None
        self.fold = Folding(CODE * count, self.coarse)

    def forward(self, *given: Tensor) -> tuple[list[Tensor], Tensor]:
        """Return all coarse clouds ``(n, coarse, 3)``, the folded one last, and ``(n, DENSE, 3)``."""
        streams = zip(self.streams, given, strict=True)
        codes, clouds = map(list, zip(*(stream(one) for stream, one in streams), strict=True))
        if self.merge is not None:
            clouds.append(self.merge(torch.relu(torch.cat(clouds, dim=1))))
        shaped = [cloud.reshape(-1, self.coarse, 3) for cloud in clouds]
        return shaped, self.fold(torch.cat(codes, dim=1), shaped[-1])

    def graph(self) -> bytes:
        """Write the network as a graph from ``INPUTS`` to ``completed``."""
        nodes = Nodes("float16")  # of the weights; computed in float32
        streams = zip(self.streams, INPUTS[self.sense], strict=True)
        codes, clouds = zip(*(stream.write(nodes, name) for stream, (name, _) in streams), strict=True)
        code, cloud = codes[0], clouds[0]
        if self.merge is not None:
            code = nodes.add("Concat", *codes, axis=1)
            cloud = linear(nodes, nodes.add("Relu", nodes.add("Concat", *clouds, axis=1)), self.merge)
        shape = nodes.constant(np.array([-1, self.coarse, 3], np.int64))
        self.fold.write(nodes, code, nodes.add("Reshape", cloud, shape))
        inputs = [float_value(name, ("n", *shape)) for name, shape in INPUTS[self.sense]]
        outputs = [float_value("completed", ("n", DENSE, 3))]
        what = "Touched places of an object, its silhouette, or both, to points all over it."
        return bytes(nodes.model(self.sense, inputs, outputs, what).SerializeToString())


_TAKES = {
    "touched": f"{TAKEN} places that were touched",
    "window": f"the silhouette in {SIDE} x {SIDE} pixels",
}


def train_paper_completion(
    sense: str, amounts: CompletionProfile, seed: int, processes: int, device: str
) -> tuple[bytes, dict[str, Any]]:
    """Train the network of a sense; return the bytes of its graph, and its card."""
    samples = sense_samples(sense, amounts.shapes, amounts.sets, seed, processes)
    takes = " and ".join(_TAKES[name] for name, _ in INPUTS[sense])
    described = {
        "what": f"{DENSE} points all over an object, from {takes}",
        "network": "PCN (Yuan et al. 2018) as in ObjectFolder 2.0, the picture by ResNet-18",
        "coarse_points": COARSE[sense],
        "presses": list(PRESSES),
    }
    make = partial(PaperCompletionNetwork, sense)
    return train_completion(sense, make, samples, amounts, seed, device, described)
