"""A drive that gives its torque later than the record says."""

import numpy as np

import sea_ident
from sea_ident.effects import make_effect
from sea_ident.motion import FourierSeries


def test_friction_jumps_in_the_record_before_the_motor_reverses():
    """The torque that is recorded at t acts at t + delay, so that of a reversal is recorded that much earlier."""
    delay, leg = 0.012, sea_ident.load_robot("exo_leg")
    rng = np.random.default_rng(8)
    motion = FourierSeries(0.2, np.zeros(leg.n), *rng.standard_normal((2, leg.n, 3))).sample(samples=4000)
    effect = make_effect("torque_delay", "knee", delay=delay)
    ((index, speed),) = effect.turning(motion, leg).items()
    assert leg.joint_names[index] == "knee"
    own, shown = (_crossings(motion.time, values) for values in (motion.dtheta[:, index], speed))
    later = own[own > delay]
    np.testing.assert_allclose(shown[: len(later)], later - delay, atol=1e-4)


def _crossings(time, values):
    """Where values pass zero [s]."""
    k = np.flatnonzero(np.sign(values[1:]) != np.sign(values[:-1]))
    return time[k] - values[k] * (time[k + 1] - time[k]) / (values[k + 1] - values[k])
