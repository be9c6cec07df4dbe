"""A few hundred cases of the fuzz over all kinds, and proof that the harness sees what it is for."""

from pathlib import Path

import pytest

from tests.fuzz import plants
from tests.fuzz.__main__ import causes, plan
from tests.fuzz.case import Outcome
from tests.fuzz.kinds import KINDS
from tests.fuzz.pool import run_cases
from tests.fuzz.stock import Stock

SEED, CASES = 20240229, 300


@pytest.fixture(scope="session")
def stock(tmp_path_factory: pytest.TempPathFactory) -> Stock:
    made = Stock(tmp_path_factory.mktemp("fuzz") / "stock")
    made.make()
    return made


@pytest.mark.thorough
def test_fuzz_no_input_brings_a_command_down(stock: Stock, tmp_path: Path) -> None:
    planned = plan(CASES, tuple(KINDS))
    outcomes = list(run_cases(planned, seed=SEED, stock=stock.folder, work=tmp_path, jobs=2))
    assert sorted((one.kind, one.number) for one in outcomes) == sorted(planned)
    assert not any(one.faults for one in outcomes), f"\n{causes(outcomes, SEED)}"
    for kind in KINDS:  # intact inputs and spoiled ones are among all kinds
        states = {one.state for one in outcomes if one.kind == kind}
        assert "refused" in states, kind
        assert "accepted" in states, kind


def planted(prepare: object, cases: int, stock: Stock, work: Path, patience: float) -> list[Outcome]:
    """Run intact records with planted faults, a second each."""
    planned = [("csv", 3 * number + 60) for number in range(cases)]
    options = {"limit": 1.0, "patience": patience, "prepare": prepare}
    return list(run_cases(planned, seed=SEED, stock=stock.folder, work=work, **options))


@pytest.mark.thorough
def test_fuzz_harness_sees_planted_faults(stock: Stock, tmp_path: Path) -> None:
    names = list(plants.CAUSES)[:-2]
    outcomes = planted(plants.all_but_the_last_two, len(names), stock, tmp_path, patience=100)
    for name, outcome in zip(names, outcomes, strict=True):
        assert any(one.cause.startswith(plants.CAUSES[name]) for one in outcome.faults), (name, outcome)


@pytest.mark.thorough
@pytest.mark.parametrize("prepare", [plants.hang_first, plants.crash_first])
def test_fuzz_harness_outlives_its_workers(prepare: object, stock: Stock, tmp_path: Path) -> None:
    (outcome,) = planted(prepare, 1, stock, tmp_path, patience=3)
    assert [one.cause for one in outcome.faults] == [prepare.__name__.removesuffix("_first")]


@pytest.mark.thorough
def test_fuzz_case_depends_on_seed_kind_and_number_alone(stock: Stock, tmp_path: Path) -> None:
    one, other = (
        list(run_cases(cases, seed=SEED, stock=stock.folder, work=tmp_path / name))[-1]
        for name, cases in (("a", [("structure", 5)]), ("b", [("csv", 1), ("structure", 0), ("structure", 5)]))
    )
    assert (one.about, one.argv, one.code) == (other.about, other.argv, other.code)
