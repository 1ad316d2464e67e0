"""Arguments in the wrong order, or names in place of what they name: a message, not a trace."""

import numpy as np
import pytest

from sea_ident import (
    SeaIdentError,
    design_excitation,
    diagnose,
    export_urdf,
    identify,
    load_robot,
    process,
    simulate,
    validate,
    write_recording,
    write_report,
)
from sea_ident.batch import identify_batch
from sea_ident.discrepancy import read_diagnosis
from sea_ident.estimation import identify_springs, read_model
from sea_ident.exceptions import RobotError
from sea_ident.excitation import Ramp, read_excitation
from sea_ident.motion import FourierSeries
from sea_ident.recordings import Recording, read_recording

LEG = load_robot("exo_leg")
SERIES = FourierSeries(0.1, np.zeros(3), np.zeros((3, 1)), np.zeros((3, 1)))
RECORDING = Recording(np.arange(9.0), {"q_hip": np.arange(9.0)}, "test")


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (lambda: identify(RECORDING, LEG), r"identify: robot must be a Robot, not a Recording; load_robot"),
        (lambda: identify(LEG, "rec.csv"), r"recording must be a Recording .*, not a str; read_recording"),
        (lambda: identify(LEG, RECORDING, effects=["payload"]), r"each of effects must be an Effect, .* make_effect"),
        (lambda: design_excitation("exo_leg"), r"must be a Robot, not a str; load_robot"),
        (lambda: simulate("exo_leg", None), r"must be a Robot, not a str; load_robot"),
        (lambda: simulate(LEG, None, effects=[("payload", 1.0)]), r"must be a PlantedEffect, not a tuple"),
        (lambda: validate(RECORDING, LEG), r"must be a Model, not a Recording; identify"),
        (lambda: diagnose("model.json", RECORDING), r"must be a Model, not a str; .*read_model"),
        (lambda: process(LEG, RECORDING), r"must be a Recording, not a Robot"),
        (lambda: identify(LEG, RECORDING, period="10"), r"identify: period must be a number \[s\] .*not a str, '10'"),
        (lambda: process(RECORDING, LEG, period="10 s"), r"process: period must be a number \[s\]"),
        (lambda: export_urdf("out.urdf", LEG), r"must be a Model, not a str"),
        (lambda: write_report("out.html", LEG), r"must be a Model or a Diagnosis, not a str"),
        (lambda: write_recording("out.csv", RECORDING), r"must be a Recording, not a str"),
        (lambda: design_excitation(LEG, ramp=2.0), r"ramp must be a Ramp, not a float; Ramp\(seconds\) gives one"),
        (lambda: design_excitation(LEG, links=0.1), r"links must be a LinksInside or a LinksAsPlanned, not a float"),
        (lambda: design_excitation(LEG, criterion="D"), r"criterion must be a Criterion, not a str; DOptimality"),
        (lambda: design_excitation(LEG, limits=3), r"limits must be a Limits, not an int; robot.limits"),
        (lambda: design_excitation(LEG, effects=["payload"]), r"each of effects must be an Effect"),
        (lambda: design_excitation(LEG, base_frequency="0.1"), r"base_frequency must be a number, not a str"),
        (lambda: design_excitation(LEG, rate=None), r"rate must be a number, not None"),
        (lambda: Ramp("2"), r"Ramp: duration must be a number"),
        (lambda: Ramp(-1.0), r"duration of the ramp is -1.0 s"),
        (lambda: simulate(LEG, SERIES, periods=1.5), r"periods must be a whole number, not 1.5"),
        (lambda: simulate(LEG, SERIES, seed=-1), r"seed must be a whole number of at least 0, not -1"),
        (lambda: simulate(LEG, SERIES, rate=np.inf), r"rate inf Hz must all be positive and finite"),
        (lambda: simulate(LEG, SERIES, rate=1e9), r"are 1e\+10 steps, more than"),
        (lambda: simulate(LEG, SERIES, step=np.inf), r"step inf s must all be positive and finite"),
        (lambda: simulate(LEG, SERIES, rate="200"), r"rate must be a number"),
        (lambda: simulate(LEG, SERIES, controller="x"), r"controller must be a Controller, .* VelocityController"),
        (lambda: simulate(LEG, SERIES, sensors=0.1), r"sensors must be a SensorNoise, not a float"),
        (lambda: simulate(LEG, SERIES, friction=0.1), r"friction must be a FrictionLaw, not a float"),
        (lambda: simulate(LEG, SERIES, friction=[0.1] * 3), r"friction must be a FrictionLaw, not a float"),
        (lambda: identify(LEG, RECORDING, estimator="wls"), r"estimator must be an Estimator, not a str"),
        (lambda: identify(LEG, RECORDING, prior="model.json"), r"prior must be a Model, not a str; .*read_model"),
        (lambda: identify(LEG, RECORDING, effects=[]), r"effects is empty"),
        (lambda: process(RECORDING, LEG, link_harmonics=1.5), r"link_harmonics must be a whole number of at least 1"),
    ],
)
def test_a_wrong_kind_of_argument_is_a_message(call, expected):
    with pytest.raises(SeaIdentError, match=expected):
        call()


def test_whole_numbers_of_few_bits_do_not_overflow():
    """A count from an array of small integers is the number that it looks like."""
    wanted = {"starts": 1, "seed": 1, "jobs": 1}
    few, plain = (design_excitation(LEG, harmonics=kind(3), **wanted) for kind in (np.int8, int))
    assert few.log_det == plain.log_det


@pytest.mark.parametrize("given", [3, None, b"rec.csv"])
@pytest.mark.parametrize(
    "call",
    [
        read_recording,
        read_model,
        read_excitation,
        read_diagnosis,
        load_robot,
        lambda path: load_robot("exo_leg", 0 if path is None else path),
        lambda path: write_recording(RECORDING, path),
        lambda path: identify_batch(LEG, path),
    ],
    ids=["recording", "model", "excitation", "diagnosis", "robot", "annotation", "writing", "batch"],
)
def test_what_is_no_path_is_refused_by_its_kind(call, given):
    with pytest.raises(SeaIdentError, match=r"must be a path, as text or pathlib\.Path, not (an int|None|a bytes), "):
        call(given)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"columns": ["q_hip"]}, r"columns must be a Mapping, not a list"),
        ({"columns": "q_hip"}, r"columns must be a Mapping, not a str"),
        ({"columns": {"q_hip": 3}}, r"columns\['q_hip'\] must be a str or a ColumnSource, not an int"),
        ({"columns": {3: "q_hip"}}, r"each key of columns must be a str, not an int"),
        ({"clocks": "time"}, r"clocks must be a ClockAlignment, not a str"),
        ({"memory_limit": "2 GB"}, r"memory_limit must be a whole number of at least 1, not '2 GB'"),
        ({"memory_limit": 0}, r"memory_limit must be a whole number of at least 1, not 0"),
    ],
)
def test_how_a_recording_is_read_is_refused_before_its_file_is_blamed(tmp_path, options, expected):
    (tmp_path / "rec.csv").write_text("time,q_hip\n0,0\n1,1\n")
    with pytest.raises(SeaIdentError, match=expected):
        read_recording(tmp_path / "rec.csv", **options)


@pytest.mark.parametrize(
    ("joints", "expected"),
    [
        (3, r"joints must be a list of names, not 3; joints that can move: hip, knee, ankle"),
        ("hip", r"joints must be a list of names, not 'hip'; joints that can move"),
        (["hip", 3], r"joints must be a list of names; 3 in it is an int; joints that can move"),
    ],
)
def test_joints_are_a_list_of_names(joints, expected):
    with pytest.raises(RobotError, match=expected):
        load_robot("exo_leg", joints=joints)
    assert (
        load_robot("exo_leg", joints={"hip"}).joint_names == load_robot("exo_leg", joints=np.array(["hip"])).joint_names
    )


def test_springs_are_asked_for_with_a_model_and_its_recording():
    with pytest.raises(SeaIdentError, match=r"identify_springs: model must be a Model, not an int"):
        identify_springs(3, RECORDING)
