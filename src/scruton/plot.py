"""Figures of results, one function each: of results in hand or in a folder, in axes of your own or in a new figure.

    import scruton

    scruton.plot.griffin("out/rectangle-4to1")

Every function takes what the figure is of, and `ax`, matplotlib's axes to draw in; a figure of several panels takes the
place of them.  It gives the figure that was drawn on: with `ax` the one that they are in.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scruton.errors import InputError
from scruton.griffin.posterior import peak_names
from scruton.infer.results import Fit
from scruton.infer.store import load_fit
from scruton.report.figures.registry import registered
from scruton.report.figures.style import placed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from scruton.griffin.validate import Validation
    from scruton.infer.cards import ModelCard
    from scruton.infer.criticism import Criticism
    from scruton.sizing.results import Sizing

    Fitted = Fit | Path | str  # a fit, or the folder of one
    Sized = Sizing | Path | str  # a sizing, the folder of one, or that of a fit that was sized

__all__ = [
    "aerodynamic_damping", "aerodynamic_damping_by_test", "compare", "corner", "cost", "damper", "decision",
    "griffin", "griffin_by_test", "griffin_reciprocal", "influence", "information", "innovations", "laws", "lock_in",
    "posterior_predictive", "prior_curves", "prior_predictive", "reciprocal_against_damping", "records",
    "required_damping", "ring_downs", "risk", "shares", "stability", "trace", "trial_functions", "validation",
    "what_moved_the_posterior",
]  # fmt: skip


def griffin(fit: "Fitted", ax: "Axes | None" = None) -> "Figure":
    """Stable amplitude against Scruton number: every peak test's band, the predictive band, the measured points."""
    return _of_fit("griffin", fit, ax)


def griffin_reciprocal(fit: "Fitted", ax: "Axes | None" = None) -> "Figure":
    """The same as D/A (or 1/rad), in which the paper's law is a straight line."""
    return _of_fit("griffin_reciprocal", fit, ax)


def griffin_by_test(fit: "Fitted", ax: "Axes | None" = None, *, page: int = 1) -> "Figure":
    """The Griffin plot that each peak test gives by itself, one panel a test."""
    return _of_fit("griffin_by_test", fit, ax, page=page)


def reciprocal_against_damping(fit: "Fitted", ax: "Axes | None" = None) -> "Figure":
    """Reciprocal amplitude against the structural damping ratio, for each test's own mass and air."""
    return _of_fit("reciprocal_against_damping", fit, ax)


def laws(fit: "Fitted", ax: "Axes | None" = None) -> "Figure":
    """Griffin curves of every peak test under n = -1 and under n = 2."""
    return _of_fit("laws", fit, ax)


def compare(first: "Fitted", second: "Fitted", ax: "Axes | None" = None) -> "Figure":
    """The Griffin plots of two fits of one motion, A and B: median, 90 % predictive band, stable amplitudes."""
    fits = (_fit(first), _fit(second))
    found = [fit.campaign.section.motion.value if peak_names(fit.tree) else "no peak test" for fit in fits]
    if found[0] != found[1] or "no peak test" in found:
        raise InputError("plot", "compare", " and ".join(found), "two fits with peak tests, of one motion")
    return _drawn("compare", fits, ax)


def lock_in(fit: "Fitted", ax: "Axes | None" = None) -> "Figure":
    """Steady amplitudes of sweeps and tests by rig, against the reduced velocity."""
    return _of_fit("lock_in", fit, ax)


def records(fit: "Fitted", ax: "Axes | None" = None, *, page: int = 1) -> "Figure":
    """The records in wind with what was fitted to them, one panel a record."""
    return _of_fit("records", fit, ax, page=page)


def ring_downs(fit: "Fitted", ax: "Axes | None" = None, *, page: int = 1) -> "Figure":
    """The free decays of every rig, and its damping ratio against amplitude."""
    return _of_fit("ring_downs", fit, ax, page=page)


def trial_functions(fit: "Fitted", ax: "Axes | None" = None) -> "Figure":
    """The Griffin curve of every record that each trial function constructs."""
    return _of_fit("trial_functions", fit, ax)


def aerodynamic_damping(fit: "Fitted", ax: "Axes | None" = None) -> "Figure":
    """Aerodynamic damping ratio against amplitude, all tests with a transient."""
    return _of_fit("aerodynamic_damping", fit, ax)


def aerodynamic_damping_by_test(fit: "Fitted", ax: "Axes | None" = None, *, page: int = 1) -> "Figure":
    """The same, one panel a test."""
    return _of_fit("aerodynamic_damping_by_test", fit, ax, page=page)


def stability(fit: "Fitted", ax: "Axes | None" = None, *, page: int = 1) -> "Figure":
    """Total damping ratio against amplitude; it crosses zero at the stable amplitude."""
    return _of_fit("stability", fit, ax, page=page)


def corner(fit: "Fitted", ax: "Axes | None" = None, *, test: str = "") -> "Figure":
    """Pairs of parameters of one test, the first if left out, with contours that hold 50 and 90 %."""
    return _of_fit("corner", fit, ax, which=test)


def trace(fit: "Fitted", ax: "Axes | None" = None, *, test: str = "") -> "Figure":
    """Chains of one test, the first if left out, by ensemble."""
    return _of_fit("trace", fit, ax, which=test)


def innovations(fit: "Fitted", criticism: "Criticism", ax: "Axes | None" = None, *, page: int = 1) -> "Figure":
    """Innovations of every record that `scruton.criticise` judged by them."""
    return _drawn("innovations", (_fit(fit).tree, criticism), ax, page=page)


def posterior_predictive(fit: "Fitted", criticism: "Criticism", ax: "Axes | None" = None, *, page: int = 1) -> "Figure":
    """Statistics of every record beside those of its replicates."""
    return _drawn("posterior_predictive", (_fit(fit).tree, criticism), ax, page=page)


def prior_predictive(fit: "Fitted", criticism: "Criticism", ax: "Axes | None" = None, *, page: int = 1) -> "Figure":
    """Every record inside what the priors expected of it."""
    return _drawn("prior_predictive", (_fit(fit).tree, criticism), ax, page=page)


def what_moved_the_posterior(
    fit: "Fitted", criticism: "Criticism", ax: "Axes | None" = None, *, page: int = 1
) -> "Figure":
    """Standard deviations and sensitivities, a line for every parameter."""
    return _drawn("what_moved_the_posterior", (_fit(fit).tree, criticism), ax, page=page)


def influence(fit: "Fitted", criticism: "Criticism", ax: "Axes | None" = None, *, page: int = 1) -> "Figure":
    """Shifts of the posterior without a record, a line for every record."""
    return _drawn("influence", (_fit(fit).tree, criticism), ax, page=page)


def decision(sizing: "Sized", ax: "Axes | None" = None) -> "Figure":
    """The Griffin plot of the bridge itself: its amplitude, the limit, where it is and where it has to go."""
    return _of_sizing("decision", sizing, ax, "")


def risk(sizing: "Sized", ax: "Axes | None" = None, *, mode: str = "") -> "Figure":
    """Probability of exceeding the limit, and amplitude, against added damping; of the first mode if left out."""
    return _of_sizing("risk", sizing, ax, mode)


def shares(sizing: "Sized", ax: "Axes | None" = None, *, mode: str = "") -> "Figure":
    """Shares of variance: what the uncertainty comes from."""
    return _of_sizing("shares", sizing, ax, mode)


def damper(sizing: "Sized", ax: "Axes | None" = None, *, mode: str = "") -> "Figure":
    """Mass of the damper against risk, with its stroke."""
    return _of_sizing("damper", sizing, ax, mode)


def cost(sizing: "Sized", ax: "Axes | None" = None, *, mode: str = "") -> "Figure":
    """Expected cost against what is bought: damping, or mass."""
    return _of_sizing("cost", sizing, ax, mode)


def information(sizing: "Sized", ax: "Axes | None" = None, *, mode: str = "") -> "Figure":
    """What it would be worth to know more."""
    return _of_sizing("information", sizing, ax, mode)


def required_damping(sizing: "Sized", ax: "Axes | None" = None) -> "Figure":
    """Added damping by confidence, every mode and limit."""
    return _of_sizing("required_damping", sizing, ax, "")


def validation(validations: "Sequence[Validation]", ax: "Axes | None" = None) -> "Figure":
    """Predicted over found, one line a prediction of `scruton.validate`."""
    return _drawn("validation", (validations,), ax)


def prior_curves(card: "ModelCard | Path | str" = "default", ax: "Axes | None" = None) -> "Figure":
    """Griffin curves drawn from the priors of a card."""
    from scruton.infer.cards import load_card

    return _drawn("prior-predictive", (load_card(card) if isinstance(card, Path | str) else card,), ax)


def _fit(fit: "Fitted") -> Fit:
    return load_fit(fit) if isinstance(fit, Path | str) else fit


def _of_fit(name: str, fit: "Fitted", ax: "Axes | None", *, page: int = 1, which: str = "") -> "Figure":
    loaded, entry = _fit(fit), registered()[name]
    if ("posterior" not in loaded.tree and not entry.in_still_air) or (entry.when and not entry.when(loaded)):
        raise InputError("plot", name, "a fit without what it shows", "a fit with such records")
    return _drawn(name, (loaded,), ax, page=page, which=which)


def _of_sizing(name: str, sizing: "Sized", ax: "Axes | None", mode: str) -> "Figure":
    from scruton.app.calls import load_sizing

    loaded = load_sizing(sizing) if isinstance(sizing, Path | str) else sizing
    return _drawn(name, (loaded.to_json(),), ax, which=mode)


def _drawn(name: str, arguments: tuple[Any, ...], ax: "Axes | None", *, page: int = 1, which: str = "") -> "Figure":
    """One page of a figure of the register, for one of the things that it is drawn for."""
    entry = registered()[name]
    with placed(ax, page):
        if entry.each:
            items = {_name_of(item): item for item in entry.each(*arguments).values()}
            if not items or (which and which not in items):
                wanted = f"one of: {', '.join(items)}" if items else "results that hold what it shows"
                raise InputError("plot", name, f"'{which}'", wanted)
            arguments = (*arguments, items[which or next(iter(items))])
        drawn: Any = entry.draw(*arguments)
        pages = drawn if isinstance(drawn, list) else [drawn]
        if not 1 <= page <= len(pages):
            raise InputError("plot", name, f"page {page}", f"1 to {len(pages)}")
    figure: Figure = pages[page - 1].figure
    return figure


def _name_of(item: Any) -> str:
    return str(item["name"] if isinstance(item, dict) else item)
