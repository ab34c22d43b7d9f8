"""A scale estimation's answer as JSON values, and in lines for people."""

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from experiments.scale_estimation.answer import OUTSIDE, Said, ScoredSize, SizeAnswer
from experiments.scale_estimation.size import Belief
from experiments.scale_estimation.sound.hearing import Hearing
from experiments.scale_estimation.touch.touch import Touch, doubted_cost
from experiments.scale_estimation.unseen.answer import ShapelessAnswer
from harness.basics.errors import FitRefused

OPEN = 0.5
"""Of the width of what is known without any reading: an interval wider than that leaves the size open."""

_NARROWED_BY = {
    "vision": "state more surely where the camera is and how high the support, or touch the object",
    "audio": "strike more places, or state what it is made of",
    "touch": "touch other sides of the object",
}


def result_of(scored: ScoredSize) -> dict[str, Any]:
    """The answer as JSON values; keys carry their unit."""
    found: SizeAnswer = scored.found
    truth = None if scored.truth is None else scored.truth.differences.get("longest_side_m")
    asked = scored.run.scene.sensors
    absent = {"vision": not asked.camera, "audio": not asked.sound, "touch": not asked.touch}
    estimates: dict[str, Any] = {}
    for sense, missing in absent.items():
        if missing:
            estimates[sense] = _none("the scene does not ask for it")
            continue
        one, seconds = found.by_sense[sense], found.seconds[sense]
        if isinstance(one, FitRefused):
            estimates[sense] = _none(str(one), seconds)
        else:
            estimates[sense] = estimate_of(one.belief, truth, seconds)
    seconds = sum(found.seconds.values())
    estimates["fused"] = estimate_of(found.fused, truth, seconds)
    model, left_out = scored.answering.model, scored.answering.left_out
    heard, other, material = found.by_sense.get("audio"), found.sight or found.touch, None
    if isinstance(heard, Hearing) and other is not None:
        # Sound alone knows the speed once sight or touch have fixed the size.
        stated = scored.answering.model.ringing(scored.accuracy).material.speed
        material = heard.speed(stated, other.belief)
    return {
        "size_m": found.fused.size,
        "error_m": estimates["fused"]["error_m"],
        "credible90_m": 0.5 * (estimates["fused"]["high90_m"] - estimates["fused"]["low90_m"]),
        "shape_known": scored.answering.shape_known,
        "nominal_m": model.nominal,
        "range_m": [model.sizes.low, model.sizes.high],
        "contacts": found.contacts,
        "strikes": found.strikes,
        "estimates": estimates,
        "sqrt_young_over_density": material,
        "seconds": seconds,
        "warnings": [
            *scored.answering.refused_pictures,
            *([f"{len(left_out)} contacts were left out; of the last: {left_out[-1]}"] if left_out else []),
            *_doubts(found),
        ],
    }


def estimate_of(belief: Belief, truth: float | None, seconds: float) -> dict[str, Any]:
    """One belief."""
    low, high = belief.interval
    return {
        "size_m": belief.size,
        "error_m": None if truth is None else abs(belief.size - truth),
        "low90_m": low,
        "high90_m": high,
        "in_interval90": None if truth is None else bool(low <= truth <= high),
        "outside_range": belief.outside,
        "seconds": seconds,
        "refused": None,
    }


def _none(why: str, seconds: float | None = None) -> dict[str, Any]:
    names = ("size_m", "error_m", "low90_m", "high90_m", "in_interval90", "outside_range")
    return {**dict.fromkeys(names), "seconds": seconds, "refused": why}


def _doubts(found: SizeAnswer) -> list[str]:
    answers = [(sense, one) for sense, one in found.by_sense.items() if not isinstance(one, FitRefused)]
    stated = [f"{sense}: {one}" for sense, one in found.by_sense.items() if isinstance(one, FitRefused)]
    stated += [doubt for sense, one in answers if (doubt := _doubt(sense, one))]
    stated += [
        f"{a} ({_span(one.belief)}) and {b} ({_span(other.belief)}) contradict each other: one of them read "
        "another object, or a bench unlike what the station states; look at the readings of both"
        for (a, one), (b, other) in combinations(answers, 2)
        if max(one.belief.interval[0], other.belief.interval[0])
        > min(one.belief.interval[1], other.belief.interval[1])
    ]
    return stated


def _doubt(sense: str, one: Said) -> str | None:
    """What is wrong with an answer, by itself; None where nothing is."""
    if isinstance(one, ShapelessAnswer):
        if not one.strange:
            return None
        return (
            f"{sense}: the reading is unlike the household shapes that were learnt ({one.distance:.1f} "
            "times the usual distance from them); its interval is widened for it"
        )
    if one.belief.outside > OUTSIDE:
        return (
            f"{sense}: the size is likely outside the range that was asked about "
            f"({100 * one.belief.outside:.0f} %); widen object.sizes"
        )
    if isinstance(one, Touch) and one.is_doubted:
        limit = doubted_cost(one.places)
        return (
            f"touch: the contacts may be of another object: their mean misfit is {one.cost:.1f}, and "
            f"{one.places} contacts with the right object are seldom above {limit:.1f}; the interval is "
            "widened for it; check the object"
        )
    if _width(one.belief) > OPEN * _width(Belief.ignorant(one.belief.range)):
        return f"{sense} leaves the size open ({_span(one.belief)}); {_NARROWED_BY[sense]}"
    return None


def _width(belief: Belief) -> float:
    low, high = belief.interval
    return float(np.log(high / low))


def _span(belief: Belief) -> str:
    low, high = belief.interval
    return f"{1e2 * low:.1f} to {1e2 * high:.1f} cm"


def lines_of(result: Mapping[str, Any]) -> list[str]:
    """A line a sense, the fused one last."""
    mock = "mock bench, " if result["mock"] else ""
    mock += "" if result["shape_known"] else "shape unknown, "
    said = []
    for sense, one in result["estimates"].items():
        if one["size_m"] is None:
            said.append(f"{mock}{sense}: no answer: {one['refused']}")
            continue
        low, high = 1e2 * one["low90_m"], 1e2 * one["high90_m"]
        error = "" if one["error_m"] is None else f"; error {1e3 * one['error_m']:.1f} mm"
        said.append(
            f"{mock}{sense}: the {result['object']} is {1e2 * one['size_m']:.2f} cm long; 90 % within "
            f"{low:.1f} to {high:.1f} cm{error}; {one['seconds']:.2f} s"
        )
    speed = result["sqrt_young_over_density"]
    if speed is not None:
        said.append(
            f"{mock}sound, at that size: sqrt(E / density) {speed['value_m_per_s']:.0f} m/s, 90 % within "
            f"{speed['low90_m_per_s']:.0f} to {speed['high90_m_per_s']:.0f}; the material's "
            f"{speed['stated_m_per_s']:.0f}"
        )
    return said
