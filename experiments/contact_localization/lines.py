"""A localization's answer for people, from its result."""

from collections.abc import Mapping
from typing import Any


def answer_lines(result: Mapping[str, Any]) -> list[str]:
    """A line for each sense; the last one with the baselines."""
    estimates = result["estimates"]
    last = next(reversed(estimates))
    return [answer_line(result, sense, baselines=sense == last) for sense in estimates]


def answer_line(result: Mapping[str, Any], sense: str, baselines: bool) -> str:
    """The answer, its error where the truth is known, how sure it is, what it took, the baselines."""
    found = result["estimates"][sense]
    if "refused" in found:
        return f"{sense}: refused: {found['refused']}"
    x, y, z = (1e3 * value for value in found["position_m"])
    said = [
        f"{sense}: contact {result['contacts']} at ({x:.1f}, {y:.1f}, {z:.1f}) mm on the {result['object']}"
    ]
    if found["error_m"] is not None:
        symmetric = found["error_symmetric_m"]
        modulo = f" ({millimetres(symmetric)} modulo symmetry)" if symmetric < 0.9 * found["error_m"] else ""
        said.append(f"error {millimetres(found['error_m'])}{modulo}")
    if len(found["modes"]) > 1:
        said.append(f"{len(found['modes'])} likely places")
    said.append(f"90 % within {millimetres(found['credible90_m'])}")
    said.append(f"{found['seconds']:.2f} s")
    if baselines and result["geometry_baseline_m"] is not None:
        said.append(
            f"baselines: geometry alone {millimetres(result['geometry_baseline_m'])}, "
            f"random {millimetres(result['random_baseline_m'])}"
        )
    mock = "mock bench, " if result["mock"] else ""
    return mock + "; ".join(said)


def millimetres(metres: float) -> str:
    """For people."""
    return f"{metres * 1e3:.1f} mm"
