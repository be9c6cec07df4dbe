"""`challenge make`: a folder of campaigns, and their answers in a sealed file whose hash lies in the open.

Cases come in blocks. A block has every effect at every severity once, eight cases without an effect and six with two
of the catalogue at once, in a random order; 25 blocks are 200 cases without, and 25 of each effect at each severity.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from scruton.calibrate.challenge.case import DESIGNS, GUSTS, NOISE, TURBULENCE, simulate_case
from scruton.calibrate.challenge.scenarios import BETWEEN_RIGS, CATALOGUE, OPEN
from scruton.calibrate.execution import Execution, at_least
from scruton.calibrate.thresholds import SEVERE_ENOUGH_FOR_TWO, WITH_TWO, WITHOUT_EFFECT
from scruton.campaign.write import save_campaign
from scruton.documents import read_json, write_text
from scruton.errors import InputError
from scruton.provenance import provenance

CHALLENGE, ANSWERS = "challenge.json", "answers/answers.json"
_MADE = "a file that a challenge was made with"
NONE, TWO = "none", "two"
SEVERITIES = (0.1, 0.2, 0.4)
KINDS = (NONE, *CATALOGUE, TWO, *OPEN)


@dataclass(frozen=True)
class Plan:
    """What a challenge is made of: with the number of a case it settles every byte of it, and of none other.

    Effects are those of `KINDS`, by default all that the design can have; `turbulence`, `noise` and `gusts` are ranges,
    see `simulate_case`. InputError for unknown names, a design that is none, severities outside (0, 0.5], or ranges
    outside 0 to 0.2.
    """

    seed: int
    effects: Sequence[str] | None = None
    severities: Sequence[float] = SEVERITIES
    design: str = "full"
    turbulence: tuple[float, float] = TURBULENCE
    noise: tuple[float, float] = NOISE
    gusts: tuple[float, float] = GUSTS

    def __post_init__(self) -> None:
        for field in ("turbulence", "noise", "gusts"):
            low, high = getattr(self, field)
            if not 0.0 <= low <= high <= 0.2:
                raise InputError("challenge", field, f"{low:g} to {high:g}", "a range between 0 and 0.2")
        if self.design not in DESIGNS:
            raise InputError("challenge", "design", repr(self.design), f"one of: {', '.join(DESIGNS)}")
        if not self.severities or not all(0.0 < s <= 0.5 for s in self.severities):
            raise InputError("challenge", "severities", repr(tuple(self.severities)), "numbers above 0, up to 0.5")
        for name in self.effects or ():
            if name not in KINDS:
                raise InputError("challenge", "effects", repr(name), f"some of: {', '.join(KINDS)}")
            if self.design == "one-rig" and name in BETWEEN_RIGS:
                raise InputError("challenge", "effects", repr(name), "the design full: it shows between rigs alone")

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of cases: effects, "none" and "two"."""
        wanted = KINDS if self.effects is None else self.effects
        return tuple(name for name in wanted if self.design == "full" or name not in BETWEEN_RIGS)

    @property
    def settings(self) -> dict[str, Any]:
        """All that decides, as JSON can hold it."""
        return {
            "seed": self.seed, "design": self.design, "effects": list(self.kinds),
            "severities": [float(s) for s in self.severities], "turbulence": list(self.turbulence),
            "noise": list(self.noise), "gusts": list(self.gusts),
        }  # fmt: skip

    def block(self) -> list[tuple[str, float]]:
        """Names and severities of one block, in order."""
        enough = [s for s in self.severities if s >= SEVERE_ENOUGH_FOR_TWO] or list(self.severities)
        special = {NONE: [0.0] * WITHOUT_EFFECT, TWO: [enough[i % len(enough)] for i in range(WITH_TWO)]}
        return [(name, s) for name in self.kinds for s in special.get(name, self.severities)]

    def case(self, index: int) -> tuple[tuple[str, ...], float]:
        """Effects and severity of a case, the first of which is number 1."""
        rows = self.block()
        number, place = divmod(index - 1, len(rows))
        order = np.random.default_rng([self.seed, number, 0xB10C]).permutation(len(rows))
        name, severity = rows[order[place]]
        if name == NONE:
            return (), 0.0
        if name != TWO:
            return (name,), severity
        single = [effect for effect in CATALOGUE if self.design == "full" or effect not in BETWEEN_RIGS]
        rng, pair = np.random.default_rng([self.seed, index, 0x2]), BETWEEN_RIGS
        while pair == BETWEEN_RIGS:  # each of these sets the rigs' speeds: one would undo the other's order
            picked = sorted(rng.choice(len(single), size=2, replace=False))
            pair = single[int(picked[0])], single[int(picked[1])]
        return pair, severity


def make_challenge(how: Execution, plan: Plan, cases: int) -> Path:
    """Write campaigns whose effects are hidden, and return their folder (InputError where that holds a challenge).

    It gets `case-0001/campaign.toml` with its records and so on, `challenge.json` (settings, the list of cases, the
    SHA-256 of the answers) and `answers/answers.json`. A challenge that is resumed may go on to more cases.
    """
    at_least(1, "challenge", cases=cases, jobs=how.workers.jobs)
    settings = plan.settings
    names = {index: f"case-{index:04d}" for index in range(1, cases + 1)}
    with how.claim("challenge make", inputs={}, settings=settings, results=(CHALLENGE,)) as work:
        before = work.find(ANSWERS)
        answers: dict[str, Any] = {} if before is None else read_json(before, _MADE)
        answers |= {path.stem: read_json(path, _MADE) for path in sorted(work.checkpoints.glob("*.json"))}
        missing = [i for i, name in names.items() if name not in answers or not work.find(f"{name}/campaign.toml")]
        tasks = [(work.new.absolute(), work.checkpoints.absolute(), i, plan) for i in missing]
        for done, (_, index) in enumerate(how.workers.values(_write_case, tasks), cases - len(missing) + 1):
            work.keep(names[index])
            how.tell("make", done, cases)
            answers[names[index]] = read_json(work.checkpoints / f"{names[index]}.json", _MADE)
        sealed = json.dumps({name: answers[name] for name in names.values()}, indent=1, sort_keys=True) + "\n"
        write_text(work.new / ANSWERS, sealed)
        table = {
            "format": 1, "settings": settings, "cases": list(names.values()), "answers": ANSWERS,
            "answers_sha256": sha256(sealed.encode()).hexdigest(), "versions": {"scruton": version("scruton")},
            "provenance": provenance("challenge make", seed=plan.seed, sha256={}, settings=settings),
        }  # fmt: skip
        write_text(work.new / CHALLENGE, json.dumps(table, indent=1) + "\n")
        work.publish()
    return how.folder


def _write_case(task: tuple[Path, Path, int, Plan]) -> int:
    """Write one case and the part of the answers that is its own, the campaign.toml and then the answer last."""
    out, answers, index, plan = task
    air = plan.turbulence, plan.noise, plan.gusts
    campaign, answer = simulate_case(plan.seed, index, *plan.case(index), plan.design, *air)
    place = out / campaign.title
    place.mkdir(parents=True, exist_ok=True)
    save_campaign(campaign, place)
    write_text(answers / f"{campaign.title}.json", json.dumps(answer))
    return index
