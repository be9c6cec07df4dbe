"""`scruton size`: sizing.json, its table for the terminal and its figures."""

from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.app.options import check_writable
from scruton.app.predict import check_effect, parse_damping
from scruton.app.run import Outcome, Run
from scruton.errors import InputError
from scruton.report.figures.sizing import CONFIDENCES
from scruton.report.text import bullets, number, table
from scruton.terminal import DONE, NOT_TRUSTED

if TYPE_CHECKING:
    import xarray as xr

    from scruton.sizing.bridge import Bridge

RESULT = "sizing.json"


def run(arguments: Namespace) -> Outcome:
    """Size the damping from a folder of results.

    Raises
    ------
    InputError
        For bad input, or a folder that holds a sizing already; nothing is written then.
    """
    from scruton.infer.store import read_tree
    from scruton.report.figures.save import save
    from scruton.report.figures.sizing import sizing_figures
    from scruton.report.parts import sizing_origin
    from scruton.sizing.limits import limit
    from scruton.sizing.run import size

    results, rig = arguments.results, arguments.rig
    folder = arguments.out or results / "sizing"
    rules = [limit(one) for one in arguments.limit]
    check_writable(folder)
    tree, summary = read_tree(results)
    if not summary["tests"]:
        raise InputError(results, "", "a campaign without tests in wind", "a fit of at least one test")
    check_effect(summary, arguments.effect, results)
    stands = read_bridge(tree, arguments.bridge, damping=arguments.damping, rig=rig)
    settings = {name: getattr(arguments, name) for name in ("law", "effect", "rig", "damping")}
    settings["limits"] = arguments.limit
    origin = sizing_origin(results, summary, stands, seed=arguments.seed, settings=settings)
    inputs = origin["fit_sha256"] | origin["bridge_sha256"]
    with Run(folder, "size", arguments, sha256=inputs, settings=settings, results=(RESULT,)) as work:
        sizing = size(tree, stands, rules, rig=rig, law_n=arguments.law, seed=arguments.seed, progress=work.bar)
        content = sizing.to_json()
        _explain(content, summary, bridge=arguments.bridge)
        content["provenance"] = origin | {key: settings[key] for key in ("law", "effect")}
        figures = [path for one in sizing_figures(content) for path in save(one, work.new, formats=("svg", "png"))]
        work.write(RESULT, content)
        paths = work.published([work.new / RESULT, *figures])
    return Outcome(sizing_text(content), paths, code=DONE if summary["converged"] else NOT_TRUSTED)


def _explain(content: dict[str, Any], summary: Mapping[str, Any], *, bridge: Path | None) -> None:
    """Add what has to be said of the fit and of a bridge that was not given."""
    if bridge is None:
        content["flags"].append("no bridge was given: the answer is for the section model itself, at its own size")
    if not summary["converged"]:
        content["flags"].insert(0, "the fit did not converge: " + "; ".join(summary["flags"]))


def read_bridge(
    tree: "xr.DataTree", path: Path | None, *, damping: str | None = None, rig: str | None = None
) -> "Bridge":
    """Read the bridge of the command line, or take the section model itself where none is given."""
    from dataclasses import replace

    from scruton.griffin.posterior import chosen_rig, motion_of
    from scruton.sizing.bridge import DAMPING, load_bridge, stand_in
    from scruton.sizing.thresholds import DAMPING_COV

    motion = motion_of(tree)
    design = None
    if damping is not None:
        design = parse_damping(damping).or_relative_sd(DAMPING_COV)
    if path is None:
        return stand_in(tree, motion, chosen_rig(tree, rig), design or DAMPING)
    found = load_bridge(path, motion)
    if design is None:
        return found
    return replace(found, modes=tuple(replace(mode, damping_ratio=design) for mode in found.modes))


def sizing_text(content: Mapping[str, Any]) -> str:
    """What is required, by mode and limit; the damper; what more knowledge would be worth."""
    unit = content["amplitude_unit"]
    parts = [f"{content['bridge']['title']}: damping that keeps the amplitude below the limit"]
    rows = [
        [
            mode["name"], one["rule"], number(one["limit"]), f"{one['probability']:.3f}",
            *(_percent(one["required"][p]) for p in CONFIDENCES),
        ]
        for mode in content["modes"]
        for one in mode["limits"]
    ]  # fmt: skip
    header = ["mode", "limit", f"[{unit}]", "P without", "50 %", "84 %", "95 %", "99 %"]
    parts.append("Added damping [%] by confidence\n" + table(header, rows))
    rows = []
    for mode in content["modes"]:
        one = mode["amplitude"]
        sc = mode["scruton_number"]
        rows.append(
            [
                mode["name"], f"{number(sc['median'], 3)} ({number(sc['low'], 3)} .. {number(sc['high'], 3)})",
                f"{number(one['median'], 3)} ({number(one['low'], 3)} .. {number(one['high'], 3)})",
                *(f"{share['source']} {max(share['first'], 0.0):.0%}" if share["total"] else "-"
                  for share in mode["shares"]["needed"][:1]),
            ]
        )  # fmt: skip
    parts.append(table(["mode", "Sc (90 %)", f"amplitude without [{unit}]", "largest share of variance"], rows))
    parts += [_damper_text(mode) for mode in content["modes"]]
    parts += [text for mode in content["modes"] if "cost" in mode for text in _cost_text(mode)]
    parts += _all_text(content["all_modes"])
    if content["flags"]:
        parts.append(bullets(content["flags"]))
    return "\n\n".join(parts)


def _percent(value: float | None) -> str:
    return f"> {5}" if value is None else f"{100 * value:.3f}"


def _damper_text(mode: Mapping[str, Any]) -> str:
    one = mode["damper"]
    name = f"Tuned mass damper, mode {mode['name']}"
    if not one["dampers"]:
        return f"{name}: {one['reason']}"
    rows = [
        [
            str(k + 1), number(each["mass"], 4), f"{100 * each['mass_ratio']:.3f}", number(each["frequency"], 5),
            f"{100 * each['damping_ratio']:.2f}", number(each["spring"], 4), number(each["dashpot"], 4),
        ]
        for k, each in enumerate(one["dampers"])
    ]  # fmt: skip
    header = [
        "damper",
        "mass [kg]",
        "mass ratio [%]",
        "frequency [Hz]",
        "damping [%]",
        "spring [N/m]",
        "dashpot [N s/m]",
    ]
    stroke, asked = one["stroke"], one["asked"]
    lines = [
        f"{name}: {'least mass' if one['achievable'] else 'NOT ACHIEVED'} for a risk of {asked['risk']:.1%}; "
        f"{one['reason']}",
        table(header, rows),
        f"risk left {one['probability']:.3f}; stroke {number(stroke['median'], 3)} m "
        f"(95 %: {number(stroke['high'], 3)} m); risk where detuned: "
        + ", ".join(f"{each['detuning']:+.0%} {each['probability']:.3f}" for each in one["detuned"]),
    ]
    return "\n".join(lines)


def _cost_text(mode: Mapping[str, Any]) -> list[str]:
    cost = mode["cost"]
    found = []
    money = cost["currency"]
    if by_mass := cost.get("by_mass"):
        least = f"Least expected cost, mode {mode['name']}: {number(by_mass['best_total'], 4)} {money}"
        if by_mass["best_mass"]:
            end = ", the heaviest looked at" if by_mass["at_the_end"] else ""
            found.append(
                f"{least} with a damper of {number(by_mass['best_mass'], 4)} kg{end} "
                f"(without: {number(by_mass['without'], 4)} {money})"
            )
        else:
            found.append(f"{least} without a damper")
    if by_damping := cost.get("by_damping"):
        found.append(
            f"Least expected cost, mode {mode['name']}: {number(by_damping['best_total'], 4)} {money} with "
            f"{100 * by_damping['best_added_damping']:.3f} % added damping"
            + (", the most looked at" if by_damping["at_the_end"] else "")
        )
    if known := cost.get("information"):
        rows = [[one["name"], one["kind"], number(one["value"], 3)] for one in known["worth"]]
        found.append(
            f"Value of knowing more before choosing [{money or 'currency'}]; all of it {number(known['perfect'], 3)}\n"
            + table(["of", "kind", "worth at most"], rows)
        )
    return found


def _all_text(every: Mapping[str, Any]) -> list[str]:
    if len(every["names"]) < 2 and "hours" not in every:
        return []
    rows = []
    for key, label in (
        ("without", "as it is"), ("with_required_damping", "with the damping required at 95 %"),
        ("with_dampers", "with all dampers, each acting on every mode"),
    ):  # fmt: skip
        if key in every:
            rows.append([label, *(f"{p:.3f}" for p in every[key]["each"]), f"{every[key]['any']:.3f}"])
    found = ["Probability of exceeding the limit in lock-in\n" + table(["", *every["names"], "any"], rows)]
    if hours := every.get("hours"):
        rows = [
            [name, f"{low:.2f} .. {high:.2f}{' (assumed)' if assumed else ''}", number(a_year, 4), number(beyond, 4)]
            for name, (low, high), assumed, a_year, beyond in zip(
                every["names"],
                hours["lock_in"],
                hours["assumed"],
                hours["a_year"],
                hours["exceeding_a_year"],
                strict=True,
            )
        ]
        header = ["mode", "lock-in U/(fD)", "hours a year in lock-in", "expected hours beyond the limit"]
        found.append(table(header, rows))
    return found
