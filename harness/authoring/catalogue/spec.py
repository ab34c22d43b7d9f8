"""What is built of every object of a catalogue, and the keys by which results are found again."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, get_args

from harness.authoring.audio.object_audio import MODES
from harness.authoring.audio.profiles import profile as audio_profile
from harness.authoring.catalogue.rows import CatalogueRow
from harness.authoring.touch.profiles import touch_profile
from harness.authoring.vision.profiles import vision_profile
from harness.basics.code_version import content_hash
from harness.basics.errors import WrongUse
from harness.basics.files.foreign_file import sha256_of
from harness.basics.files.named_file import nearest, require_file
from harness.basics.materials import MATERIALS
from harness.basics.store import digest
from harness.bench.sensor import GELSIGHT_R15, TactileSensor
from harness.objectfile.entries import Modality
from harness.objects.builtin import BUILTIN
from harness.sim.modal.modal import HEARING

SENSES: tuple[Modality, ...] = get_args(Modality)
"""All that an ObjectFile may have, in the order in which they are built."""

_CHECKED: Mapping[Modality, Callable[[str], Any]] = MappingProxyType(
    {"audio": audio_profile, "touch": touch_profile, "vision": vision_profile}
)

_NAMES_A_LIBRARY = re.compile(rb"^[ \t]*mtllib[ \t]+(.+?)[ \t\r]*$", re.MULTILINE)
_NAMES_A_PICTURE = re.compile(rb"^[ \t]*map_\w+[ \t]+(.+?)[ \t\r]*$", re.MULTILINE)


@dataclass(frozen=True)
class BuildSpec:
    """What is built of every object."""

    senses: tuple[Modality, ...] = ("audio", "touch")  #: some of ``SENSES``.
    profile: str = "standard"  #: of every sense.
    seed: int = 0  #: of everything random.
    limit: float = HEARING  #: Hz, modes up to there.
    most: int = MODES  #: modes at most, the lowest.
    edge: float | None = None  #: m, longest edge of an element; None for a share of the shortest wave.
    sensor: TactileSensor = GELSIGHT_R15  #: that presses.

    def check(self) -> None:
        """Refuse what cannot be built.

        Raises:
            WrongUse: no sense, an unknown one, or a profile that a sense does not have.
        """
        for sense in self.senses:
            if sense not in SENSES:
                raise WrongUse(f"no sense {sense!r}; {nearest(sense, SENSES)}")
            _CHECKED[sense](self.profile)
        if not self.senses:
            raise WrongUse(f"a build without a sense makes nothing; say some of {', '.join(SENSES)}")


@dataclass(frozen=True)
class BuildItem:
    """One object with its keys: all that the unit of work depends on."""

    row: CatalogueRow  #: of the catalogue.
    mesh: str  #: its file, or ``builtin:`` and a name.
    key: str  #: of the whole object under a spec.
    stages: Mapping[Modality, str]  #: the key of every sense.


def build_item(row: CatalogueRow, mesh: str, spec: BuildSpec) -> BuildItem:
    """An object with its keys; reads the mesh's file whole.

    Keys hold the content of the mesh, all settings and the code, so equal keys are equal results. A
    material is in the key of sound and of the object, and in no other.

    Raises:
        WrongUse: there is no such file.
    """
    label = row.scale if row.units is None else None
    if mesh.startswith(BUILTIN):
        surface = [mesh, content_hash("harness.objects.builtin")]
    else:
        require_file(Path(mesh), "mesh file")
        surface = [Path(mesh).name, sha256_of(Path(mesh))]
    shape = [surface, row.units, row.wall, label, row.licence, row.up_axis]
    common = [*shape, spec.profile, spec.seed]
    of_sense: dict[Modality, list[Any]] = {
        "audio": [MATERIALS[row.material], spec.limit, spec.most, spec.edge],
        "touch": [spec.sensor],
        "vision": [_colours_key(mesh)] if "vision" in spec.senses else [],
    }
    stages = {
        sense: digest([sense, builder_hash(sense), *common, *of_sense[sense]])
        for sense in SENSES
        if sense in spec.senses
    }
    key = digest(["object", row.name, MATERIALS[row.material], *stages.values()])
    return BuildItem(row, mesh, key, stages)


@cache
def builder_hash(sense: Modality) -> str:
    """Of the code that builds a sense."""
    return content_hash(f"harness.authoring.{sense}.object_{sense}")


def _colours_key(mesh: str) -> list[str]:
    """Hashes of the files beside a mesh that its colours come from."""
    path = Path(mesh)
    if mesh.startswith(BUILTIN) or path.suffix.lower() != ".obj":
        return [content_hash("harness.sim.light.appearance_source")] if mesh.startswith(BUILTIN) else []
    libraries = _named_files([path], _NAMES_A_LIBRARY)
    return [sha256_of(each) for each in (*libraries, *_named_files(libraries, _NAMES_A_PICTURE))]


def _named_files(paths: Sequence[Path], pattern: re.Pattern[bytes]) -> list[Path]:
    """Files that text files name, relative to their own folders, and that are there."""
    named = [
        path.parent / name.decode("utf-8", "replace").split()[-1]
        for path in paths
        for name in dict.fromkeys(pattern.findall(path.read_bytes()))
    ]
    return [path for path in named if path.is_file()]
