"""One stretch of a recording on the working bench: what a model leaves of it stands in for the noise."""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sea_ident._typing import FloatArray
from sea_ident.discrepancy.bench.bench import Bench
from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.measured.data import PeriodData, around_reversals, equations_of, harmonics_for, waveform
from sea_ident.discrepancy.measured.noise import ComplexArray, NoiseFloor
from sea_ident.effects import Effect
from sea_ident.processing import ProcessedRecording
from sea_ident.robot import Robot

HALF_WIDTH = 12
"""The residual is smoothed over at least this many frequencies to either side before it counts as noise."""

BLOCKS = 12
"""Blocks of a stretch, each of which is predicted from the others."""

BETTER = 0.75
"""Share of the blocks that an effect must predict better."""

GUARD = 0.1
"""Share of a block at either end that is not used: neighbouring blocks know about it."""


class StretchBench(Bench):
    """A bench whose noise floor is the smoothed spectrum of what the model leaves.

    All that a model lacks counts as noise there, so the residual is never too large, small effects hide behind large
    ones until these are found, and nothing can be said about lack of fit.
    """

    @property
    def target_spectrum(self) -> ComplexArray:
        """(H + 1, E) what the columns must sum up to."""
        return self._target

    def noise(self, fit: Fit) -> NoiseFloor:
        """Noise floor from the residual of a fit."""
        return _from_residual(self.clean_residual(fit) * fit.scale, self._free.count)


def _from_residual(residual: ComplexArray, taken: int) -> NoiseFloor:
    harmonics, count = residual.shape
    half = min(max(HALF_WIDTH, 4 * count), max((harmonics - 1) // 2, 1))
    products = np.einsum("ke,kf->kef", residual, residual.conj())
    products[1:] /= 2.0
    products[0] = products[0].real
    width = min(2 * half + 1, harmonics)
    total = np.concatenate([np.zeros((1, count, count), dtype=np.complex128), np.cumsum(products[1:], axis=0)])
    start = np.clip(np.arange(harmonics) - 1 - half, 0, max(harmonics - 1 - width, 0))
    width = min(width, harmonics - 1)
    smooth = (total[start + width] - total[start]) / width
    smooth[0] = smooth[0].real
    left = max(1.0 - taken / (2.0 * harmonics * count), 0.1)
    smooth = smooth / left
    scale = np.real(np.einsum("kee->ke", smooth))
    smooth += np.einsum("ke,ef->kef", 1e-12 * scale + 1e-300, np.eye(count))
    return NoiseFloor(smooth, 1, width * left, 2.0 * harmonics * left)


def stretch_data(processed: ProcessedRecording, robot: Robot, left_out: NDArray[np.bool_] | None = None) -> PeriodData:
    """A stretch as if it were one period; it is compared up to the same frequencies.

    Args:
        processed: the stretch.
        robot: the robot.
        left_out: (N, n) samples of joints that say nothing, such as those of a push.

    Returns:
        The data.
    """
    equations = equations_of(robot)
    period = processed.interval * processed.samples
    out = around_reversals(processed.motion, equations)
    if left_out is not None:
        out |= np.stack([left_out[:, equation.index] for equation in equations], axis=1)
    return PeriodData(
        robot=robot,
        source=processed.source,
        period=period,
        motion=processed.motion,
        tau_motor=processed.tau_motor,
        period_motions=(processed.motion,),
        period_tau_motor=processed.tau_motor[None],
        channels=processed.channels,
        equations=equations,
        harmonics=harmonics_for(period, processed.samples, len(equations)),
        reach=processed.samples // 2,
        left_out=out,
        warnings=processed.warnings,
    )


def full_residual(bench: Bench, fit: Fit) -> FloatArray:
    """(N, n) residual of the sum of both equations of every joint, at all frequencies [N m]."""
    rows = np.zeros_like(bench.data.tau_motor)
    state = bench.state(fit.effects)
    for effect in fit.effects:
        own = np.array([fit.parameters[c.name] for c in effect.columns(bench.robot)])
        if len(own):
            part = effect.evaluate(state)
            rows += (part.link + part.motor) @ own
    return np.asarray(bench.data.tau_motor - rows, dtype=np.float64)


def block_errors(bench: StretchBench, effects: Sequence[Effect], noise: NoiseFloor) -> FloatArray:
    """(B,) squared error in every block, predicted with parameters from the other blocks.

    Equations count in units of their noise; shapes are held.
    """
    samples = 4 * bench.data.harmonics
    size = np.maximum(noise.std, 1e-300)
    design = waveform(bench.design(effects), samples) / size[None, :, None]
    target = waveform(bench.target_spectrum, samples) / size
    keep = _thinned_left_out(bench.data.left_out, samples)
    edges = np.linspace(0, samples, BLOCKS + 1).astype(int)
    grams, sides = [], []
    for first, last in itertools.pairwise(edges):
        weight = keep[first:last].ravel()
        columns = design[first:last].reshape(-1, design.shape[2])[weight]
        grams.append(columns.T @ columns)
        sides.append(columns.T @ target[first:last].ravel()[weight])
    scale = np.sqrt(np.maximum(np.diag(sum(grams)), 1e-300))
    errors = np.empty(BLOCKS)
    for b, (first, last) in enumerate(itertools.pairwise(edges)):
        gram = (sum(grams) - grams[b]) / np.outer(scale, scale)
        side = (sum(sides) - sides[b]) / scale
        values = np.linalg.lstsq(gram, side, rcond=1e-10)[0] / scale
        guard = int(GUARD * (last - first))
        inside = slice(first + guard, last - guard)
        difference = (target[inside] - design[inside] @ values)[keep[inside]]
        errors[b] = float(difference @ difference)
    return errors


def _thinned_left_out(left_out: NDArray[np.bool_], samples: int) -> NDArray[np.bool_]:
    """(samples, E) which samples of a thinner grid are used."""
    nearest = np.minimum((np.arange(samples) * len(left_out)) // samples, len(left_out) - 1)
    return ~left_out[nearest]
