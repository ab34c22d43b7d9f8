"""The part of a report that holds live readings beside a model of the object and beside the twin."""

from dataclasses import dataclass

from harness.agreement.agreement import Agreement, JudgedSense, Residual
from harness.report.figures.agreement import agreement_figure
from harness.report.figures.figures import Album, Picture
from harness.report.values import Missing


@dataclass(frozen=True)
class AgreementRow:
    """One sense of the table.

    Attributes:
        sense: its name.
        source: what it is compared with.
        verdict: of it.
        sentence: the residual that speaks most against the model with its numbers, or why there is none.
        doubted: whether it does not fit.
    """

    sense: str
    source: str
    verdict: str
    sentence: str
    doubted: bool


@dataclass(frozen=True)
class AgreementPart:
    """What the part shows.

    Attributes:
        about: the object that was compared with.
        summary: whether all fits, or what is first in doubt.
        rows: one a sense.
        picture: live, model and difference of the step in doubt, or of the first; and why there is none.
    """

    about: str
    summary: str
    rows: tuple[AgreementRow, ...]
    picture: Picture | Missing


def agreement_part(found: Agreement | Missing, album: Album) -> AgreementPart | Missing:
    """The part of a run's page; its picture goes into the album."""
    if isinstance(found, Missing):
        return found
    rows = tuple(
        AgreementRow(
            one.compared.sense,
            one.compared.source,
            one.verdict,
            sentence,
            one.verdict == "does not fit",
        )
        for one, sentence in zip(found.senses, found.sentences(), strict=True)
    )
    return AgreementPart(found.about, _summary(found), rows, _picture(found, album))


def _summary(found: Agreement) -> str:
    doubt = found.first_doubt
    if doubt is not None:
        return f"First in doubt: {doubt[1]}, at step {doubt[0] + 1}."
    return "Everything that can be compared fits." if found.fits else "Nothing could be compared."


def _picture(found: Agreement, album: Album) -> Picture | Missing:
    shown = [(one, residual) for one in found.senses if (residual := _shown(one)) is not None]
    pairs = {_title(one, residual): residual.sides for one, residual in shown if residual.sides is not None}
    if not pairs:
        return Missing("no sense that was compared has a picture")
    return album.drawing("agreement", agreement_figure(pairs))


def _shown(one: JudgedSense) -> Residual | None:
    """The residual in doubt, or the first that has a picture."""
    if one.doubted is not None and one.doubted.sides is not None:
        return one.doubted
    return next((residual for residual in one.compared.residuals if residual.sides is not None), None)


def _title(one: JudgedSense, residual: Residual) -> str:
    of = f"{one.compared.sense} against the {one.compared.source}, step {residual.step + 1}"
    return f"{of}: {residual.quantity}, {'in doubt' if residual is one.doubted else one.verdict}"
