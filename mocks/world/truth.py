"""The truth of a run, written beside its folder for scoring; nothing that estimates reads it."""

from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.basics.arrays import FloatArray
from harness.basics.errors import TouchstoneError
from harness.basics.geometry import apply
from harness.basics.npz_file import write_arrays
from harness.bench.station import STRIKE
from harness.recording.truth_file import SCHEMA, read_truth_file, surface_path, write_truth_file
from mocks.world.world import World

if TYPE_CHECKING:
    from mocks.world.sound import WorldSound


class TruthFile:
    """``truth.json``: what the world knows, and where each contact really was.

    A step that is performed again, after a resume, replaces what was written of it. Beside it ``truth.npz``
    has the true surface in its true pose: ``vertices``, m in base, and ``faces``.

    Args:
        path: of the file; contacts already in it are kept if it is undamaged and of the same run and world.
        world: whose truth it is.
        seed: of the run.
        run_id: identity of the run; empty where no run is recorded.
        sound: of the run; None where the scene asks for none.
    """

    def __init__(
        self, path: Path, world: World, seed: int, run_id: str = "", sound: "WorldSound | None" = None
    ) -> None:
        self._path = path
        self._world = world
        self._sound = sound
        self._head = {
            "schema": SCHEMA,
            "run_id": run_id,
            "seed": seed,
            "base_from_object": world.base_from_object.tolist(),
            "differences": {
                **world.differences(),
                **({} if sound is None else {"sound": sound.differences()}),
            },
        }
        self._contacts: dict[int, dict[str, Any]] = self._resumed()
        self._surface_sum: str | None = None

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
        if self._surface_sum is None:
            self._surface_sum = self._write_surface()
        contacts = [self._contacts[index] for index in sorted(self._contacts)]
        fields = {**self._head, "surface_sha256": self._surface_sum, "contacts": contacts}
        write_truth_file(self._path, fields)

    def _write_surface(self) -> str:
        """Write the true surface; the SHA-256 of its file."""
        world, path = self._world, surface_path(self._path)
        vertices = apply(world.base_from_object, world.mesh.vertices)
        write_arrays(path, {"vertices": vertices, "faces": world.mesh.faces})
        return sha256(path.read_bytes()).hexdigest()

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
        """The contacts of the same run; none where the file is damaged or of another run."""
        if not self._path.exists():
            return {}
        try:
            written = read_truth_file(self._path)
        except TouchstoneError:
            return {}
        if any(written.get(key) != self._head[key] for key in ("run_id", "seed", "base_from_object")):
            return {}
        return {contact["step"]: contact for contact in written["contacts"]}
