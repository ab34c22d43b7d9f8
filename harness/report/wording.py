"""Numbers as an operator reads them, and captions in words."""

from harness.basics.arrays import FloatArray
from harness.report.data import AnswerRow, PeakLine, ReportData, SenseAnswer, Sound
from harness.report.values import Missing

SENSES = {"touch": "touch", "audio": "sound", "both": "touch and sound"}
"""The senses by the names they have in answers, as an operator reads them."""

NONE = "\N{EN DASH}"
"""Stands where there is no number."""


def millimetres(metres: float | None, digits: int = 2) -> str:
    """A length with its unit, or a dash."""
    return NONE if metres is None else f"{metres * 1e3:.{digits}f} mm"


def area(square_metres: float | None) -> str:
    """An area with the unit that suits it, or a dash."""
    if square_metres is None:
        return NONE
    return f"{square_metres * 1e6:.0f} mm²" if square_metres < 1e-3 else f"{square_metres * 1e4:.0f} cm²"


def duration(seconds: float | None) -> str:
    """A time with the unit that suits it, or a dash."""
    if seconds is None:
        return NONE
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs"
    return f"{seconds * 1e3:.3g} ms" if seconds < 1.0 else f"{seconds:.2f} s"


def rate(hertz: float | None) -> str:
    """A frequency with its unit, or a dash."""
    if hertz is None:
        return NONE
    return f"{hertz:.4g} Hz" if hertz < 1e4 else f"{hertz / 1e3:.5g} kHz"


def place(position: FloatArray) -> str:
    """A point in millimetres."""
    x, y, z = position * 1e3
    return f"({x:.1f}, {y:.1f}, {z:.1f}) mm"


def headline(data: ReportData) -> str:
    """The answer in one sentence."""
    answer = data.answer
    if isinstance(answer, Missing):
        return f"No answer: {answer.reason}."
    said = [f"The last contact lies at {place(answer.position)} on the {data.object_name}"]
    if answer.error is not None:
        said.append(f"{millimetres(answer.error)} from the truth")
    if answer.credible90 is not None:
        said.append(f"with 90 % certainty within {millimetres(answer.credible90, 1)}")
    sentence = ", ".join(said) + "."
    if answer.modes > 1:
        sentence += f" The readings fit {answer.modes} separate places; this is the likeliest."
    if isinstance(data.sound, Missing):
        return sentence
    senses = ", ".join(f"by {SENSES[sense.name]} {_nearness(sense)}" for sense in data.sound.senses)
    return f"{sentence} {senses[:1].upper()}{senses[1:]}."


def _nearness(sense: SenseAnswer) -> str:
    if isinstance(sense.posterior, Missing):
        return "no answer"
    certain = f"90 % within {millimetres(sense.posterior.credible90, 1)}"
    return certain if sense.error is None else f"{millimetres(sense.error)} off ({certain})"


def heard(sound: Sound) -> str:
    """What the strikes say together, in one or two sentences."""
    counted = sum(strike.unused == "" for strike in sound.strikes)
    said = f"{counted} of {len(sound.strikes)} strikes count"
    if sound.band is not None:
        said += f"; together they excite {sound.band[0] / 1e3:.1f} to {sound.band[1] / 1e3:.1f} kHz"
    if not isinstance(sound.peaks, Missing):
        matched = sum(bool(peak.modes) for peak in sound.peaks)
        number = len(sound.peaks)
        common = f"{number} {'resonance'}" + ("" if number == 1 else "s")
        said += f". {common} in common, {matched} of them taken for modes"
        if sound.set_aside:
            said += f", and {sound.set_aside} more set aside as echoes or as more than one waveform"
        side = "above" if sound.scale >= 1.0 else "below"
        said += f". The object rings {100.0 * abs(sound.scale - 1.0):.1f} % {side} its model"
    return said + "."


def modes_of(peak: PeakLine) -> str:
    """Numbers of the modes that a peak is taken for."""
    if not peak.modes:
        return "none"
    first, last = peak.modes[0], peak.modes[-1]
    return str(first) if first == last else f"{first} to {last}"


def percent(share: float | None) -> str:
    """A signed relative difference, or a dash."""
    return NONE if share is None else f"{100.0 * share:+.2f} %"


def quantity(value: float | None, unit: str, digits: int = 3) -> str:
    """A number to so many digits with its unit, or a dash."""
    return NONE if value is None else f"{value:.{digits}g} {unit}"


def cards(answer: AnswerRow) -> list[tuple[str, str, str]]:
    """(what, value, remark) of the numbers that stand first."""
    shown = [
        ("error", millimetres(answer.error), "last contact, straight line"),
        ("error modulo symmetry", millimetres(answer.error_symmetric), "least over the object's rotations"),
        ("90 % radius", millimetres(answer.credible90, 1), "of the posterior about the answer"),
        ("estimation took", duration(answer.seconds), "from readings to answer"),
        ("mean error", millimetres(answer.error_mean), "over all contacts of the run"),
        ("geometry alone", millimetres(answer.geometry_baseline, 1), "baseline: translations, no touch"),
        ("random point", millimetres(answer.random_baseline, 1), "baseline: no knowledge"),
        ("likely places", str(answer.modes), "separate modes of the posterior"),
    ]
    return [card for card in shown if card[1] != NONE]
