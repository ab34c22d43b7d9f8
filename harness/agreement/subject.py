"""What readings are compared with: a run's own object as it carries it, or an ObjectFile in its place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import cast

from harness.agreement.agreement import Source
from harness.basics.arrays import FloatArray
from harness.basics.materials import MATERIALS, Material
from harness.basics.mesh import Mesh
from harness.basics.store import Store, default_folder
from harness.bench.scene import SceneFile
from harness.bench.scene_objectfile import OBJECTFILE
from harness.effects.accuracy import Level
from harness.effects.catalogue import DIALS, EFFECTS, NETWORK, networks_of
from harness.effects.effect import Facts, parameter_name, quantity_name
from harness.effects.evaluate import Evaluation, evaluate
from harness.effects.plan import Plan, default_accuracy, plan
from harness.effects.quantities import Quantities
from harness.objectfile.entries import Modality
from harness.objectfile.file import ObjectFile
from harness.recording.observation import Observation, in_time, picture_left_out
from harness.recording.run_folder import RunFiles

SEEN = 0.12e-3
"""m of indentation at the deepest place, below which a picture shows no contact."""


@dataclass(frozen=True, eq=False)
class Subject:
    """An object, standing where a run's scene states."""

    run: RunFiles  #: whose readings are compared.
    scene: SceneFile  #: of the run, with this object in it.
    mesh: Mesh  #: of the object, m, in its own frame.
    material: Material  #: it is made of.
    objectfile: ObjectFile | None  #: of the object; None without one.
    levels: Mapping[str, Level] = field(default_factory=dict)
    """of the simulation's dials, but for the one that chooses between network and reference; what they leave
    out is at its default."""
    _store: Store = field(default_factory=lambda: Store(default_folder()), repr=False)
    _made: dict[tuple[Modality, Source], Quantities] = field(default_factory=dict, repr=False, init=False)

    @cached_property
    def base_from_object(self) -> FloatArray:
        """``(4, 4)``, as the scene states it."""
        return self.scene.base_from_object(self.mesh)

    def sources_of(self, sense: Modality) -> tuple[Source, ...]:
        """What can stand for a sense, the ObjectFile's network first."""
        has = self.objectfile is not None and sense in networks_of(self.objectfile.description)
        return ("network", "reference") if has else ("reference",)

    def simulated(
        self, sense: Modality, source: Source, wanted: Sequence[str], given: Quantities
    ) -> Evaluation:
        """Compute quantities of the catalogue for this object.

        Args:
            sense: whose dial ``source`` turns.
            source: the network or the reference.
            wanted: their names.
            given: further sources.

        Raises:
            WrongUse: the network is of another gel or another object.
            OutOfDomain: a gel stands where no network was made for it.
        """
        dial, known = DIALS[sense], default_accuracy(EFFECTS)
        chosen_levels = {name: level for name, level in self.levels.items() if name in known.levels}
        turned = NETWORK if source == "network" else dial.default
        levels = known.with_({**chosen_levels, dial.name: turned})
        facts = Facts(self.scene, self.run.station.gel.sensor)
        chosen = plan(EFFECTS, facts, tuple(wanted), levels)
        if (sense, source) not in self._made:
            lasting = _of_object(chosen, given)
            made = evaluate(plan(EFFECTS, facts, lasting, levels), self._sources(), self._store)
            computed = {parameter_name(name): made[name] for name in lasting}
            self._made[sense, source] = cast(Quantities, computed)
        sources: Quantities = {**self._sources(), **given, **self._made[sense, source]}
        return evaluate(chosen, sources, self._store)

    def _sources(self) -> Quantities:
        sources: Quantities = {
            "object_mesh": self.mesh,
            "object_wall": self.scene.object.wall,
            "object_material": self.material,
            "sensor": self.run.station.gel.sensor,
            "sensor_calibration": self.run.calibration,
        }
        if self.objectfile is not None:
            sources["object_file"] = self.objectfile
        return sources


def _of_object(chosen: Plan, given: Quantities) -> tuple[str, ...]:
    """Return the quantities that depend on the object alone and that others need: each is computed once."""
    fixed, needed = set(chosen.sources) - set(map(quantity_name, given)), set[str]()
    for step in chosen.ran:
        needs = {chosen.resolved(need) for need in step.needs}
        if needs <= fixed:
            fixed.add(step.effect.provides)
        else:
            needed |= needs & fixed
    return tuple(sorted(needed - set(chosen.sources)))


def own_subject(run: RunFiles, levels: Mapping[str, Level] | None = None) -> Subject:
    """Return the object of a run's scene, with the run's ObjectFile if it has one; see ``Subject``."""
    of = run.objectfile if run.carries_objectfile else None
    return Subject(run, run.scene, run.mesh, MATERIALS[run.scene.object.material], of, levels or {})


def subject_of_file(run: RunFiles, folder: Path) -> Subject:
    """Return the object of an ObjectFile at the pose of a run's object.

    Raises:
        WrongUse: there is no such ObjectFile.
        DataRefused: it is damaged.
    """
    of = ObjectFile.open(folder)
    named = {
        "mesh": OBJECTFILE + of.description.name,
        "objectfile": str(folder),
        "material": of.material.name,
        "wall": None,
        "units": None,
        "scale": 1.0,
        "sizes": None,
    }
    object_ = run.scene.object.model_copy(update=named)
    return Subject(run, run.scene.model_copy(update={"object": object_}), of.mesh, of.material, of)


@dataclass(frozen=True, eq=False)
class PressedContact:
    """One step that pressed the gel."""

    step: int  #: of the run.
    seen: Observation  #: as it was recorded.
    heights: FloatArray  #: ``(rows, columns)`` m of indentation, by its picture; zeros where that is refused.
    refusal: str = ""  #: why its picture is not compared; empty where it is.

    @property
    def touched(self) -> bool:
        """Whether the picture shows a contact."""
        return float(self.heights.max()) > SEEN


def contacts_of(run: RunFiles) -> tuple[PressedContact, ...]:
    """Every step of a run that has pictures of the gel, its strikes in time with each other.

    Raises:
        RecordingDamaged: a step has pictures and no pose of the arm with them.
    """
    records = [record for record in run.recording.steps() if "gel.image" in record.readings]
    seen = in_time([run.observe(record) for record in records])
    gels = [run.gel_reader.read(one.images) for one in seen]
    return tuple(
        PressedContact(record.step.index, one, gel.height, gel.refusal)
        for record, one, gel in zip(records, seen, gels, strict=True)
    )


def refusal_notes(contacts: Sequence[PressedContact]) -> list[str]:
    """A sentence for each picture that is not compared."""
    return [picture_left_out(one.step, one.refusal) for one in contacts if one.refusal]
