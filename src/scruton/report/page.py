"""Tables as the page of a report shows them: cells are text, rounded to what they are worth."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from scruton.campaign.schema import Motion, Quantity
from scruton.report.tables import unit_of
from scruton.report.wording import column, estimate, number, parameter_name, percent, stated, unit_text

if TYPE_CHECKING:
    import pandas as pd

    from scruton.griffin import Prediction
    from scruton.infer.results import Fit


@dataclass(frozen=True)
class Table:
    """A table as the page holds it: cells are text; `numeric` says which columns stand to the right."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    numeric: Sequence[bool] = field(default_factory=tuple)

    def is_numeric(self, column: int) -> bool:
        """Whether a column holds numbers; by default all but the first."""
        return self.numeric[column] if self.numeric else column > 0


def in_model_unit(fit: "Fit", entry: Mapping[str, Any]) -> str:
    """An amplitude as a length at the model's scale, or in degrees."""
    section = fit.campaign.section
    heaving = section.motion is Motion.HEAVING
    median, interval = estimate(dict(entry), 1e3 * section.depth if heaving else 180.0 / np.pi)
    return f"{median} ({interval}) {'mm' if heaving else '°'}"


def design_table(fit: "Fit", design: Sequence["Prediction"]) -> Table | None:
    """Predictions at the design Scruton numbers."""
    if not design:
        return None
    unit = fit.campaign.section.amplitude_unit
    rows = []
    for one in design:
        entry = one.to_json()
        amplitude = entry["amplitude"]
        median, interval = estimate(amplitude)
        wide = estimate({"median": amplitude["median"], "interval": {"0.90": amplitude["interval"]["0.95"]}})[1]
        rows.append(
            [
                stated(one.scruton_number), percent(one.damping_ratio), median, interval, wide,
                in_model_unit(fit, amplitude), number(one.extrapolation_index, 2),
            ]
        )  # fmt: skip
    return Table(
        "Predicted stable amplitude at the design Scruton numbers",
        [
            "Sc", "ξₛ", f"median [{unit}]", f"90 % interval [{unit}]", f"95 % interval [{unit}]",
            "at the model's scale, 90 %", "x",
        ],
        rows,
        "x is the extrapolation index from the nearest test: laws of aerodynamic damping agree for |x| < 0.2 and part "
        "beyond 0.3.",
    )  # fmt: skip


def test_table(fit: "Fit", at_tests: Mapping[str, "Prediction"]) -> Table | None:
    """Stable amplitude of every test: measured, found, and predicted for another setting at its Scruton number."""
    if not fit.summary["tests"]:
        return None
    unit = fit.campaign.section.amplitude_unit
    rows = []
    for one in fit.summary["tests"]:
        measured = fit.campaign.test(one["name"]).stable_amplitude
        predicted = at_tests.get(one["name"])
        rows.append(
            [
                one["name"],
                one["rig"],
                number(one["parameters"]["scruton_number"]["median"], 4),
                "–" if measured is None else number(measured.mean),
                *estimate(one["parameters"]["a_star"]),
                *(("–", "–") if predicted is None else estimate(predicted.to_json()["amplitude"])),
            ]
        )
    return Table(
        f"Stable amplitude at the tested Scruton numbers [{unit}]",
        ["test", "rig", "Sc", "measured", "this test", "90 % interval", "another setting", "90 % interval"],
        rows,
        "“This test” is what its own records say. “Another setting” is the prediction for a rig of the same Scruton "
        "number that was not tested; it draws on all peak tests and carries the discrepancy between settings.",
        [False, False, True, True, True, True, True, True],
    )


def crossed_table(fit: "Fit", crossed: Mapping[str, "Prediction"]) -> Table | None:
    """Each peak test predicted from the others, beside what it was."""
    if not crossed:
        return None
    unit = fit.campaign.section.amplitude_unit
    found = {one["name"]: one["parameters"]["a_star"] for one in fit.summary["tests"]}
    rows = []
    for test, one in crossed.items():
        measured = fit.campaign.test(test).stable_amplitude
        truth = found[test]["median"] if measured is None else measured.mean
        low, high = one.interval(0.90)
        rows.append(
            [
                test, number(one.scruton_number), *estimate(one.to_json()["amplitude"]), number(truth),
                "measured" if measured is not None else "from its records",
                f"{100 * (one.median / truth - 1):+.0f} %".replace("-", "−"),
                "inside" if low <= truth <= high else "OUTSIDE",
            ]
        )  # fmt: skip
    return Table(
        f"Each peak test predicted from the other peak tests [{unit}]",
        ["test", "Sc", "predicted", "90 % interval", "found", "how", "error", "90 % interval"],
        rows,
        "Each is a fit of its own that never sees the records of the test it predicts. Nine in ten should lie inside.",
        [False, True, True, True, True, False, True, False],
    )


def law_table(fit: "Fit") -> Table | None:
    """The laws of the model card and what the records say of them."""
    weights = fit.summary["laws"].get("weights", {})
    if len(weights) < 2:
        return None
    best = max((one["log_evidence"] for one in weights.values() if one["log_evidence"] is not None), default=0.0)
    rows = []
    for label, one in weights.items():
        gap = None if one["log_evidence"] is None else one["log_evidence"] - best
        text = "–" if gap is None else f"{gap:.1f}".replace("-", "−")
        error = (
            "by Laplace's approximation" if one["log_evidence_error"] is None else f"± {one['log_evidence_error']:.2f}"
        )
        stacked = "–" if one["stacking"] is None else f"{one['stacking']:.3f}"
        rows.append([label, f"{one['prior']:.2f}", text, error, f"{one['weight']:.3f}", stacked])
    return Table(
        "Laws of aerodynamic damping, weighed by the records of the peak tests",
        ["law", "prior", "log evidence below the best", "error", "weight in predictions", "stacking"],
        rows,
        "Stacking scores each record, left out, by its joint density given all others. A law far below the best is not "
        "sampled. Predictions draw on each law as often as its weight says.",
        [False, True, True, False, True, True],
    )


def discrepancy(fit: "Fit") -> str:
    """What was found of the discrepancy between settings, in words."""
    found = fit.summary["campaign"].get("parameters")
    if not found:
        return ""
    texts = [
        "{} (90 %: {})".format(*estimate(found[key])) for key in ("discrepancy_amplitude", "discrepancy_relaxation")
    ]
    return f"{texts[0]} in the logarithm of the amplitude and {texts[1]} in that of G"


def damping_table(fit: "Fit") -> Table:
    """Structural damping of every rig."""
    rows = []
    for one in fit.summary["rigs"]:
        rig = fit.campaign.rig(one["name"])
        ring = fit.ringdowns.get(rig.name)
        rows.append(
            [
                rig.name,
                number(ring.frequency if ring else rig.frequency.mean),
                _stated_damping(rig.damping_ratio),
                str(len(rig.records)),
                *(f"{text} %" for text in estimate(one["parameters"]["damping_ratio"], 100.0)),
            ]
        )  # fmt: skip
    return Table(
        "Structural damping ratio in still air",
        ["rig", "f₀ [Hz]", "stated", "ring-downs", "found", "90 % interval"],
        rows,
        "Without ring-downs the damping found is the stated one, with the uncertainty of the model card.",
    )


def _stated_damping(quantity: Quantity | None) -> str:
    if quantity is None:
        return "–"
    text = f"{stated(100.0 * quantity.mean)} %"
    return f"{text} ± {stated(100.0 * quantity.sd)} %" if quantity.sd else text


def campaign_tables(fit: "Fit", frames: Mapping[str, "pd.DataFrame"]) -> list[Table]:
    """Rigs, tests and records as they were read."""
    found = []
    plans: tuple[tuple[str, str, tuple[str, ...]], ...] = (
        ("rigs", "Rigs", ("rig", "mass [", "f0 stated", "damping ratio stated", "ring-downs")),
        ("tests", "Tests in wind", ("test", "rig", "air density", "wind speed", "U/(f0", "frequency in", "peak")),
    )
    for name, caption, starts in plans:
        if name in frames:
            frame = frames[name]
            kept = [one for one in frame.columns if str(one).startswith(starts) and not frame[one].isna().all()]
            found.append(from_frame(caption, frame[kept]))
    if "records" in frames:
        found.append(_record_table(frames["records"]))
    return found


def _record_table(frame: "pd.DataFrame") -> Table:
    smallest = next(str(one) for one in frame.columns if str(one).startswith("smallest"))
    unit = smallest.partition("[")[2]
    rows = [
        [
            str(one["record"]), str(one["of"]), str(one["kind"]), number(float(one["length [s]"]), 3),
            str(one["cycles"]), number(float(one["frequency [Hz]"])),
            f"{number(float(one[smallest]), 3)} to {number(float(one[smallest.replace('smallest', 'largest')]), 3)}",
        ]
        for one in frame.to_dict("records")
    ]  # fmt: skip
    return Table(
        "Records",
        ["record", "of", "kind", "length [s]", "cycles", "frequency [Hz]", f"amplitude [{unit}"],
        rows,
        numeric=[False, False, False, True, True, True, True],
    )


def ring_down_table(fit: "Fit", frames: Mapping[str, "pd.DataFrame"]) -> Table | None:
    """Structural damping against amplitude."""
    if "ring_downs" not in frames:
        return None
    unit = fit.campaign.section.amplitude_unit
    rows = [
        [
            name, f"{number(band.lower, 3)} to {number(band.upper, 3)}", percent(band.damping_ratio, 4),
            percent(band.sd, 2), str(band.plucks),
        ]
        for name, ring in fit.ringdowns.items()
        for band in ring.bands
    ]  # fmt: skip
    return Table(
        "Structural damping ratio by amplitude",
        ["rig", f"amplitude [{unit}]", "damping ratio", "sd", "plucks"],
        rows,
    )


def posterior_tables(fit: "Fit") -> list[Table]:
    """One table a test: every parameter with its intervals."""
    unit = fit.campaign.section.amplitude_unit
    return [_parameter_table(f"Test {one['name']}", one["parameters"], unit) for one in fit.summary["tests"]]


def _parameter_table(caption: str, parameters: Mapping[str, Any], unit: str) -> Table:
    rows = []
    for name, entry in parameters.items():
        halves = {"median": entry["median"], "interval": {"0.90": entry["interval"]["0.50"]}}
        median, interval = estimate(entry)
        rows.append([parameter_name(name), unit_text(unit_of(name, unit)), median, estimate(halves)[1], interval])
    return Table(
        caption, ["parameter", "unit", "median", "50 % interval", "90 % interval"], rows,
        numeric=[False, False, True, True, True],
    )  # fmt: skip


def trial_table(fit: "Fit") -> Table | None:
    """Constants of the trial function, Eq. (4), of every transient record."""
    rows = []
    for one in fit.summary["records"]:
        texts = (estimate(one["parameters"][name]) for name in "abcd")
        rows.append([one["name"], one["test"], *(f"{median}\n{interval}" for median, interval in texts)])
    unit = fit.campaign.section.amplitude_unit
    if not rows:
        return None
    return Table(
        "Constants of the trial function: median, and 90 % interval below it",
        ["record", "test", f"a [{unit}]", "b [1/s]", f"c [{unit}]", "d [1/s]"],
        rows,
        numeric=[False, False, True, True, True, True],
    )


def convergence_table(fit: "Fit") -> Table | None:
    """The worst parameter of every posterior; all of them are in the CSV file."""
    if not len(fit.convergence):
        return None
    rows = []
    for posterior, group in fit.convergence.groupby(level="posterior", sort=False):
        worst = group.index.get_level_values("parameter")[int(np.argmax(group["rhat_nested"].fillna(np.inf)))]
        rows.append(
            [
                str(posterior), "yes" if bool(group["converged"].all()) else "NO",
                number(float(group["rhat_nested"].max(skipna=False)), 5), parameter_name(str(worst)),
                f"{group['ess_bulk'].min():.0f}", f"{group['ess_tail'].min():.0f}",
                number(float(group["tau"].max()), 3), str(int(group["steps"].max())), str(int(group["stuck"].max())),
            ]
        )  # fmt: skip
    return Table(
        "Convergence of every posterior: its worst parameter",
        [
            "posterior", "converged", "nested R-hat", "of", "bulk ESS", "tail ESS", "τ [steps]", "steps",
            "stuck walkers",
        ],
        rows,
        numeric=[False, False, True, False, True, True, True, True, True],
    )  # fmt: skip


def from_frame(caption: str, frame: "pd.DataFrame") -> Table:
    """A frame as a table: four significant digits, units with their powers raised."""
    columns, numeric = [], []
    for name in frame.columns:
        kind = frame[name].dtype.kind
        numeric.append(kind in "fi")
        if kind == "f":
            columns.append(column([float(one) for one in frame[name]]))
        elif kind == "b":
            columns.append(["yes" if one else "no" for one in frame[name]])
        else:
            columns.append([str(one) for one in frame[name]])
    rows = [list(row) for row in zip(*columns, strict=True)]
    return Table(caption, [_heading(str(one)) for one in frame.columns], rows, numeric=numeric)


def _heading(name: str) -> str:
    """A column's name with its unit as a reader writes it."""
    words, _, unit = name.replace("f0", "f₀").partition(" [")
    text = unit_text(unit.removesuffix("]"))
    return f"{words} [{text}]" if text else words
