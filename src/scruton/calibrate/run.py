"""The whole calibration: regimes, processes, resumption, and what comes out."""

from collections.abc import Sequence

from scruton.calibrate import store
from scruton.calibrate.campaigns import run_campaign
from scruton.calibrate.execution import Execution, at_least
from scruton.calibrate.identifiability import identifiability
from scruton.calibrate.regimes import chosen
from scruton.calibrate.result import CalibrationResult, summarise
from scruton.calibrate.tables import write_tables
from scruton.infer.cards import load_card
from scruton.processes import completed
from scruton.provenance import versions


def run_calibration(
    how: Execution,
    *,
    regimes: Sequence[str] | None = None,
    campaigns: int = 500,
    seed: int = 0,
    model: str = "default",
) -> CalibrationResult:
    """Simulate and fit campaigns whose truths come from the prior, and see how often the intervals hold them.

    Parameters
    ----------
    how : Execution
        Where the results go, and by how many processes.
    regimes : sequence of str, optional
        Some of `REGIMES`; all by default.
    campaigns : int
        In every regime.
    seed : int
        The one source of randomness.
    model : str
        Model card: a shipped name or a TOML file. A regime replaces some of its priors; see `Regime.card`.

    Raises
    ------
    InputError
        For unknown regimes, a card that cannot be read, or a folder that holds results.
    """
    at_least(2, "calibration", campaigns=campaigns)
    at_least(1, "calibration", jobs=how.jobs)
    wanted, base = chosen(regimes), load_card(model)
    settings = {"seed": seed, "model": base.name, "model_sha256": base.sha256, "versions": versions()}
    with store.claim(how, settings) as work:
        store.begin(work, settings)
        informed = [regime for regime in wanted if not regime.weighs_laws]
        design = tuple(row for regime in informed for row in identifiability(regime, regime.card(base)))
        done = {regime.name: store.load(work.new, regime.name) for regime in wanted}
        # Campaign by campaign through all regimes, so that a run that is stopped early tells something of each.
        missing = [(name, i) for i in range(campaigns) for name, mine in done.items() if i not in mine]
        for record in completed(run_campaign, [(*task, seed, base) for task in missing], how.jobs):
            store.append(work.new, record)
            mine = done[record["regime"]]
            mine[record["index"]] = record
            how.tell(record["regime"], len(mine), campaigns)
        for mine in done.values():
            store.put_in_order(work.new, mine)
        kept = {name: [mine[i] for i in range(campaigns)] for name, mine in done.items()}
        result = summarise(how.folder, settings, wanted, kept, design)
        write_tables(result, work.new)
        work.publish()
    return result
