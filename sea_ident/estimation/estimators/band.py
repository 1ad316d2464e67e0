"""The part of equations that moves an estimate: some harmonics of a period, without what happens at reversals."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.processing.harmonics import within

PER_HARMONIC = 16
"""Samples per wave of the last harmonic beyond which neighbours are one."""

OWN = 1e-2
"""Share of its energy within the band below which a combination of samples is nothing of its own there [-]."""


@dataclass(frozen=True, eq=False)
class Band:
    """Signals of some harmonics that vanish at samples around reversals; a projection onto these.

    At a reversal friction and acceleration jump. Which sample sees the one or the other side of the jump hangs on less
    than an interval, and beyond its last harmonic a motion does not hold the jump at all. Both leave an error in the
    equations at the same few samples of every period, and some of it lies within the band. What vanishes at these
    samples does not see it.

    Attributes:
        samples: N of a period.
        harmonics: that count, fewer than N / 2.
        left_out: (N, n) samples of every joint around reversals.
    """

    samples: int
    harmonics: int
    left_out: NDArray[np.bool_]

    def part_of(self, values: FloatArray) -> FloatArray:
        """(N, n, ...) the part of signals (N, n, ...) that counts."""
        part = within(values, self.harmonics)
        for i, pulses in enumerate(self._pulses):
            if pulses.size:
                part[:, i] -= np.tensordot(pulses, np.tensordot(pulses, part[:, i], axes=(0, 0)), axes=(1, 0))
        return part

    @cached_property
    def _pulses(self) -> tuple[FloatArray, ...]:
        """(n,) orthonormal (N, k) of what lies within the band of pulses at the samples that are left out."""
        spectrum = np.zeros(self.samples // 2 + 1)
        spectrum[: self.harmonics + 1] = 1.0
        pulse = np.fft.irfft(spectrum, self.samples)
        found = []
        for left_out in self.left_out.T:
            at = np.flatnonzero(left_out)[:: max(1, self.samples // (PER_HARMONIC * self.harmonics))]
            energy, mixed = np.linalg.eigh(pulse[(at[:, None] - at) % self.samples])
            own = energy > OWN
            columns = pulse[(np.arange(self.samples)[:, None] - at) % self.samples]
            found.append(columns @ (mixed[:, own] / np.sqrt(energy[own])))
        return tuple(found)
