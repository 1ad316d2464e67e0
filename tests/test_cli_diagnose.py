"""What `sea-ident diagnose` writes beside the diagnosis."""

import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest

from sea_ident.cli import main
from sea_ident.discrepancy import Diagnosis, LackOfFit, NextExperiment, Verdict
from sea_ident.excitation import design_excitation, read_excitation
from sea_ident.robot import load_robot


@pytest.fixture
def told(monkeypatch, tmp_path):
    """Runs the verb with a diagnosis that is given."""

    def run(diagnosis):
        monkeypatch.setattr("sea_ident.estimation.read_model", lambda path: SimpleNamespace())
        monkeypatch.setattr("sea_ident.recordings.read_recording", lambda path, columns=None: SimpleNamespace())
        monkeypatch.setattr("sea_ident.discrepancy.diagnose", lambda *args, **options: diagnosis)
        words = ["diagnose", "model.json", "rec.csv", "--out", "d.json", "--next", "next.json"]
        monkeypatch.setattr(sys, "argv", ["sea-ident", *words])
        monkeypatch.chdir(tmp_path)
        with pytest.raises(SystemExit) as done:
            main()
        assert not done.value.code

    return run


def test_the_next_experiment_is_an_excitation_like_any_other(told, tmp_path, capsys):
    excitation = design_excitation(load_robot("quanser_2dof"), harmonics=2, starts=1, seed=1)
    found = Diagnosis(
        Verdict.AMBIGUOUS, "A or B.", LackOfFit(0.0, 1, 1.0, 1.0, {}),
        next_experiment=NextExperiment(("a at stage1", "b at stage1"), excitation.to_dict(), 3.0),
    )  # fmt: skip
    told(found)
    assert "written: d.json, next.json" in capsys.readouterr().out
    again = read_excitation(tmp_path / "next.json")
    assert again.to_dict() == excitation.to_dict()
    assert list(tmp_path.glob("*.part*")) == []


def test_without_a_next_experiment_none_is_written_and_that_is_said(told, tmp_path, capsys):
    found = Diagnosis(Verdict.NAMED, "A.", LackOfFit(0.0, 1, 1.0, 1.0, {}))
    told(replace(found, next_experiment=None))
    assert not (tmp_path / "next.json").exists()
    assert "next.json is not written: the verdict named comes without" in capsys.readouterr().err
