"""What a sizing finds, `Sizing`, to sizing.json and back."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from scruton.documents import as_json, from_json, read_document
from scruton.errors import InputError
from scruton.shown import fields_in_brief, shown
from scruton.sizing.checks import Required
from scruton.sizing.damper_table import DamperTable
from scruton.sizing.dampers import Damper
from scruton.sizing.existing import Existing
from scruton.sizing.inputs import Inputs
from scruton.sizing.model import Spread
from scruton.sizing.modes import AllModes, BothMotions
from scruton.sizing.money import Costs
from scruton.sizing.risk import Risk, Share

RESULT = "sizing.json"


@dataclass(frozen=True)
class Stated:
    """A number of the bridge as it was stated; its distribution is "known" where it is certain."""

    mean: float
    sd: float
    distribution: str


@dataclass(frozen=True)
class StatedTransfer:
    """Factors of the amplitude between tunnel and site; whether they are the defaults; a handbook's, for comparison."""

    turbulence: Stated
    reynolds_number: Stated
    details: Stated
    assumed: bool
    turbulence_intensity: float | None = None
    handbook_factor: float | None = None


@shown(fields_in_brief)
@dataclass(frozen=True)
class SizedBridge:
    """The bridge that the answer is for: title, motion, width and depth [m], air density [kg/m^3], coherence.

    `coherence_amplitude`, A_c, is A/D or rad; without it, and without a `transfer`, they do not act.
    """

    title: str
    motion: str
    width: float
    depth: float
    air_density: float
    coherence: Stated
    coherence_amplitude: Stated | None = None
    transfer: StatedTransfer | None = None


@shown(fields_in_brief)
@dataclass(frozen=True, eq=False)
class ModeSizing:
    """One mode of the bridge.

    Attributes
    ----------
    frequency, damping_ratio : Stated
        [Hz], and the structural damping ratio.
    mass : Stated or None
        [kg/m] or [kg m^2/m]; None: the mass ratio of the section model.
    modal_mass : float or None
        [kg] or [kg m^2].
    shape : str
        "sine", "uniform" or the file it was read from as bridge.toml states it; by that name its SHA-256 stands in
        `provenance["bridge_sha256"]`.
    mode_factor : mapping
        Amplitude of the mode over that of the section, by law, with full coherence.
    scruton_number, amplitude : Spread
        Without added damping; [m] or [rad].
    scruton_number_at_means : float
        Of the mean mass and the mean damping, as one computes it by hand.
    governing : str
        The rule of the smallest limit, of those that hold for the mode.
    shares : mapping
        Shares of variance by quantity ("needed", "amplitude"), the largest first.
    cost : Costs or None
        Where the bridge states what its failure costs.
    required_by_law : mapping
        Of the limit that governs, as of `Risk`.
    damper_table : DamperTable or None
        Risk and stroke of the dampers about their design, to be read off; None without a design.
    """

    name: str
    frequency: Stated
    damping_ratio: Stated
    mass: Stated | None
    modal_mass: float | None
    shape: str
    mode_factor: Mapping[str, float]
    scruton_number: Spread
    amplitude: Spread
    limits: tuple[Risk, ...]
    governing: str
    shares: Mapping[str, tuple[Share, ...]]
    flags: tuple[str, ...]
    damper: Damper
    cost: Costs | None = None
    required_by_law: Mapping[str, Required] = field(default_factory=dict)
    scruton_number_at_means: float = np.nan
    damper_table: DamperTable | None = None

    @property
    def governing_limit(self) -> Risk:
        """The limit that decides: the smallest, of those that hold for the mode."""
        return next(risk for risk in self.limits if risk.rule == self.governing)


def _facts(one: "Sizing") -> Mapping[str, object]:
    facts: dict[str, object] = {"bridge": one.bridge.title}
    for mode in one.modes:
        against = mode.governing_limit
        facts[mode.name] = f"{against.required_text['0.95']} at 95 %, against {against.rule}"
    return facts | {"flags": len(one.flags)}


@shown(_facts)
@dataclass(frozen=True, eq=False)
class Sizing:
    """The damping that a bridge needs, the dampers that give it, and the risk that they leave.

    Attributes
    ----------
    format : int
        Of sizing.json.
    amplitude_unit : {"m", "rad"}
    laws : mapping
        Weight of each law.
    flags : tuple of str
        What the reader must know before trusting the numbers.
    provenance : mapping or None
        Versions, seed and SHA-256 of what it rests on, where it was written.
    existing : tuple of Existing or None
        Dampers that were asked about.
    inputs : Inputs
        Every number that it rests on, stated or default, and the files of the bridge.
    both : BothMotions or None
        Heaving and torsion together, where the bridge has modes of both and both were sized.
    conventions : mapping or None
        What a reader is shown otherwise than it stands here, as of `Campaign.conventions`, of the bridge.
    unconverged : tuple of str
        Posteriors that it rests on and that did not converge: while there is one, nothing is to be decided, and no
        damper, cost or risk with a given damper is told. None in a sizing of earlier versions, which do not say.
    flag_parts : mapping or None
        Of flags with values in them, where it was written: the parts of each by its text, as of `scruton.said`.
    """

    format: int
    bridge: SizedBridge
    amplitude_unit: str
    laws: Mapping[str, float]
    modes: tuple[ModeSizing, ...]
    all_modes: AllModes
    flags: tuple[str, ...]
    provenance: Mapping[str, Any] | None = None
    existing: tuple[Existing, ...] | None = None
    inputs: Inputs = field(default_factory=Inputs)
    both: BothMotions | None = None
    conventions: Mapping[str, Any] | None = None
    unconverged: tuple[str, ...] | None = None
    flag_parts: Mapping[str, Any] | None = None

    def to_json(self) -> dict[str, Any]:
        """The content of sizing.json; numbers that do not exist are None."""
        content: dict[str, Any] = as_json(self)
        return content


def load_sizing(folder: Path | str) -> Sizing:
    """Read back what `scruton size` found from the folder that holds its sizing.json.

    Numbers that do not exist (an amplitude where none is stable) are NaN.

    Raises
    ------
    InputError
        If there is none, or it is not as it was written.
    """
    path, wanted = Path(folder) / RESULT, "a sizing that this version wrote"
    content = read_document(path, wanted, version=1)
    try:
        sizing: Sizing = from_json(Sizing, content)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(path, "", f"other content ({error})", wanted) from error
    return sizing
