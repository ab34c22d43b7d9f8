"""What the paper's networks answer from the readings of one run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from experiments.scale_estimation.touch.patch import Patch
from experiments.scale_estimation.unseen.paper.inputs import INPUTS, crop_of, sequence_of, spectrogram_of
from experiments.scale_estimation.unseen.paper.network import PaperNetwork
from experiments.scale_estimation.unseen.spectrogram import response_of
from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.clock import now
from harness.basics.errors import FitRefused
from harness.bench.acquisition import Strike
from harness.picture.object_mask import mask_by_background

PAPER_ROWS = MappingProxyType(
    {
        "picture": "ResNet-18, picture",
        "spectrogram": "ResNet-18, spectrogram",
        "imprints": "GRU, imprints without poses",
    }
)
"""Names of rows, by sense."""

_Views = list[dict[str, FloatArray]]


@dataclass(frozen=True, eq=False)
class PaperReadings:
    """The readings of a run as the paper has them: no poses, no material.

    Attributes:
        pictures: ``(rows, columns, 3)`` RGB with the object and without it; None without a look.
        focal_px: pixels of the camera's focal length.
        strikes: all that were made.
        patches: of the contacts that met the object, in their order.
    """

    pictures: tuple[ByteArray, ByteArray] | None
    focal_px: float
    strikes: Sequence[Strike]
    patches: Sequence[Patch]

    def views(self, sense: str) -> _Views:
        """The inputs of a sense's network, one or more.

        Raises:
            FitRefused: the run has no reading of the sense.
        """
        made: dict[str, Callable[[], _Views]] = {
            "picture": self._crop, "spectrogram": self._spectrograms, "imprints": self._sequence,
        }  # fmt: skip
        return made[sense]()

    def _crop(self) -> _Views:
        if self.pictures is None:
            raise FitRefused("the camera has not looked yet")
        live, bare = self.pictures
        return [{"crop": crop_of(live, mask_by_background(live, bare), self.focal_px)}]

    def _spectrograms(self) -> _Views:
        found = response_of(self.strikes)
        if found is None:
            raise FitRefused("no strike may be used: none was made, or none excited anything")
        responses, rate, band = found
        return [{"spectrogram": spectrogram_of(response, rate, band)} for response in responses]

    def _sequence(self) -> _Views:
        rows, last = sequence_of([patch.points for patch in self.patches])
        return [{"imprints": rows, "last": last}]


def paper_sizes(
    networks: Mapping[str, PaperNetwork], readings: PaperReadings
) -> dict[str, tuple[float | FitRefused, float]]:
    """By row: the size in m, or why there is none; and the seconds that it took."""
    found: dict[str, tuple[float | FitRefused, float]] = {}
    for sense in INPUTS:
        if sense in networks:
            began = now()
            size: float | FitRefused
            try:
                size = networks[sense].size(readings.views(sense))
            except FitRefused as refusal:
                size = refusal
            found[PAPER_ROWS[sense]] = size, now() - began
    return found
