"""One run: which card and seed, where its checkpoints lie, whom it tells how far it is."""

import contextlib
import hashlib
import zlib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from scruton.arrays import FloatArray
from scruton.errors import InputError
from scruton.infer.cards import ModelCard
from scruton.infer.thresholds import ROUGH_PART
from scruton.processes import SecondProcess, Work
from scruton.progress import Progress
from scruton.stats.convergence import SamplerSettings
from scruton.stats.optimum import ImpossibleError
from scruton.stats.posterior import Posterior
from scruton.stats.sampler import Checkpoint, sample
from scruton.stats.samples import Samples


def fewer_walkers(settings: SamplerSettings, dimensions: int) -> SamplerSettings:
    """As few walkers as the dimensions that are sampled together allow, each of which keeps more draws."""
    for k in (4, 2):
        if settings.walkers % k == 0 and settings.walkers // k >= 4 * dimensions:
            return replace(settings, walkers=settings.walkers // k, draws=settings.draws * k)
    return settings


# Name, posterior and all arrays that its likelihood reads, as `Sampling.run` and `Sampling.begin` take them.
type Asked = tuple[str, Posterior, *tuple[FloatArray, ...]]


class Known(dict[str, tuple[str, Samples]]):
    """By what was sampled: the fingerprint of everything that determines the draws, and the draws.

    With a `second` process, posteriors that are going to be asked for are sampled there meanwhile.
    """

    def __init__(self, known: Mapping[str, tuple[str, Samples]] = {}, second: SecondProcess | None = None) -> None:
        super().__init__(known)
        self.second = second
        self.begun: dict[str, Work[Known]] = {}

    def begin(self, what: str, work: Callable[..., "Known"], *arguments: object) -> None:
        """Begin to sample beside, where there is a second process and the draws are not known."""
        if self.second is not None and what not in self:
            self.begun[what] = self.second.begin(work, *arguments)

    def wait(self, what: str) -> None:
        """Wait for what was begun; what was not, or failed, is left to who asks for it."""
        work = self.begun.pop(what, None)
        if work is not None and not work.withdrawn():
            with contextlib.suppress(InputError, BrokenExecutor):
                self.update(work())


class ExcludedByPriorsError(InputError):
    """No point of the priors explains the records."""


@dataclass(eq=False)
class Sampling:
    """How the posteriors of one run are sampled: card, seed, where checkpoints lie, whom to tell.

    What an earlier run drew of the very same posterior is `known`, and is not drawn again: what is left of a campaign
    has most of its posteriors in common with the whole. `faults` says of each posterior that did not converge what is
    wrong with its draws; which of them bring the verdict down is for `scruton.infer.joint.unconverged` to say.  What
    else was `made` `once` of posteriors of this run goes by its own name.
    """

    card: ModelCard
    seed: int
    checkpoints: Path | None = None
    report: Progress | None = None
    known: Known = field(default_factory=Known)
    flags: list[str] = field(default_factory=list)
    faults: dict[str, str] = field(default_factory=dict)
    made: dict[str, Any] = field(default_factory=dict)

    def seed_of(self, name: str) -> np.random.SeedSequence:
        """Seed of the posterior called `name`."""
        return np.random.SeedSequence([self.seed, zlib.crc32(name.encode())])

    def generator(self, name: str) -> np.random.Generator:
        """Generator of what is called `name`."""
        return np.random.default_rng(self.seed_of(name))

    def once[T](self, what: str, work: Callable[..., T], *arguments: object) -> T:
        """Give what some work gave before, or do it now."""
        if what not in self.made:
            self.made[what] = work(*arguments)
        found: T = self.made[what]
        return found

    def begin(self, name: str, posterior: Posterior, *arrays: FloatArray, roughly: bool = False) -> None:
        """Sample beside, if there is a second process, what `run` is going to be asked for."""
        apart = Sampling(self.card, self.seed, self.checkpoints)
        self.known.begin(kept_as(name, roughly), _drawn, apart, name, posterior, arrays, roughly)

    def run(self, name: str, posterior: Posterior, *arrays: FloatArray, roughly: bool = False) -> Samples:
        """Sample, with a checkpoint that knows the data by their digest.

        Where it is enough to know the posterior `roughly`, a part of the card's effective draws ends the run; the whole
        is sampled anew, so that a run that was interrupted between the two finds each as it was.
        """
        from scruton import __version__

        digest = hashlib.sha256(f"{__version__}|{self.seed}|{name}|{posterior.priors!r}|{self.card.sha256}".encode())
        for array in arrays:
            digest.update(np.ascontiguousarray(array).tobytes())
        fingerprint, what = digest.hexdigest(), kept_as(name, roughly)
        checkpoint = None
        if self.checkpoints is not None:
            checkpoint = Checkpoint(self.checkpoints / f"{zlib.crc32(what.encode()):08x}.npz", fingerprint)
        paid = [block.members.size for block in posterior.blocks if block.times == 1]  # with a likelihood
        settings = fewer_walkers(self.card.sampler, max(paid))
        if roughly:
            settings = replace(settings, min_ess=settings.min_ess * ROUGH_PART)

        def progress(_: int, done: float) -> None:
            if self.report:
                self.report(name, done)

        self.known.wait(what)
        known, samples = self.known.get(what, ("", None))
        try:
            if samples is None or known != fingerprint:
                samples = sample(posterior, settings, self.seed_of(name), checkpoint, progress)
        except ValueError as error:
            if isinstance(error, InputError):
                raise
            kind = ExcludedByPriorsError if isinstance(error, ImpossibleError) else InputError
            raise kind(name, "", str(error), "a record and priors that agree") from error
        self.known[what] = fingerprint, samples
        self.faults.pop(name, None)  # of a sampling that counts no longer
        if fault := samples.convergence.explain(posterior.names, settings):
            self.faults[name] = fault
        return samples


def kept_as(name: str, roughly: bool) -> str:
    """The name that what is known roughly goes by, so that it is not taken for the whole."""
    return f"{name}, roughly" if roughly else name


def _drawn(sampling: Sampling, name: str, posterior: Posterior, arrays: Sequence[FloatArray], roughly: bool) -> Known:
    """What is drawn of one posterior."""
    sampling.run(name, posterior, *arrays, roughly=roughly)
    return sampling.known
