"""Options of a press that several commands take: its pose, its gel and its force."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypedDict

import typer

from harness.commands import options, places

if TYPE_CHECKING:
    from harness.sim.gel.elastic import GelElastic

Contact = Annotated[
    places.Coordinates | None,
    typer.Option(help="Pressed point in the object's frame: metres, or each with its unit.", metavar="X Y Z"),
]
Depth = Annotated[
    str | None,
    typer.Option(help="Distance that the centre of the gel is pressed on; 1mm if left out.", metavar="L"),
]
Tilt = Annotated[
    str | None,
    typer.Option(help="Angle between the gel's axis and the normal; 0deg if left out.", metavar="A"),
]
Azimuth = Annotated[
    str | None,
    typer.Option(
        help="Direction of the tilt, from the gel's x axis at no yaw; 0deg if left out.", metavar="A"
    ),
]
Yaw = Annotated[
    str | None,
    typer.Option(help="Rotation of the sensor about its own axis; 0deg if left out.", metavar="A"),
]
Sensor = Annotated[
    str | None,
    typer.Option(
        help="Sensor that presses: a shipped name or a sensor file; that of the calibration, else "
        "gelsight-r1.5, if left out.",
        metavar="NAME",
    ),
]
Calibration = Annotated[
    str | None,
    typer.Option(
        help="Calibration of the colours: a file, a shipped name, or a folder of Taxim's or ObjectFolder's; "
        "the sensor's own if left out.",
        metavar="FILE",
    ),
]
Force = Annotated[
    bool,
    typer.Option(
        "--force",
        help="Compute the force in N with its error as well: docs/explanation/touch_force.md.",
    ),
]
Modulus = Annotated[
    str | None,
    typer.Option(
        "--gel-modulus",
        help="Young's modulus of the gel, e.g. 0.2MPa; 0.255MPa +- 53 % if left out, as no measurement of "
        "this gel is published. Forces are proportional to it.",
        metavar="PRESSURE",
    ),
]
ModulusError = Annotated[
    str | None,
    typer.Option(
        "--gel-modulus-error", help="One standard deviation of --gel-modulus, e.g. 5%.", metavar="SHARE"
    ),
]
Poisson = Annotated[
    float | None,
    typer.Option("--gel-poisson", help="Poisson's ratio of the gel, 0 to 0.5; 0.485 if left out."),
]
Table = Annotated[
    Path | None,
    typer.Option(
        "--force-table", help="Forces measured on this gel, instead of its modulus.", metavar="FILE.json"
    ),
]
PressureOut = Annotated[
    Path | None,
    typer.Option("--pressure-out", help="File for the pressure in Pa of every pixel.", metavar="FILE.npy"),
]


class PressPose(TypedDict):
    """The pose of a press; lengths in m, angles in rad."""

    contact: tuple[float, float, float] | None
    depth: float
    tilt: float
    azimuth: float
    yaw: float


def read_pose(
    contact: Contact, depth: Depth = None, tilt: Tilt = None, azimuth: Azimuth = None, yaw: Yaw = None
) -> PressPose:
    """Read the options of a pose; ``WrongUse`` names the option that cannot be read."""
    from harness.basics.quantities import ANGLE, LENGTH

    return {
        "contact": None if contact is None else places.point("--contact", contact),
        "depth": options.quantity("--depth", depth or "1mm", LENGTH),
        "tilt": options.quantity("--tilt", tilt or "0deg", ANGLE),
        "azimuth": options.quantity("--azimuth", azimuth or "0deg", ANGLE),
        "yaw": options.quantity("--yaw", yaw or "0deg", ANGLE),
    }


def read_stiffness(
    force: bool,
    levels: Sequence[str],
    modulus: str | None,
    share: str | None,
    poisson: float | None,
    **others: object,
) -> "GelElastic | None":
    """Read the stiffness of the gel, the assumed one if no option states it; None if no force is computed.

    Raises:
        WrongUse: options of a force without ``--force``, or a modulus without its error.
    """
    from dataclasses import replace

    from harness.basics.errors import WrongUse
    from harness.basics.quantities import PRESSURE, RATIO
    from harness.sim.gel.elastic import NOT_MEASURED, GelElastic
    from harness.tasks.press_force import FORCE_LEVEL

    named = {"gel-modulus": modulus, "gel-modulus-error": share, "gel-poisson": poisson, **others}
    idle = [f"--{name.replace('_', '-')}" for name, value in named.items() if value is not None]
    idle += [text for text in levels if text.startswith(FORCE_LEVEL)]
    if idle and not force:
        raise WrongUse(f"{idle[0]} needs a force; add --force, or omit {idle[0]}")
    if (modulus is None) != (share is None):
        raise WrongUse(
            "a modulus needs its error; say both, e.g. --gel-modulus 0.2MPa --gel-modulus-error 10%"
        )
    gel = NOT_MEASURED
    if modulus is not None:
        young = options.quantity("--gel-modulus", modulus, PRESSURE)
        gel = GelElastic(young, options.quantity("--gel-modulus-error", share or "", RATIO))
    gel = gel if poisson is None else replace(gel, poisson=poisson)
    return gel if force else None
