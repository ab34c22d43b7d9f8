"""A toy section: the thermometer's table of a station file, and its row in the table of kinds."""

from collections.abc import Callable
from typing import ClassVar, Literal

from harness.bench.device import InstrumentName
from harness.bench.instruments.section import AtRest, InstrumentKind, InstrumentSection
from harness.bench.station import Bench
from harness.bench.station_file import Station
from tests.harness.bench.thermometer.driver import Thermometer


class ThermometerSection(InstrumentSection):
    address_key: ClassVar[str] = "address"
    kind: Literal["thermometer-line"] = "thermometer-line"
    address: str | None = None
    serial: str = ""

    @property
    def nominal_rate(self) -> float:
        return 10.0

    def options(self, _station: Station, _alarm: Callable[[], str]) -> dict[str, object]:
        return {"address": self.address, "serial": self.serial}

    def probe(self, name: str, bench: Bench) -> AtRest:
        kelvin = float(bench.get(InstrumentName[Thermometer](name)).read(1, 5.0).values[0])
        return AtRest({"temperature_k": kelvin}, {name: f"{kelvin:.1f} K"})


THERMOMETER: InstrumentName[Thermometer] = InstrumentName("thermometer")

ROW = InstrumentKind(
    section="tests.harness.bench.thermometer.section:ThermometerSection",
    driver="tests.harness.bench.thermometer.driver:Thermometer",
    mock="tests.harness.bench.thermometer.mock:start_thermometer",
)
