"""Whole chains: simulate a campaign, fit it, size a bridge, build what is required, and simulate the bridge.

    python -m tests.sizing.chains --chains 40 --seed 0

Nothing of the truth is the model's: oscillators with a force that is written out here, by Runge and Kutta's steps, in
a tunnel with three rigs and on a bridge strip by strip.  The force is Van der Pol's (n = 2), a constant one in the
sense of the velocity beside linear damping (n = -1), or that of a wake which is an oscillator itself (Facchinetti, de
Langre and Biolley 2004); every second three have slow gusts.  Every rig and the bridge miss the curve by a factor of
their own, and the bridge has a damping ratio of its own.  One fit takes most of a minute.
"""

import argparse
import json
import math
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from scruton.cli import main

# The section: A/D = 0.05 at Sc = 20, and 60 Scruton numbers for the relaxation there.
WIDTH, DEPTH, AIR, MASS, FREQUENCY = 0.300, 0.075, 1.2, 20.0, 6.0
FACTOR = 4.0 * math.pi * MASS / (AIR * WIDTH * DEPTH)
RIGS = (10.0, 20.0, 40.0)  # Scruton numbers
RATE, SECONDS, NOISE = 100.0, 60.0, 0.01  # of records; the noise over the stable amplitude
SPAN_MASS, SPAN_AIR, SPAN_DEPTH, SPAN_FREQUENCY = 21_056.0, 1.225, 3.0, 0.3  # of the bridge, B = 4 D as the section
SPAN_FACTOR = 4.0 * math.pi * SPAN_MASS / (SPAN_AIR * 4.0 * SPAN_DEPTH**2)
DAMPING, DAMPING_COV = 0.003, 0.45
LAWS = ("van-der-pol", "constant", "wake")
LIFT, FEEDBACK, SELF_EXCITATION, STALL = 1.14, 12.0, 0.3, 40.0  # of the wake: A/D = 0.05 at Sc = 20, too
GUSTS, PERIODS = 0.02, (8.0, 60.0)  # scatter of the drive, and its periods [s]: about 2 to 15 relaxation times
TOML = """format = 1
title = "{title}"
width = "12 m"
depth = "3 m"
air_density = "1.225 kg/m^3"
limits = ["{limit:.6f} m"]
transfer = "none"

[[modes]]
name = "V1"
frequency = "0.3 Hz"
mass = "21056 kg/m"
length = "400 m"
damping_ratio = {{ mean = 0.003, cov = 0.45 }}
"""


def force(velocity, displacement, law, wake=0.0):
    """Force of the wind in Scruton numbers: times 2 omega^2/F it is an acceleration of y/D, v = y'/(omega D)."""
    if law == "van-der-pol":
        return 50.0 * (1.0 - 4.0 * displacement**2 / (0.05**2 * 5.0 / 3.0)) * velocity
    if law == "wake":
        return LIFT * wake - STALL * velocity
    return 0.75 * math.pi * np.sign(velocity) - 40.0 * velocity * (1.0 + 0.0 * displacement)


def pull(wake, rate, acceleration):
    """Second derivative of the wake's lift variable, by the phase; the acceleration is that of y/D."""
    return SELF_EXCITATION * (1.0 - wake * wake) * rate - wake + FEEDBACK * acceleration


@cache
def stable(sc, law):
    """A/D at which the work of that force over a cycle is that of the damping; with a wake, that which it comes to."""
    if law == "van-der-pol":
        return 0.05 * math.sqrt(max(0.0, 5.0 / 3.0 * (1.0 - sc / 50.0)))
    if law == "wake":
        return float(np.max(np.abs(record(0.05, sc, 0.0, law)[-200:])))
    return 3.0 / (40.0 + sc)


def gusts(rng):
    """A slow fluctuation of the drive in time [s]: a few waves, with a standard deviation of one."""
    rates = 2.0 * math.pi / np.exp(rng.uniform(*np.log(PERIODS), 6))
    phases = rng.uniform(0.0, 2.0 * math.pi, 6)
    return lambda time: math.sqrt(2.0 / 6.0) * float(np.sum(np.cos(rates * time + phases)))


def stepped(slope, state, step):
    """One of Runge and Kutta's steps of a state, a tuple of numbers or arrays."""
    one = slope(*state)
    two = slope(*(x + 0.5 * step * d for x, d in zip(state, one, strict=True)))
    three = slope(*(x + 0.5 * step * d for x, d in zip(state, two, strict=True)))
    four = slope(*(x + step * d for x, d in zip(state, three, strict=True)))
    every = zip(state, one, two, three, four, strict=True)
    return tuple(x + step / 6.0 * (a + 2.0 * b + 2.0 * c + d) for x, a, b, c, d in every)


def record(start, sc, miss, law, blows=None):
    """Displacement y/D of a rig let go at an amplitude, (N,): Runge and Kutta, 8 steps a sample."""
    omega, substeps = 2.0 * math.pi * FREQUENCY, 8
    step, calm = omega / (RATE * substeps), math.exp(miss)
    scale = calm

    def slope(y, v, q, r):
        acceleration = -y + 2.0 / FACTOR * (scale * float(force(v / scale, y / scale, law, q)) - sc * v)
        return v, acceleration, r, pull(q, r, acceleration / scale) if law == "wake" else 0.0

    state, found = (start, 0.0, 0.0, -2.0), []
    for k in range(int(RATE * SECONDS) * substeps):
        if k % substeps == 0:
            found.append(state[0])
            if blows:
                scale = calm * (1.0 + GUSTS * blows(k / (RATE * substeps)))
        state = stepped(slope, state, step)
    return np.array(found)


def on_bridge(damping_ratio, miss, law, cycles=800):
    """Amplitude [m] that the first mode of a sine comes to, in time: 24 strips along half a span, RK4."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    phi = np.sin(0.25 * np.pi * (nodes + 1.0))
    share = weights * phi / np.sum(weights * phi**2)
    scale, step, sc = math.exp(miss), 2.0 * math.pi / 60.0, damping_ratio * SPAN_FACTOR

    stirred = phi if law == "wake" else phi[:0]  # each of these strips has a wake

    def slope(state):
        y, v, (wake, rate) = state[0], state[1], state[2:].reshape(2, -1)
        driven = scale * share @ force(phi * v / scale, phi * y / scale, law, wake)
        acceleration = -y + 2.0 / SPAN_FACTOR * (driven - sc * v)
        return np.concatenate([[v, acceleration], rate, pull(wake, rate, stirred * acceleration / scale)])

    state, last = np.concatenate([[0.02, 0.0], 0.0 * stirred, np.full(stirred.size, -2.0)]), []
    for k in range(60 * cycles):
        first = slope(state)
        second = slope(state + 0.5 * step * first)
        third = slope(state + 0.5 * step * second)
        state = state + step / 6.0 * (first + 2.0 * second + 2.0 * third + slope(state + step * third))
        if k >= 60 * (cycles - 3):
            last.append(state[0])
    return float(SPAN_DEPTH * np.max(np.abs(last)))


@cache
def stands(law):
    """Damping ratios, and the amplitudes [m] that a bridge on the curve comes to with them: by `on_bridge`."""
    ratios = [10.0, 14.0, 18.0, 22.0, 26.0, 30.0, 36.0, 44.0, 48.0, 54.0, 68.0, 90.0, 120.0, 160.0, 220.0]
    ratios = np.array(ratios) / SPAN_FACTOR
    return ratios, np.array([on_bridge(ratio, 0.0, law, 300) for ratio in ratios])


def holding(limit, miss, law):
    """Damping ratio that holds a bridge at its limit [m]; amplitudes scale with what it misses the curve by."""
    ratios, amplitudes = stands(law)
    return float(np.interp(-limit / math.exp(miss), -amplitudes, ratios))


def write_campaign(folder, law, tau, rng, *, gusty=False):
    """Three rigs, one peak test each, a growth and a decay record."""
    lines = [
        "format = 1", 'title = "A chain"', 'source = "simulated"', "", "[section]", 'motion = "heaving"',
        f'width = "{WIDTH} m"', f'depth = "{DEPTH} m"',
    ]  # fmt: skip
    for k, sc in enumerate(RIGS):
        miss = tau * rng.standard_normal()
        steady = stable(sc, law) * math.exp(miss)
        stated = sc / FACTOR * math.exp(0.03 * rng.standard_normal())
        lines += [
            "", "[[rigs]]", f'name = "R{k}"', f'mass = "{MASS} kg/m"', f'frequency = "{FREQUENCY} Hz"',
            f"damping_ratio = {{ mean = {stated:.6g}, sd = {0.03 * stated:.6g} }}", "", "[[tests]]", f'name = "T{k}"',
            f'rig = "R{k}"', f'air_density = "{AIR} kg/m^3"', "reduced_velocity = 9.0", "peak = true",
        ]  # fmt: skip
        for kind, ratio in (("growth", 0.2), ("decay", 1.8)):
            y = record(ratio * steady, sc, miss, law, gusts(rng) if gusty else None)
            y += NOISE * steady * rng.standard_normal(int(RATE * SECONDS))
            t = np.arange(y.size) / RATE
            lines += ["", "[[tests.records]]", f'file = "t{k}_{kind}.csv"', f'kind = "{kind}"']
            header = "time [s],displacement [m]"
            np.savetxt(
                folder / f"t{k}_{kind}.csv", np.c_[t, DEPTH * y], "%.8g", delimiter=",", header=header, comments=""
            )
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


@dataclass(frozen=True)
class Link:
    """What came of one chain: limit and amplitude with what was required [m], damping required and truly needed."""

    law: str
    gusty: bool
    limit: float
    required: float | None
    needed: float
    amplitude: float
    converged: bool

    @property
    def violated(self):
        """Whether the bridge as built exceeds its limit."""
        return self.amplitude > self.limit


def chain(folder, seed, tau=0.10):
    """One chain in an empty folder."""
    rng = np.random.default_rng([seed, 0xC4A1])
    law, gusty = LAWS[seed % 3], seed // 3 % 2 == 1
    write_campaign(folder, law, tau, rng, gusty=gusty)
    limit = SPAN_DEPTH * 0.05 * rng.uniform(0.45, 0.7)
    (folder / "bridge.toml").write_text(TOML.format(title="A chain", limit=limit), encoding="utf-8")
    log = math.sqrt(math.log1p(DAMPING_COV**2))
    own = DAMPING * math.exp(log * rng.standard_normal() - 0.5 * log**2)
    miss = tau * rng.standard_normal()
    fit = main(["fit", str(folder), "-o", str(folder / "fit"), "--seed", str(seed), "--quiet"])
    main(
        ["size", str(folder / "fit"), "--bridge", str(folder / "bridge.toml"), "-o", str(folder / "sizing"), "--quiet"]
    )
    found = json.loads((folder / "sizing" / "sizing.json").read_text(encoding="utf-8"))
    required = found["modes"][0]["limits"][0]["required"]["0.95"]
    built = own + (0.05 if required is None else required)
    needed = max(holding(limit, miss, law) - own, 0.0)
    return Link(law, gusty, limit, required, needed, on_bridge(built, miss, law), fit == 0)


def run(count, first=0):
    """So many chains, printed one by one."""
    links = []
    for seed in range(first, first + count):
        with tempfile.TemporaryDirectory() as folder:
            links.append(chain(Path(folder), seed))
        print(seed, links[-1], "violated" if links[-1].violated else "kept", flush=True)
    return links


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--chains", type=int, default=40)
    arguments.add_argument("--seed", type=int, default=0)
    asked = arguments.parse_args()
    done = run(asked.chains, asked.seed)
    print(f"{sum(link.violated for link in done)} of {len(done)} bridges exceed their limit")
    for law in LAWS:
        of_law = [link for link in done if link.law == law and link.required is not None]
        asked_for, true = (
            float(np.median([getattr(link, name) for link in of_law])) for name in ("required", "needed")
        )
        print(f"{law}: {len(of_law)} bridges, median required {asked_for:.3%}, truly needed {true:.3%}")
