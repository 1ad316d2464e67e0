"""Checks at the border of the diagnosis."""

from dataclasses import replace

import numpy as np
import pytest
from estimation.synthetic import leg_series, record, truth_of

from sea_ident.discrepancy.check import Findings, channels_move, cleaned, clock_in_seconds, drowned
from sea_ident.discrepancy.data import period_data, wide_processing
from sea_ident.discrepancy.findings import Gap
from sea_ident.exceptions import DiagnosisError
from sea_ident.recordings import Recording
from sea_ident.robot import load_robot

STEP = 2.0 * np.pi / 2**14
PERIOD = 10.0


@pytest.fixture(scope="module")
def counted(leg):
    """Eight periods read by encoders of 14 bits with next to no noise: the same to a step that falls a sample later."""
    fine = record(leg, truth_of(leg, leg_series(), samples=1000), 8, torque_noise=0.05, encoder_noise=3e-5 * STEP)
    columns = {
        name: np.round(values / STEP) * STEP if name.startswith(("q_", "theta_")) else values
        for name, values in fine.columns.items()
    }
    return Recording(fine.time, columns, "counted")


def said_of(recording, leg, **columns):
    """Periods that are kept, counted from 1, and what is said of the others."""
    changed = Recording(recording.time, {**recording.columns, **columns}, "changed")
    data, findings = cleaned(period_data(wide_processing(changed, leg, PERIOD), leg), changed)
    return [place + 1 for place in data.places], [text for text in findings.warnings if "left out" in text]


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_a_step_that_falls_a_sample_later_is_no_spike(counted, leg):
    assert said_of(counted, leg) == ([1, 2, 3, 4, 5, 6, 7, 8], [])


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
@pytest.mark.parametrize("column", ["q_knee", "theta_ankle"])
def test_a_spike_of_some_steps_is_one(counted, leg, column):
    values = counted.columns[column].copy()
    values[2340] += 30.0 * STEP
    kept, said = said_of(counted, leg, **{column: values})
    assert kept == [1, 2, 4, 5, 6, 7, 8]
    assert said == [
        "changed: spikes in period(s) 3 of 8, far outside what the other periods show; these periods were left out. "
        "Check the wiring of the sensor"
    ]


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_a_motion_that_stops_is_no_spike(counted, leg):
    """One joint only: where all of them do, the recording ends there."""
    columns = {name: counted.columns[name].copy() for name in ("q_hip", "theta_hip", "q_knee")}
    for name in ("q_hip", "theta_hip"):
        columns[name][7600:] = columns[name][7600]
    columns["q_knee"][2340] += 30.0 * STEP
    kept, said = said_of(counted, leg, **columns)
    assert kept == [1, 2, 4, 5, 6, 7]
    assert "spikes in period(s) 3 of 8" in said[0]
    assert said[1] == (
        "changed: the motion stops or differs in period(s) 8 of 8, where its position is away from that of the other "
        "periods for long; these periods were left out. Cut the recording to where the motion repeats itself"
    )


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_a_motion_that_stops_too_often_lets_nothing_be_told(counted, leg):
    """Each joint stops in a few of the periods, one or the other in most of them."""
    data = period_data(wide_processing(counted, leg, PERIOD), leg)
    motions = list(data.period_motions)
    for period, joint in ((0, 0), (2, 0), (4, 1), (6, 1), (7, 2)):
        q, ddq = motions[period].q.copy(), motions[period].ddq.copy()
        q[600:, joint] = q[600, joint]
        ddq[600, joint] = 1e4
        motions[period] = replace(motions[period], q=q, ddq=ddq)
    data, findings = cleaned(replace(data, period_motions=tuple(motions)), counted)
    assert data.periods == 8
    assert findings.fatal
    assert findings.warnings[-1] == (
        "counted: the motion stops or differs in 5 of 8 periods (1, 3, 5, 7, 8): too many to leave out. Cut the "
        "recording to where the motion repeats itself"
    )


def test_noise_beyond_the_torque_lets_nothing_be_told():
    before = Findings(("clipped",))
    sound = Gap({"hip": 0.1, "grip": 0.0}, {"hip": 0.0, "grip": 0.0}, {"hip": 0.05, "grip": 0.3})
    assert drowned(before, sound, {"hip": 10.0, "grip": 4.0}) is before
    for noise in (5e21, float("inf"), float("nan")):
        lost = Gap(sound.before, sound.after, {"hip": 0.05, "grip": noise})
        found = drowned(before, lost, {"hip": 10.0, "grip": 4.0})
        assert found.fatal
        assert found.warnings[0] == "clipped"
        assert "the noise of grip" in found.warnings[1]


@pytest.mark.parametrize(
    ("column", "why"),
    [
        ("q_hip", "the sensor is dead, or the joint does not move"),
        ("theta_knee", "the sensor is dead, or the joint does not move"),
        ("tau_motor_ankle", "no torque is measured"),
    ],
)
def test_a_joint_that_does_not_move_or_has_no_torque_is_refused(column, why):
    leg, time = load_robot("exo_leg"), 0.01 * np.arange(200)
    columns = {f"{kind}_{name}": np.sin(time) for kind in ("q", "theta", "tau_motor") for name in leg.joint_names}
    columns |= {"current_ankle": np.zeros(200)}
    channels_move(leg, Recording(time=time, columns=columns, source="a.csv"))
    dead = Recording(time=time, columns={**columns, column: np.full(200, 0.25)}, source="a.csv")
    with pytest.raises(DiagnosisError, match=rf"a.csv: column {column} is constant, 0.25: {why}, .*--joints"):
        channels_move(leg, dead)


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_only_what_is_used_has_to_move():
    """A current where no torque was measured; no motor's encoder at a joint without a spring."""
    slide, time = load_robot("emps"), 0.01 * np.arange(200)
    (name,) = slide.joint_names
    columns = {f"q_{name}": np.sin(time), f"theta_{name}": np.zeros(200), f"current_{name}": np.cos(time)}
    channels_move(slide, Recording(time=time, columns=columns, source="a.csv"))
    columns[f"current_{name}"] = np.zeros(200)
    with pytest.raises(DiagnosisError, match=f"column current_{name} is constant, 0: no torque is measured"):
        channels_move(slide, Recording(time=time, columns=columns, source="a.csv"))


@pytest.mark.parametrize("rate", [200, 5000])
def test_time_that_is_not_in_seconds_is_refused(rate):
    """A search in it takes minutes and finds nothing."""
    time = np.arange(20 * rate) / rate
    columns = {"q_hip": 0.8 * np.sin(time)}
    clock_in_seconds(Recording(time, columns, "a.csv"))
    with pytest.raises(
        DiagnosisError, match=r"a.csv: no position moves faster.*--column time=time,unit=ms. If it is in"
    ):
        clock_in_seconds(Recording(1e3 * time, columns, "a.csv"))


@pytest.mark.parametrize("held", [True, False], ids=["let go late", "at once"])
def test_a_joint_that_stiction_lets_go_late_in_one_pass_is_no_spike(counted, leg, held):
    """Without the rest before it, the same acceleration is one."""
    data = period_data(wide_processing(counted, leg, PERIOD), leg)
    ankle, motions = leg.index("ankle"), list(data.period_motions)
    speed = data.motion.dtheta[:, ankle]
    begin = next(
        k
        for k in np.flatnonzero(np.diff(np.sign(speed)))
        if np.all(np.sign(speed[k + 1 : k + 30]) == np.sign(speed[k + 1]))
    )
    late = slice(begin, begin + 20)
    changed = {name: getattr(motions[2], name).copy() for name in ("dq", "ddq", "dtheta", "ddtheta")}
    if held:
        for values in changed.values():
            values[late, ankle] = 0.0
    for name in ("ddq", "ddtheta"):
        changed[name][begin + 20 : begin + 24, ankle] += 30.0 * np.sign(speed[begin + 20])
    motions[2] = replace(motions[2], **changed)
    kept, _ = cleaned(replace(data, period_motions=tuple(motions)), counted)
    assert kept.periods == (8 if held else 7)
