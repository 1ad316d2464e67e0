"""Columns of effects on one recording, as spectra; what was computed once is kept."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias
from zlib import crc32

import numpy as np

from sea_ident._typing import FloatArray, IntArray
from sea_ident.discrepancy.bench.free_shapes import moving, seen_by, signal_effects
from sea_ident.discrepancy.measured.data import PeriodData, equation_row, spectrum
from sea_ident.discrepancy.measured.noise import ComplexArray
from sea_ident.effects import Anchor, Column, Contribution, Effect, State, corrected_motion

VARIANTS_KEPT = 3e8
"""Bytes of columns of candidates that are kept for the next search."""

COLUMNS_KEPT = 3e8
"""Bytes of columns of effects that are kept."""

STATES_KEPT = 12
"""Motions, each corrected by other effects in the chain of signals, that are kept."""

LABELS_KEPT = 1000
"""Effects of which the labels of the columns are kept."""

Key = tuple[str, str | None, str]
"""Name of an effect, its joint, and the other joint where there is one."""

Places: TypeAlias = dict[Key, IntArray]
"""Equations (e,) that effects of a kind act in at a place."""

DIGITS = 1e-7
"""Share of the largest column of an effect below which another is nothing but the digits of a description [-]."""


@dataclass(frozen=True, eq=False)
class PeriodStates:
    """The mean of a recording and some of its periods, at fewer samples.

    Attributes:
        each: S states (N').
        joined: all of them, one after the other.
        bodies: (S N', 2 n, k) link and motor rows of bodies and rotors.
    """

    each: tuple[State, ...]
    joined: State
    bodies: FloatArray


KeptPeriods: TypeAlias = dict[tuple[tuple[Effect, ...], range], PeriodStates]
"""The mean (0) and some periods, by effects in the chain of signals and by which they are."""


@dataclass(eq=False)
class Evaluated:
    """What was evaluated on a recording, whichever of its samples are compared.

    Attributes:
        states: robot and mean motion behind effects in the chain of signals.
        columns: spectra (H + 1, E, k) of effects behind these.
        size: of the columns [bytes].
        labels: of the columns of effects.
        places: of effects.
        variants: equations (e,) and columns (H + 1, e, v, k) of an effect in several shapes.
        deflections: spectra (H,) of every link equation behind effects in the chain of signals.
        periods: the mean and the periods.
        steps: the mean, and what it would be with steps of encoders that lie elsewhere.
    """

    states: dict[tuple[Effect, ...], State] = field(default_factory=dict)
    columns: dict[tuple[Effect, tuple[Effect, ...]], ComplexArray] = field(default_factory=dict)
    size: int = 0
    labels: dict[Effect, tuple[Column, ...]] = field(default_factory=dict)
    places: Places = field(default_factory=dict)
    variants: dict[tuple[tuple[Effect, ...], tuple[Effect, ...]], tuple[IntArray, ComplexArray]] = field(
        default_factory=dict
    )
    deflections: dict[tuple[Effect, ...], dict[int, ComplexArray]] = field(default_factory=dict)
    periods: KeptPeriods = field(default_factory=dict)
    steps: KeptPeriods = field(default_factory=dict)


class Columns:
    """Evaluates effects on one recording.

    Args:
        data: the recording.
        evaluated: what was evaluated on it already, to go on with.
    """

    def __init__(self, data: PeriodData, evaluated: Evaluated | None = None) -> None:
        self.data = data
        self.robot = data.robot
        self._evaluated = Evaluated() if evaluated is None else evaluated

    def state(self, effects: Sequence[Effect]) -> State:
        """Robot and mean motion, with the errors of the sensors taken out that the effects describe."""
        signals = moving(signal_effects(effects))
        if signals not in self._evaluated.states:
            if len(self._evaluated.states) > STATES_KEPT:
                self._evaluated.states.pop(next(k for k in self._evaluated.states if k))
            motion = corrected_motion(self.robot, signals, self.data.motion)
            self._evaluated.states[signals] = State(self.robot, motion, self.data.channels)
        return self._evaluated.states[signals]

    def column_spectra(self, effect: Effect, effects: Sequence[Effect]) -> ComplexArray:
        """(H + 1, E, k) columns of one effect within a model."""
        return self.columns_behind(effect, signal_effects(effects))

    def columns_behind(self, effect: Effect, signals: tuple[Effect, ...]) -> ComplexArray:
        """(H + 1, E, k) columns of one effect behind the effects in the chain of signals of its model."""
        signals = seen_by(effect, signals)
        key = (effect, signals)
        if key not in self._evaluated.columns:
            if self._evaluated.size > COLUMNS_KEPT:
                self._evaluated.columns.clear()
                self._evaluated.size = 0
            found = without_digits(self._spectra(effect.evaluate(self.state(signals)), signals))
            self._evaluated.columns[key] = found
            self._evaluated.size += found.nbytes
        return self._evaluated.columns[key]

    def equations_of(self, effect: Effect) -> IntArray | None:
        """Equations (e,) that an effect acts in, None where none of its kind at its place was evaluated yet."""
        return self._evaluated.places.get(effect_key(effect))

    def places_of(self, effects: Sequence[Effect]) -> Places:
        """Where effects act, of those that were evaluated yet."""
        found = ((effect_key(effect), self.equations_of(effect)) for effect in effects)
        return {key: equations for key, equations in found if equations is not None}

    def remember(self, places: Places) -> None:
        """Take over where effects act that were evaluated by another process."""
        self._evaluated.places.update(places)

    def in_two(self, effects: Sequence[Effect]) -> tuple[tuple[Effect, ...], tuple[Effect, ...]]:
        """Effects in two parts of about the same work, each always in the same: who compared it has its columns."""
        joints = {joint: k for k, joint in enumerate(self.robot.joint_names)}
        second = [(crc32(e.name.encode()) + joints.get(e.joint or "", 0)) % 2 for e in effects]
        one, other = (tuple(e for e, part in zip(effects, second, strict=True) if part == k) for k in (0, 1))
        return one, other

    def variant_spectra(self, variants: Sequence[Effect], effects: Sequence[Effect]) -> tuple[IntArray, ComplexArray]:
        """Columns of one effect in all its variants.

        Returns:
            (e,) equations that it touches, and (H + 1, e, v, k) columns in these.
        """
        signals = seen_by(variants[0], signal_effects(effects))
        key = (tuple(variants), signals)
        if key not in self._evaluated.variants:
            if sum(spectra.nbytes for _, spectra in self._evaluated.variants.values()) > VARIANTS_KEPT:
                self._evaluated.variants.clear()
            self._evaluated.variants[key] = self.spectra_of_variants(variants, signals)
            self._evaluated.places[effect_key(variants[0])] = self._evaluated.variants[key][0]
        return self._evaluated.variants[key]

    def spectra_of_variants(
        self, variants: Sequence[Effect], effects: Sequence[Effect]
    ) -> tuple[IntArray, ComplexArray]:
        """The same, of shapes that nobody will ask for again."""
        signals = seen_by(variants[0], signal_effects(effects))
        state = self.state(signals)
        pieces, amounts = type(variants[0]).in_pieces(variants)
        touched, spectra = self._touched([piece.evaluate(state) for piece in pieces], signals)
        return touched, spectra if amounts is None else np.einsum("vp,hepk->hevk", amounts, spectra, optimize=True)

    def _touched(self, parts: Sequence[Contribution], signals: tuple[Effect, ...]) -> tuple[IntArray, ComplexArray]:
        """Equations with anything in them, and the spectra (H + 1, e, v, ...) of all parts there."""
        for signal in signals:
            parts = [signal.shifted(self.robot, self.data.motion.time, part) for part in parts]
        touched, found = [], []
        joints = {part.joint for part in parts}
        for e, equation in enumerate(self.data.equations):
            if None not in joints and equation.index not in joints:
                continue
            rows = [equation_row(equation, part) for part in parts]
            if any(np.any(row) for row in rows):
                touched.append(e)
                found.append(np.stack(rows, axis=1) if len(rows) > 1 else rows[0][:, None])
        shape = (self.data.samples, 0, len(parts), *parts[0].link.shape[2:])
        every = np.stack(found, axis=1) if found else np.zeros(shape)
        return np.array(touched, dtype=np.intp), spectrum(every, self.data.harmonics)

    def spectra_of(self, part: Contribution, effects: Sequence[Effect]) -> ComplexArray:
        """(H + 1, E, ...) of link and motor rows (N, n, ...) within a model."""
        return self._spectra(part, signal_effects(effects))

    def _spectra(self, part: Contribution, signals: tuple[Effect, ...]) -> ComplexArray:
        touched, found = self._touched([part], signals)
        out = np.zeros((self.data.harmonics + 1, len(self.data.equations), *found.shape[3:]), dtype=np.complex128)
        out[:, touched] = found[:, :, 0]
        return out

    def design(self, effects: Sequence[Effect]) -> ComplexArray:
        """(H + 1, E, p) columns of a model."""
        signals = signal_effects(effects)
        return np.concatenate([self.columns_behind(effect, signals) for effect in effects], axis=2)

    def labels(self, effects: Sequence[Effect]) -> tuple[Column, ...]:
        """(p,) labels of the columns of a model."""
        return tuple(column for effect in effects for column in self.labels_of(effect))

    def labels_of(self, effect: Effect) -> tuple[Column, ...]:
        """(k,) labels of the columns of one effect."""
        if effect not in self._evaluated.labels:
            if len(self._evaluated.labels) > LABELS_KEPT:
                self._evaluated.labels.clear()
            self._evaluated.labels[effect] = effect.columns(self.robot)
        return self._evaluated.labels[effect]

    def counts(self, effects: Sequence[Effect]) -> list[int]:
        """Number of columns of every effect."""
        return [len(self.labels_of(effect)) for effect in effects]

    def anchored(self, effects: Sequence[Effect], parameters: dict[str, float] | None) -> tuple[Effect, ...]:
        """The same effects, knowing what they need of the rest of the model."""
        effects = tuple(effects)
        if parameters is None:
            return effects
        anchor = Anchor(self.robot, effects, parameters)
        return tuple(effect.anchored(anchor) for effect in effects)


def effect_key(effect: Effect) -> Key:
    """Name, joint, and the other joint where there is one."""
    return effect.name, effect.joint, str(getattr(effect, "other", "") or "")


def without_digits(spectra: ComplexArray) -> ComplexArray:
    """Columns (H + 1, E, k) of one effect, exactly zero where an axis given to seven digits would make them something.

    The parameter of such a column would be as large as it takes to explain noise. That does no harm by itself, but what
    depends on it, as gravity on a tilted base, would be anything.
    """
    sizes = np.sqrt(np.sum(np.abs(spectra) ** 2, axis=(0, 1)))
    nothing = sizes < DIGITS * np.max(sizes, initial=0.0)
    if np.any(nothing):
        spectra = spectra.copy()
        spectra[:, :, nothing] = 0.0
    return spectra
