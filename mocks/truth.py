"""The truth of a run, written beside its folder for scoring; nothing that estimates reads it."""

import json
from pathlib import Path
from typing import Any

from harness.arrays import FloatArray
from harness.recording import write_text_whole
from mocks.world import World

SCHEMA = 1


class TruthFile:
    """``truth.json``: what the world knows, and where each contact really was.

    A step that is performed again, after a resume, replaces what was written of it.

    Args:
        path: of the file; contacts already in it are kept if it is of the same world.
        world: whose truth it is.
        seed: of the run.
    """

    def __init__(self, path: Path, world: World, seed: int) -> None:
        self._path = path
        self._world = world
        self._head = {
            "schema": SCHEMA,
            "seed": seed,
            "base_from_object": world.base_from_object.tolist(),
            "differences": world.differences(),
        }
        self._contacts: dict[int, dict[str, Any]] = self._resumed()

    def append(self, base_from_flange: FloatArray, step: int, sample: int) -> None:
        """Write where the contact of ``step`` is, with the flange reported at this pose."""
        self._contacts[step] = {
            "step": step,
            "sample": sample,
            "point_in_object_m": self._world.true_contact(base_from_flange, step).tolist(),
            "penetration_m": self._world.penetration(base_from_flange, step),
            "base_from_flange": base_from_flange.tolist(),
        }
        contacts = [self._contacts[index] for index in sorted(self._contacts)]
        write_text_whole(self._path, json.dumps({**self._head, "contacts": contacts}, indent=1) + "\n")

    def _resumed(self) -> dict[int, dict[str, Any]]:
        if not self._path.exists():
            return {}
        written = json.loads(self._path.read_text(encoding="utf-8"))
        if any(written.get(key) != self._head[key] for key in ("schema", "seed", "base_from_object")):
            return {}
        return {contact["step"]: contact for contact in written["contacts"]}
