"""A gait-like motion of the leg, for validation."""

import numpy as np

from sea_ident.motion import FourierSeries

PERIOD = 2.5
HARMONICS = 5

# Flexion of hip, knee and ankle over the cycle as in textbooks of gait analysis, in shares of their range: heel strike
# at 0, toe off about 0.62, the knee bends a little in stance and much in swing.
_PHASE = np.array([0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95])
_HIP = np.array([0.97, 0.93, 0.83, 0.72, 0.61, 0.37, 0.15, 0.0, 0.01, 0.07, 0.22, 0.46, 0.67, 0.83, 0.94, 1.0, 1.0])
_KNEE = np.array([0.07, 0.15, 0.26, 0.29, 0.26, 0.15, 0.07, 0.13, 0.28, 0.52, 0.8, 0.97, 1.0, 0.85, 0.58, 0.27, 0.1])
_ANKLE = np.array([0.6, 0.48, 0.5, 0.6, 0.72, 0.87, 0.97, 1.0, 0.8, 0.35, 0.0, 0.25, 0.48, 0.6, 0.65, 0.65, 0.63])

# Ranges of the exoskeleton leg are narrower than a person's: the gait is scaled into them [rad].
_RANGES = ((0.34, 0.68), (0.0, -0.37), (-0.12, 0.14))
_INSET = 0.03


def gait(period: float = PERIOD) -> FourierSeries:
    """A gait of the exoskeleton leg: hip, knee and ankle inside the leg's limits.

    Args:
        period: of one stride [s].

    Returns:
        The periodic motion of the three joints.
    """
    curves = []
    for share, (low, high) in zip((_HIP, _KNEE, _ANKLE), _RANGES, strict=True):
        inset = _INSET * np.sign(high - low)
        curves.append(low + inset + share * (high - low - 2.0 * inset))
    # the phases are not evenly spaced: fill in between them before the fit, closing the cycle
    dense = np.arange(200) / 200.0
    closed = np.append(_PHASE, 1.0)
    values = np.stack([np.interp(dense, closed, np.append(curve, curve[0])) for curve in curves], axis=1)
    return FourierSeries.fit(dense * period, values, 1.0 / period, HARMONICS)
