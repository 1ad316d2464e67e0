"""Why there is no repaired model, and what speaks against one, is said."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.gap import Gap
from sea_ident.discrepancy.result.diagnosis import Diagnosis
from sea_ident.discrepancy.result.findings import LackOfFit, Verdict
from sea_ident.discrepancy.simulated import repaired
from sea_ident.discrepancy.simulated.repaired import Repaired, repair, with_repaired
from sea_ident.estimation.agreement import Agreement
from sea_ident.report.sections import gap as gap_section

JOINTS = ("hip", "knee", "ankle")
NOISE = dict.fromkeys(JOINTS, 0.1)


def sizes(*values):
    return dict(zip(JOINTS, values, strict=True))


def judged(leg, rms, gaps=None, torque=10.0):
    """Warnings of a diagnosis whose fit leaves 0.2 N m in the knee, with a model that leaves this much."""
    training = Gap(sizes(0.0, 3.0, 0.0), sizes(0.0, 0.2, 0.0), NOISE)
    found = Diagnosis(Verdict.NAMED, "A.", LackOfFit(0.0, 1, 1.0, 1.0, {}), training=training, warnings=("before",))
    agreement = Agreement(np.array(rms), np.full(3, 0.1), np.ones(3))
    model = SimpleNamespace(robot=leg, fit=SimpleNamespace(agreement=agreement))
    first, *more = with_repaired(found, Repaired(model, gaps or {}, ()), dict.fromkeys(JOINTS, torque)).warnings
    assert first == "before"
    return more


@pytest.mark.parametrize(
    ("answers", "model", "note"),
    [
        (
            ["columns depend", "too short"],
            False,
            "there is no repaired model, thus neither .* experiment: columns depend",
        ),
        (["made", "too short"], True, "no forward simulation, as the model before the repair is none: too short"),
    ],
)
def test_a_model_that_cannot_be_identified_leaves_its_reason(monkeypatch, answers, model, note):
    made = SimpleNamespace()
    given = iter([made if answer == "made" else answer for answer in answers])
    monkeypatch.setattr(repaired, "repaired_model", lambda *_: next(given))
    found = repair(None, (None, None), (None, None), None, None, None, None)
    assert (found.model is made) is model
    assert found.gaps == {}
    (text,) = found.notes
    assert re.fullmatch(note, text)


def test_a_model_that_leaves_what_its_fit_leaves_is_not_spoken_against(leg):
    assert judged(leg, [0.12, 0.3, 0.15]) == []


def test_a_model_far_from_the_fit_is_not_to_be_relied_on(leg):
    (text,) = judged(leg, [0.12, 2.0, 0.15])
    assert text.startswith(
        "the repaired model is far from what this diagnosis fitted: of the motor torque it leaves 2 N m at knee (the "
        "fit 0.2, noise 0.1) beyond the noise"
    )
    # a thousandth of the torque, however quiet the recording
    assert judged(leg, [0.12, 2.0, 0.15], torque=2001.0) == []


def test_a_gap_that_grows_in_forward_simulation_is_said_with_its_numbers(leg):
    rad = Gap(
        sizes(0.001, 0.002, 0.001),
        sizes(0.0005, 0.004, 0.001),
        dict.fromkeys(JOINTS, 1e-5),
        dict.fromkeys(JOINTS, "N m"),
    )
    (text,) = judged(leg, [0.1, 0.1, 0.1], {"q": rad})
    assert text.startswith("the gap in forward simulation grows with the repair: of q by 70 % (knee 0.002 -> 0.004 rad")
    shrinks = replace(rad, before=rad.after, after=rad.before)
    in_noise = replace(rad, noise=dict.fromkeys(JOINTS, 0.01))
    assert judged(leg, [0.1, 0.1, 0.1], {"q": shrinks, "theta": in_noise}) == []


def test_a_gap_that_opens_in_forward_simulation_is_said_too(leg):
    """No share of nothing says how much it grew."""
    noise = dict.fromkeys(JOINTS, 1e-5)
    rad = Gap(sizes(0.0, 0.0, 0.0), sizes(0.0, 5e-5, 0.0), noise, dict.fromkeys(JOINTS, "N m"))
    (text,) = judged(leg, [0.1, 0.1, 0.1], {"q": rad})
    assert "grows with the repair: of q from nothing (knee 0 -> 5e-05 rad)" in text
    assert judged(leg, [0.1, 0.1, 0.1], {"q": replace(rad, after=sizes(0.0, 5e-6, 0.0))}) == []
    assert gap_section._closed(rad, True) == "The model was within the noise before already, and is no longer."
