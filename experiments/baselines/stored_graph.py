"""Networks that were trained once: bytes of their graphs, by what they were trained from."""

import time
from collections.abc import Callable, Mapping
from importlib.util import find_spec

import numpy as np

from harness.basics.store import Store, digest

VERSION = "baseline graph"
"""Of what trainings compute; another text with every change of it, so that stored networks are dropped."""


class TorchMissing(Exception):
    """A baseline has to be trained, and torch is not installed; its row of the table says so."""


def require_torch(what: str) -> None:
    """Raise ``TorchMissing`` where torch is not installed."""
    if any(find_spec(name) is None for name in ("torch", "onnxscript")):
        raise TorchMissing(f"{what} has to be trained, which needs torch: pip install '.[author]'")


def stored_graph(
    store: Store, identity: tuple[object, ...], what: str, train: Callable[[], bytes], torch: bool = True
) -> tuple[bytes, float]:
    """The graph of a network from the store, or trained now and put there.

    Args:
        store: of graphs.
        identity: of all that the network depends on.
        what: the network is called in messages.
        train: gives the graph's bytes.
        torch: whether training needs it.

    Returns:
        The bytes, and the CPU s that training took, then or now.

    Raises:
        TorchMissing: it has to be trained and cannot be.
    """
    key = digest([VERSION, *identity])
    stored = store.get(key)
    if isinstance(stored, Mapping):
        return stored["graph"].tobytes(), float(stored["seconds"])
    if torch:
        require_torch(what)
    begun = time.process_time()
    data = train()
    seconds = time.process_time() - begun
    store.put(key, {"graph": np.frombuffer(data, np.uint8), "seconds": np.array(seconds)})
    return data, seconds
