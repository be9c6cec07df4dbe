"""Do 90 % intervals of the stable amplitude and of the rate there hold on motions that no part of the program makes?

The full equation of motion by Runge-Kutta, in units of 1/omega: forces of the laws n = 0, 1, 2, and Facchinetti's wake
oscillator; white turbulence, slow gusts, noise of the sensor.  One rig, two growths, two decays, one lock-in record,
fitted with the default card: `python -m benchmarks.outside SEED KIND:FIRST-LAST ...`, kinds n0, n1, n2 and wake.

The true rate is seen in the motion without noise: the mean of releases a tenth above and a tenth below, over deviations
from 5 to 0.5 %.  Random numbers within a run are numba's own.
"""

# ruff: noqa: NPY002

import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign, Kind, Motion, Quantity, Record, Rig, Section, Test
from scruton.infer.cards import load_card
from scruton.infer.fit import fit_campaign
from scruton.infer.joint import joint_draws, law_weights

FREQUENCY, DEPTH, DENSITY, MASS, WIDTH = 7.87, 0.075, 1.22, 7.292, 0.3
STEPS = 56  # a cycle
KINDS = {"n2": 0, "wake": 1, "n1": 2, "n0": 3}
RELEASES = ((Kind.GROWTH, 0.15), (Kind.DECAY, 2.3), (Kind.GROWTH, 0.2), (Kind.DECAY, 2.0), (Kind.STEADY, 1.0))


@njit(cache=True)
def rhs(kind, s, p, g):  # type: ignore[no-untyped-def]
    """Rates of (x, v, q, q'); p is (xi, h, a0) of a law, (xi, fluid damping, M, A, epsilon, tuning) of a wake."""
    x, v, q, z = s
    if kind == 1:
        wf = 1.0 / p[5]
        a = -(2.0 * p[0] + p[1]) * v - x + p[2] * (1.0 + g) * q
        return np.array([v, a, z, -wf * p[4] * (q * q - 1.0) * z - wf * wf * q + p[3] * a])
    a0 = p[2] * (1.0 + g)
    if kind == 0:
        wind = 1.0 - 4.0 * (x / a0) ** 2
    elif kind == 2:
        wind = 1.0 - 0.375 * np.pi * abs(v) / a0
    else:
        wind = np.log(a0 / np.sqrt(x * x + v * v))
    return np.array([v, -2.0 * p[0] * v - x + 2.0 * p[1] * wind * v, 0.0, 0.0])


@njit(cache=True)
def run(kind, s, p, cycles, white, gust, gust_time, seed):  # type: ignore[no-untyped-def]
    """Displacement at every step, and where it ends."""
    np.random.seed(seed)
    n, dt = int(cycles * STEPS), 2.0 * np.pi / STEPS
    out, g, fade = np.empty(n), gust * np.random.randn(), np.exp(-dt / gust_time)
    for k in range(n):
        out[k] = s[0]
        a = rhs(kind, s, p, g)
        b = rhs(kind, s + 0.5 * dt * a, p, g)
        c = rhs(kind, s + 0.5 * dt * b, p, g)
        s = s + dt / 6.0 * (a + 2.0 * b + 2.0 * c + rhs(kind, s + dt * c, p, g))
        s[1] += white * np.sqrt(dt) * np.random.randn()
        g = fade * g + gust * np.sqrt(1.0 - fade * fade) * np.random.randn()
    return out, s


def truth(kind: int, p: FloatArray) -> tuple[float, FloatArray, float]:
    """Stable amplitude [A/D], a state on the limit cycle, and the rate there over omega; without noise."""
    start = np.array([0.08 if kind == 1 else p[2], 0.0, 0.0, -2.0])
    _, s = run(kind, start, p, 3000, 0.0, 0.0, 1.0, 1)
    x, s = run(kind, s, p, 40, 0.0, 0.0, 1.0, 1)
    stable = float(np.sqrt(2.0 * np.mean(x**2)))
    rates = []
    for off in (1.1, 0.9):
        released = s * np.array([off, off, 1.0, 1.0])
        x, _ = run(kind, released, p, 600, 0.0, 0.0, 1.0, 1)
        away = np.abs(np.sqrt(2.0 * np.mean(x.reshape(-1, STEPS) ** 2, axis=1)) / stable - 1.0)
        k = np.flatnonzero((away < 0.05) & (away > 0.005))
        k = k[: np.argmax(np.diff(k) > 1) + 1] if np.any(np.diff(k) > 1) else k
        rates.append(-np.polyfit(k + 0.5, np.log(away[k]), 1)[0] / (2.0 * np.pi))
    return stable, s, float(np.mean(rates))


class Made(NamedTuple):
    """A campaign, and what is true of it: stable amplitude [A/D], rate over omega."""

    campaign: Campaign
    stable: float
    rate: float


def campaign(kind: int, index: int, seed: int) -> Made:
    """One rig in one wind, drawn."""
    rng = np.random.default_rng([seed, kind, index])
    if kind == 1:
        xi, mass_ratio = np.exp(rng.normal(np.log(0.002), 0.4)), 195.0
        means = (0.8 / mass_ratio, 0.0475 / mass_ratio, 12.0, 0.3)
        p = np.array([xi, *(mean * rng.uniform(0.8, 1.2) for mean in means), rng.uniform(0.99, 1.03)])
    else:
        xi = np.exp(rng.normal(np.log(0.004), 0.4))
        h = xi + np.exp(rng.normal(np.log(0.005), 0.4))
        over = {0: np.sqrt(h / (h - xi)), 2: h / (h - xi), 3: np.exp(xi / h)}[kind]
        p = np.array([xi, h, np.exp(rng.normal(np.log(0.07), 0.4)) * over])
    stable, state, rate = truth(kind, p)
    white = rng.uniform(0.005, 0.02) * stable * np.sqrt(4.0 * rate)  # sd of the amplitude over a*
    gust, gust_time = rng.uniform(0.0, 0.02), rng.uniform(2.0, 8.0) / rate
    cycles, records = float(np.clip(5.5 / rate / (2.0 * np.pi), 20.0, 250.0)), []
    for j, (what, over) in enumerate(RELEASES):
        released = state * np.array([over, over, 1.0, 1.0])
        length = 200.0 if what is Kind.STEADY else cycles
        x, _ = run(kind, released, p, length, white, gust, gust_time, int(rng.integers(2**31)))
        x = x[::2] + 0.005 * stable * rng.standard_normal(len(x[::2]))
        t = np.arange(len(x)) / (FREQUENCY * STEPS / 2.0)
        records.append(Record(f"r{j}", Path(f"r{j}.csv"), what, t, x))
    stated = xi * np.exp(0.1 * rng.standard_normal())
    rig = Rig("rig", Quantity(FREQUENCY), Quantity(MASS), Quantity(stated, 0.1 * stated), ())
    wind = Quantity(8.5 * FREQUENCY * DEPTH)
    test = Test("test", "rig", Quantity(DENSITY), wind, peak=True, records=tuple(records))
    section = Section(Motion.HEAVING, WIDTH, DEPTH)
    made = Campaign(Path("outside.toml"), "outside", "outside", section, (rig,), (test,))
    return Made(made, stable, rate)


def main(arguments: list[str]) -> None:
    """Print one line a campaign, and how many intervals held: of all laws weighed, and of the reference law alone."""
    card = load_card("default")
    card = replace(card, sampler=replace(card.sampler, walkers=128, draws=16, min_ess=400, max_steps=2000))
    for argument in arguments[1:]:
        kind, places = argument.split(":")
        first, last = map(int, places.split("-"))
        held: Counter[str] = Counter()
        for i in range(first, last):
            made = campaign(KINDS[kind], i, int(arguments[0]))
            fit = fit_campaign(made.campaign, card, seed=i, thorough=False)
            own, cells = joint_draws(fit.tree).tests["test"], []
            reference = fit.tree["campaign_posterior"]["relaxation_rate"].sel(law="n=-1").to_numpy()
            omega = 2.0 * np.pi * FREQUENCY
            for name, true, draws in (
                ("a*", made.stable, own["a_star"]),
                ("lambda", made.rate, own["relaxation_rate"] / omega),
                ("lambda by n=-1", made.rate, reference / omega),
            ):
                low, high = np.quantile(draws, [0.05, 0.95])
                held[name] += bool(low < true < high)
                cells.append(f"{name} {true:.5f} in [{low:.5f}, {high:.5f}]{'' if low < true < high else ' OUT'}")
            weights = " ".join(f"{label} {weight:.2f}" for label, weight in zip(*law_weights(fit.tree), strict=True))
            print(f"{kind} {i}: {'; '.join(cells)}; {weights}", flush=True)
        print(f"{kind}, of {last - first} held: " + ", ".join(f"{name} {count}" for name, count in held.items()))


if __name__ == "__main__":
    main(sys.argv[1:])
