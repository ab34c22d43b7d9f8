"""Numbers as an operator reads them, and captions in words."""

from harness.arrays import FloatArray
from harness.report.data import Answer, ReportData
from harness.report.values import Missing

NONE = "\N{EN DASH}"
"""Stands where there is no number."""


def millimetres(metres: float | None, digits: int = 2) -> str:
    """A length with its unit, or a dash."""
    return NONE if metres is None else f"{metres * 1e3:.{digits}f} mm"


def duration(seconds: float | None) -> str:
    """A time with the unit that suits it, or a dash."""
    if seconds is None:
        return NONE
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs"
    return f"{seconds * 1e3:.3g} ms" if seconds < 1.0 else f"{seconds:.2f} s"


def rate(hertz: float | None) -> str:
    """A frequency with its unit, or a dash."""
    return NONE if hertz is None else f"{hertz:.4g} Hz"


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
    return sentence


def cards(answer: Answer) -> list[tuple[str, str, str]]:
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
