"""What `sea-ident diagnose` writes beside the diagnosis."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from sea_ident.discrepancy import Diagnosis, LackOfFit, NextExperiment, Verdict
from sea_ident.excitation import design_excitation, read_excitation
from sea_ident.robot import load_robot


@pytest.fixture
def told(monkeypatch, tmp_path, call_here):
    """Runs the verb with a diagnosis that is given."""

    def run(diagnosis, *more):
        monkeypatch.setattr("sea_ident.estimation.read_model", lambda path: SimpleNamespace())
        monkeypatch.setattr("sea_ident.recordings.read_recording", lambda path, columns=None: SimpleNamespace())
        monkeypatch.setattr("sea_ident.discrepancy.diagnose", lambda *args, **options: diagnosis)
        words = ["diagnose", "model.json", "rec.csv", "--out", "d.json", "--next", "next.json", *more]
        answer = call_here(*words, cwd=tmp_path)
        assert answer.returncode == 0, answer.stderr
        return answer

    return run


def test_the_next_experiment_is_an_excitation_like_any_other(told, tmp_path):
    excitation = design_excitation(load_robot("quanser_2dof"), harmonics=2, starts=1, seed=1)
    found = Diagnosis(
        Verdict.AMBIGUOUS, "A or B.", LackOfFit(0.0, 1, 1.0, 1.0, {}),
        next_experiment=NextExperiment(("a at stage1", "b at stage1"), excitation.to_dict(), 3.0),
    )  # fmt: skip
    assert "written: d.json, next.json" in told(found).stdout
    again = read_excitation(tmp_path / "next.json")
    assert again.to_dict() == excitation.to_dict()
    assert list(tmp_path.glob("*.part*")) == []


@pytest.mark.parametrize(
    ("verdict", "reason"),
    [
        (Verdict.NAMED, "it is for an ambiguous pair, and the verdict is named"),
        (Verdict.NONE, "it is for an ambiguous pair, and the verdict is none"),
        (Verdict.AMBIGUOUS, "no motion was tried, for there is no repaired model (the diagnosis says why)"),
    ],
)
def test_without_a_next_experiment_none_is_written_and_that_is_said(told, tmp_path, verdict, reason):
    answer = told(Diagnosis(verdict, "A.", LackOfFit(0.0, 1, 1.0, 1.0, {})))
    assert not (tmp_path / "next.json").exists()
    out, err = answer.stdout, answer.stderr
    assert f"warning: next.json is not written: {reason}" in err
    assert "older" not in err
    assert out.endswith("written: d.json\n")


def test_where_no_motion_tells_a_pair_apart_that_is_said(told):
    found = Diagnosis(Verdict.AMBIGUOUS, "A.", LackOfFit(0.0, 1, 1.0, 1.0, {}), model=SimpleNamespace())
    reason = "there is no motion that tells the effects apart better (the diagnosis says why)"
    assert f"warning: next.json is not written: {reason}" in told(found).stderr


def test_a_file_that_stays_is_said_to_be_an_older_one(told, tmp_path):
    """Else what an earlier diagnosis proposed passes for what this one does."""
    (tmp_path / "next.json").write_text("before")
    answer = told(Diagnosis(Verdict.NAMED, "A.", LackOfFit(0.0, 1, 1.0, 1.0, {})), "--model-out", "m.json")
    assert (tmp_path / "next.json").read_text() == "before"
    older, model = (line for line in answer.stderr.splitlines()[::-1])
    assert older.endswith("; the file of that name is an older one")
    assert model == "warning: m.json is not written: there is no repaired model, and the verdict is named"


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no folder that takes no file whoever writes")
@pytest.mark.parametrize("option", ["--out", "--next", "--model-out", "--report"])
def test_what_cannot_be_written_is_refused_before_anything_is_read(call_here, tmp_path, option):
    outputs = {"--out": "d.json", option: "/proc/x.json"}
    words = ["diagnose", "model.json", "rec.csv", *(word for pair in outputs.items() for word in pair)]
    answer = call_here(*words, cwd=tmp_path)
    assert answer.returncode == 2
    assert "/proc/x.json: the folder /proc cannot be written to" in answer.stderr


def test_a_report_takes_no_model_of_another_robot(monkeypatch, call_here, tmp_path):
    units = {"hip": "N m", "knee": "N m"}
    Diagnosis(Verdict.NONE, "A.", LackOfFit(0.0, 1, 1.0, 1.0, {}), units=units).save(tmp_path / "d.json")
    other = SimpleNamespace(robot=load_robot("quanser_2dof"))
    monkeypatch.setattr("sea_ident.estimation.read_model", lambda path: other)
    answer = call_here("report", "d.json", "--out", "r.html", "--model", "m.json", cwd=tmp_path)
    assert answer.returncode == 2
    assert "m.json: is a model of quanser_2dof (stage1, stage2), d.json is the diagnosis" in answer.stderr
    assert not (tmp_path / "r.html").exists()
