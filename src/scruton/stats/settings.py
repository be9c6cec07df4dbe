"""How long to sample, and with which moves."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SamplerSettings:
    """How long to sample and with which moves; see `scruton.stats.sampler`."""

    ensembles: int = 4
    walkers: int = 256
    draws: int = 8
    min_ess: float = 1000.0
    max_rhat: float = 1.01
    max_steps: int = 4000
    independence: float = 0.9
    differential_evolution: float = 0.07
    stretch: float = 0.03
