r"""From the tunnel to the site: what a section model in smooth flow cannot tell, as factors of the amplitude.

.. math:: A_{site} = A\, f_{turbulence}\, f_{Reynolds}\, f_{details}

Each is lognormal about one unless the bridge says otherwise: turbulence mostly makes amplitudes smaller, but nothing is
counted on that nobody has stated; a model at a small scale may err to either side, sharp edges or not (Larose and
D'Auteuil, 2006), and so may railings and wind screens that are only modelled roughly.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.quantity import Quantity
from scruton.campaign.schema import Motion
from scruton.campaign.toml import Field, Table, number
from scruton.campaign.units import ANGLE, HEAVING_AMPLITUDE, LENGTH, TORSIONAL_AMPLITUDE, Dimension
from scruton.said import key, said
from scruton.sizing.stated import uncertain
from scruton.sizing.thresholds import DETAILS_COV, REYNOLDS_COV, TURBULENCE_COV

NONE = "none"
_FACTOR = Dimension("a factor of the amplitude, a bare number", "", 1.0)
_INTENSITY = Dimension("a turbulence intensity, a bare number", "", 0.1)
_COVS = {"turbulence": TURBULENCE_COV, "reynolds_number": REYNOLDS_COV, "details": DETAILS_COV}


def _about_one(cov: float) -> Quantity:
    return Quantity(float(np.sqrt(1.0 + cov**2)), cov * float(np.sqrt(1.0 + cov**2)))


_DEFAULTS = {key: _about_one(cov) for key, cov in _COVS.items()}


@dataclass(frozen=True)
class Transfer:
    """Factors of the amplitude between tunnel and site.

    Attributes
    ----------
    turbulence, reynolds_number, details : Quantity
    turbulence_intensity : float or None
        I_u at the site, for comparison with a handbook's factor.
    beta : float
        beta_t of that factor.
    assumed : bool
        Whether nothing of it was stated.
    """

    turbulence: Quantity = _DEFAULTS["turbulence"]
    reynolds_number: Quantity = _DEFAULTS["reynolds_number"]
    details: Quantity = _DEFAULTS["details"]
    turbulence_intensity: float | None = None
    beta: float = 1.0
    assumed: bool = False

    @property
    def factors(self) -> tuple[Quantity, Quantity, Quantity]:
        """Turbulence, Reynolds number, details."""
        return self.turbulence, self.reynolds_number, self.details

    def handbook(self, width: float, depth: float) -> float | None:
        """E_t of the Japanese handbook for the turbulence that is stated; None where none is."""
        intensity = self.turbulence_intensity
        return None if intensity is None else handbook_factor(intensity, width, depth, self.beta)


def handbook_factor(intensity: float, width: float, depth: float, beta: float = 1.0) -> float:
    """Factor of a heaving amplitude in turbulence: E_t = 1 - 15 beta_t sqrt(B/D) I_u^2, not below zero.

    Notes
    -----
    As quoted from the Japanese handbook of wind-resistant design; to be confirmed in its own text.
    """
    return max(0.0, 1.0 - 15.0 * beta * float(np.sqrt(width / depth)) * intensity**2)


def read_transfer(top: Table) -> Transfer | None:
    """Read `[transfer]` of a bridge: its defaults where it is left out, None for transfer = "none".

    Raises
    ------
    InputError
        For what is no factor, or an intensity of one or more.
    """
    if "transfer" not in top:
        return Transfer(assumed=True)
    if isinstance(top.values["transfer"], str):
        top.choice("transfer", (NONE,))
        return None
    return Transfer(**top.table("transfer").read(_TRANSFER))


def amplitude_of_coherence(top: Table, motion: Motion, depth: float, *, both: bool = False) -> Quantity | None:
    """Read `coherence_amplitude`, A_c, as A/D or rad; None where it is left out.

    Of a bridge with modes of both motions it is a table of one for each, or for one of them.

    Raises
    ------
    InputError
        For what is no amplitude, or one for both motions.
    """
    key = "coherence_amplitude"
    if both and key in top:
        stated = top.values[key]
        if not isinstance(stated, Mapping) or not {*stated} <= {*map(str, Motion)}:
            wanted = 'one for each motion where modes are of both, as { heaving = "30 mm", torsional = "0.1 deg" }'
            raise top.refusal(key, wanted)
        top, key = top.table(key), motion.value
    if key not in top:
        return None
    stated = top.values[key]
    if isinstance(stated, Mapping):
        stated = stated.get("mean", stated.get("median"))
    heaving = motion is Motion.HEAVING
    if not isinstance(stated, str):
        return uncertain(top, key, HEAVING_AMPLITUDE if heaving else TORSIONAL_AMPLITUDE)
    value = uncertain(top, key, LENGTH if heaving else ANGLE)
    size = depth if heaving else 1.0
    return Quantity(value.mean / size, (value.sd or 0.0) / size, value.family, value.minimum / size)


def transfer_remarks(transfer: Transfer | None, width: float, depth: float, motion: Motion) -> list[str]:
    """What the reader must know of the way from the tunnel to the site."""
    if transfer is None:
        return []
    remarks: list[str] = []
    if transfer.assumed:
        z = np.sqrt(sum(factor.log_sd**2 for factor in transfer.factors)) * 1.645
        remarks.append(said(
            "nothing is stated of the way from the tunnel to the site: by judgement the amplitude has factors for "
            "turbulence, Reynolds number and details, each with median 1 and coefficients of variation of "
            f"{100 * TURBULENCE_COV:g}, {100 * REYNOLDS_COV:g} and "
            f"{100 * DETAILS_COV:g} % (with 90 %: {np.exp(-z):.2f} to {np.exp(z):.2f} together); ",
            key(
                'state [transfer], or transfer = "none" to leave them out',
                "state them with the bridge, or leave them out there",
            ),
        ))  # fmt: skip
    factor = transfer.handbook(width, depth)
    if factor is not None and motion is Motion.HEAVING:
        remarks.append(
            "for comparison: at the turbulence intensity of the site the Japanese handbook's factor "
            f"1 - 15 beta_t sqrt(B/D) I_u^2 is {factor:.2f}; the sizing takes {transfer.turbulence.median:.2f} (median)"
        )
    return remarks


@dataclass(frozen=True)
class TurbulenceClass:
    """Part of the time with one turbulence: its share, its intensity I_u where stated, the factor of the amplitude."""

    share: float
    intensity: float | None
    factor: Quantity


def read_turbulence(wind: Table, motion: Motion, width: float, depth: float) -> tuple[TurbulenceClass, ...]:
    """Read `[[wind.turbulence]]`: classes whose shares of the time sum to one; none where it is left out.

    A class without a factor of its own has the handbook's, for heaving.

    Raises
    ------
    InputError
        Where shares do not sum to one, or a class has neither a factor nor, for heaving, an intensity.
    """
    classes = []
    for table in wind.tables("turbulence"):
        values = table.read(_CLASS)
        intensity = values["intensity"]
        if values["factor"] is None:
            if intensity is None or motion is not Motion.HEAVING:
                raise table.error("factor", "nothing", "a factor of the amplitude, or for heaving an intensity")
            # at the least a thousandth: where the handbook leaves nothing, nothing exceeds a limit
            values["factor"] = Quantity(max(handbook_factor(intensity, width, depth), 1e-3), family="known")
        classes.append(TurbulenceClass(**values))
    total = sum(each.share for each in classes)
    if classes and abs(total - 1.0) > 0.01:
        raise wind.error("turbulence", f"shares of the time that sum to {total:g}", "shares that sum to 1")
    return tuple(classes)


def _factor(name: str) -> Field:
    return Field(lambda table, key: uncertain(table, key, _FACTOR, _COVS[name]), _DEFAULTS[name])


_SHARE = Dimension("a share of the time, a bare number", "", 0.5)
_CLASS = {
    "share": number(_SHARE, good=lambda share: share <= 1.0, wanted="a share of the time, up to 1"),
    "intensity": number(_INTENSITY, None, good=lambda share: share < 1.0, wanted="a number between 0 and 1"),
    "factor": Field(lambda table, key: uncertain(table, key, _FACTOR), None),
}


_TRANSFER = {
    **{key: _factor(key) for key in _COVS},
    "turbulence_intensity": number(_INTENSITY, None, good=lambda share: share < 1.0, wanted="a number between 0 and 1"),
    "beta": number(_FACTOR, 1.0),
}


def factor_at(transfer: Transfer, u: FloatArray) -> FloatArray:
    """Factor of the amplitude at coordinates (N, 3) of the unit cube: turbulence, Reynolds number, details."""
    product = np.ones(len(u))
    for k, factor in enumerate(transfer.factors):
        product *= factor.quantile(u[:, k])
    return product
