"""The other TOML files: model cards, bridges, specifications of simulations."""

import tomllib
from pathlib import Path
from typing import Any

import tomli_w
from numpy.random import Generator

from tests.fuzz.case import ACCEPTED, Case, Run
from tests.fuzz.damage import STRANGE, UNITS, get, leaves, one, put, spell, spoil_bytes, spoil_tree
from tests.fuzz.kinds.numbers import finite_json
from tests.fuzz.stock import Stock

BRIDGE = """
format = 1
title = "A bridge"
width = "12 m"
depth = "3 m"
air_density = "1.22 kg/m^3"
limits = ["jtg", "kd", "0.1 m", "rms-acceleration"]
coherence = { mean = 0.95, sd = 0.03 }

[[modes]]
name = "V1"
frequency = "0.30 +/- 0.003 Hz"
mass = "20000 +/- 400 kg/m"
length = "400 m"
damping_ratio = { mean = 0.003, cov = 0.45 }

[[modes]]
name = "V2"
frequency = "0.42 Hz"
mass = "20000 kg/m"
length = "400 m"
shape = "sine"
half_waves = 2
lock_in = [6.0, 12.0]
damping_ratio = { median = 0.003, cov = 0.45, minimum = 0.001 }

[damper]
number = 1
risk = 0.05
largest_stroke = "0.6 m"
largest_mass_ratio = 0.05
position = 0.25

[wind]
weibull_scale = "7 m/s"
weibull_shape = 2.0
share = 0.4

[cost]
currency = "EUR"
fixed = 10000.0
per_kg = 5.0
per_percent = 1000.0
failure = 1e7
"""
EXTENSION = {
    "format": 1, "name": "mine", "title": "A card", "extends": "default",
    "law": {"n": [-1, 0.5], "prior_weights": [0.5, 0.5], "averaging": "evidence", "reason": "to see"},
    "priors": {
        "relaxation_ratio": {"family": "lognormal", "median": 0.02, "log_sd": 1.0, "unit": "-", "reason": "to see"},
        "stable_amplitude": {
            "heaving": {"family": "lognormal", "median": 0.05, "log_sd": 1.5, "unit": "A/D", "reason": "to see"},
        },
    },
    "effects": {"prior_none": 0.5, "weights": {"coulomb_friction": 2.0}},
    "sampler": {"walkers": 64, "draws": 16},
}  # fmt: skip


def spoiled(rng: Generator, number: int, content: dict[str, Any], path: Path) -> str:
    """Write a table with something wrong in it, and say what."""
    text = None
    how = number % 5
    if how in (0, 1):
        about, content = spoil_tree(rng, content)
    elif how == 2:
        where = one(rng, leaves(content))
        value = STRANGE[number // 5 % len(STRANGE)]
        about, content = f"{spell(where)} = {str(value)[:40]!r}", put(content, where, value)
    elif how == 3:
        where = one(rng, [at for at in leaves(content) if isinstance(get(content, at), str | float)])
        value = f"{str(get(content, where)).split(' ')[0]} {UNITS[number // 5 % len(UNITS)]}"
        about, content = f"{spell(where)} = {value[:40]!r}", put(content, where, value)
    else:
        about, text = spoil_bytes(rng, tomli_w.dumps(content).encode())
        about = f"bytes {about}"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(tomli_w.dumps(content).encode(errors="surrogatepass") if text is None else text)
    return about


def card(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """`models show` of a card that extends another or stands alone; a few fits up to the sampling."""
    from scruton.infer.cards import load_card

    alone = rng.random() < 0.4
    content = tomllib.loads(load_card("default").resolved) if alone else EXTENSION
    path = folder / "card.toml"
    show = ("models", "show", "card.toml")
    if number % 8 == 0:
        where = one(
            rng,
            [at for at in leaves(content) if at[-1] in ("median", "log_sd") and isinstance(get(content, at), float)],
        )
        path.write_text(
            tomli_w.dumps(put(content, where, get(content, where) * rng.uniform(0.5, 2.0))), encoding="utf-8"
        )
        return Case("card: intact", show, ACCEPTED)
    about = f"card ({'whole' if alone else 'extends'}): {spoiled(rng, number, content, path)}"
    if number % 8 == 1:
        fit = ("fit", str(stock.path("heaving")), "-o", "results", "--model", "card.toml", "--quiet")
        return Case(about, fit, blames=("card.toml", "default.toml"), stops=("scruton.infer.fit.fit_campaign",))
    return Case(about, show, blames=("card.toml", "default.toml"))


def bridge(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """`size` with a bridge, up to the sizing; one in 30 to its end."""
    content = tomllib.loads(BRIDGE)
    whole = number % 60 == 32
    size = (
        "size",
        str(stock.path("fit")),
        "--bridge",
        "bridge.toml",
        "-o",
        "sizing",
        *(() if number % 2 else ("--quiet",)),
    )
    stops = () if whole else ("scruton.sizing.size.size",)
    if number % 8 == 0:
        where = one(rng, [at for at in leaves(content) if isinstance(get(content, at), float) and at[0] != "wind"])
        value = get(content, where) * rng.uniform(0.7, 1.05)
        (folder / "bridge.toml").write_text(tomli_w.dumps(put(content, where, value)), encoding="utf-8")
        return Case("bridge: intact", size, ACCEPTED, stops=stops, demand=_sized if whole else None, patience=6.0)
    about = f"bridge: {spoiled(rng, number, content, folder / 'bridge.toml')}"
    blames = ("bridge.toml", "command line", "/dev/null", "passwd")
    return Case(about, size, blames=blames, stops=stops, demand=_sized if whole else None, patience=6.0)


def _sized(run: Run) -> str:
    path = run.folder / "sizing" / "sizing.json"
    return finite_json(path.read_text(encoding="utf-8")) if path.is_file() else ""


def simulation(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """`simulate` of a specification."""
    motion = one(rng, ("heaving", "torsional"))
    content = tomllib.loads(stock.path(f"{motion}.toml").read_text(encoding="utf-8"))
    if number % 4 == 1:
        content["rigs"][0]["disturbances"] = {"friction": 0.01, "friction_form": "tanh", "friction_scale": 0.002}
        content["rigs"][1]["true_damping_ratio"] = 0.006
    path = folder / "spec.toml"
    simulate = ("simulate", "spec.toml", "-o", "made", "--seed", str(number))
    if number % 8 == 0:
        for at in leaves(content):
            if at[-1] in ("duration", "initial_amplitude"):
                content = put(content, at, get(content, at) * float(rng.uniform(0.8, 1.2)))
        path.write_text(tomli_w.dumps(content), encoding="utf-8")
        return Case("simulation: intact", simulate, ACCEPTED, demand=_loads)
    about = f"simulation ({motion}): {spoiled(rng, number, content, path)}"
    return Case(about, simulate, blames=("spec.toml", "made"), demand=_loads)


def _loads(run: Run) -> str:
    """What was simulated can be read."""
    import scruton
    from scruton.errors import InputError

    if run.code != 0:
        return ""
    try:
        scruton.load_campaign(run.folder / "made")
    except InputError as error:
        return f"a simulated campaign that cannot be read\n{error}"
    return ""
