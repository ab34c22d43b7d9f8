"""What is said of a folder of imported networks: its model card in lines for people."""

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from harness.objectfile.published.entries import PublishedDescription


def published_lines(description: "PublishedDescription") -> list[str]:
    """The object, its networks, where they come from, and what the file did not hold."""
    source = description.provenance.sources[0]
    senses = (*_sound(description), *_touch(description), *_vision(description))
    dropped = sum(description.dropped.values())
    lines = [
        f"{description.name}, imported from {source.origin} ({description.format})",
        f"  sha256    {source.sha256}",
        f"  licence   {description.provenance.licence}",
        *senses,
    ]
    if dropped:
        lines.append(f"  dropped   {dropped} weights in {len(description.dropped)} layers that nothing uses")
    return [*lines, *(f"  lacks     {sentence}" for sentence in description.missing)]


def _sound(description: "PublishedDescription") -> list[str]:
    gains, spectrum = description.audio_gains, description.audio_spectrum
    if gains is not None:
        low, high = min(gains.frequencies_hz), max(gains.frequencies_hz)
        box = _box(gains.low_m, gains.high_m)
        return [f"  audio     {len(gains.frequencies_hz)} modes, {low:.5g} to {high:.5g} Hz; {box}"]
    if spectrum is not None:
        bounds = (
            "no bounds" if spectrum.bounds is None else "bounds {:g} to {:g} voxels".format(*spectrum.bounds)
        )
        return [f"  audio     spectra at {spectrum.rate_hz:g} Hz, {spectrum.samples} samples; {bounds}"]
    return ["  audio     none"]


def _touch(description: "PublishedDescription") -> list[str]:
    depth, colours = description.touch_depth, description.touch_colours
    if depth is not None:
        least, most = (1e3 * value for value in depth.depth_m)
        return [
            f"  touch     {depth.rows} x {depth.columns}, distance from the camera; {least:g} to {most:g} "
            "mm deep, tilts to "
            f"{math.degrees(depth.most_tilt_rad):g} deg; {_box(depth.low_m, depth.high_m)}"
        ]
    if colours is not None:
        bounds = (
            "no bounds" if colours.bounds_m is None else "bounds {:g} to {:g} m".format(*colours.bounds_m)
        )
        return [f"  touch     {colours.rows} x {colours.columns}, colours; {bounds}"]
    return ["  touch     none"]


def _vision(description: "PublishedDescription") -> list[str]:
    vision = description.vision
    if vision is None:
        return ["  vision    none"]
    further = f" and {vision.importance}" if vision.importance else ""
    cells = "" if vision.cells is None else " of {} x {} x {} cells".format(*vision.cells.cells)
    return [
        f"  vision    {vision.kind}{cells}, {vision.samples}{further} samples from {vision.near:g} to "
        f"{vision.far:g} in "
        "its own unit"
    ]


def _box(low: tuple[float, ...], high: tuple[float, ...]) -> str:
    size = " x ".join(f"{(b - a) * 1e3:.4g}" for a, b in zip(low, high, strict=True))
    return f"queries in a box of {size} mm"
