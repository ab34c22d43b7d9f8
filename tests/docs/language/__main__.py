"""Print the texts that break the rules of the language; exit with 1 if there are more than allowed.

``--list`` prints every finding, also those that ``counts.json`` allows, under the given folders or files.
``--update`` lowers the allowed counts to those of today.
"""

import argparse
import sys
from pathlib import Path

from tests.docs.language.check import (
    Words,
    count,
    excess,
    find_all,
    function_shares,
    load_counts,
    lower,
    write_counts,
)
from tests.docs.language.sources import read_sources

ROOT = Path(__file__).parents[3]


def main() -> int:
    """Check the checkout."""
    parser = argparse.ArgumentParser(prog="python -m tests.docs.language")
    parser.add_argument("--list", action="store_true", help="print also what counts.json allows")
    parser.add_argument("--update", action="store_true", help="lower the allowed counts to those of today")
    parser.add_argument("paths", nargs="*", help="with --list: beginnings of paths")
    options = parser.parse_args()
    sources, words = read_sources(ROOT), Words()
    findings = list(find_all(sources, words))
    allowed = load_counts()
    if options.update:
        write_counts(lower(allowed, count(findings)))
        return 0
    shown = findings if options.list else excess(findings, allowed)
    shown = [f for f in shown if not options.paths or f.text.place.startswith(tuple(options.paths))]
    for finding in shown:
        sys.stdout.write(finding.describe() + "\n")
    if options.list:
        verbs, participles = function_shares(sources, words)
        sys.stdout.write(
            f"{len(shown)} findings; names of {len(sources.functions)} functions: "
            f"{100 * verbs:.1f} % begin with a verb, {100 * participles:.1f} % with a participle\n"
        )
        return 0
    now = count(findings)
    for rule, package, word in sorted({(f.rule, f.text.package, f.word) for f in shown}):
        most = allowed.get(rule, {}).get(package, {}).get(word, 0)
        sys.stdout.write(
            f"{package}: {rule}: {word!r}: {now[rule][package][word]} found, {most} allowed by "
            "tests/docs/language/counts.json; mend what you added, as listed above\n"
        )
    return 1 if shown else 0


if __name__ == "__main__":
    sys.exit(main())
