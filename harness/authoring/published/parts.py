"""Parts of an imported folder, gathered while a published file is read."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harness.objectfile.entries import Input, NetworkEntry, Tensor
from harness.objectfile.network_part import NetworkPart, network_entry

_TOLERANCE = 1e-4
"""Tolerance of a self-test, relative to the greatest number: as for networks of ours."""

_TESTED = 4
"""Queries of a self-test."""


@dataclass(eq=False)
class ImportedParts:
    """Parts gathered while a file is read."""

    tree: dict[str, Any] = field(default_factory=dict)  #: tables of ``object.json``.
    contents: dict[str, bytes] = field(default_factory=dict)  #: bytes of files, by name.
    dropped: dict[str, int] = field(default_factory=dict)
    """numbers that the published programs never use, by name."""
    missing: list[str] = field(default_factory=list)  #: sentences on what the file does not hold.

    def network(
        self, file: str, module: Any, inputs: tuple[Input, ...], outputs: tuple[Tensor, ...], doc: str
    ) -> NetworkEntry:
        """Export a module into the contents, with a self-test of queries spread over the inputs' domains.

        Args:
            file: name of the graph's file.
            module: torch module.
            inputs: the module's inputs, in order.
            outputs: the module's outputs, in order.
            doc: description stored in the graph.

        Raises:
            DataRefused: a graph that must not be run.
        """
        from harness.authoring.published.modules import exported_graph

        graph, random, queries = exported_graph(module, inputs, outputs, doc), np.random.default_rng(0), {}
        for item in inputs:
            low, high = (np.array(bound, np.float64) for bound in (item.domain.low, item.domain.high))
            spread = low + random.random((_TESTED, low.size)) * (high - low)
            queries[item.name] = spread.reshape(_TESTED, *map(int, item.shape[1:])).astype(item.dtype)
        part = NetworkPart(file, graph, inputs, outputs, queries, _TOLERANCE)
        return network_entry(part, self.contents)
