"""Periods with spikes, or with another motion, are told from those that differ at reversals."""

from dataclasses import replace

import numpy as np
import pytest
from estimation.synthetic import leg_series, record, truth_of

from sea_ident.discrepancy.measured.check import cleaned
from sea_ident.discrepancy.measured.data import period_data, wide_processing
from sea_ident.recordings import Recording

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
@pytest.mark.parametrize(
    ("column", "sensor"), [("q_knee", "link encoder of knee"), ("theta_ankle", "motor encoder of ankle")]
)
def test_a_spike_of_some_steps_is_one(counted, leg, column, sensor):
    values = counted.columns[column].copy()
    values[2340] += 30.0 * STEP
    kept, said = said_of(counted, leg, **{column: values})
    assert kept == [1, 2, 4, 5, 6, 7, 8]
    assert said == [
        f"changed: spikes in period(s) 3 of 8, far outside what the other periods show ({sensor}); these periods were "
        "left out. Check the wiring of the sensor"
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
        "counted: the motion stops or differs in 5 of 8 periods (1, 3, 5, 7, 8), where its position is away "
        "from that of the other periods for long: too many to leave out. Cut the recording to where the motion repeats "
        "itself"
    )


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


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_a_simulation_without_noise_has_no_spikes_in_its_last_digits(leg):
    """What settles shows in the first periods, a thousand times above what is left in the later ones."""
    fine = record(leg, truth_of(leg, leg_series(), samples=1000), 8, torque_noise=1e-9, encoder_noise=1e-12)
    fading = np.exp(-fine.time / 2.0)
    columns = {
        name: values + 1e-9 * fading * (np.arange(len(values)) % 97 == 0) if name.startswith("q_") else values
        for name, values in fine.columns.items()
    }
    columns["tau_motor_hip"] = columns["tau_motor_hip"] + 1e-5 * fading * (np.arange(len(fine.time)) % 89 == 0)
    recording = Recording(fine.time, columns, "fine")
    assert said_of(recording, leg) == ([1, 2, 3, 4, 5, 6, 7, 8], [])
    spiked = columns["tau_motor_knee"].copy()
    spiked[2340] += 1.0
    kept, said = said_of(recording, leg, tau_motor_knee=spiked)
    assert kept == [1, 2, 4, 5, 6, 7, 8]
    assert "(torque of knee)" in said[0]
