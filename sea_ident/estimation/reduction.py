"""Long recordings: the stacked regressor goes through a sequential QR and is never held.

Every block of samples leaves one triangle per joint; memory does not grow with the recording. Least squares with any
weights per joint, residuals per joint, condition number and the scores that the covariance needs follow from triangles.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.linalg import lapack

from sea_ident._typing import FloatArray, IntArray
from sea_ident.base_parameters import BaseParameters, random_motion
from sea_ident.effects import Effect, State
from sea_ident.effects.signal import corrected_motion
from sea_ident.exceptions import IdentificationError
from sea_ident.motion import Motion
from sea_ident.regressor import build_total
from sea_ident.robot import Robot

CHUNK = 1000
"""Samples of which the regressor is built at once."""

PANEL = 1000
"""Samples that one QR decomposition takes in."""

MOST_BLOCKS = 80
"""Blocks are joined in pairs when there are more."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """Reduced equations of blocks of samples.

    Attributes:
        columns: per joint, (c,) indices of the base parameters in its rows.
        blocks: per block and joint, the (c + 1, c + 1) triangle of ``[F, torque]``.
        samples: (blocks, n) rows in each.
        count: number b of base parameters.
    """

    columns: tuple[IntArray, ...]
    blocks: tuple[tuple[FloatArray, ...], ...]
    samples: IntArray
    count: int

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.columns)

    def joint(self, index: int) -> FloatArray:
        """(c + 1, c + 1) triangle of all blocks of one joint."""
        return _triangle(np.vstack([block[index] for block in self.blocks]))

    def whole(self, weights: FloatArray) -> FloatArray:
        """(b + 1, b + 1) triangle of all joints, each with its weight (n,) for the squares."""
        parts = []
        for j, columns in enumerate(self.columns):
            own = self.joint(j)
            part = np.zeros((len(own), self.count + 1))
            part[:, columns] = own[:, :-1]
            part[:, -1] = own[:, -1]
            parts.append(part * np.sqrt(weights[j]))
        return _triangle(np.vstack(parts), self.count + 1)

    def squares(self, values: FloatArray) -> FloatArray:
        """(n,) sum of squares of the residual of every joint."""
        found = np.empty(self.joints)
        for j, columns in enumerate(self.columns):
            own = self.joint(j)
            found[j] = float(((own @ np.append(values[columns], -1.0)) ** 2).sum())
        return found

    def scores(self, values: FloatArray, weights: FloatArray) -> FloatArray:
        """(blocks, b) ``sum w_j F' (torque - F values)`` of every block."""
        found = np.zeros((len(self.blocks), self.count))
        for k, block in enumerate(self.blocks):
            for j, columns in enumerate(self.columns):
                residual = -block[j] @ np.append(values[columns], -1.0)
                found[k, columns] += weights[j] * (block[j][:, :-1].T @ residual)
        return found


class Reducer:
    """Takes in samples, keeps triangles.

    Args:
        robot: the robot.
        effects: the model.
        base: its base parameters.
        block: samples of a block.
    """

    def __init__(self, robot: Robot, effects: Sequence[Effect], base: BaseParameters, block: int) -> None:
        self._robot, self._effects, self._base = robot, tuple(effects), base
        self._columns = _structure(robot, effects, base)
        self._panels = [np.zeros((PANEL + len(columns) + 1, len(columns) + 1), order="F") for columns in self._columns]
        self._filled = [len(columns) + 1 for columns in self._columns]
        self._block_size = block
        self._in_block = 0
        self._counts = np.zeros(robot.n, dtype=np.intp)
        self._blocks: list[tuple[FloatArray, ...]] = []
        self._samples: list[IntArray] = []
        self._places = _places(robot, self._effects, base, self._columns)
        self._shifts = any(type(effect).shifted is not Effect.shifted for effect in self._effects)

    def add(
        self,
        motion: Motion,
        torque: FloatArray,
        valid: FloatArray | None = None,
        channels: Mapping[str, FloatArray] | None = None,
    ) -> None:
        """Take in consecutive samples.

        Args:
            motion: (N, n).
            torque: (N, n) motor torque [N m] or [N].
            valid: (N, n) 1 where a row counts, 0 where not; all by default.
            channels: further signals (N, n) by kind.

        Raises:
            IdentificationError: the lengths differ.
        """
        if torque.shape != (len(motion), self._robot.n):
            raise IdentificationError(
                f"{len(motion)} samples of {self._robot.n} joints, but the torque has shape {torque.shape}"
            )
        size = len(motion) if self._shifts else CHUNK
        for start in range(0, len(motion), size):
            part = slice(start, min(start + size, len(motion)))
            some = None if channels is None else {kind: values[part] for kind, values in channels.items()}
            self._add_chunk(motion[part], torque[part], None if valid is None else valid[part], some)

    def _add_chunk(
        self,
        motion: Motion,
        torque: FloatArray,
        valid: FloatArray | None,
        channels: Mapping[str, FloatArray] | None,
    ) -> None:
        count, done = len(motion), 0
        tables = self._tables(motion, channels)
        while done < count:
            room = min(
                self._block_size - self._in_block,
                *(len(p) - f for p, f in zip(self._panels, self._filled, strict=True)),
            )
            take = slice(done, done + min(room, count - done))
            length = take.stop - take.start
            for j, panel in enumerate(self._panels):
                rows = slice(self._filled[j], self._filled[j] + length)
                for target, source, columns in self._places[j]:
                    for table in tables[source]:
                        if table is not None:
                            panel[rows, target] += table[take, j][:, columns]
                panel[rows, -1] = torque[take, j]
                if valid is not None:
                    panel[rows] *= valid[take, j, None]
                self._filled[j] += length
            self._counts += length if valid is None else np.count_nonzero(valid[take], axis=0)
            self._in_block += length
            done += length
            if self._in_block == self._block_size:
                self._close_block()
            elif any(f == len(p) for p, f in zip(self._panels, self._filled, strict=True)):
                self._decompose()

    def _tables(
        self, motion: Motion, channels: Mapping[str, FloatArray] | None
    ) -> list[tuple[FloatArray | None, FloatArray | None]]:
        """Link and motor rows of every effect, None where nothing is in them."""
        if self._shifts:
            total = build_total(self._robot, self._effects, motion, channels)
            return [(total, None)]
        state = State(self._robot, corrected_motion(self._robot, self._effects, motion), channels)
        found = []
        for effect in self._effects:
            part = effect.evaluate(state)
            found.append(tuple(None if _repeated_zero(rows) else rows for rows in (part.link, part.motor)))
        return [(link, motor) for link, motor in found]

    def _decompose(self) -> None:
        for j, panel in enumerate(self._panels):
            filled = self._filled[j]
            width = panel.shape[1]
            if filled == width:
                continue
            factor, _, _, info = lapack.dgeqrf(panel[:filled])
            if info != 0:
                raise IdentificationError(f"QR decomposition failed (LAPACK info {info})")
            panel[:] = 0.0
            panel[:width] = np.triu(factor[:width])
            self._filled[j] = width

    def _close_block(self) -> None:
        self._decompose()
        self._blocks.append(tuple(panel[: panel.shape[1]].copy() for panel in self._panels))
        self._samples.append(self._counts)
        for panel in self._panels:
            panel[:] = 0.0
        self._counts, self._in_block = np.zeros(self._robot.n, dtype=np.intp), 0
        if len(self._blocks) > MOST_BLOCKS and len(self._blocks) % 2 == 0:
            pairs = range(0, len(self._blocks), 2)
            self._blocks = [
                tuple(_triangle(np.vstack([self._blocks[k][j], self._blocks[k + 1][j]])) for j in range(self._robot.n))
                for k in pairs
            ]
            self._samples = [self._samples[k] + self._samples[k + 1] for k in pairs]
            self._block_size *= 2

    def triangles(self) -> Triangles:
        """What has been taken in so far.

        Raises:
            IdentificationError: nothing has.
        """
        if self._in_block:
            self._close_block()
        if not self._blocks:
            raise IdentificationError("no samples were given")
        return Triangles(tuple(self._columns), tuple(self._blocks), np.array(self._samples), self._base.rank)


def reduce_recording(
    robot: Robot,
    effects: Sequence[Effect],
    base: BaseParameters,
    chunks: Iterable[tuple[Motion, FloatArray]],
    *,
    block: int = 1000,
) -> Triangles:
    """Reduce a recording of any length that comes in pieces.

    Args:
        robot: the robot.
        effects: the model.
        base: its base parameters.
        chunks: motion (N, n) and motor torque (N, n) of consecutive pieces.
        block: samples of a block at first; blocks are joined as they become many.

    Returns:
        Triangles, from which `solve` follows.

    Raises:
        IdentificationError: no samples were given.
    """
    reducer = Reducer(robot, effects, base, block)
    for motion, torque in chunks:
        reducer.add(motion, torque)
    return reducer.triangles()


def _triangle(rows: FloatArray, size: int | None = None) -> FloatArray:
    """Square triangular factor of rows, filled up with zeros where there are fewer rows than columns."""
    width = rows.shape[1] if size is None else size
    upper = scipy.linalg.qr(rows, mode="r", check_finite=False)[0][:width]
    if len(upper) < width:
        upper = np.vstack([upper, np.zeros((width - len(upper), width))])
    return np.asarray(upper, dtype=np.float64)


def _repeated_zero(rows: FloatArray) -> bool:
    return rows.size > 0 and not any(rows.strides) and rows.flat[0] == 0.0


def _structure(robot: Robot, effects: Sequence[Effect], base: BaseParameters) -> list[IntArray]:
    """Per joint, the base parameters that can appear in its rows, by independent random states."""
    rows = build_total(robot, effects, random_motion(robot, 20, 1), None, base.independent)
    largest = np.abs(rows).max(axis=0)
    return [np.flatnonzero(largest[j] > 0.0).astype(np.intp) for j in range(robot.n)]


def _places(
    robot: Robot, effects: Sequence[Effect], base: BaseParameters, columns: Sequence[IntArray]
) -> list[list[tuple[IntArray | slice, int, IntArray | slice]]]:
    """Per joint: columns of its panel, which effect they come from, and which columns of that effect."""
    starts = np.cumsum([0, *(len(effect.columns(robot)) for effect in effects)])
    owner = np.searchsorted(starts, base.independent, side="right") - 1
    if any(type(effect).shifted is not Effect.shifted for effect in effects):
        owner, starts = np.zeros(base.rank, dtype=np.intp), np.zeros(1, dtype=np.intp)
    places: list[list[tuple[IntArray | slice, int, IntArray | slice]]] = []
    for own in columns:
        found: list[tuple[IntArray | slice, int, IntArray | slice]] = []
        for e in dict.fromkeys(owner[own].tolist()):
            target = np.flatnonzero(owner[own] == e).astype(np.intp)
            source = (base.independent[own[target]] - starts[e]).astype(np.intp)
            found.append((_as_slice(target), int(e), _as_slice(source)))
        places.append(found)
    return places


def _as_slice(indices: IntArray) -> IntArray | slice:
    """A slice where the indices are consecutive, which copies faster."""
    if len(indices) and np.array_equal(indices, np.arange(indices[0], indices[0] + len(indices))):
        return slice(int(indices[0]), int(indices[-1]) + 1)
    return indices
