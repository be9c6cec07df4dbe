"""`python -m tests.fuzz.kill --moments 40 --seed 1`: what is killed at random moments and resumed gives the same bytes.

Every command is run twice untouched, for its duration and its files.  Then it is ended at random moments, by SIGKILL,
SIGINT or SIGTERM in turn, and run again with --resume (or --force, where it has no --resume), three times in ten to be
ended again; what lies there at last must be what lies there untouched, timings apart.
"""

import argparse
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tests.fuzz.kill_runs import RESULTS, contents, differences, faults_of_end, keep, run, torn
from tests.fuzz.kinds.options import verbs
from tests.fuzz.stock import ROOT, Stock, fingerprint

AGAIN = 0.3  # probability that a run that was taken up again is ended again
SIGNALS = ("SIGKILL", "SIGINT", "SIGTERM")
OUT = ROOT / "out" / "kill"


def commands(stock: Stock) -> dict[str, tuple[str, ...]]:
    """What is run, small; each writes into `results`."""
    heaving, torsional, card = (str(stock.path(name)) for name in ("heaving", "torsional", "card.toml"))
    out = ("-o", RESULTS, "--quiet")
    return {
        "fit": ("fit", heaving, *out),
        "report": ("report", heaving, *out, "--model", card, "--no-gap", "--sc", "30"),
        "diagnose": ("diagnose", heaving, *out),
        "calibrate": ("calibrate", *out, "--regimes", "turbulence-1", "--campaigns", "2", "--model", card),
        "challenge run": ("challenge", "run", str(stock.path("challenge/made")), *out),
        "batch": ("batch", heaving, torsional, *out, "--model", card, "--jobs", "2"),
    }


@dataclass
class Verb:
    """A command, what it gives untouched, and what became of its moments."""

    name: str
    argv: tuple[str, ...]
    again: str
    seconds: float = 0.0
    wanted: dict[str, bytes] = field(default_factory=dict)
    known: frozenset[str] = frozenset()
    moments: int = 0
    ended: int = 0
    same: int = 0
    faults: list[str] = field(default_factory=list)

    def refer(self, work: Path) -> None:
        """Run twice untouched; what differs then is a fault of its own, and not of resuming."""
        found = []
        for name in ("reference", "reference-again"):
            one = run(self.argv, work / name)
            if one.code not in (0, 1):
                raise RuntimeError(f"{self.name} fails untouched, with {one.code}: {one.err[-500:]}")
            self.seconds = one.seconds
            found.append(contents(work / name / RESULTS))
        self.wanted, other = found
        names = set(self.wanted) | set(other)
        self.known = frozenset(one for one in names if self.wanted.get(one) != other.get(one))
        differ = differences(other, self.wanted, frozenset())
        self.faults += [f"two untouched runs differ: {one}" for one in differ]

    def moment(self, rng: np.random.Generator, how: str, folder: Path) -> list[str]:
        """End a run, take it up until nobody ends it, and say what is wrong."""
        found: list[str] = []
        shares, argv = [], self.argv
        while True:
            share = float(rng.uniform(0.0, 1.0))
            ended = run(argv, folder, share * self.seconds, how)
            shares.append(f"{share:.3f}")
            self.moments += 1
            self.ended += ended.in_time
            found += [*faults_of_end(ended, how), *torn(folder)]
            argv = (*self.argv, self.again)
            if rng.random() >= AGAIN:
                break
        last = run(argv, folder)
        if last.code not in (0, 1):
            found.append(f"exit code {last.code} when taken up again: {last.err.strip().splitlines()[-1:]}")
        found += differences(contents(folder / RESULTS), self.wanted, self.known)
        self.same += not found
        return [f"{one}  [{how} at {', '.join(shares)} of {self.seconds:.0f} s]" for one in found]


def table(several: Sequence[Verb]) -> str:
    """Count by command."""
    lines = [f"{'command':<14} {'seconds':>8} {'moments':>8} {'in time':>8} {'faults':>7}  again with"]
    for one in several:
        lines.append(
            f"{one.name:<14} {one.seconds:>8.1f} {one.moments:>8} {one.ended:>8} {len(one.faults):>7}  {one.again}"
        )
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Run all, print the table and the faults, exit 1 where there are any."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.kill", description=__doc__)
    parser.add_argument("--moments", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--verb", action="append", help="only this command; may be repeated")
    parser.add_argument("-o", "--out", type=Path, default=OUT)
    options = parser.parse_args(argv)
    stock = Stock(options.out / f"stock-{fingerprint()}")
    stock.make()
    work = options.out / "work"
    shutil.rmtree(work, ignore_errors=True)
    several = [
        Verb(name, words, "--resume" if "--resume" in verbs()[name]._option_string_actions else "--force")
        for name, words in commands(stock).items()
        if not options.verb or name in options.verb
    ]
    for number, verb in enumerate(several):
        verb.refer(work / verb.name)
        print(f"{verb.name}: {verb.seconds:.1f} s, {len(verb.wanted)} files", *verb.faults, sep="\n  ", flush=True)
        quota = len(range(number, options.moments, len(several)))
        turn = 0
        while verb.moments < quota:
            rng = np.random.default_rng([options.seed, number, turn])
            folder = work / verb.name / f"moment-{turn}"
            faults = verb.moment(rng, SIGNALS[turn % len(SIGNALS)], folder)
            for one in faults:
                print(f"  {verb.name} {turn}: {one}", flush=True)
            if faults:
                keep(folder, options.out / f"{verb.name}-{turn}")
            verb.faults += faults
            shutil.rmtree(folder)
            turn += 1
    shutil.rmtree(work)
    print(f"\n{table(several)}\n")
    for line in [f"{verb.name}: {one}" for verb in several for one in verb.faults]:
        print(line)
    return 1 if any(verb.faults for verb in several) else 0


if __name__ == "__main__":
    sys.exit(main())
