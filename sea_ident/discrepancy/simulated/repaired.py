"""The repaired model beside the model as it was, in forward simulation, and what to know before it is used."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from sea_ident.discrepancy.bench.fit import Fit
from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.bench.judge import SMALLEST_SHARE
from sea_ident.discrepancy.compared.heldout import HeldOut
from sea_ident.discrepancy.result.diagnosis import Diagnosis, units_by_joint
from sea_ident.discrepancy.result.repair import repaired_model
from sea_ident.discrepancy.simulated.forward import Present, SimulationGap, simulation_gap
from sea_ident.estimation import Model, TrendTerm
from sea_ident.processing import ProcessedRecording
from sea_ident.recordings import Recording
from sea_ident.side_by_side import side_by_side
from sea_ident.simulation import Controller

FAR_ABOVE = 3.0
"""Times what the fit of a diagnosis leaves, noise and all, from which on what the model leaves is another thing [-]."""


@dataclass(frozen=True, eq=False)
class Repaired:
    """A repaired model and what it does.

    Attributes:
        model: the model; None where none could be identified.
        gaps: of forward simulation by signal, before and after.
        notes: what a user should know, and why there is no model or no simulation.
    """

    model: Model | None
    gaps: dict[str, Gap]
    notes: tuple[str, ...]

    def changing(self, trends: tuple[TrendTerm, ...]) -> "Repaired":
        """The same with a model that holds what changes in the course of a recording; it was simulated as in a mean."""
        return self if self.model is None else replace(self, model=replace(self.model, trends=trends))


def repair(
    model: Model,
    after: tuple[ProcessedRecording, Fit],
    before: tuple[ProcessedRecording, Fit] | None,
    held: HeldOut | None,
    recording: Recording | ProcessedRecording,
    processed: ProcessedRecording,
    controller: Controller | None,
    present: Present | None = None,
) -> Repaired:
    """Repair a model, and simulate it before and after.

    Args:
        model: the model that was diagnosed.
        after: the recording as it is identified from, and the fit with what was found.
        before: the same without what was found; None where nothing was.
        held: another motion, on which it is simulated where there is one.
        recording: what was measured.
        processed: the same, processed.
        controller: what drove the motors.
        present: what has changed in the mean of the other motion since that of the recording.

    Returns:
        The model with what it does.
    """
    given = [after] if before is None else [after, before]
    repaired, *former = side_by_side(lambda one: repaired_model(model, *one), given)
    if isinstance(repaired, str):
        return Repaired(None, {}, (no_model(repaired),))
    if not former and not (present and present.differs):
        return Repaired(repaired, {}, ())
    as_it_was = former[0] if former else repaired
    if isinstance(as_it_was, str):
        return Repaired(repaired, {}, (f"no forward simulation, as the model before the repair is none: {as_it_was}",))
    forward = _forward(as_it_was, repaired, held, recording, processed, controller, present)
    return Repaired(repaired, forward.gaps, forward.notes)


def no_model(why: str) -> str:
    """That the model was not repaired, and what follows."""
    return f"there is no repaired model, thus neither forward simulation nor a next experiment: {why}"


def _forward(
    before: Model,
    after: Model,
    held: HeldOut | None,
    recording: Recording | ProcessedRecording,
    processed: ProcessedRecording,
    controller: Controller | None,
    present: Present | None,
) -> SimulationGap:
    """Forward simulation before and after, on another motion where there is one."""
    if held is not None and held.processed is not None and held.recording is not None:
        return simulation_gap(before, after, held.recording, held.processed, controller, present)
    found = simulation_gap(before, after, recording, processed, controller)
    same = ("no other motion was given: forward simulation is compared on the motion that was used in the fit",)
    return replace(found, notes=(*same, *found.notes))


def with_repaired(diagnosis: Diagnosis, repaired: Repaired, torque: Mapping[str, float]) -> Diagnosis:
    """A diagnosis with the repaired model, and with what speaks against that one.

    Args:
        diagnosis: the diagnosis.
        repaired: the model.
        torque: rms by joint [N m] or [N].
    """
    found = replace(diagnosis, model=repaired.model, simulation_gap=repaired.gaps)
    return replace(found, warnings=(*found.warnings, *_worse_than_the_fit(found, torque), *_worse_than_before(found)))


def _worse_than_the_fit(diagnosis: Diagnosis, torque: Mapping[str, float]) -> tuple[str, ...]:
    """Where the repaired model leaves far more than the fit that it was made from."""
    model, gap = diagnosis.model, diagnosis.training
    if model is None or gap is None or model.fit.agreement is None:
        return ()
    own = model.fit.agreement
    parts = []
    for joint, left, noise in zip(model.robot.joints, own.gap, own.noise, strict=True):
        fitted = gap.after[joint.name]
        # the noise of a fit knows what steps of encoders do in every period, that of the model what none compares
        usual = np.linalg.norm([fitted, gap.noise[joint.name], noise])
        if left > max(FAR_ABOVE * usual, SMALLEST_SHARE * torque[joint.name]):
            parts.append(f"{left:.3g} {joint.torque_unit} at {joint.name} (the fit {fitted:.2g}, noise {noise:.2g})")
    if not parts:
        return ()
    return (
        f"the repaired model is far from what this diagnosis fitted: of the motor torque it leaves {', '.join(parts)} "
        "beyond the noise. Do not rely on it, nor on its forward simulation",
    )


def _worse_than_before(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Where forward simulation is further from the recording with the repaired model than it was without."""
    found = []
    for kind, gap in diagnosis.simulation_gap.items():
        units = units_by_joint(gap.units, gap.before, positions=kind != "tau")
        parts = ", ".join(
            f"{joint} {before:.2g} -> {gap.after[joint]:.2g} {units[joint]}"
            for joint, before in gap.before.items()
            if gap.after[joint] > np.hypot(before, gap.noise[joint])
        )
        if parts and (gap.opens or gap.shrink < 0.0):
            growth = "from nothing" if gap.opens else f"by {-100.0 * gap.shrink:.0f} %"
            found.append(f"of {kind} {growth} ({parts})")
    if not found:
        return ()
    return (
        f"the gap in forward simulation grows with the repair: {'; '.join(found)}. What was found does not make the "
        "model better there",
    )
