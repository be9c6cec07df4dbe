"""Stable amplitudes as a campaign states them, beside what its records say.

Nothing is fitted to them: where the two part, one of them is wrong, or the model.
"""

from collections.abc import Mapping

import numpy as np

from scruton.arrays import FloatArray
from scruton.campaign.schema import Campaign
from scruton.infer.thresholds import STATED_OFF

_SURE = (0.025, 0.5, 0.975)


def off_stated(campaign: Campaign, amplitudes: Mapping[str, FloatArray]) -> list[str]:
    """Name the tests whose stated stable amplitude is not that of their posterior, a sentence each.

    Parameters
    ----------
    amplitudes : mapping
        Draws of the stable amplitude by test, A/D or rad.
    """
    written, flags = campaign.section.motion.amplitude_text, []
    for test in campaign.tests:
        if test.stable_amplitude is None or test.name not in amplitudes:
            continue
        stated, margin = test.stable_amplitude.mean, 2.0 * (test.stable_amplitude.sd or 0.0)
        low, middle, high = np.quantile(amplitudes[test.name], _SURE)
        ratio = stated / middle
        if low - margin <= stated <= high + margin or max(ratio, 1.0 / ratio) < STATED_OFF:
            continue
        flags.append(
            f"test {test.name}: its stable amplitude is stated as {written(stated)}, {ratio:.3g} times what its "
            f"records say ({written(middle)}, 95 % {written(low)} to {written(high)}), which is what predicts. A unit "
            "or a gain of one of the two is wrong, an r.m.s. stands for an amplitude, the wind was another; or growth "
            "and decay do not lead where the body stands: the air remembers, or there are two branches"
        )
    return flags
