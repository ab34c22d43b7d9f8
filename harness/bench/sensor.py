"""The geometry of a tactile camera: all that a simulator needs to know of its make."""

from dataclasses import dataclass


@dataclass(frozen=True)
class MarkerGrid:
    """Printed dots on the gel: count, spacing and radius.

    Attributes:
        rows: dots along the image's rows (downwards).
        columns: dots along the image's columns.
        spacing: metres between neighbours.
        radius: metres.
    """

    rows: int
    columns: int
    spacing: float
    radius: float


@dataclass(frozen=True)
class TactileSensor:
    """A gel with a camera behind it.

    The ``gel`` frame has its origin at the centre of the undeformed gel surface, z out of
    the sensor towards the object, x along image columns, y along image rows. Pixel
    (row i, column j) has its centre at x = (j + 0.5 - columns / 2) * pitch,
    y = (i + 0.5 - rows / 2) * pitch.

    Attributes:
        name: of the make.
        rows: pixels.
        columns: pixels.
        pitch: metres a pixel.
        gel_thickness: metres; no press may be deeper.
        gel_radius: metres, of a dome that bulges towards the object; None for a flat gel.
        housing: metres (x, y): full size of the flat face around the gel.
        markers: the dots printed on the gel, None where there are none.
        casts_shadow: whether a grazing light makes shadows worth simulating.
    """

    name: str
    rows: int
    columns: int
    pitch: float
    gel_thickness: float
    gel_radius: float | None = None
    housing: tuple[float, float] = (0.034, 0.030)
    markers: MarkerGrid | None = None
    casts_shadow: bool = False

    @property
    def window(self) -> tuple[float, float]:
        """Metres (x, y): the area the camera sees."""
        return self.columns * self.pitch, self.rows * self.pitch


GELSIGHT_R15 = TactileSensor("GelSight R1.5 (ObjectFolder 2.0)", 120, 160, 0.1245e-3, 2.5e-3)
"""The paper's own sensor: 120 x 160 pixels of 0.1245 mm, a window of 19.9 x 14.9 mm."""
