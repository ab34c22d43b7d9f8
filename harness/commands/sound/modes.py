"""``touchstone sim``: what the simulators compute, one at a time."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from harness.commands import options
from harness.commands.output import ANSWERS, emit, warn

if TYPE_CHECKING:
    from harness.basics.materials import Material
    from harness.basics.quantities import Dimension
    from harness.sim.modal.file import FileModes

_SHOWN = 40
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
    units: Annotated[
        str | None, typer.Option(help="Of the file's numbers: m, cm, mm, um, in or ft.", metavar="U")
    ] = None,
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
    wall: Annotated[
        str | None,
        typer.Option(
            help="Wall of a hollow thing of which the file is the outside, as 2mm.", metavar="LENGTH"
        ),
    ] = None,
    count: Annotated[
        int | None, typer.Option("--modes", help="So many, the lowest.", metavar="N", min=1)
    ] = None,
    up_to: Annotated[
        str | None,
        typer.Option("--up-to", help="All up to this frequency; 20kHz if no number is given.", metavar="F"),
    ] = None,
    edge: Annotated[
        str | None,
        typer.Option(help="Longest edge of an element, as 3mm; chosen by the wave if left out.", metavar="L"),
    ] = None,
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
    from harness.basics.quantities import FREQUENCY, LENGTH
    from harness.basics.store import Store, default_folder
    from harness.objects.builtin import BUILTIN, MATERIALS
    from harness.sim.modal.file import modes_of_file

    if not material:
        # One of our own objects is of its own material; a file states none.
        material = MATERIALS.get(mesh.removeprefix(BUILTIN)) if mesh.startswith(BUILTIN) else None
    of = _material(material, young, poisson, density, alpha, beta)
    found = modes_of_file(
        mesh,
        of,
        units,
        wall=options.quantity("--wall", wall, LENGTH),
        limit=_in_si("--up-to", up_to, FREQUENCY),
        count=count,
        edge=options.quantity("--edge", edge, LENGTH),
        envelope=options.quantity("--envelope", envelope, LENGTH),
        fixed=fixed or (),
        up_axis=up_axis,
        store=Store(default_folder()),
    )
    if not json:
        for sentence in found.said:
            warn(sentence)
        _print(Path(mesh).name, found, of, count)
        return 0
    emit(_as_json(Path(mesh).name, found, of, count))
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


def _listed(found: "FileModes", count: int | None) -> Any:
    """Hz: as many as were asked for; what came with the last ones is counted but not listed."""
    return found.solution.modes.frequencies[:count]


def _as_json(name: str, found: "FileModes", of: "Material", count: int | None) -> dict[str, Any]:
    from harness.sim.modal.modes import dampings

    modes_, listed = found.solution.modes, _listed(found, count)
    finite = modes_.limit < float("inf")
    return {
        "schema": 1,
        "mesh": name,
        "material": dict(vars(of)),
        "units": found.units,
        "volume_mesh": found.volume,
        "frequencies_hz": listed.tolist(),
        "dampings_per_s": dampings(listed, of).tolist(),
        "rigid_modes": modes_.rigid,
        "unknowns": found.solution.unknowns,
        "nodes": modes_.nodes,
        "elements": modes_.elements,
        "bodies": found.bodies,
        "held_nodes": found.held,
        "edge_m": found.edge,
        "mass_kg": modes_.mass,
        "complete_below_hz": modes_.limit if finite else None,
        "modes_below": len(modes_.frequencies),
        "certified": found.solution.certified,
        "residual": modes_.residual,
        "seconds": dict(found.seconds),
        "notes": list(found.said),
    }


def _print(name: str, found: "FileModes", of: "Material", count: int | None) -> None:
    from harness.sim.modal.modes import dampings

    modes_, listed = found.solution.modes, _listed(found, count)
    drawn = Table(title=f"{name}: {of.name}, {modes_.mass:.4g} kg")
    for heading in ("mode", "Hz", "damping 1/s", "falls by 60 dB in s"):
        drawn.add_column(heading, justify="right")
    rates = dampings(listed, of)
    for row, (frequency, rate) in enumerate(zip(listed[:_SHOWN], rates, strict=False)):
        quiet = f"{6.9078 / rate:.3g}" if rate > 0.0 else "never"
        drawn.add_row(str(row + 1), f"{frequency:.6g}", f"{rate:.4g}", quiet)
    ANSWERS.print(drawn)
    if len(listed) > _SHOWN:
        ANSWERS.print(f"... and {len(listed) - _SHOWN} more up to {listed[-1]:.6g} Hz; --json lists all")
    below = f"below {modes_.limit:.6g} Hz" if modes_.limit < float("inf") else "in all"
    number = f"{len(modes_.frequencies)} modes {below}"
    if found.solution.certified:
        ANSWERS.print(f"certified: exactly {number}, counted by the inertia of the system")
    else:
        ANSWERS.print(f"not certified: {number} were found, but the factors do not say whether all")
    held = f"{found.held} nodes held, " if found.held else ""
    kind = "its own nodes" if found.volume else f"tetrahedra of {1e3 * (found.edge or 0.0):.3g} mm"
    ANSWERS.print(
        f"{modes_.elements} elements, {found.solution.unknowns} unknowns on {kind}; {held}{modes_.rigid} "
        f"rigid motions left out ({found.bodies} {'body' if found.bodies == 1 else 'bodies'})"
    )
    ANSWERS.print(", ".join(f"{stage} {took:.2f} s" for stage, took in found.seconds.items()))
