"""Which networks of an ObjectFile stand for which simulation, how far off they are and how long they take."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rich.table import Table

from harness.bench.scene import SceneFile
from harness.effects.accuracy import Level
from harness.effects.file_levels import DIALS, NETWORK
from harness.effects.plan import Plan
from harness.effects.scene_object import named_file
from harness.objectfile.description import Description
from harness.objectfile.entries import Modality, NetworkEntry

_INSTEAD_OF: Mapping[Modality, str] = {
    "audio": "finite elements: the modes and their gains",
    "touch": "rasteriser and skirt: candidates' tactile images, and the readings' at the answer",
    "vision": "rays on the mesh: the scene camera's picture",
}

_OTHER = ("seconds_", "bytes")
"""What a model card says beside errors, by how the name begins."""


@dataclass(frozen=True)
class NetworkInUse:
    """A network that stands for a simulation.

    Attributes:
        dial: whose level it is.
        file: of the ObjectFile.
        instead_of: what is not simulated.
        errors: of its model card, by names with units, where it was never trained.
        seconds: of one query as its model card has it, by the name of the query; empty where it says none.
    """

    dial: str
    file: str
    instead_of: str
    errors: Mapping[str, float]
    seconds: Mapping[str, float]


def networks_in_use(scene: SceneFile, chosen: Plan) -> tuple[NetworkInUse, ...]:
    """The networks that stand for a simulation of a plan; none where the scene names no ObjectFile.

    Raises:
        DataRefused: the ObjectFile is damaged.
    """
    turned = {name for step in chosen.ran for name, level in step.levels.items() if level == NETWORK}
    if scene.object.objectfile is None or not turned:
        return ()
    return networks_at(named_file(scene).description, dict.fromkeys(turned, NETWORK))


def networks_at(of: Description, levels: Mapping[str, Level]) -> tuple[NetworkInUse, ...]:
    """The networks of an ObjectFile that stand for a simulation at some levels.

    Args:
        of: what its ``object.json`` says.
        levels: by the names of dials.
    """
    networks = of.networks
    return tuple(
        _in_use(sense, networks[sense])
        for sense, dial in DIALS.items()
        if levels.get(dial.name) == NETWORK and sense in networks
    )


def networks_as_json(networks: tuple[NetworkInUse, ...]) -> list[dict[str, Any]]:
    """``[{dial, level, file, instead_of, errors, seconds}]``."""
    return [
        {
            "dial": each.dial,
            "level": NETWORK,
            "file": each.file,
            "instead_of": each.instead_of,
            "errors": dict(each.errors),
            "seconds": dict(each.seconds),
        }
        for each in networks
    ]


def networks_as_table(networks: tuple[NetworkInUse, ...]) -> Table:
    """The same for a terminal."""
    table = Table(title="networks of the ObjectFile that stand for a simulation")
    for heading in ("level", "network", "instead of", "error on its model card", "seconds on it"):
        table.add_column(heading)
    for each in networks:
        errors, seconds = _listed(each.errors), _listed(each.seconds)
        table.add_row(f"{each.dial} = {NETWORK}", each.file, each.instead_of, errors, seconds)
    return table


def _in_use(sense: Modality, entry: NetworkEntry) -> NetworkInUse:
    measured = entry.measured
    errors = {name: value for name, value in measured.items() if not name.startswith(_OTHER)}
    begun = {name: value for name, value in measured.items() if name.startswith("seconds_")}
    seconds = {name.removeprefix("seconds_").replace("_", " "): value for name, value in begun.items()}
    return NetworkInUse(DIALS[sense].name, entry.file, _INSTEAD_OF[sense], errors, seconds)


def _listed(numbers: Mapping[str, float]) -> str:
    return "\n".join(f"{name} {value:.3g}" for name, value in numbers.items()) or "not measured"
