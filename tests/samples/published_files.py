"""Published ObjectFiles as torch writes them, for tests that have torch."""

from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np


def write_published(tree: dict[str, Any], path: Path) -> Path:
    """A ``.pth`` of tables: weights as tensors, boxes and modes as arrays of numpy."""
    import torch

    def saved(value: Any, key: str = "") -> Any:
        if isinstance(value, dict):
            inner = {name: saved(item, str(name)) for name, item in value.items()}
            return OrderedDict(inner) if key.endswith("state_dict") else inner
        if isinstance(value, np.ndarray) and key not in _NUMPY:
            return torch.from_numpy(np.ascontiguousarray(value))
        if isinstance(value, float) and key.startswith("f1"):
            return np.float32(value)
        return value

    torch.save(saved(tree), path)
    return path


_NUMPY = ("frequencies", "dampings", "xyz_min", "xyz_max", "voxel_vertex", "translation")
