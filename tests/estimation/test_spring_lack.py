"""What would take most of what the law of a spring leaves is named, and how far off it puts the law is counted."""

import numpy as np
import pytest

from estimation.synthetic import leg_series, record
from sea_ident.effects import make_effect
from sea_ident.estimation import identify, read_model
from sea_ident.estimation.spring_lack import beside_the_law, spring_lack
from sea_ident.estimation.springs import spring_columns
from sea_ident.motion import Motion
from sea_ident.processing import process
from sea_ident.simulation import PlantedEffect, simulate

LAW = np.array([200.0, 4000.0, 0.5])


@pytest.fixture(scope="module")
def bent():
    """A joint whose spring is bent to one side, as gravity bends it."""
    period, samples = 2.0, 800
    w, t = 2.0 * np.pi / period, np.arange(samples) * period / samples
    q, dq = 0.5 * np.sin(w * t) + 0.2 * np.cos(2 * w * t), w * (0.5 * np.cos(w * t) - 0.4 * np.sin(2 * w * t))
    d = 0.02 + 0.03 * np.sin(w * t + 0.5) + 0.01 * np.cos(3 * w * t)
    dd = w * (0.03 * np.cos(w * t + 0.5) - 0.03 * np.sin(3 * w * t))
    zero = np.zeros((samples, 1))
    return Motion(t, q[:, None], dq[:, None], zero, (q + d)[:, None], (dq + dd)[:, None], zero)


def lack_of(motion, beyond):
    """The law that is fitted to a torque with something beyond it, and what is said to lack."""
    columns = spring_columns(motion, 0, 0.0)
    inverse = np.linalg.pinv(columns)
    tau = columns @ LAW + beyond
    values = inverse @ tau
    return values, spring_lack(values, tau - columns @ values, inverse, columns, beside_the_law(motion, 0, 0.0), 1e-6)


AMOUNTS = {
    "spring_offset": [0.8],
    "encoder_offset": [1.0, 200.0],
    "link_friction": [0.3, 0.5],
    "spring_hysteresis": [0.6, 0.4],
    "encoder_eccentricity": [1.0, -2.0],
}


@pytest.mark.parametrize("effect", sorted(AMOUNTS))
def test_an_effect_alone_is_named_and_the_law_beside_it_is_the_true_one(bent, effect):
    beyond = beside_the_law(bent, 0, 0.0)[effect] @ np.array(AMOUNTS[effect])
    values, found = lack_of(bent, beyond)
    lack, shift = found
    assert lack.effects == (effect,)
    assert lack.rms_residual == pytest.approx(0.0, abs=1e-9)
    assert np.abs(values - LAW).max() > 0.1
    np.testing.assert_allclose(values + shift, LAW, rtol=1e-6)
    assert lack.stiffness == pytest.approx(LAW[0], rel=1e-6)


def test_what_slides_has_no_eccentric_encoder(bent):
    assert beside_the_law(bent, 0, 0.0).keys() - beside_the_law(bent, 0, 0.0, "m").keys() == {"encoder_eccentricity"}


def test_two_effects_are_named_the_larger_first(bent):
    beside = beside_the_law(bent, 0, 0.0)
    beyond = 0.5 * beside["spring_offset"][:, 0] + beside["link_friction"] @ np.array([0.3, 0.8])
    values, (lack, shift) = lack_of(bent, beyond)
    assert lack.effects == ("link_friction", "spring_offset")
    np.testing.assert_allclose(values + shift, LAW, rtol=1e-6)


def test_what_is_left_is_not_explained_below_its_noise(bent):
    """A constant and noise: with the constant taken, nothing is looked for in the noise."""
    noise = 0.05 * np.random.default_rng(2).standard_normal(len(bent.time))
    columns = spring_columns(bent, 0, 0.0)
    inverse = np.linalg.pinv(columns)
    left = 0.8 + noise - columns @ (inverse @ (0.8 + noise))
    for told, most in ((0.05, 1), (1.0, 0)):
        found = spring_lack(LAW, left, inverse, columns, beside_the_law(bent, 0, 0.0), told)
        assert (0 if found is None else len(found[0].effects)) == most


def test_what_none_of_them_has_the_form_of_has_no_name(bent):
    wave = 0.5 * np.sin(2.0 * np.pi * 17.0 * bent.time / 2.0)
    assert lack_of(bent, wave)[1] is None


@pytest.mark.parametrize(("part", "told"), [(0.2, True), (0.02, False)])
def test_what_takes_a_tenth_of_what_is_left_is_named(bent, part, told):
    """Beside something that none of them has the form of."""
    columns = spring_columns(bent, 0, 0.0)
    inverse = np.linalg.pinv(columns)

    def beyond(torque):
        left = torque - columns @ (inverse @ torque)
        return left / np.linalg.norm(left)

    constant = {"spring_offset": np.ones((len(bent.time), 1))}
    own, other = beyond(constant["spring_offset"][:, 0]), beyond(np.sin(2.0 * np.pi * 17.0 * bent.time / 2.0))
    other = beyond(other - own * (own @ other))
    found = spring_lack(LAW, np.sqrt(part) * own + np.sqrt(1.0 - part) * other, inverse, columns, constant, 1e-6)
    assert (found is not None) is told


def test_what_would_make_the_stiffness_negative_explains_nothing(bent):
    beside = beside_the_law(bent, 0, 0.0)
    columns = spring_columns(bent, 0, 0.0)
    inverse = np.linalg.pinv(columns)
    left = 3.0 * (beside["spring_offset"][:, 0] - columns @ (inverse @ beside["spring_offset"][:, 0]))
    shift = -3.0 * float((inverse @ beside["spring_offset"])[0, 0])
    assert shift < 0.0
    offset = {"spring_offset": beside["spring_offset"]}
    for stiffness, told in ((-0.9 * shift, False), (-1.1 * shift, True)):
        values = np.array([stiffness, 0.0, 0.5])
        assert (spring_lack(values, left, inverse, columns, offset, 1e-6) is not None) is told


def test_what_the_law_has_already_is_none_of_it(bent):
    """What hardly lies beside the law would explain anything by an amount without end."""
    columns, wave = spring_columns(bent, 0, 0.0), np.sin(2.0 * np.pi * 17.0 * bent.time / 2.0)
    inverse = np.linalg.pinv(columns)
    left = wave - columns @ (inverse @ wave)
    for share, told in ((1e-4, False), (1e-2, True)):
        again = columns[:, :1] / np.linalg.norm(columns[:, 0]) - share * left[:, None] / np.linalg.norm(left)
        assert (spring_lack(LAW, left, inverse, columns, {"again": again}, 1e-6) is not None) is told


@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
@pytest.mark.parametrize("joint", ["hip", "knee", "ankle"])
@pytest.mark.parametrize("zero", [0.005, -0.02, 0.05])
def test_zeros_apart_no_longer_make_a_wrong_stiffness_sure(leg, truth, joint, zero):
    recording = record(leg, truth, 8, torque_noise=0.2, encoder_noise=1e-5)
    moved = recording.replace_columns({f"theta_{joint}": recording.columns[f"theta_{joint}"] + zero})
    spring = next(each for each in identify(leg, moved, period=10.0).springs if each.joint == joint)
    assert abs(spring.stiffness - leg.spring(joint).stiffness) < 2.0 * spring.stiffness_std
    # by what was said before it was at more than that
    assert spring.lack is not None
    assert spring.stiffness_noise_std < 0.1 * spring.stiffness_std
    supported = abs(spring.cubic_stiffness) > 2.0 * spring.cubic_stiffness_std
    doubted = spring.note.endswith("which may be what its law lacks")
    assert doubted is (spring.verdict == "stiffening" and not supported)


@pytest.mark.scenario
@pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")
def test_a_constant_torque_in_a_motor_no_longer_makes_a_wrong_stiffness_sure(leg, tmp_path):
    planted = PlantedEffect(make_effect("torque_offset", "hip"), np.array([6.0]))
    recording = simulate(leg, leg_series(), periods=6, seed=3, effects=(planted,)).recording
    model = identify(leg, process(recording, leg, period=leg_series().period))
    hip = next(spring for spring in model.springs if spring.joint == "hip")
    true = leg.spring("hip")
    assert hip.lack is not None
    assert hip.lack.stiffness == pytest.approx(true.stiffness, rel=0.05)
    assert hip.lack.rms_residual < 0.1 * hip.rms_residual
    errors = np.array([hip.stiffness - true.stiffness, hip.cubic_stiffness - true.cubic_stiffness])
    stds = np.array([hip.stiffness_std, hip.cubic_stiffness_std])
    assert abs(errors[0]) > 0.05 * true.stiffness
    assert np.all(np.abs(errors) < 2.0 * stds)
    (said,) = [text for text in model.warnings if "its law leaves" in text and "Beside" in text]
    assert f"of the form of {' and '.join(hip.lack.effects)} it would leave {hip.lack.rms_residual:.3g}" in said
    assert f"stiffness be {hip.lack.stiffness:.4g} instead of {hip.stiffness:.4g}" in said
    model.save(tmp_path / "m.json")
    again = next(spring for spring in read_model(tmp_path / "m.json").springs if spring.joint == "hip")
    assert again.lack == hip.lack
