"""The processor that a network is fitted on."""

import torch

DEVICES = ("auto", "cpu", "cuda")


def device_of(asked: str) -> str | None:
    """``"cpu"`` or ``"cuda"``, by ``"auto"`` the latter where there is one; None: there is none."""
    there = torch.cuda.is_available()
    if asked == "auto":
        return "cuda" if there else "cpu"
    return asked if there or asked == "cpu" else None
