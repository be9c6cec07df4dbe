"""`python -m tests.fuzz --cases 3000 --seed 1 --jobs 2`: run the fuzz, print a table by kind, exit 1 on any fault."""

import argparse
import shutil
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from tests.fuzz.case import Outcome
from tests.fuzz.kinds import KINDS
from tests.fuzz.pool import LIMIT, Planned, run_cases
from tests.fuzz.stock import ROOT, Stock, fingerprint

OUT = ROOT / "out" / "fuzz"


def plan(cases: int, kinds: Sequence[str]) -> list[Planned]:
    """Spread so many cases over kinds by their shares; those of one kind are numbered from 0, and kinds alternate."""
    total = sum(KINDS[one].share for one in kinds)
    found = [
        ((number + 0.5) / KINDS[kind].share, kind, number)
        for kind in kinds
        for number in range(max(1, round(cases * KINDS[kind].share / total)))
    ]
    return [(kind, number) for _, kind, number in sorted(found)]


def table(outcomes: Sequence[Outcome]) -> str:
    """Count by kind."""
    lines = [f"{'kind':<12} {'cases':>6} {'accepted':>9} {'refused':>8} {'faults':>7} {'seconds':>8}"]
    rows = [(kind, [one for one in outcomes if one.kind == kind]) for kind in KINDS]
    for kind, some in [*rows, ("all", list(outcomes))]:
        if some:
            count = Counter(one.state for one in some)
            lines.append(
                f"{kind:<12} {len(some):>6} {count['accepted']:>9} {count['refused']:>8} {count['fault']:>7} "
                f"{sum(one.seconds for one in some):>8.0f}"
            )
    return "\n".join(lines)


def causes(outcomes: Sequence[Outcome], seed: int) -> str:
    """Faults alike for alike, with a case of each to run again."""
    found: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        for fault in outcome.faults:
            found.setdefault(fault.cause, []).append(outcome)
    lines = []
    for cause, some in sorted(found.items(), key=lambda item: -len(item[1])):
        first = some[0]
        lines.append(f"{len(some):>5}  {cause}\n       {first.about[:150]}")
        lines.append(f"       python -m tests.fuzz --seed {seed} --kind {first.kind} --only {first.number}")
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Run, print, and keep the files of cases with faults in out/fuzz/."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--cases", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--kind", action="append", choices=tuple(KINDS), help="only this kind; may be repeated")
    parser.add_argument("--only", type=int, help="only the case of this number (with --kind)")
    parser.add_argument("--limit", type=float, default=LIMIT, help="seconds of processor time that a case may take")
    parser.add_argument("-o", "--out", type=Path, default=OUT)
    options = parser.parse_args(argv)
    kinds = options.kind or tuple(KINDS)
    planned = plan(options.cases, kinds) if options.only is None else [(kind, options.only) for kind in kinds]
    stock = Stock(options.out / f"stock-{fingerprint()}")
    stock.make()
    work = options.out / f"work-{options.seed}"
    began, outcomes = time.monotonic(), []
    try:
        for outcome in run_cases(
            planned, seed=options.seed, stock=stock.folder, work=work, jobs=options.jobs, limit=options.limit,
            keep=options.out,
        ):  # fmt: skip
            outcomes.append(outcome)
            if len(outcomes) % 250 == 0:
                print(f"{len(outcomes)} of {len(planned)} cases", file=sys.stderr, flush=True)
            if outcome.faults or options.only is not None:
                _show(outcome, options.only is not None)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    print(f"\n{table(outcomes)}\n\n{causes(outcomes, options.seed)}".rstrip())
    print(f"{time.monotonic() - began:.0f} s; files of the cases with faults: {options.out}")
    return 1 if any(one.faults for one in outcomes) else 0


def _show(outcome: Outcome, whole: bool) -> None:
    faults = "; ".join(one.cause for one in outcome.faults) or outcome.state
    print(
        f"{outcome.kind} {outcome.number}: {faults}: {outcome.about}"[:300].encode("unicode_escape").decode(),
        flush=True,
    )
    if whole:
        shown = "\n".join([" ".join(outcome.argv), outcome.said, *(one.detail for one in outcome.faults)])
        print(shown.encode("ascii", errors="backslashreplace").decode().replace("\x1b", "\\x1b"))


if __name__ == "__main__":
    sys.exit(main())
