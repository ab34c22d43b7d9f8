"""The truth of a run, written beside its folder for scoring; nothing that estimates reads it."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply
from harness.basics.npz_file import write_arrays
from harness.basics.whole_file import write_text_whole
from harness.bench.station import STRIKE
from mocks.world.world import World

if TYPE_CHECKING:
    from mocks.world.sound import WorldSound

SCHEMA = 1


class TruthFile:
    """``truth.json``: what the world knows, and where each contact really was.

    A step that is performed again, after a resume, replaces what was written of it. Beside it ``truth.npz``
    has the true surface as it stands: ``vertices``, m in base, and ``faces``.

    Args:
        path: of the file; contacts already in it are kept if it is of the same world.
        world: whose truth it is.
        seed: of the run.
        sound: of the run; None where the scene asks for none.
    """

    def __init__(self, path: Path, world: World, seed: int, sound: "WorldSound | None" = None) -> None:
        self._path = path
        self._world = world
        self._sound = sound
        self._head = {
            "schema": SCHEMA,
            "seed": seed,
            "base_from_object": world.base_from_object.tolist(),
            "differences": {
                **world.differences(),
                **({} if sound is None else {"sound": sound.differences()}),
            },
        }
        self._contacts: dict[int, dict[str, Any]] = self._resumed()
        self._has_surface = False

    def append(self, base_from_flange: FloatArray, step: int, sample: int) -> None:
        """Write where the press or the strike of ``step`` is, with the flange reported at this pose."""
        if sample == STRIKE and self._sound is not None:
            self._contacts.setdefault(step, {"step": step})["strike"] = self._strike(
                self._sound, base_from_flange, step
            )
        else:
            self._contacts[step] = {
                "step": step,
                "sample": sample,
                "point_in_object_m": self._world.true_contact(base_from_flange, step).tolist(),
                "penetration_m": self._world.penetration(base_from_flange, step),
                "base_from_flange": base_from_flange.tolist(),
            }
        self._write()

    def looked(self) -> None:
        """Write what is true of the whole run: the scene camera has looked, and nothing was touched."""
        self._write()

    def _write(self) -> None:
        if not self._has_surface:
            self._write_surface()
        contacts = [self._contacts[index] for index in sorted(self._contacts)]
        write_text_whole(self._path, json.dumps({**self._head, "contacts": contacts}, indent=1) + "\n")

    def _write_surface(self) -> None:
        world, path = self._world, self._path.with_suffix(".npz")
        vertices = apply(world.base_from_object, world.mesh.vertices)
        write_arrays(path, {"vertices": vertices, "faces": world.mesh.faces})
        self._has_surface = True

    def _strike(self, sound: "WorldSound", base_from_flange: FloatArray, step: int) -> dict[str, Any]:
        aim = sound.aim(base_from_flange, step, STRIKE)
        return {
            "point_in_object_m": None if aim.met is None else aim.met.nominal.tolist(),
            "direction_in_object": aim.direction_in_object.tolist(),
            "pulse_s": aim.blow.pulse,
            "impulse_n_s": aim.blow.impulse,
            "base_from_flange": base_from_flange.tolist(),
        }

    def _resumed(self) -> dict[int, dict[str, Any]]:
        if not self._path.exists():
            return {}
        written = json.loads(self._path.read_text(encoding="utf-8"))
        if any(written.get(key) != self._head[key] for key in ("schema", "seed", "base_from_object")):
            return {}
        return {contact["step"]: contact for contact in written["contacts"]}
