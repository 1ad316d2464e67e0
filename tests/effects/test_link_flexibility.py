"""A link that bends behind its encoder: the way back from what that shows, and the law of the spring beside it."""

from dataclasses import replace

import numpy as np
import pytest

import sea_ident
from sea_ident.effects import Anchor, make_effect
from sea_ident.effects.signal import below, rate_of
from sea_ident.exceptions import EffectError
from sea_ident.motion import FourierSeries
from sea_ident.simulation import PlantedEffect, simulate

COMPLIANCE = 0.0015
LAW = {"stiffness": 570.0, "cubic_stiffness": 15e3, "damping": 4.8}
PERIOD = 4.0


def bending(samples=400):
    """What the encoders of a leg show while its hip bends, and where the thigh is (N,), with its first two rates."""
    leg = sea_ident.load_robot("exo_leg")
    rng = np.random.default_rng(5)
    shown, bent = (
        FourierSeries(1.0 / PERIOD, rng.normal(0.0, size, 3), *rng.normal(0.0, size, (2, 3, 3))) for size in (0.1, 0.02)
    )
    time = np.arange(samples) * PERIOD / samples
    links, between = ([series.evaluate(time, k) for k in range(4)] for series in (shown, bent))
    theta, dtheta, ddtheta = (link + d for link, d in zip(links[:3], between[:3], strict=True))
    motion = replace(shown.motion(time), theta=theta, dtheta=dtheta, ddtheta=ddtheta)
    d, *rates = (each[:, 0] for each in between)
    torque = LAW["stiffness"] * d + LAW["cubic_stiffness"] * d**3 + LAW["damping"] * rates[0]
    slope = LAW["stiffness"] + 3.0 * LAW["cubic_stiffness"] * d**2
    torque_rate = slope * rates[0] + LAW["damping"] * rates[1]
    torque_bend = slope * rates[1] + 6.0 * LAW["cubic_stiffness"] * d * rates[0] ** 2 + LAW["damping"] * rates[2]
    bodies = [shown.evaluate(time, k)[:, 0] - COMPLIANCE * t for k, t in enumerate((torque, torque_rate, torque_bend))]
    return leg, motion, torque, bodies


def test_the_link_is_where_the_torque_of_the_spring_bends_it_to_its_damping_included():
    leg, motion, torque, bodies = bending()
    effect = make_effect("link_flexibility", "hip", compliance=COMPLIANCE, **LAW)
    found = effect.corrected(leg, motion)
    for name, right in zip(("q", "dq", "ddq"), bodies, strict=True):
        np.testing.assert_allclose(getattr(found, name)[:, 0], right, atol=1e-9 * np.abs(right).max())
    signals = {"q": found.q, "tau_spring": np.stack([torque, *np.zeros((2, len(torque)))], axis=1)}
    back = effect.measured(leg, motion.time, signals)
    np.testing.assert_allclose(back["q"][:, 0], motion.q[:, 0], atol=1e-12)


def test_the_law_of_the_spring_before_the_encoder_follows_from_that_of_the_whole():
    """However wrong it was while the whole was fitted: what it moved the bodies by is not left for the whole."""
    leg, motion, torque, _ = bending()
    wrong = {"stiffness": 560.0, "cubic_stiffness": -4e3, "damping": 1.0}
    effect = make_effect("link_flexibility", "hip", compliance=COMPLIANCE, **wrong)
    bodies = effect.corrected(leg, motion)
    w, rate = bodies.deflection[:, 0], bodies.deflection_rate[:, 0]
    whole = np.linalg.lstsq(np.stack([w, w**3, rate], axis=1), torque, rcond=None)[0]
    names = ("hip.spring_stiffness", "hip.spring_stiffening", "hip.spring_damping")
    found = effect.anchored(Anchor(leg, (effect,), dict(zip(names, map(float, whole), strict=True))))
    assert found.stiffness == pytest.approx(LAW["stiffness"], rel=0.01)
    assert found.cubic_stiffness == pytest.approx(LAW["cubic_stiffness"], rel=0.15)
    assert found.damping == pytest.approx(LAW["damping"], rel=0.05)
    # the bodies bend as far as before by the first of them
    assert found.compliance * found.stiffness == pytest.approx(COMPLIANCE * wrong["stiffness"], rel=1e-12)


def test_beyond_the_corner_of_the_spring_the_damping_bends_nothing():
    """Three derivatives of a position are noise there: what a fast deflection bends is that of the spring alone."""
    leg, motion, _, _ = bending()
    corner = LAW["stiffness"] / LAW["damping"] * PERIOD / (2.0 * np.pi)  # 75.6 harmonics
    with_damping = make_effect("link_flexibility", "hip", compliance=COMPLIANCE, **LAW)
    without = make_effect("link_flexibility", "hip", compliance=COMPLIANCE, **LAW | {"damping": 0.0})
    for harmonic, bends in ((75, True), (76, False)):
        assert (harmonic < corner) == bends
        rate = 2.0 * np.pi * harmonic / PERIOD
        wave = 1e-4 * np.stack([f(rate * motion.time) for f in (np.sin, np.cos, lambda x: -np.sin(x))])
        fast = [getattr(motion, name).copy() for name in ("theta", "dtheta", "ddtheta")]
        for k, each in enumerate(fast):
            each[:, 0] += rate**k * wave[k]
        shaken = replace(motion, theta=fast[0], dtheta=fast[1], ddtheta=fast[2])
        lag = [
            (with_damping.corrected(leg, each).ddq - without.corrected(leg, each).ddq)[:, 0]
            for each in (motion, shaken)
        ]
        expected = COMPLIANCE * LAW["damping"] * rate**3 * 1e-4 if bends else 0.0
        assert np.abs(lag[1] - lag[0]).max() == pytest.approx(expected, rel=1e-3, abs=1e-6)


def test_what_is_slower_than_a_corner_is_left_in_phase():
    """Of a period its harmonics, exactly; of any other signal what a filter without delay leaves."""
    time = np.arange(1000) * 0.005
    slow, fast = np.sin(2.0 * np.pi * 0.8 * time), 0.02 * np.sin(2.0 * np.pi * 40.0 * time)
    np.testing.assert_allclose(below(time, slow + fast, 2.0 * np.pi * 10.0), slow, atol=1e-12)
    begun = slice(0, 700)  # does not close
    both = (slow + fast)[begun]
    np.testing.assert_allclose(below(time[begun], both, 2.0 * np.pi * 10.0)[50:-50], slow[begun][50:-50], atol=5e-4)
    np.testing.assert_array_equal(below(time[begun], both, 1e9), both)


def test_rate_of_a_period_and_of_any_other_signal():
    time = np.arange(1000) * 0.005
    wave, rate = np.sin(2.0 * np.pi * 0.8 * time), 1.6 * np.pi * np.cos(2.0 * np.pi * 0.8 * time)
    np.testing.assert_allclose(rate_of(time, wave), rate, atol=1e-10)
    np.testing.assert_allclose(rate_of(time[:700], wave[:700]), rate[:700], atol=1e-4)


def test_a_description_gives_the_spring_of_the_whole():
    """The damping to first order: it bends the whole, of which the encoder shows the part before it."""
    leg, motion, _, _ = bending()
    spring, compliance = leg.spring("hip"), 5e-4
    w, rate = motion.deflection[:, 0], motion.deflection_rate[:, 0]
    lag = compliance * spring.damping * rate
    shown = motion.q.copy()
    shown[:, 0] += compliance * (spring.stiffness * w + spring.cubic_stiffness * w**3) + lag
    rates = [rate_of(motion.time, shown[:, 0])]
    rates.append(rate_of(motion.time, rates[0]))
    dq, ddq = motion.dq.copy(), motion.ddq.copy()
    dq[:, 0], ddq[:, 0] = rates
    seen = replace(motion, q=shown, dq=dq, ddq=ddq)
    found = make_effect("link_flexibility", "hip", compliance=compliance).corrected(leg, seen)
    for name, order in (("q", 0), ("dq", 1), ("ddq", 2)):
        bent = [lag, rate_of(motion.time, lag), rate_of(motion.time, rate_of(motion.time, lag))][order]
        wrong = getattr(found, name)[:, 0] - getattr(motion, name)[:, 0]
        assert np.std(wrong) < 0.1 * np.std(bent)


@pytest.mark.parametrize("samples", [1, 7, 15, 16])
def test_a_few_states_of_a_motion_are_enough_for_positions_and_velocities(samples):
    leg, motion, _, _ = bending()
    effect = make_effect("link_flexibility", "hip", compliance=COMPLIANCE, **LAW)
    few, whole = effect.corrected(leg, motion[:samples]), effect.corrected(leg, motion)
    assert np.all(np.isfinite(few.ddq))
    if samples < 16:
        np.testing.assert_allclose(few.q, whole.q[:samples], atol=1e-9)
        np.testing.assert_allclose(few.dq, whole.dq[:samples], atol=1e-9)


def test_no_more_bends_behind_the_encoder_than_in_all():
    """It is said before anything is simulated."""
    leg, nothing = sea_ident.load_robot("exo_leg"), np.zeros(0)
    whole = 1.0 / leg.spring("hip").stiffness
    assert make_effect("link_flexibility", "hip", compliance=0.99 * whole).modified(leg, nothing) is leg
    said = r"link_flexibility at hip: a compliance of 0\.00168 rad/\(N m\) .* more than the 0\.00167 rad/\(N m\) of all"
    too_soft = PlantedEffect(make_effect("link_flexibility", "hip", compliance=0.00168), nothing)
    told = []
    with pytest.raises(EffectError, match=said):
        simulate(
            leg, FourierSeries(0.5, np.zeros(3), *np.full((2, 3, 1), 0.1)), effects=[too_soft], progress=told.append
        )
    assert told == []
    # of a spring that was fitted nothing is said here
    assert make_effect("link_flexibility", "hip", compliance=0.00168, **LAW).modified(leg, nothing) is leg
