"""What the commands do: from arguments to results in a folder and text for the terminal."""

import json
import math
import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.app.options import check_effect_name
from scruton.campaign import Campaign, Quantity, load_campaign, tests_named, tests_used
from scruton.errors import InputError
from scruton.report.text import number, table
from scruton.workspace import Workspace

if TYPE_CHECKING:
    from scruton.infer.cards import ModelCard
    from scruton.infer.results import Fit

# Files and folders that say that a fit or its report lies in a folder, whoever wrote them.
RESULTS = ("posterior.nc", "fit.json", "report.html", "report.pdf", "report.json", "gap.json", "sizing.json")
# Parameters that the terminal shows, and how: key, heading, factor.
SHOWN = (
    ("scruton_number", "Sc", 1.0),
    ("a_star", "stable amplitude", 1.0),
    ("relaxation_rate", "lambda [1/s]", 1.0),
    ("Y1", "Y1", 1.0),
    ("epsilon", "epsilon", 1.0),
)


def default_folder(campaign: Path) -> Path:
    """Where results go when no folder is named: out/NAME below the working folder."""
    folder = campaign.parent if campaign.name == "campaign.toml" else campaign
    return Path("out") / folder.resolve().name


def run_fit(
    path: Path,
    out: Path | None,
    *,
    model: str = "default",
    tests: str | Sequence[str] | None = None,
    seed: int = 0,
    force: bool = False,
    resume: bool = False,
    quiet: bool = False,
    effect: str | None = None,
) -> tuple["Fit", Path]:
    """Fit a campaign into a folder.

    With `effect` (its name, or "auto" for what diagnosis finds) the predictions carry that unmodelled effect.

    Returns
    -------
    fit, folder : (Fit, Path)

    Raises
    ------
    InputError
        For bad input; nothing is written then.
    """
    from scruton.infer.store import write_fit

    task = FitTask.of(path, out, model=model, tests=tests, seed=seed, effect=effect)
    with task.workspace(force=force, resume=resume) as work:
        fit = task.fit(work, quiet=quiet)
        write_fit(fit, work.new)
        work.publish()
    return fit, task.folder


@dataclass(frozen=True, eq=False)
class FitTask:
    """A fit that was asked for: its inputs are read and checked, and nothing is done yet.

    Attributes
    ----------
    campaign : Campaign
        Restricted to the tests in `names`, where there are any.
    card : ModelCard
    names : tuple of str
    seed : int
    effect : str or None
    folder : Path
        For the results.
    """

    campaign: Campaign
    card: "ModelCard"
    names: tuple[str, ...]
    seed: int
    effect: str | None
    folder: Path

    @classmethod
    def of(
        cls,
        path: Path,
        out: Path | None,
        *,
        model: str,
        tests: str | Sequence[str] | None,
        seed: int,
        effect: str | None,
    ) -> "FitTask":
        """Read the campaign and the card; InputError for bad input."""
        from scruton.infer.cards import load_card

        check_effect_name(effect)
        if seed < 0:
            raise InputError("command line", "--seed", str(seed), "a whole number, zero or more")
        campaign = load_campaign(path)
        names = tests_named(campaign, tests)
        if names:
            campaign = tests_used(campaign, names)
        return cls(campaign, load_card(model), names, seed, effect, out if out is not None else default_folder(path))

    def workspace(
        self,
        *,
        force: bool,
        resume: bool,
        inputs: Mapping[str, str] | None = None,
        settings: Mapping[str, Any] | None = None,
    ) -> Workspace:
        """The folder of the results, to be entered; `inputs` and `settings` are those beside the fit's own."""
        return Workspace(
            self.folder,
            "fit",
            inputs={**inputs_of(self.campaign, self.card), **(inputs or {})},
            settings={
                "seed": self.seed, "tests": list(self.names), "effect": self.effect, "version": version_of_scruton(),
                **(settings or {}),
            },
            results=RESULTS,
            force=force,
            resume=resume,
        )  # fmt: skip

    def fit(self, work: Workspace, *, quiet: bool) -> "Fit":
        """Fit, with checkpoints in the folder."""
        from scruton.infer.fit import fit_campaign

        with Bar(quiet) as bar:
            fit = fit_campaign(
                self.campaign,
                self.card,
                seed=self.seed,
                checkpoints=work.checkpoints,
                report=bar,
                command=f"fit --seed {self.seed} --model {self.card.name}"
                + "".join(f" --test {shlex.quote(name)}" for name in self.names)
                + (f" --effect {self.effect}" if self.effect else ""),
                only=self.names,
            )
            if self.effect is not None:
                _carry_effect(fit, self.effect, self.card, self.seed, bar)
        return fit


def inputs_of(campaign: Campaign, card: "ModelCard | None" = None) -> dict[str, str]:
    """SHA-256 of every file of a campaign, and of all that a model card says, by the names that errors show."""
    digests = {} if card is None else {f"model card {card.name}": sha256(card.resolved.encode()).hexdigest()}
    return {**(campaign.sha256 or {}), **digests}


def version_of_scruton() -> str:
    """Which version of the program this is: another one may give other numbers."""
    from scruton import __version__

    return __version__


def _carry_effect(fit: "Fit", effect: str, card: "ModelCard", seed: int, bar: "Bar") -> None:
    """Diagnose the campaign and put the effect into the tree of the fit."""
    from scruton.gap.bands import attach
    from scruton.gap.data import load_gap
    from scruton.gap.diagnosis import diagnose_data

    data = load_gap(fit.campaign, card)
    diagnosis = diagnose_data(data, fit.campaign, prior=card.effect_weights, prior_none=card.prior_none, progress=bar)
    name = attach(fit.tree, diagnosis, effect, seed)
    fit.summary["effect"] = {
        "asked": effect, "used": name, "also": list(diagnosis.found[1:]) if name == diagnosis.verdict else [],
        "probability": diagnosis.probability.get(name, 0.0),
    }  # fmt: skip


def check_design(scruton_numbers: Sequence[float]) -> None:
    """Refuse design Scruton numbers that are no numbers, before any work is done."""
    for one in scruton_numbers:
        if not math.isfinite(one):
            raise InputError("command line", "--sc", str(one), "a finite number such as --sc 30")


class Bar:
    """Progress on standard error: one line that names what is being sampled and how far it is."""

    def __init__(self, quiet: bool) -> None:
        self.shown = not quiet and sys.stderr.isatty()
        self.name = ""

    def __enter__(self) -> "Bar":
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def __call__(self, name: str, fraction: float) -> None:
        """Show that `fraction` of the effective draws wanted of `name` is there."""
        if not self.shown:
            return
        if name != self.name:
            self._end()
            self.name = name
        filled = round(24 * fraction)
        print(f"\r  [{'#' * filled}{'.' * (24 - filled)}] {name}"[:110], end="", file=sys.stderr, flush=True)

    def _end(self) -> None:
        if self.shown and self.name:
            print(file=sys.stderr)


def fit_text(fit: "Fit") -> str:
    """Tables of a fit for the terminal."""
    parts = [fit.campaign.title]
    unit = fit.campaign.section.amplitude_unit
    if fit.summary["rigs"]:
        rows = [[one["name"], *_spread(one["parameters"]["damping_ratio"], 100.0)] for one in fit.summary["rigs"]]
        parts.append("Structural damping ratio [%]\n" + table(["rig", "median", "90 % interval"], rows))
    for key, heading, factor in SHOWN:
        rows = [
            [one["name"], one["rig"], *_spread(one["parameters"][key], factor)]
            for one in fit.summary["tests"]
            if key in one["parameters"]
        ]
        if rows:
            title = f"{heading} [{unit}]" if key == "a_star" else heading
            parts.append(f"{title}\n" + table(["test", "rig", "median", "90 % interval"], rows))
    parts += _campaign_text(fit)
    state = "converged" if fit.converged else "NOT CONVERGED: not to be trusted"
    parts.append(f"Sampling: {state}")
    return "\n\n".join(parts)


def _campaign_text(fit: "Fit") -> list[str]:
    """The laws and what the campaign model says of the discrepancy between settings."""
    parts = []
    weights = fit.summary["laws"].get("weights", {})
    if len(weights) > 1:
        best = max(one["log_evidence"] for one in weights.values())
        rows = [
            [
                law, number(one["prior"]), number(one["log_evidence"] - best, 3), number(one["weight"], 3),
                "-" if one["stacking"] is None else number(one["stacking"], 3), "" if one["sampled"] else "not sampled",
            ]
            for law, one in weights.items()
        ]  # fmt: skip
        header = ["law", "prior", "log evidence", "weight", "stacking", ""]
        parts.append("Laws of aerodynamic damping; log evidence below the best\n" + table(header, rows))
    found = fit.summary["campaign"].get("parameters", {})
    rows = [
        [name, *_spread(found[key], 1.0)]
        for key, name in (("discrepancy_amplitude", "ln amplitude"), ("discrepancy_relaxation", "ln G"))
        if key in found
    ]
    if rows:
        parts.append(
            "Discrepancy between settings, standard deviation\n" + table(["of", "median", "90 % interval"], rows)
        )
    return parts


def _spread(entry: dict[str, Any], factor: float) -> list[str]:
    low, high = entry["interval"]["0.90"]
    return [number(entry["median"] * factor), f"{number(low * factor)} .. {number(high * factor)}"]


def parse_damping(text: str) -> Quantity:
    """Read a design damping ratio from the command line: "0.003", "0.003 +/- 0.001"."""
    wanted = 'a damping ratio such as "0.003" or "0.003 +/- 0.001"'
    try:
        values = [float(part) for part in re.split(r"\s*(?:\+/-|±)\s*", text.strip())]
    except ValueError:
        raise InputError("command line", "--damping", f'"{text}"', wanted) from None
    if len(values) > 2 or not 0 < values[0] < 1 or not all(math.isfinite(one) and one >= 0 for one in values):
        raise InputError("command line", "--damping", f'"{text}"', wanted + ", between 0 and 1")
    return Quantity(values[0], values[1] if len(values) == 2 else None)


def check_law(law_n: float | None) -> None:
    """Refuse an exponent that is no number, before any work is done."""
    if law_n is not None and not math.isfinite(law_n):
        raise InputError("command line", "--law", str(law_n), "a finite exponent such as --law -1")


def check_effect(summary: dict[str, Any], effect: str | None, results: Path) -> None:
    """Refuse a fit that does not carry the effect: what was found is put into the fit, nothing here can.

    Parameters
    ----------
    summary : dict
        Of fit.json.
    effect : str or None
        A name, or "auto": any fit that was diagnosed, also one without a gap.
    results : Path
        For the error.
    """
    check_effect_name(effect)
    carried = summary.get("effect", {}).get("used")
    if effect is not None and (carried is None or effect not in ("auto", carried)):
        raise InputError(
            results, "--effect", f"a fit that carries {carried or 'no effect'}",
            f"the folder of `scruton fit CAMPAIGN --effect {effect}`",
        )  # fmt: skip


def predict_text(
    results: Path,
    *,
    scruton_numbers: Sequence[float],
    damping_ratios: Sequence[str],
    rig: str | None = None,
    law_n: float | None = None,
    effect: str | None = None,
    seed: int = 0,
    as_json: bool = False,
) -> tuple[str, bool]:
    """Predict from a folder of results; the text to print, and whether it is to be trusted."""
    from scruton.griffin import predict
    from scruton.infer.store import read_tree

    if not scruton_numbers and not damping_ratios:
        raise InputError("command line", "--sc", "no design Scruton number", "--sc 30, or --damping 0.003")
    check_law(law_n)
    tree, summary = read_tree(results)
    if not summary["tests"]:
        raise InputError(
            results, "", "a campaign without tests in wind", "a fit of at least one test: still air says nothing of it"
        )
    check_effect(summary, effect, results)
    rigs = [one["name"] for one in summary["rigs"]]
    if rig is not None and rig not in rigs:
        raise InputError(results, "--rig", f"'{rig}'", f"one of: {', '.join(rigs)}")
    common: dict[str, Any] = {"rig": rig, "law_n": law_n, "seed": seed}
    found = [predict(tree, scruton_number=one, **common) for one in scruton_numbers]
    found += [predict(tree, damping_ratio=parse_damping(one), **common) for one in damping_ratios]
    trusted = bool(summary["converged"])
    if as_json:
        return json.dumps({"predictions": [one.to_json() for one in found]}), trusted
    rows = []
    for one in found:
        entry = one.to_json()
        amplitude = entry["amplitude"]
        low, high = amplitude["interval"]["0.90"]
        rows.append(
            [
                number(entry["sc"]), number(entry["damping_ratio"]), number(amplitude["median"]),
                f"{number(low)} .. {number(high)}", number(amplitude["sd"]), number(one.extrapolation_index, 2),
            ]
        )  # fmt: skip
    header = ["Sc", "damping ratio", f"amplitude [{summary['amplitude_unit']}]", "90 % interval", "sd", "x"]
    lines = [table(header, rows), "x: extrapolation index; laws agree for |x| < 0.2 and part beyond 0.3."]
    shares = [f"{law} {weight:.0%}" for law, weight in found[0].laws.items() if weight > 0.005]
    lines.append(f"Laws: {', '.join(shares)}. The interval carries the discrepancy between settings.")
    lines += [f"! {flag}" for one in found for flag in one.flags]
    if not trusted:
        lines.append("! the fit did not converge: " + "; ".join(summary["flags"]))
    return "\n".join(lines), trusted
