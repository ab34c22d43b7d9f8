"""``touchstone object``: what an ObjectFile holds, and whether it is what it says."""

import math
from typing import TYPE_CHECKING, Any

from harness.commands import options
from harness.commands.output import ANSWERS, emit, print_result

if TYPE_CHECKING:
    from harness.objectfile.description import Description
    from harness.objectfile.published.entries import PublishedDescription


def info(folder: options.ObjectFolder, json: options.Json = False) -> int:
    """Say what an ObjectFile holds: the object, its modes, its networks, where they come from.

    Only object.json is read; whether the files are what it says is asked of `touchstone object verify`.

    Try: touchstone object info objects/mug
    """
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.published.entries import open_either

    of = open_either(folder)
    if json:
        emit({"folder": str(folder), **of.description.model_dump(mode="json", by_alias=True)})
        return 0
    lines = _lines(of.description) if isinstance(of, ObjectFile) else published_lines(of.description)
    for line in lines:
        ANSWERS.print(line, markup=False)
    return 0


def verify(folder: options.ObjectFolder, json: options.Json = False) -> int:
    """Check an ObjectFile: hashes, graphs, shapes, finite answers, and the answers it was made with.

    Nothing is written, nothing outside of the folder is read, and nothing in it can run code: a graph
    whose weights lie elsewhere, or that asks for an unknown operation, is refused before it is opened.
    Exit code 0 where all holds, 1 where anything does not; every line that fails says what to do.

    Try: touchstone object verify objects/mug
    """
    from harness import api

    verified = api.verify_object(folder)
    print_result(verified, json)
    return 0 if verified.verified else 1


def published_lines(description: "PublishedDescription") -> list[str]:
    """Describe imported networks: the source, the tables of each sense, and what the file did not hold."""
    source = description.provenance.sources[0]
    lines = [
        f"{description.name}, imported from {source.origin} ({description.format})",
        f"  sha256    {source.sha256}",
        f"  licence   {description.provenance.licence}",
    ]
    for sense in ("audio_gains", "audio_spectrum", "touch_depth", "touch_colours", "vision"):
        fields = []
        for key, value in getattr(description, sense) or ():
            if isinstance(value, tuple) and len(value) > 3:
                fields.append(f"{len(value)} {key} from {min(value):.5g} to {max(value):.5g}")
            elif isinstance(value, tuple | float | int | str):
                fields.append(f"{key} {value}")
        if fields:
            lines.append(f"  {sense}: {'; '.join(fields)}")
    dropped = sum(description.dropped.values())
    if dropped:
        lines.append(f"  dropped   {dropped} weights in {len(description.dropped)} layers that nothing uses")
    return [*lines, *(f"  lacks     {sentence}" for sentence in description.missing)]


def _lines(description: "Description") -> list[str]:
    mesh, material = description.mesh, description.material
    size = " x ".join(f"{(b - a) * 1e3:.4g}" for a, b in zip(mesh.low_m, mesh.high_m, strict=True))
    lines = [
        f"{description.name}, of {material.name}",
        f"  mesh      {mesh.file}: {mesh.vertices} vertices, {mesh.faces} faces, {size} mm",
        f"  material  {material.density_kg_per_m3:g} kg/m3, E = {material.young_pa:g} Pa, "
        f"nu = {material.poisson:g}, alpha = {material.rayleigh_alpha_per_s:g}/s, "
        f"beta = {material.rayleigh_beta_s:g} s",
        f"  licence   {description.provenance.licence}",
    ]
    lines += _audio_lines(description)
    lines += _touch_lines(description)
    return [*lines, *_vision_lines(description)]


def _touch_lines(description: "Description") -> list[str]:
    touch = description.touch
    if touch is None:
        return ["  touch     none yet"]
    gel, (low, high) = touch.gel, touch.depth_m
    lines = [
        f"  touch     {gel.name}, {gel.rows} x {gel.columns}; {low * 1e3:g} to {high * 1e3:g} mm deep, "
        f"tilts to {math.degrees(touch.most_tilt_rad):g} deg"
    ]
    if touch.codes is not None:
        size = _megabytes(touch.codes.network.bytes + touch.codes.nodes.bytes)
        lines.append(
            f"    codes   {touch.codes.network.file}, {size}{_measured(touch.codes.network.measured)}"
        )
    if touch.perceptron is not None:
        size = _megabytes(touch.perceptron.bytes)
        lines.append(f"    perceptron {touch.perceptron.file}, {size}; this version does not render it")
    return lines


def _vision_lines(description: "Description") -> list[str]:
    vision = description.vision
    if vision is None:
        return ["  vision    none yet"]
    grid, size, network = vision.grid, vision.size, vision.network
    return [
        f"  vision    {vision.level}: {grid.networks} networks {size.width} wide, in cubes of "
        f"{grid.cell_m * 1e3:.4g} mm; {vision.colour}, camera as {vision.camera}",
        f"    network {network.file}, {_megabytes(network.bytes)}{_measured(network.measured)}",
    ]


def _audio_lines(description: "Description") -> list[str]:
    audio = description.audio
    if audio is None:
        return ["  audio     none yet"]
    low, high = audio.frequencies_hz[0], audio.frequencies_hz[-1]
    lines = [
        f"  audio     {len(audio.frequencies_hz)} modes, {low:.5g} to {high:.5g} Hz, all up to "
        f"{audio.complete_up_to_hz:.5g} Hz; {audio.mass_kg:.4g} kg; queries within "
        f"{audio.near_surface_m * 1e3:g} mm of the surface"
    ]
    if audio.network is not None:
        size, measured = _megabytes(audio.network.bytes), _measured(audio.network.measured)
        lines.append(f"    network {audio.network.file}, {size}{measured}")
    if audio.table is not None:
        size = _megabytes(audio.table.bytes + audio.table.surface.bytes)
        lines.append(f"    table   {audio.table.file}, {size}{_measured(audio.table.measured)}")
    return lines


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.2f} MB"


def _measured(numbers: dict[str, Any]) -> str:
    return "".join(f"; {name} {number:.4g}" for name, number in numbers.items())
