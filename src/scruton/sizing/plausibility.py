"""What a bridge states, held against what can be: remarks on slips of the pen, which are no errors."""

from collections.abc import Iterator, Sequence

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.plausibility import AMPLITUDE, DAMPING, DENSITY, SLENDERNESS, Range, outside
from scruton.campaign.quantity import Quantity
from scruton.campaign.remarks import Remark, Severity, sentences
from scruton.campaign.schema import Fluid, Motion
from scruton.said import Said
from scruton.sizing.bridge import Bridge, Mode
from scruton.sizing.limits import Limit
from scruton.sizing.thresholds import ODD_COV, ODD_SHARE

FREQUENCY = Range(0.02, 20.0, "Hz", "no deck or tower of a bridge swings so slowly, none that vortices move so fast")
HEAVINESS = Range(5.0, 3e4, "", "lighter than foam or heavier than lead")
DEPTH = Range(0.01, 30.0, "m", "no deck is so deep or so thin")
_GRID: FloatArray = np.asarray((np.arange(1000) + 0.5) / 1000.0, dtype=np.float64)


def odd_input(bridge: Bridge, limits: Sequence[Limit] = ()) -> list[Said]:
    """Remark on everything that a bridge and its limits state and that can hardly be, worst first."""
    parts = _bridge(bridge), *(_mode(bridge, mode, limits) for mode in bridge.modes)
    return sentences(remark for part in parts for remark in part)


def _bridge(bridge: Bridge) -> Iterator[Remark]:
    yield from outside(bridge.width / bridge.depth, SLENDERNESS, "slenderness", "", "bridge", "B/D")
    yield from outside(bridge.depth, DEPTH, "depth", "", "bridge", "the depth D")
    yield from outside(bridge.air_density, DENSITY[Fluid.AIR], "density", "", "bridge", "the air density")
    if not bridge.coherence.certain:
        above = float(np.mean(bridge.coherence.quantile(_GRID) > 1.0))
        if above > ODD_SHARE:
            text = (
                f"{100.0 * above:.0f} % of what is stated of the coherence lies above 1, where there is none; "
                'distribution = "beta" stays below'
            )
            yield Remark(Severity.DOUBT, "coherence", "", "bridge", f"{text}.", text, above, above / ODD_SHARE)
    yield from _spread(bridge.coherence, "coherence", "", "bridge")


def _mode(bridge: Bridge, mode: Mode, limits: Sequence[Limit]) -> Iterator[Remark]:
    about = ("mode", mode.name)
    depth = bridge.depth if bridge.motion is Motion.HEAVING else 1.0
    for limit in limits:
        amplitude = limit.amplitude(bridge.motion, mode.frequency.mean, bridge.width, bridge.depth) / depth
        yield from outside(
            amplitude, AMPLITUDE[bridge.motion], "limit", *about, f"the amplitude of the limit {limit.text}"
        )
    yield from outside(mode.frequency.mean, FREQUENCY, "frequency", *about, "the frequency")
    yield from _spread(mode.frequency, "frequency", *about)
    if mode.damping_ratio.mean < DAMPING.low:  # too much of it is remarked on as a design damping ratio
        yield from outside(mode.damping_ratio.mean, DAMPING, "damping", *about, "the damping")
    yield from _spread(mode.damping_ratio, "damping_ratio", *about)
    if mode.mass is not None:
        what, displaced = "mass", bridge.air_density * bridge.width * bridge.depth
        if bridge.motion is Motion.TORSIONAL:
            what, displaced = "inertia", displaced * (bridge.width**2 + bridge.depth**2) / 12.0
        over = f"the {what} over that of the air displaced"
        yield from outside(mode.mass.mean / displaced, HEAVINESS, what, *about, over)
        yield from _spread(mode.mass, what, *about)


def _spread(quantity: Quantity, what: str, of: str, name: str) -> Iterator[Remark]:
    """Remark on a standard deviation that nobody who measured or calculated the number would state."""
    most, share = ODD_COV[what], quantity.relative_sd
    if share > most:
        text = (
            f"the standard deviation of the {what.replace('_', ' ')} is {{}} % of its mean, above {100.0 * most:.0f} %"
        )
        said = text.format(f"{100.0 * share:.3g}")
        yield Remark(
            Severity.DOUBT, f"{what} uncertainty", of, name,
            f"{said}; wanted is one standard deviation, no interval and no percentage.",
            f"{text},", 100.0 * share, share / most,
        )  # fmt: skip
