"""Friction of motor and link, where springs are too stiff to tell one from the other."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from estimation.synthetic import record, truth_of
from sea_ident.effects import base_effects
from sea_ident.effects.link_friction import LinkFriction
from sea_ident.estimation import identify
from sea_ident.estimation.estimators.instrumental_variables import _estimate
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.motion import FourierSeries
from sea_ident.robot import load_robot

ARM = ("left_s0", "left_s1", "left_e0", "left_e1", "left_w0", "left_w1", "left_w2")
WRIST = ARM[4:]


@pytest.fixture(scope="module")
def arm():
    return load_robot("example:baxter_description/urdf/baxter.urdf", "baxter_sea", ARM)


@pytest.fixture(scope="module")
def recording(arm):
    series = FourierSeries(0.1, np.zeros(7), *(0.3 * np.random.default_rng(1).normal(size=(2, 7, 5))))
    return record(arm, truth_of(arm, series, 500), 10, torque_noise=0.05, encoder_noise=1e-5)


def identified(arm, recording, effects):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        model = identify(arm, recording, period=10.0, effects=effects)
    assert {str(w.message) for w in caught if w.category is SeaIdentWarning} >= set(model.warnings)
    return model


def test_motor_friction_alone_gives_every_stiffness_without_a_warning(arm, recording):
    model = identified(arm, recording, base_effects(arm))
    assert not any("friction" in text or "spring of" in text for text in model.warnings)
    for spring in model.springs:
        exact = arm.spring(spring.joint).stiffness
        assert abs(spring.stiffness - exact) < 4.0 * spring.stiffness_std
        assert spring.stiffness_std < 0.02 * exact


def test_friction_on_both_sides_of_stiff_springs_is_named_joint_by_joint(arm, recording):
    model = identified(arm, recording, (*base_effects(arm), *LinkFriction.instances(arm)))
    (friction,) = [text for text in model.warnings if "friction of motor and of link" in text]
    assert all(f"{joint} (coulomb" in friction for joint in WRIST)
    for spring in model.springs:
        exact = arm.spring(spring.joint).stiffness
        # wrong by far, but never more so than it says
        assert abs(spring.stiffness - exact) < 4.0 * spring.stiffness_std
        if spring.joint in WRIST:
            assert spring.verdict == "not_excited"
            assert any(f"spring of {spring.joint}: stiffness known to" in text for text in model.warnings)
    # the sums are as good as they are with one of them alone
    values, covariance = dict(zip(model.names, model.values, strict=True)), model.covariance
    for joint in ARM:
        names = f"{joint}.coulomb_friction", f"{joint}.link_friction_coulomb"
        rows = [model.names.index(name) for name in names]
        exact = arm.spring(joint).coulomb_friction
        assert values[names[0]] + values[names[1]] == pytest.approx(exact, rel=0.02)
        assert covariance[np.ix_(rows, rows)].sum() ** 0.5 < 0.01 * exact


def test_friction_on_both_sides_of_soft_springs_is_told_apart():
    leg = load_robot("exo_leg_link_friction")
    effects = (*base_effects(leg), *LinkFriction.instances(leg))
    series = FourierSeries(0.2, np.array([0.5, -0.3, 0.4]), *np.random.default_rng(3).normal(0.0, 0.4, (2, 3, 5)))
    truth = truth_of(leg, series, 1000, effects)
    model = identified(leg, record(leg, truth, 10, torque_noise=0.02, encoder_noise=1e-6), effects)
    assert not any("friction of motor and of link" in text for text in model.warnings)


def test_what_is_hardly_told_apart_still_has_a_covariance():
    """A product of matrices that are nearly singular leaves rounding only, and what is known of a sum is lost."""
    rng = np.random.default_rng(0)
    shared, own = rng.normal(size=(2, 400, 1))
    for apart in (1e-2, 1e-4, 1e-6):
        instruments = np.stack([shared, shared + apart * own], axis=2)
        variance = rng.uniform(0.5, 2.0, size=(400, 1))
        cross = np.einsum("knb,knc->bc", instruments, instruments)
        first = SimpleNamespace(
            variance=variance, weights=None, solution=SimpleNamespace(log_det=0.0), notes=(), warnings=()
        )
        found = _estimate(first, np.zeros(2), instruments, cross, None, "").covariance
        # in the coordinates of the two directions nothing is nearly singular
        plain = np.stack([shared, own], axis=2)
        gram = np.linalg.inv(np.einsum("knb,knc->bc", plain, plain))
        exact = gram @ np.einsum("knb,kn,knc->bc", plain, variance, plain) @ gram
        back = np.array([[1.0, -1.0 / apart], [0.0, 1.0 / apart]])
        std = np.sqrt(np.diag(back @ exact @ back.T))
        np.testing.assert_allclose(np.sqrt(np.diag(found)), std, rtol=1e-3)
        assert np.linalg.eigvalsh(found / np.outer(std, std))[0] > -1e-12
        assert np.ones(2) @ found @ np.ones(2) == pytest.approx(exact[0, 0], rel=1e-2)
