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
from sea_ident.recordings import Recording

LEG = load_robot("exo_leg")
RECORDING = Recording(np.arange(9.0), {"q_hip": np.arange(9.0)}, "test")


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (lambda: identify(RECORDING, LEG), r"identify: robot must be a Robot, not a Recording; load_robot"),
        (lambda: identify(LEG, "rec.csv"), r"recording must be a Recording .*, not a str; read_recording"),
        (lambda: identify(LEG, RECORDING, effects=["payload"]), r"each of effects must be a Effect, .* make_effect"),
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
    ],
)
def test_a_wrong_kind_of_argument_is_a_message(call, expected):
    with pytest.raises(SeaIdentError, match=expected):
        call()
