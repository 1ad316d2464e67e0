"""A misfit that was put somewhere is found there, with its size."""

from dataclasses import replace

import numpy as np
import pytest

from sea_ident.discrepancy.bench.gap import excess_power, gap_of, noise_of_residual, per_joint
from sea_ident.discrepancy.bench.lack import lack_of_fit, remainder_share
from sea_ident.discrepancy.bench.settle import Settled
from sea_ident.discrepancy.conclude import _per_joint, _waveforms
from sea_ident.discrepancy.evidence.locate import locate, regimes
from sea_ident.discrepancy.measured.data import spectrum
from sea_ident.discrepancy.search.search import Selection

SIZE = 0.5
"""Of the misfit [N m]."""


def index(bench, joint, kind):
    (found,) = [k for k, e in enumerate(bench.data.equations) if (e.joint, str(e.kind)) == (joint, kind)]
    return found


def misfit(bench, now, parts, chosen=None):
    """The fit with a wave more in the residual of some equations: amplitude by joint and equation."""
    samples = bench.data.samples
    wave = SIZE * np.sqrt(2.0) * np.sin(2 * np.pi * 12 * np.arange(samples) / samples)
    if chosen is not None:
        wave = np.where(chosen, wave, 0.0)
    rows = np.zeros((samples, len(bench.data.equations)))
    for (joint, kind), amplitude in parts.items():
        rows[:, index(bench, joint, kind)] = amplitude * wave
    extra = spectrum(rows, bench.data.harmonics)
    whitened = now.fit.whitened + bench.whitening(now.noise).flat(extra * now.fit.scale)
    return replace(now.fit, residual=now.fit.residual + extra, whitened=whitened)


def test_nothing_missing_nowhere(nothing_missing):
    bench, now = nothing_missing
    # friction that differs from pass to pass stands out a little near reversals
    assert all(place.z < 40.0 for place in locate(bench, now.fit, now.noise))


def test_in_one_motor(nothing_missing):
    bench, now = nothing_missing
    places = locate(bench, misfit(bench, now, {("ankle", "motor"): 1.0}), now.noise)
    assert (places[0].joint, places[0].equation, places[0].regime) == ("ankle", "motor", "all")
    assert places[0].excess_rms == pytest.approx(SIZE, rel=0.1)
    assert {place.joint for place in places if place.z > 40.0} == {"ankle"}
    assert [p.z for p in places] == sorted((p.z for p in places), reverse=True)


def test_in_a_spring_where_both_equations_show_it_with_opposite_signs(nothing_missing):
    bench, now = nothing_missing
    places = locate(bench, misfit(bench, now, {("knee", "motor"): 1.0, ("knee", "link"): -1.0}), now.noise)
    assert (places[0].joint, places[0].equation) == ("knee", "spring")
    same = locate(bench, misfit(bench, now, {("knee", "motor"): 1.0, ("knee", "link"): 1.0}), now.noise)
    assert "spring" not in {place.equation for place in same}


@pytest.mark.parametrize("regime", ["high position", "forwards", "large deflection", "time 2.5 to 3.12 s"])
def test_in_a_part_of_the_motion(nothing_missing, regime):
    bench, now = nothing_missing
    chosen = regimes(bench, bench.robot.index("knee"))[regime]
    assert 0.02 < np.mean(chosen) < 0.7
    places = locate(bench, misfit(bench, now, {("knee", "motor"): 1.0}, chosen), now.noise)
    own = {p.regime: p for p in places if (p.joint, p.equation) == ("knee", "motor")}
    assert own[regime].excess_rms == pytest.approx(SIZE, rel=0.25)
    assert own[regime].excess_rms == pytest.approx(max(p.excess_rms for p in own.values()), rel=0.15)


def test_nothing_is_told_of_what_is_within_the_scatter_of_the_periods_there(nothing_missing, monkeypatch):
    """Torque at low speed that differs from pass to pass leaves a mean there; the same in every pass is told."""
    bench, now = nothing_missing
    knee, e = bench.robot.index("knee"), index(bench, "knee", "motor")
    assert locate(bench, now.fit, now.noise) == ()
    slow = np.flatnonzero(regimes(bench, knee)["slow"] & ~bench.data.left_out[:, e])
    wave = np.zeros((bench.data.periods, bench.data.samples, len(bench.data.equations)))
    phase = np.random.default_rng(5).standard_normal((bench.data.periods, 1))
    wave[:, slow, e] = SIZE * np.sqrt(2.0) * (1.0 + 2.0 * phase)
    extra = np.stack([spectrum(w, bench.data.harmonics) for w in wave])
    wrong = replace(now.fit, residual=now.fit.residual + extra.mean(axis=0))
    own = bench.period_steps(now.fit)

    def places(each):
        steps = np.diff(each, axis=0)[: len(own)] / np.sqrt(2.0)
        monkeypatch.setattr(bench, "period_steps", lambda fit: own + steps * fit.scale)
        return {(p.joint, p.equation, p.regime) for p in locate(bench, wrong, now.noise)}

    assert ("knee", "motor", "slow") in places(np.broadcast_to(extra.mean(axis=0), extra.shape))
    assert places(extra) == set()


def test_what_is_missing_is_told_where_it_is(rippled):
    bench, without, with_it = rippled
    before = locate(bench, without.fit, without.noise)
    assert {p.joint for p in before[:3]} == {"hip"}
    assert before[0].excess_rms == pytest.approx(np.hypot(1.0, 0.5) / np.sqrt(2.0), rel=0.5)
    assert not {p for p in locate(bench, with_it.fit, with_it.noise) if p.z > 10.0}


def test_regimes_say_what_they_are(nothing_missing):
    bench, _ = nothing_missing
    knee = bench.robot.index("knee")
    found, motion = regimes(bench, knee), bench.data.motion
    assert np.all(motion.dtheta[found["forwards"], knee] > 0.0)
    assert np.all(motion.dtheta[found["backwards"], knee] < 0.0)
    assert motion.q[found["low position"], knee].max() <= motion.q[found["middle position"], knee].min()
    assert motion.q[found["middle position"], knee].max() <= motion.q[found["high position"], knee].min()
    assert np.abs(motion.dtheta[found["slow"], knee]).max() < np.abs(motion.dtheta[found["fast"], knee]).min()
    for low, high in (("low load", "high load"), ("small deflection", "large deflection")):
        assert np.mean(found[low]) == pytest.approx(1 / 3, abs=0.02)
        assert not np.any(found[low] & found[high])
    assert sum(np.sum(v) for k, v in found.items() if k.startswith("time")) == len(motion)


# -- sizes


def test_excess_is_what_was_put_there(nothing_missing):
    bench, now = nothing_missing
    wrong = misfit(bench, now, {("ankle", "motor"): 1.0, ("knee", "link"): 0.5})
    power = np.sqrt(excess_power(bench, wrong, now.noise))
    assert power[index(bench, "ankle", "motor")] == pytest.approx(SIZE, rel=0.15)
    assert power[index(bench, "knee", "link")] == pytest.approx(0.5 * SIZE, rel=0.1)
    assert power[index(bench, "hip", "link")] < 0.1 * SIZE
    share = remainder_share(bench, Settled(wrong, now.noise))
    assert share == pytest.approx(np.max(power / bench.torque_rms))


def test_what_the_noise_of_a_deflection_hides_shows_in_the_sum(nothing_missing):
    bench, now = nothing_missing
    pair = np.zeros(len(bench.data.equations))
    pair[[index(bench, "ankle", "motor"), index(bench, "ankle", "link")]] = 1.0, -1.0
    covariance = now.noise.covariance + SIZE**2 / bench.data.harmonics * np.outer(pair, pair)
    noise = replace(now.noise, covariance=covariance)
    wrong = misfit(bench, now, {("ankle", "motor"): 0.2, ("ankle", "link"): 0.2})
    assert np.all(excess_power(bench, wrong, noise)[pair != 0.0] == 0.0)
    torque = bench.torque_rms[index(bench, "ankle", "motor")]
    assert remainder_share(bench, Settled(wrong, noise)) == pytest.approx(0.4 * SIZE / torque, rel=0.15)


def test_noise_follows_the_spring_that_the_residual_is_measured_by(nothing_missing, monkeypatch):
    """With a tenth of the stiffness both are a tenth at a link, and one beside the other is what it was."""
    bench, now = nothing_missing
    stiff = misfit(bench, now, {("knee", "link"): 0.1})
    softer = np.array([10.0 if e.kind == "link" else 1.0 for e in bench.data.equations])
    soft = replace(stiff, residual=stiff.residual / softer, scale=stiff.scale * softer)
    steps = bench.period_steps(now.fit)
    monkeypatch.setattr(bench, "period_steps", lambda fit: steps)
    np.testing.assert_allclose(
        excess_power(bench, soft, now.noise) * softer**2, excess_power(bench, stiff, now.noise), rtol=1e-9, atol=1e-12
    )
    assert gap_of(bench, soft, soft, now.noise).noise["knee"] < gap_of(bench, stiff, stiff, now.noise).noise["knee"]
    drawn = [
        _waveforms(bench, fit, fit, now.noise, Selection(Settled(fit, now.noise), Settled(fit, now.noise), 0, ()))
        for fit in (soft, stiff)
    ]
    np.testing.assert_allclose(drawn[0].noise * softer, drawn[1].noise)
    of_both = [_per_joint(bench, Settled(fit, now.noise))["knee"]["link"] for fit in (soft, stiff)]
    assert of_both[0] == pytest.approx(of_both[1])
    places = [[p for p in locate(bench, fit, now.noise) if p.joint == "knee"] for fit in (soft, stiff)]
    assert [(p.regime, pytest.approx(p.z)) for p in places[0]] == [(p.regime, p.z) for p in places[1]]
    assert places[0][0].excess_rms == pytest.approx(0.1 * places[1][0].excess_rms)


def test_gap_before_and_after(nothing_missing):
    bench, now = nothing_missing
    before, after = (misfit(bench, now, {("ankle", "motor"): a, ("ankle", "link"): a}) for a in (1.0, 0.25))
    gap = gap_of(bench, before, after, now.noise)
    # the powers of both equations add up
    assert gap.before["ankle"] == pytest.approx(np.sqrt(2.0) * SIZE, rel=0.15)
    assert gap.after["ankle"] == pytest.approx(0.25 * np.sqrt(2.0) * SIZE, rel=0.15)
    assert gap.shrink == pytest.approx(0.75, abs=0.07)
    noise = noise_of_residual(after, now.noise)
    assert gap.noise == per_joint(bench, noise**2)
    assert gap.noise["ankle"] == pytest.approx(
        np.hypot(noise[index(bench, "ankle", "motor")], noise[index(bench, "ankle", "link")])
    )


def test_lack_of_fit_grows_with_the_misfit(nothing_missing):
    bench, now = nothing_missing
    found = [
        lack_of_fit(bench, Settled(misfit(bench, now, {("ankle", "motor"): a}), now.noise)) for a in (0.0, 0.03, 0.3)
    ]
    assert found[0][2] > 1e-3
    assert found[2][2] < 1e-6
    assert found[0][2] >= found[1][2] >= found[2][2]
