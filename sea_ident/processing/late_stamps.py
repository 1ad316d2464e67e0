"""Whether stamps of time that scatter say when samples were taken, or only when they were written down."""

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.recordings import Recording
from sea_ident.recordings.stamps import spread_of_stamps

SURE = 5.0
"""Standard deviations by which the share of the scatter that positions show is below a half [-]."""

FEWEST = 100
"""Samples in a row on the grid at least."""


def late_stamps(recording: Recording, positions: FloatArray) -> list[str]:
    """A sentence where samples were taken evenly and stamped unevenly: a wrong time is a wrong position.

    Where a stamp is right, the second difference of a position holds its speed times that of the stamps; where samples
    were taken evenly it does not. The share is fitted over all samples.

    Args:
        recording: where the stamps are.
        positions: (N, k) that move [rad] or [m].

    Returns:
        One sentence, or none.
    """
    if recording.is_uniform:
        return []
    places, distance, interval = spread_of_stamps(recording.time)
    in_a_row = np.flatnonzero(places[4:] - places[:-4] == 4) + 2
    if in_a_row.size < FEWEST:
        return []
    bend = distance[in_a_row + 1] - 2.0 * distance[in_a_row] + distance[in_a_row - 1]
    product, power, scatter = 0.0, 0.0, 0.0
    for column in positions.T:
        # over four samples, so that noise of the samples in the second difference is not in the speed as well
        speed = (column[in_a_row + 2] - column[in_a_row - 2]) / (4.0 * interval)
        second = column[in_a_row + 1] - 2.0 * column[in_a_row] + column[in_a_row - 1]
        expected = speed * bend
        own = float(expected @ expected)
        if own == 0.0:
            continue
        left = second - expected * float(expected @ second) / own
        weight = len(left) / max(float(left @ left), 1e-300)
        product += weight * float(expected @ second)
        power += weight * own
        scatter += weight**2 * float(np.sum((left * expected) ** 2))
    if power == 0.0:
        return []
    # neighbouring second differences share samples: their sum scatters more than each by itself
    share, std = product / power, 2.0 * np.sqrt(scatter) / power
    if not share < 0.5 - SURE * std:
        return []
    spread = 1e3 * float(np.std(distance))
    return [
        f"{recording.source}: time scatters by {spread:.2g} ms around an even grid, but positions move as if samples "
        f"had been taken evenly (they show {100.0 * share:.2g} +- {100.0 * std:.2g} % of the scatter): stamps were "
        "taken late, and a wrong time is a wrong position. Put them on the grid: ColumnSource('time', "
        f"interval={interval:.4g}), on the command line --column 'time=time,interval={interval:.4g}' (where the file "
        "is in s)"
    ]
