"""``touchstone sim``: what the simulators compute, one at a time."""

from typing import TYPE_CHECKING, Annotated

import typer

from harness.commands import options
from harness.commands.output import print_result

if TYPE_CHECKING:
    from harness.basics.materials import Material
    from harness.basics.quantities import Dimension

_SI_OR_UNIT = "a number in SI units, or with its unit"


def modes(
    mesh: Annotated[
        str,
        typer.Argument(
            help="A surface, or tetrahedra of four or ten nodes (.inp, .msh, .vtu, ...); or builtin:NAME.",
            metavar="MESH",
            callback=options.check_mesh,
        ),
    ],
    material: Annotated[
        str | None, typer.Option(help="What it is made of; a built-in object's own if left out.", metavar="M")
    ] = None,
    units: options.Units = None,
    up_axis: options.UpAxis = None,
    young: Annotated[str | None, typer.Option(help="Young's modulus, as 210GPa.", metavar="E")] = None,
    poisson: Annotated[float | None, typer.Option(help="Poisson's ratio.", metavar="NU")] = None,
    density: Annotated[str | None, typer.Option(help="Density, as 7.85g/cm^3.", metavar="RHO")] = None,
    alpha: Annotated[
        str | None, typer.Option(help="Damping proportional to mass, in 1/s.", metavar="A")
    ] = None,
    beta: Annotated[
        str | None, typer.Option(help="Damping proportional to stiffness, in s.", metavar="B")
    ] = None,
    wall: options.Wall = None,
    count: Annotated[
        int | None, typer.Option("--modes", help="So many, the lowest.", metavar="N", min=1)
    ] = None,
    up_to: Annotated[
        str | None,
        typer.Option("--up-to", help="All up to this frequency; 20kHz if no number is given.", metavar="F"),
    ] = None,
    edge: options.LongestEdge = None,
    envelope: Annotated[
        str | None,
        typer.Option(
            help="How far cells may leave the surface, as 0.1mm; by wall, edge and size if left out. Less "
            "holds the volume better, of more cells.",
            metavar="L",
        ),
    ] = None,
    fixed: Annotated[
        list[str] | None,
        typer.Option(
            help="Hold a side (x-min, ..., z-max) or a set of nodes of the file; z-min:z holds one axis. "
            "May be given again; free if left out.",
            metavar="SIDE",
        ),
    ] = None,
    json: options.Json = False,
) -> int:
    """The frequencies and dampings of an object, and how sure it is that none is missing.

    A closed surface is filled with ten-node tetrahedra whose nodes lie on it. A file of tetrahedra is
    solved on its own nodes. Frequencies are those of the undamped object; a mode decays as exp(-d t).

    Try: touchstone sim modes plate.inp --material steel --units mm --modes 20
    """
    from harness import api
    from harness.basics.quantities import FREQUENCY, LENGTH
    from harness.objects.builtin import BUILTIN, MATERIALS

    if not material:
        # A built-in object is of its own material; a file states none.
        material = MATERIALS.get(mesh.removeprefix(BUILTIN)) if mesh.startswith(BUILTIN) else None
    found = api.modes(
        mesh,
        _material(material, young, poisson, density, alpha, beta),
        units,
        up_to=_in_si("--up-to", up_to, FREQUENCY),
        count=count,
        edge=options.quantity("--edge", edge, LENGTH),
        up_axis=up_axis,
        wall=options.quantity("--wall", wall, LENGTH),
        envelope=options.quantity("--envelope", envelope, LENGTH),
        fixed=fixed or (),
    )
    print_result(found, json)
    return 0


def _material(
    name: str | None,
    young: str | None,
    poisson: float | None,
    density: str | None,
    alpha: str | None,
    beta: str | None,
) -> "Material":
    """The named material with what the options change of it, or one of the options alone."""
    from harness.basics.errors import WrongUse
    from harness.basics.materials import MATERIALS, Material, material
    from harness.basics.quantities import DECAY, DENSITY, PRESSURE, TIME

    given = {
        "young": _in_si("--young", young, PRESSURE),
        "poisson": poisson,
        "density": _in_si("--density", density, DENSITY),
        "alpha": _in_si("--alpha", alpha, DECAY),
        "beta": _in_si("--beta", beta, TIME),
    }
    if name is not None:
        base = material(name)
        changed = any(value is not None for value in given.values())
        label = f"{base.name}, changed" if changed else base.name
    elif None in (young, poisson, density):
        raise WrongUse(
            f"say what it is made of: --material, one of {', '.join(MATERIALS)}; or all of --young, "
            "--poisson and --density"
        )
    else:
        base, label = Material("", 0.0, 0.0, 0.0, 0.0, 0.0), "as given"
    kept = {key: vars(base)[key] if value is None else value for key, value in given.items()}
    for key in ("alpha", "beta"):
        if not kept[key] >= 0.0:
            raise WrongUse(f"--{key} {kept[key]:g} would make the sound grow; say 0 or more")
    return Material(name=label, **kept)


def _in_si(option: str, text: str | None, kind: "Dimension") -> float | None:
    """The SI value of an option; a bare number is one in SI units."""
    try:
        return None if text is None else float(text)
    except ValueError:
        return options.quantity(option, text, kind)
