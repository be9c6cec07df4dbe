"""Types of arrays, draws of several chains as rows, and an even choice among rows."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]
ComplexArray = NDArray[np.complex128]


def end_to_end(draws: FloatArray) -> FloatArray:
    """Draws of all chains, one chain after the other, (S, d), of (chains, draws, d)."""
    return draws.reshape(-1, draws.shape[-1])


def thin(size: int, count: int) -> IntArray:
    """Indices of at most `count` of `size` points, evenly spread, first and last among them."""
    return np.unique(np.linspace(0, size - 1, min(size, count)).round().astype(np.intp))
