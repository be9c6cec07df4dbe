"""How far each unmodelled effect would close the gap between the rows of Table 5, from amplitudes and slopes alone.

Run `python examples/table5.py`.
"""

import numpy as np

from scruton.campaign.schema import Motion
from scruton.dynamics import Setting, force_parameters, relaxation
from scruton.gap.rows import Rows, close_rows, rows_text
from scruton.gap.thresholds import SD_AMPLITUDE, SD_RATE
from scruton.report.document import Table
from scruton.report.render_text import render_text

WIDTH, DEPTH, DENSITY = 0.300, 0.075, 1.19
SC = np.array([1.9, 21.7, 78.1])
MASS_RATIO = np.array([9.442e-4, 9.411e-4, 9.411e-4])  # rho D^2/m
SLOPE = np.array([0.8927, 0.7543, 0.9583])  # d(D/A)/dSc
K = np.array([0.6549, 0.7364, 0.7733])  # omega D/U
AMPLITUDE = np.array([0.06551, 0.0292, 0.01106])  # A/D
FREQUENCY = np.array([7.97, 7.87, 7.88])  # Hz


def rows() -> Rows:
    """The rows: the slope of the Griffin plot's reciprocal gives the relaxation rate, 1/A being linear in Sc."""
    omega = 2.0 * np.pi * FREQUENCY
    mass = DENSITY * DEPTH**2 / MASS_RATIO
    factor = 4.0 * np.pi * mass / (DENSITY * WIDTH * DEPTH)
    damping = SC / factor
    # 1/A = (lambda/omega0) / (c/omega0), and lambda/omega0 grows by 1/factor with Sc.
    rate = omega / (factor * SLOPE * AMPLITUDE)
    aero = MASS_RATIO / K * omega
    middle = 1
    return Rows(
        SC, 2.0 * np.pi / K, omega, damping, aero / aero[middle], aero / K / (aero / K)[middle], AMPLITUDE, rate,
        np.full(3, SD_AMPLITUDE), np.full(3, SD_RATE),
    )  # fmt: skip


def cross_predictions() -> np.ndarray:
    """Stable amplitude of every row (columns) from the parameters of every row over that measured, less one."""
    one = rows()
    found = np.empty((3, 3))
    settings = [
        Setting(Motion.HEAVING, WIDTH, DEPTH, DENSITY * DEPTH**2 / MASS_RATIO[j], DENSITY,
                one.omega[j] * DEPTH / K[j], FREQUENCY[j], FREQUENCY[j], one.damping_ratio[j])
        for j in range(3)
    ]  # fmt: skip
    for i in range(3):
        pair = force_parameters(AMPLITUDE[i], one.rate[i], settings[i])
        for j in range(3):
            found[i, j] = relaxation(*pair, settings[j])[0] / AMPLITUDE[j] - 1.0
    return found


def main() -> None:
    """Print both tables."""
    print("Stable amplitude predicted from another row, error in %")
    cells = [
        [f"from Sc {a:g}", *(f"{100 * e:+.0f}" for e in line)] for a, line in zip(SC, cross_predictions(), strict=True)
    ]
    blocks = [Table("rows", "", ["", *(f"Sc {a:g}" for a in SC)], cells)]
    print(render_text(blocks).strip("\n"))
    print("\nWhat each effect would close, the most plausible first; errors of the amplitudes in % by row")
    header = ["effect", "form", "closed", "errors", "parameters"]
    print(render_text([Table("effects", "", header, rows_text(close_rows(rows())))]).strip("\n"))


if __name__ == "__main__":
    main()
