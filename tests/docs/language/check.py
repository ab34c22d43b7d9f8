"""Rules of the language, and the counts of what breaks them, which may only fall.

``counts.json`` holds, by rule, package and word, how many findings are allowed. More is an error; when there
are fewer, ``--update`` writes the lower count.
"""

import json
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, TypeAlias

from tests.docs.language.sources import Sources, Text

HERE: Final = Path(__file__).parent
COUNTS: Final = HERE / "counts.json"

Counts: TypeAlias = dict[str, dict[str, dict[str, int]]]
"""How often, by rule, package and word."""


@dataclass(frozen=True)
class Finding:
    """A text that breaks a rule."""

    rule: str
    word: str  #: the word or phrase that counts.
    text: Text
    advice: str = ""

    def describe(self) -> str:
        """Return place, rule and what to write instead, in one line."""
        shown = re.sub(r"\s+", " ", self.text.text)
        shown = shown if len(shown) <= 100 else shown[:97] + "..."
        instead = f" (instead: {self.advice})" if self.advice else ""
        return f"{self.text.place}: {self.rule}: {self.word!r}{instead}: {shown}"


class Words:
    """The lists of ``words.toml`` and ``phrases.toml``."""

    def __init__(self, folder: Path = HERE) -> None:
        self._words: Mapping[str, Any] = tomllib.loads((folder / "words.toml").read_text(encoding="utf-8"))
        phrases: Mapping[str, str] = tomllib.loads((folder / "phrases.toml").read_text(encoding="utf-8"))[
            "phrases"
        ]
        self.phrases = [(re.compile(pattern, re.IGNORECASE), advice) for pattern, advice in phrases.items()]
        self.private: Mapping[str, str] = self._words["private"]

    @cached_property
    def ordinary(self) -> Mapping[str, str]:
        """The ordinary word that each inflection counts as."""
        return {form: word for word, forms in self._words["ordinary"].items() for form in forms}

    @cached_property
    def verbs(self) -> frozenset[str]:
        """Verbs with which a function's name may begin."""
        return frozenset(self._words["verbs"]["all"]) | frozenset(self._words["participles"]["plain"])

    def is_participle(self, word: str) -> bool:
        """Tell whether a word is a past participle and not also the plain form of a verb."""
        lists = self._words["participles"]
        if word in lists["plain"] or word in lists["not"]:
            return False
        return word in lists["irregular"] or (word.endswith("ed") and len(word) > 3)

    def forbidden_start(self, docstring: str) -> str | None:
        """Return the first word of a docstring if none may begin with it; else None."""
        rest = re.sub(r"^(``[^`]*``,?\s*)+", "", docstring)
        first = re.split(r"[\s,:.;]", rest, maxsplit=1)[0]
        if first.lower() in self._words["starts"]["words"]:
            return first.lower()
        if first in self._words["starts"]["units"]:
            return "unit"
        return "shape" if rest != docstring and re.match(r"``\([^`]*\)``", docstring) else None


def split_name(name: str) -> list[str]:
    """Split an identifier into lower-case words, at underscores and capitals."""
    return [part.lower() for part in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)]


def find_all(sources: Sources, words: Words) -> Iterator[Finding]:
    """Yield every text that breaks a rule."""
    for text in sources.names:
        parts = split_name(text.text)
        for part in sorted(set(parts) & words.private.keys()):
            yield Finding("private word in a name", part, text, words.private[part])
        for word in sorted({words.ordinary[part] for part in parts if part in words.ordinary}):
            yield Finding("ordinary word in a name", word, text)
    for text in (*sources.docstrings, *sources.fields, *sources.messages, *sources.pages):
        for word in sorted(set(re.findall(r"[a-z]+", text.text.lower())) & words.private.keys()):
            yield Finding("private word in a text", word, text, words.private[word])
    for text in (*sources.messages, *sources.pages):
        for pattern, advice in words.phrases:
            for match in pattern.finditer(text.text):
                yield Finding("forbidden phrase", match[0].strip(".;:( ").lower(), text, advice)
    for kind, texts in (("docstring", sources.docstrings), ("field", sources.fields)):
        for text in texts:
            start = words.forbidden_start(text.text)
            if start:
                yield Finding(f"start of a {kind}", start, text, "what it does or is, then shape and unit")
    for text in sources.functions:
        first = next(iter(split_name(text.text)), "")
        if words.is_participle(first):
            yield Finding("participle as a function's name", "participle", text, "begin with a verb")
        elif first not in words.verbs:
            yield Finding("function's name without a verb", "no verb", text, "begin with a verb")


def function_shares(sources: Sources, words: Words) -> tuple[float, float]:
    """Return the fractions of functions whose name begins with a verb, and with a participle."""
    first = [next(iter(split_name(text.text)), "") for text in sources.functions]
    participles = sum(words.is_participle(word) for word in first)
    verbs = sum(word in words.verbs and not words.is_participle(word) for word in first)
    return verbs / len(first), participles / len(first)


def count(findings: Iterable[Finding]) -> Counts:
    """Count findings by rule, package and word."""
    counts: Counts = {}
    for finding in findings:
        words = counts.setdefault(finding.rule, {}).setdefault(finding.text.package, {})
        words[finding.word] = words.get(finding.word, 0) + 1
    return counts


def excess(findings: Iterable[Finding], allowed: Counts) -> list[Finding]:
    """Return the findings of each rule, package and word that has more of them than allowed."""
    listed = list(findings)
    now = count(listed)
    return [finding for finding in listed if _number(now, finding) > _number(allowed, finding)]


def lower(allowed: Counts, now: Counts) -> Counts:
    """Return the allowed counts, each at most that of now, without those that are zero."""
    result: Counts = {}
    for rule, packages in allowed.items():
        for package, words in packages.items():
            for word, most in words.items():
                number = min(most, now.get(rule, {}).get(package, {}).get(word, 0))
                if number:
                    result.setdefault(rule, {}).setdefault(package, {})[word] = number
    return result


def _number(counts: Counts, finding: Finding) -> int:
    return counts.get(finding.rule, {}).get(finding.text.package, {}).get(finding.word, 0)


def load_counts() -> Counts:
    """Read the allowed counts."""
    counts: Counts = json.loads(COUNTS.read_text(encoding="utf-8"))
    return counts


def write_counts(counts: Counts) -> None:
    """Write the allowed counts, one package on a line."""
    rules = []
    for rule, packages in sorted(counts.items()):
        rows = [
            f"  {json.dumps(package)}: {json.dumps(words, sort_keys=True)}"
            for package, words in sorted(packages.items())
        ]
        rules.append(f" {json.dumps(rule)}: {{\n" + ",\n".join(rows) + "\n }")
    COUNTS.write_text("{\n" + ",\n".join(rules) + "\n}\n", encoding="utf-8")
