"""What a law of aerodynamic damping states: the drift of the amplitude, and what its parameters are."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numba import njit

from scruton.arrays import FloatArray
from scruton.dynamics.limit_cycle import attracting_amplitude


@dataclass(frozen=True, eq=False)
class Law:
    """A law, of the n-family or outside it; `scruton.dynamics.filter` takes any.

    Attributes
    ----------
    name : str
    drift : compiled function
        (a, parameters) to da/dt [amplitude/s] and its derivative in a [1/s], at one amplitude; parameters in an array.
    parameters : mapping of str to str
        Meaning and unit of every parameter, by name, in the order of the array.
    linear : bool
        Whether the drift is linear in a: the filter is exact then, and takes amplitudes of either sign.
    """

    name: str
    drift: Callable[[float, FloatArray], tuple[float, float]]
    parameters: Mapping[str, str]
    linear: bool = False

    def stable_amplitude(self, parameters: FloatArray, scale: float) -> FloatArray:
        """Amplitude that the motion comes to, by root finding, (W,); see `limit_cycle.attracting_amplitude`.

        Parameters
        ----------
        parameters : (W, P) array
        scale : float
            A typical amplitude, A/D or rad.
        """
        return attracting_amplitude(lambda a: self.rates(parameters, a)[0], len(parameters), scale)

    def relaxation_rate(self, parameters: FloatArray, stable_amplitude: FloatArray) -> FloatArray:
        """Rate at which small deviations from the stable amplitude die out [1/s], (W,)."""
        return -self.rates(parameters, stable_amplitude[:, None])[1][:, 0]

    def rates(self, parameters: FloatArray, amplitude: FloatArray) -> tuple[FloatArray, FloatArray]:
        """`drift` at (W, A) amplitudes, each row with its own (P,) parameters: (W, A) each."""
        out = np.empty((2, *amplitude.shape))
        _rates(self.drift, np.ascontiguousarray(parameters), np.ascontiguousarray(amplitude), out)
        return out[0], out[1]


@njit(error_model="numpy")
def _rates(law, parameters, amplitude, out):  # type: ignore[no-untyped-def]
    for w in range(amplitude.shape[0]):
        for i in range(amplitude.shape[1]):
            out[0, w, i], out[1, w, i] = law(amplitude[w, i], parameters[w])
