"""Damaged results: fits, checkpoints, batches, calibrations, challenges, and other campaigns' files among them."""

import json
from collections.abc import Callable
from pathlib import Path

from numpy.random import Generator

from tests.fuzz.case import ACCEPTED, ANY, REFUSED, Case, Run
from tests.fuzz.damage import one, spoil_bytes, spoil_tree
from tests.fuzz.kinds.numbers import finite_json
from tests.fuzz.stock import Stock

PREDICT = ("predict", "case", "--sc", "30", "--json")
TOLERANCE = 0.05  # relative change of the median that damage may make unnoticed
STOP = {
    "size": "scruton.sizing.study.size",
    "criticise": "scruton.infer.criticism.criticise_tree",
    "fit": "scruton.infer.fit.fit_campaign",
    "batch": "scruton.workers.connected",
    "calibrate": "scruton.calibrate.calibration.run_campaign",
}


def spoil_json(rng: Generator, path: Path) -> str:
    """Spoil a JSON file: its bytes, its fields, or put something else in its place."""
    data = path.read_bytes()
    how = one(rng, ("bytes", "fields", "fields", "fields", "whole"))
    if how == "bytes":
        about, data = spoil_bytes(rng, data)
    elif how == "fields":
        about, content = spoil_tree(rng, json.loads(data))
        data = json.dumps(content, default=str).encode(errors="surrogatepass")
    else:
        about, data = one(rng, WHOLE)
    path.write_bytes(data)
    return f"{path.name}: {about}"


WHOLE = (
    ("{}", b"{}"), ("[]", b"[]"), ("null", b"null"), ("a number", b"7"), ("text", b'"text"'), ("empty", b""),
    ("NaN", b"NaN"), ("deep", b"[" * 100_000), ("binary", bytes(range(256)) * 20), ("a TOML", b"format = 1\n"),
    ("UTF-16", "{}".encode("utf-16")), ("an integer of 5,000 digits", b"1" * 5000),
)  # fmt: skip


def fit(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """A folder of `fit` that is damaged, and what reads it."""
    place = stock.copy("fit", folder / "case")
    if number % 12 == 0:
        return Case("results: intact", PREDICT, ACCEPTED, demand=_predicted(stock, 1e-12))
    about, allowed = _damage(rng, number, place, stock)
    verb = ("predict", "predict", "size", "criticise", "fit")[number % 5]
    names = ("fit.json", "posterior.nc", "case")
    if verb == "predict":
        return Case(f"predict of {about}", PREDICT, allowed, names, demand=_predicted(stock, TOLERANCE))
    if verb == "fit":
        argv = ("fit", str(stock.path("heaving")), "-o", "case", "--resume", "--model", str(stock.path("card.toml")))
        return Case(f"fit --resume over {about}", argv, ANY, names, (STOP["fit"],), may_write=True)
    argv = (verb, "case", *(("--limit", "0.05") if verb == "size" else ()))
    stops = () if number % 50 in (42, 43) else (STOP[verb],)
    return Case(f"{verb} of {about}", argv, allowed, names, stops, patience=1.0 if stops else 3.0)


def _damage(rng: Generator, number: int, place: Path, stock: Stock) -> tuple[str, frozenset[int]]:
    """Spoil one of the two files, drop it, or take that of another campaign."""
    how = number % 7
    posterior, summary = place / "posterior.nc", place / "fit.json"
    if how < 3:
        return spoil_json(rng, summary), ANY
    if how < 5:
        about, data = spoil_bytes(rng, posterior.read_bytes())
        posterior.write_bytes(data)
        return f"posterior.nc: {about}", ANY
    path = one(rng, (posterior, summary))
    if how == 5:
        stock.copy(f"other/{path.name}", path)
        return f"{path.name} of another campaign", REFUSED
    path.unlink()
    if rng.random() < 0.5:
        path.mkdir()
    return f"no {path.name}", REFUSED


def _predicted(stock: Stock, tolerance: float) -> Callable[[Run], str]:
    """A prediction that is accepted is strict JSON, and that of the intact fit."""

    def demand(run: Run) -> str:
        if run.code == 2:
            return ""
        if wrong := finite_json(run.out):
            return wrong
        content = json.loads(run.out)
        found = content["predictions"][0]["amplitude"]["median"]
        wanted = intact_median(stock)
        if abs(found / wanted - 1.0) > tolerance and not content["predictions"][0].get("flags") and run.code == 0:
            return f"silent nonsense: another prediction from damaged results\n{found} for {wanted}"
        return ""

    return demand


def intact_median(stock: Stock) -> float:
    """Median that the intact fit predicts at Sc = 30."""
    from scruton.griffin import predict
    from scruton.infer.store import read_tree

    if stock.folder not in _MEDIAN:
        _MEDIAN[stock.folder] = predict(read_tree(stock.path("fit"))[0], scruton_number=30.0).to_json()["amplitude"][
            "median"
        ]
    return _MEDIAN[stock.folder]


_MEDIAN: dict[Path, float] = {}


def resumed(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """Interrupted runs taken up again, most of them with damaged files."""
    if number % 20 == 0:
        stock.copy("interrupted", folder / "case")
        argv = ("fit", str(stock.path("heaving")), "-o", "case", "--resume", "--model", str(stock.path("card.toml")))
        return Case("fit --resume, intact", argv, ACCEPTED, demand=_refitted(stock), may_write=True)
    return (_checkpoint, _batch, _batch, _calibration, _calibration)[number % 5](rng, number, folder, stock)


def _checkpoint(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    place = stock.copy("interrupted", folder / "case")
    path = one(rng, sorted(one for one in place.rglob("*") if one.is_file()))
    about, data = spoil_bytes(rng, path.read_bytes())
    if number % 10 == 5:
        about, data = one(rng, WHOLE)
    path.write_bytes(data)
    argv = (
        "fit",
        str(stock.path("heaving")),
        "-o",
        "case",
        "--resume",
        "--model",
        str(stock.path("card.toml")),
        "--quiet",
    )
    names = (path.name, "case")
    return Case(f"fit --resume over a checkpoint: {about}", argv, ANY, names, demand=_refitted(stock), may_write=True)


def _refitted(stock: Stock) -> Callable[[Run], str]:
    def demand(run: Run) -> str:
        if run.code == 2:
            return ""
        found, wanted = ((at / "fit.json").read_bytes() for at in (run.folder / "case", stock.path("fit")))
        return "" if found == wanted else "silent nonsense: another fit from a damaged checkpoint"

    return demand


def _batch(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    place = stock.copy("batch", folder / "case")
    file = ("heaving/fit.json", "batch.json", ".scruton/batch/run.json", ".scruton/manifest.json")[number % 4]
    about = spoil_json(rng, place / file)
    campaign, card = str(stock.path("heaving")), str(stock.path("card.toml"))
    argv = ("batch", campaign, "-o", "case", "--model", card, "--resume", "--quiet")
    return Case(f"batch --resume over {about}", argv, ANY, ("case",), (STOP["batch"],), may_write=True)


def _calibration(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    place = stock.copy("calibration", folder / "case")
    if number % 2:
        about = spoil_json(rng, place / ".scruton/calibrate/run.json")
    else:
        line = one(rng, LINES)
        lines = place / ".scruton/calibrate/new/campaigns"
        lines.mkdir(parents=True, exist_ok=True)
        (lines / "turbulence-1.jsonl").write_bytes(line)
        about = f"turbulence-1.jsonl: {line[:40]!r}"
    card = str(stock.path("card.toml"))
    argv = ("calibrate", "-o", "case", "--campaigns", "2", "--regimes", "turbulence-1", "--model", card, "--resume")
    return Case(f"calibrate --resume over {about}", argv, ANY, ("case",), (STOP["calibrate"],), may_write=True)


LINES = (
    b"", b"\n", b"{}\n", b"[]\n", b"null\n", b"7\n", b'{"index": 0}\n{"index": 1}\n', b'{"index": 0, "regime": "x"}',
    b"\xff\xfe\n", b'{"index": "a"}\n{"index": null}\n', b'{"index": []}\n', b"[" * 50_000 + b"\n",
    b'{"index": 0}\n{"index": 1}',
    b'{"index": 0, "scores": {}}\n{"index": 1, "scores": 7}\n',
    b'{"index": 0, "error": 3}\n{"index": 1, "error": {}}\n',
)  # fmt: skip


def challenge(rng: Generator, number: int, folder: Path, stock: Stock) -> Case:
    """A challenge, its sealed answers and the results of its run, damaged, and `score` or `run --resume`."""
    place = stock.copy("challenge", folder / "case")
    score = ("challenge", "score", "case/made", "case/results", "-o", "score")
    draw = ("scruton.calibrate.challenge.pictures.draw=skip",)
    if number % 12 == 0:
        return Case("challenge: intact", score, ACCEPTED, stops=draw)
    path = place / CHALLENGE_FILES[number % len(CHALLENGE_FILES)]
    about = _dropped(path) if number % 9 == 8 else spoil_json(rng, path)
    if number % 5 == 0:
        argv = ("challenge", "run", "case/made", "-o", "case/results", "--resume")
        stops = ("scruton.gap.diagnose.examine",)
        return Case(f"challenge run --resume over {about}", argv, ANY, ("case",), stops, may_write=True)
    return Case(f"challenge score of {about}", score, ANY, ("case",), draw, demand=_scored)


CHALLENGE_FILES = (
    "results/case-0001/gap.json", "results/case-0002/gap.json", "results/case-0001/case.json", "made/challenge.json",
    "results/.scruton/challenge run/run.json", "made/answers/answers.json", "results/case-0002/gap.json",
)  # fmt: skip


def _dropped(path: Path) -> str:
    path.unlink()
    return f"no {path.name}"


def _scored(run: Run) -> str:
    path = run.folder / "score" / "challenge-score.json"
    return finite_json(path.read_text(encoding="utf-8")) if path.is_file() else ""
