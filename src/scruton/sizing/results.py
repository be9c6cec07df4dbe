"""What `scruton size` finds: `Sizing`, to sizing.json and back."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scruton.documents import as_json, from_json, read_document
from scruton.errors import InputError
from scruton.sizing.damper import Damper
from scruton.sizing.model import Spread
from scruton.sizing.modes import AllModes
from scruton.sizing.money import Costs
from scruton.sizing.risk import Risk
from scruton.sizing.shares import Share

RESULT = "sizing.json"


@dataclass(frozen=True)
class Stated:
    """A number of the bridge as it was stated; its distribution is "known" where it is certain."""

    mean: float
    sd: float
    distribution: str


@dataclass(frozen=True)
class SizedBridge:
    """The bridge that the answer is for: title, motion, width and depth [m], air density [kg/m^3], coherence."""

    title: str
    motion: str
    width: float
    depth: float
    air_density: float
    coherence: Stated


@dataclass(frozen=True, eq=False)
class ModeSizing:
    """One mode of the bridge.

    Attributes
    ----------
    name : str
    frequency, damping_ratio : Stated
        [Hz], and the structural damping ratio.
    mass : Stated or None
        [kg/m] or [kg m^2/m]; None: the mass ratio of the section model.
    modal_mass : float or None
        [kg] or [kg m^2].
    shape : str
        "sine", "uniform" or the file it was read from.
    mode_factor : mapping
        Amplitude of the mode over that of the section, by law.
    scruton_number, amplitude : Spread
        Without added damping; [m] or [rad].
    limits : tuple of Risk
    governing : str
        The rule of the smallest limit.
    shares : mapping
        Shares of variance by quantity ("needed", "amplitude"), the largest first.
    flags : tuple of str
    damper : Damper
    cost : Costs or None
        Where the bridge states what its failure costs.
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

    @property
    def governing_limit(self) -> Risk:
        """The limit that decides: the smallest."""
        return next(risk for risk in self.limits if risk.rule == self.governing)


@dataclass(frozen=True, eq=False)
class Sizing:
    """The damping that a bridge needs, the dampers that give it, and the risk that they leave.

    Attributes
    ----------
    format : int
        Of sizing.json.
    bridge : SizedBridge
    amplitude_unit : {"m", "rad"}
    laws : mapping
        Weight of each law.
    modes : tuple of ModeSizing
    all_modes : AllModes
    flags : tuple of str
        What the reader must know before trusting the numbers.
    provenance : mapping or None
        Versions, seed and SHA-256 of what it rests on, where it was written.
    """

    format: int
    bridge: SizedBridge
    amplitude_unit: str
    laws: Mapping[str, float]
    modes: tuple[ModeSizing, ...]
    all_modes: AllModes
    flags: tuple[str, ...]
    provenance: Mapping[str, Any] | None = None

    def to_json(self) -> dict[str, Any]:
        """The content of sizing.json; numbers that do not exist are None."""
        content: dict[str, Any] = as_json(self)
        return content


def load_sizing(folder: Path | str) -> Sizing:
    """Read back what `scruton size` found.

    Parameters
    ----------
    folder : Path or str
        That holds a sizing.json.

    Returns
    -------
    Sizing
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
