"""The gap between the bare model and the records: where, which effect, how far it shrinks, what would settle it."""

from collections.abc import Mapping, Sequence
from typing import Any

from scruton.dynamics.effects import CATALOGUE, UNKNOWN
from scruton.report.chapters.material import Material
from scruton.report.document import CAUTION, Block, Callout, Chapter, Heading, Listing, Paragraph, Table
from scruton.report.wording import number, share, unit_text

_MOST = 12  # places that the page lists; all of them are in gap.json
_LEAST = 5e-4  # probability worth a row
_BARE_IN_WIND = (
    "The bare model is the paper’s law with one pair of aerodynamic parameters for the peak tests and no discrepancy "
    "between them: the discrepancy and the average over laws, which the predictions carry, would swallow what this "
    "chapter looks for."
)
_BARE_IN_STILL_AIR = "The bare model is a rig of constant damping ratio and constant frequency, whatever the amplitude."


def gap_chapter(material: Material) -> Chapter:
    """The diagnosis, in words, tables and its picture."""
    gap = material.gap
    blocks: tuple[Block, ...] = ()
    if gap is not None:
        blocks = (*_verdict(gap, material), *material.of("gap"), *_details(gap))
    return Chapter("gap", "The gap between model and measurement", blocks)


def effect_title(name: str) -> str:
    """An effect of the catalogue in words."""
    if name == "none":
        return "no gap"
    return {**CATALOGUE, UNKNOWN.name: UNKNOWN}[name].title


def _in_words(name: str) -> str:
    """The same inside a sentence."""
    title = effect_title(name)
    return title if title[1:2].isupper() else title[0].lower() + title[1:]


def gap_sentence(gap: Mapping[str, Any]) -> str:
    """The verdict in one sentence."""
    if gap["verdict"] == "none":
        return "The bare model and the records agree within their noise."
    names = [_in_words(name) for name in (gap["verdict"], *gap["also"])]
    p = gap["probability"][gap["verdict"]]
    return (
        f"The bare model and the records part. What explains it: {' and '.join(names)} "
        f"(probability {'above 0.99' if p > 0.99 else number(p, 2)})."
    )


def _verdict(gap: Mapping[str, Any], material: Material) -> list[Block]:
    blocks: list[Block] = [
        Paragraph((gap_sentence(gap),), role="answer"),
        Paragraph((_BARE_IN_WIND if material.in_wind else _BARE_IN_STILL_AIR,)),
    ]
    if material.fit.summary["provenance"]["tests"]:
        words = "The diagnosis uses every test of the campaign, those that the fit left out among them."
        blocks.append(Callout(CAUTION, words))
    if words := shrink_sentence(gap["shrink"]):
        blocks.append(Paragraph((words,)))
    alike = [group for group in gap["indistinguishable"] if len(group) > 1]
    if alike:
        lines = tuple(" or ".join(_in_words(name) for name in group) for group in alike)
        blocks.append(Callout(CAUTION, "These data cannot tell apart", lines))
    return blocks


def _details(gap: Mapping[str, Any]) -> list[Block]:
    blocks: list[Block] = [_probability_table(gap), _where_table(gap), _size_table(gap), _amplitude_table(gap)]
    if gap["advice"]:
        blocks += [Heading("What data would settle it"), Listing(tuple(map(str, gap["advice"])))]
    if gap["invisible"]:
        blocks += [
            Heading("What these records cannot show, whatever it is"),
            Listing(tuple(str(one["text"]) for one in gap["invisible"])),
        ]
    blocks.append(Paragraph((f"Calibrated on {gap['calibrated_on']}.",), role="note"))
    return blocks


def shrink_sentence(entry: Mapping[str, Any]) -> str:
    """How far the gap shrinks, from `shrink` of gap.json; empty where there is none."""
    if not entry:
        return ""
    if not entry.get("measurable", True):
        return "The gap is too small to measure how far it shrinks."
    words = f"Put into the model, it closes {_share(entry)} of the gap on the records used"
    if not entry.get("held_out"):
        return f"{words}; no record can be left out to test that on what the model has not seen."
    words += f", and {_share(entry['held_out'])} on records held out"
    runner = entry.get("runner_up")
    if runner and runner["fraction"] is not None:
        words += f"; the runner-up ({_in_words(runner['effect'])}) would close {share(runner['fraction'])}"
    return words + "."


def _share(entry: Mapping[str, Any]) -> str:
    if entry.get("fraction") is None:
        return "an unmeasurable part"
    if entry.get("interval90") is None:
        return f"{share(entry['fraction'])} (a single record: no interval)"
    low, high = entry["interval90"]
    return f"{share(entry['fraction'])} (90 % interval {share(low)} to {share(high)})"


def _probability_table(gap: Mapping[str, Any]) -> Table:
    likely = sorted(gap["probability"].items(), key=lambda pair: -pair[1])
    rows = tuple((effect_title(name), f"{p:.3f}") for name, p in likely if p > _LEAST)
    return Table("gap_probability", "What explains the gap", ("cause", "probability"), rows)


def _where_table(gap: Mapping[str, Any]) -> Table:
    rows = tuple(
        (
            one["quantity"], one["rig"] or "–", one["test"] or "still air", one["record"] or "–",
            _range(one["amplitude"]), _range(one["time_s"]), number(one["excess"], 3), number(one["significance"], 2),
        )
        for one in gap["where"][:_MOST]
    )  # fmt: skip
    more = len(gap["where"]) - len(rows)
    return Table(
        "gap_where",
        "Where the bare model and the records part",
        ("quantity", "rig", "test", "record", "amplitude", "time [s]", "excess", "z"),
        rows,
        "Excess: measured minus bare model, of a damping ratio or a relative frequency; z: how many standard "
        "deviations." + (f" {more} more are in gap.json." if more > 0 else ""),
        (False, False, False, False, True, True, True, True),
    )


def _size_table(gap: Mapping[str, Any]) -> Table:
    rows = tuple(
        (
            effect_title(name), key, number(one["median"]), " to ".join(number(bound) for bound in one["interval90"]),
            unit_text(one["unit"]), one["form"],
        )
        for name, effect in gap["effects"].items()
        for key, one in effect["parameters"].items()
    )  # fmt: skip
    return Table(
        "gap_size",
        "How large the effect is",
        ("effect", "parameter", "median", "90 % interval", "unit", "form"),
        rows,
        numeric=(False, False, True, True, False, False),
    )


def _amplitude_table(gap: Mapping[str, Any]) -> Table:
    found: Sequence[Mapping[str, Any]] = gap["shrink"].get("stable_amplitude", ()) if gap["shrink"] else ()

    def relative(value: float) -> str:
        return f"{100.0 * value:.1f} %"

    rows = tuple(
        (one["test"], *(number(one[key]) for key in ("measured", "before", "after")),
         relative(one["error_before"]), relative(one["error_after"]))
        for one in found
    )  # fmt: skip
    return Table(
        "gap_amplitudes",
        "Stable amplitude of every test before and after the effect is put in",
        ("test", "measured", "bare model", "with the effect", "off before", "off after"),
        rows,
    )


def _range(pair: Sequence[float] | None) -> str:
    return "–" if pair is None else f"{number(pair[0], 3)} to {number(pair[1], 3)}"
