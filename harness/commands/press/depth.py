"""``touchstone depth``: how deep a gel is pressed, from live pictures, with the error of every pixel."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from harness.commands import force_options as forces
from harness.commands import options
from harness.commands.output import ANSWERS, emit, warn

if TYPE_CHECKING:
    from harness.basics.arrays import ByteArray, FloatArray
    from harness.bench.sensor import TactileSensor
    from harness.sim.gel.elastic import GelElastic
    from harness.sim.optics.depth_reading import DepthReading
    from harness.sim.optics.tactile_calibration import TactileCalibration


FRAME_WORDS = {"gel": "of the gel", "flange": "of the arm's flange"}


def depth(
    images: Annotated[
        list[Path],
        typer.Argument(
            help="What the camera saw of one press that was held still; of several frames the mean is read.",
            metavar="IMAGE...",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Arrays without pickles: height, sigma (metres), contact, trusted, points, points_sigma. "
            "Without it the figures are only printed.",
            metavar="FILE.npz",
        ),
    ] = None,
    calibration: Annotated[
        str | None,
        typer.Option(
            help="As calibrate taxim wrote it, or a shipped one's name; that of --station if left out.",
            metavar="FILE",
        ),
    ] = None,
    background: Annotated[
        Path | None,
        typer.Option(
            help="Picture of the untouched gel, taken just before the press. The calibration's if left out, "
            "with a note.",
            metavar="IMAGE",
        ),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            help="Sensor whose gel is pressed: a shipped name or a sensor file. Its thickness bounds the "
            "depth. If left out, that of --station, or the shipped one that the calibration names.",
            metavar="NAME",
        ),
    ] = None,
    station: Annotated[
        str | None,
        typer.Option(
            help="A bench: points are then in the frame of its arm's flange, else in the gel's own.",
            metavar="NAME",
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Live picture, heights and their error.", metavar="FILE.png")
    ] = None,
    height_out: Annotated[
        Path | None,
        typer.Option(
            help="The heights alone, as `sim touch --heights-of gel` takes them.", metavar="FILE.npy"
        ),
    ] = None,
    force: forces.Force = False,
    thickness: Annotated[
        str | None,
        typer.Option(
            help="Thickness of the gel, for --force; that of the sensor if left out.", metavar="LENGTH"
        ),
    ] = None,
    gel_modulus: forces.Modulus = None,
    gel_modulus_error: forces.ModulusError = None,
    gel_poisson: forces.Poisson = None,
    json: options.Json = False,
) -> int:
    """Read the surface of a pressed gel from what its camera saw.

    Every pixel has its height and one standard deviation of it: by the camera's noise, the calibration's own
    misfit, slopes steeper than it knows, and what a contact itself does to the colour.

    Try: touchstone depth press.png --background rest.png --calibration gelsight_r15_bench --picture d.png
    """
    from harness.basics.errors import WrongUse
    from harness.basics.files.named_file import refusals_name
    from harness.basics.npz_file import write_array, write_arrays
    from harness.bench.sensor import described_sensor
    from harness.bench.station_file import load_station, station_path
    from harness.picture.image_file import read_image
    from harness.recording.run_folder import station_calibration
    from harness.sim.optics.depth_reading import read_press
    from harness.sim.optics.inverse import DRIFTING, STEADY
    from harness.sim.optics.lit_calibration import named_calibration

    options.require_files(
        ("--out", out, ".npz"), ("--picture", picture, ".png"), ("--height-out", height_out, ".npy")
    )
    bench = None if station is None else load_station(station_path(station))
    if sensor is not None:
        gel: TactileSensor | None = described_sensor(sensor).sensor
    else:
        gel = None if bench is None else bench.gel.sensor
    if calibration is not None:
        known = named_calibration(calibration)
    elif bench is not None:
        known = station_calibration(bench)
    else:
        raise WrongUse("say by which colours: --calibration FILE, or a --station that has one")
    gel = gel or _sensor_named_by(known)
    wanted = _wanted_force(force, thickness, gel_modulus, gel_modulus_error, gel_poisson, gel)
    rest = None if background is None else read_image(background)
    # A background of just now is by the light of now; the calibration's is of another day.
    detection = DRIFTING if rest is None else STEADY
    frames, thickness_known = _frames(images), None if gel is None else gel.gel_thickness
    with refusals_name(*images, *([] if background is None else [background])):
        found = read_press(frames, known, detection, rest, thickness_known)
    frame_from_gel = None if bench is None else bench.flange_from_gel
    points = found.points(frame_from_gel)
    pressed = _force_json(wanted, found)
    if out is not None:
        arrays = {"height": found.height, "sigma": found.sigma, "contact": found.contact}
        arrays |= {"trusted": found.trusted, "points": points, "points_sigma": found.sigma[found.contact]}
        write_arrays(out, arrays, compressed=True)
    if height_out is not None:
        write_array(height_out, found.height)
    if picture is not None:
        from harness.report.figures.figures import Album
        from harness.report.figures.touch import depth_figure

        Album(picture.parent).photograph(picture.stem, depth_figure(found))
    answer = _answer(found, known, points, "gel" if bench is None else "flange")
    answer["sensor"] = None if gel is None else {"name": gel.name, "gel_thickness_m": gel.gel_thickness}
    if gel is None:
        answer["notes"].append(
            "the thickness of the gel is not known, and the depth is not compared with it: the calibration "
            f"is of {known.header.sensor!r}; give --sensor"
        )
    elif sensor is not None and (own := _sensor_named_by(known)) is not None and own.name != gel.name:
        answer["notes"].append(
            f"the calibration is of {own.name!r} and --sensor is {gel.name!r}, "
            f"{1e3 * gel.gel_thickness:g} mm thick: the depth is right only if this gel has the "
            "calibration's colours and pixels"
        )
    files = {"out": out, "picture": picture, "height_out": height_out}
    answer |= {name: None if path is None else str(path) for name, path in files.items()}
    answer["images"] = [str(path) for path in images]
    answer["seconds"]["force_cpu"] = pressed.pop("seconds")
    answer["notes"] += pressed.pop("notes")
    answer |= pressed
    for sentence in answer["notes"]:
        warn(sentence)
    if json:
        emit(answer)
    else:
        _say(answer)
    return 0


def _sensor_named_by(known: "TactileCalibration") -> "TactileSensor | None":
    """Return the shipped sensor that a calibration names as its own; None where there is none.

    Number and size of the pixels do not identify a sensor: gels of 2 to 5 mm share them.
    """
    from harness.bench.sensor import described_sensor, shipped_sensors

    sensors = [described_sensor(name).sensor for name in shipped_sensors()]
    return next((sensor for sensor in sensors if sensor.name == known.header.sensor), None)


def _frames(images: list[Path]) -> "ByteArray":
    import numpy as np

    from harness.basics.errors import DataRefused
    from harness.picture.image_file import read_image

    read = [read_image(path) for path in images]
    for path, one in zip(images, read, strict=True):
        if one.shape != read[0].shape:
            raise DataRefused(
                f"{path} is {one.shape[1]} x {one.shape[0]} pixels and {images[0]} {read[0].shape[1]} x "
                f"{read[0].shape[0]}; give frames of one press by one camera"
            )
    return np.stack(read)


def _answer(
    found: "DepthReading", known: "TactileCalibration", points: "FloatArray", frame: str
) -> dict[str, Any]:
    """The one JSON object, but for the files."""
    import numpy as np

    contact, (row, column) = found.contact, found.deepest
    touched = bool(contact.any())
    deepest_at = int(np.argmax(found.height[contact])) if touched else 0
    border = bool(contact[[0, -1]].any() or contact[:, [0, -1]].any())
    return {
        "schema": 1,
        "calibration": {"made_from": known.header.made_from, "sha256": known.sha256},
        "made_square_by": found.aspect,
        "rows": found.height.shape[0],
        "columns": found.height.shape[1],
        "pitch_m": found.pitch,
        "contact": touched,
        "contact_pixels": int(contact.sum()),
        "contact_area_m2": float(contact.sum()) * found.pitch**2,
        "deepest_m": float(found.height[row, column]),
        "deepest_sigma_m": float(found.sigma[row, column]),
        "deepest_point_m": points[deepest_at].tolist() if touched else None,
        "frame": frame,
        "sigma_contact_m": float(np.median(found.sigma[contact])) if touched else None,
        "sigma_rest_m": float(found.sigma.min()),
        "trusted_share": float(found.trusted[contact].mean()) if touched else None,
        "light_moved_levels": found.depth.drift[0].tolist(),
        "flags": {
            "no_contact": not touched,
            "touches_border": border,
            "not_anchored": not found.anchored,
        },
        "seconds": {"reading_cpu": found.seconds[0], "error_cpu": found.seconds[1]},
        "notes": _notes(found, touched, border),
    }


def _notes(found: "DepthReading", touched: bool, border: bool) -> list[str]:
    said = list(found.notes)
    if not touched:
        said.append("no contact: nothing in the picture differs from the untouched gel")
    if border:
        said.append("the contact reaches the edge of the window; there is more of it than is seen")
    if not found.anchored:
        said.append(
            "none of the gel in view is at rest, or the light changed: heights are counted from their least, "
            "and only shapes mean anything; take --background just before the press, or leave it out"
        )
    if touched and found.trusted[found.contact].mean() < 0.5:
        said.append(
            "more than half of the contact is steeper than any press of the calibration, or of another "
            "colour: its heights are worth what their error says"
        )
    if found.aspect != 1.0:
        said.append(f"the picture was made square by {found.aspect:.4f}, as the calibration's presses were")
    return said


def _say(answer: dict[str, Any]) -> None:
    if answer["contact"]:
        x, y, z = (1e3 * value for value in answer["deepest_point_m"])
        ANSWERS.print(
            f"{1e3 * answer['deepest_m']:.3f} mm at the deepest (one standard deviation "
            f"{1e3 * answer['deepest_sigma_m']:.3f}), at ({x:.2f}, {y:.2f}, {z:.2f}) mm in the frame "
            f"{FRAME_WORDS[answer['frame']]}"
        )
        ANSWERS.print(
            f"{answer['contact_pixels']} pixels in contact, a deviation of "
            f"{1e3 * answer['sigma_contact_m']:.3f} mm in the median, slopes of "
            f"{answer['trusted_share']:.0%} of them trusted"
        )
    else:
        ANSWERS.print("no contact")
    if answer["force_n"] is not None:
        ANSWERS.print(forces.sentence(answer["force_n"], answer["force_uncertainty_n"]))
    moved = ", ".join(f"{level:+.1f}" for level in answer["light_moved_levels"])
    ANSWERS.print(f"the light moved by {moved} grey levels (red, green, blue)")
    seconds = answer["seconds"]
    ANSWERS.print(
        f"reading {1e3 * seconds['reading_cpu']:.0f} ms, its error {1e3 * seconds['error_cpu']:.0f} ms of "
        "the processor"
    )
    for name in ("out", "height_out", "picture"):
        if answer[name] is not None:
            ANSWERS.print(answer[name], markup=False)


def _wanted_force(
    force: bool,
    thickness: str | None,
    modulus: str | None,
    share: str | None,
    poisson: float | None,
    sensor: "TactileSensor | None",
) -> "tuple[float, GelElastic] | None":
    """Return the gel's thickness in metres and its stiffness; None where no force is asked for.

    Raises:
        WrongUse: options of a force without ``--force``, or a gel of which nobody says how thick it is.
    """
    from harness.basics.errors import WrongUse
    from harness.basics.quantities import LENGTH

    forces.require_force(force, [], modulus, share, **{"--thickness": thickness, "--gel-poisson": poisson})
    if not force:
        return None
    found = options.positive("--thickness", thickness, LENGTH)
    if found is None:
        if sensor is None:
            raise WrongUse(
                "a force needs to know how thick the gel is: --thickness 2.5mm, a --sensor or a --station"
            )
        found = sensor.gel_thickness
    return found, forces.stiffness(modulus, share, poisson)


def _force_json(wanted: "tuple[float, GelElastic] | None", read: "DepthReading") -> dict[str, Any]:
    """Return the keys of the answer, as ``sim touch`` has them, and its ``notes`` and ``seconds``."""
    if wanted is None:
        return {"force_n": None, "force_uncertainty_n": None, "force": None, "notes": [], "seconds": None}
    from harness.sim.optics.depth_reading import read_force

    began, (thickness, elastic) = time.process_time(), wanted
    found = read_force(read, thickness, elastic)
    took = time.process_time() - began
    bound = bool(found.pressed.lower_bound[0]) or not read.anchored
    said = forces.described(found.pressed, "layer", elastic, bound)
    said["uncertainty_shares"]["reading"] = found.reading
    return {
        "force_n": found.newtons,
        "force_uncertainty_n": found.uncertainty,
        "force": {**said, "thickness_m": thickness},
        "notes": forces.noted(found.pressed, elastic, bound),
        "seconds": took,
    }
