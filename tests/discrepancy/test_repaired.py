"""Why there is no repaired model is said."""

import re
from types import SimpleNamespace

import pytest

from sea_ident.discrepancy import repaired
from sea_ident.discrepancy.repaired import repair


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
