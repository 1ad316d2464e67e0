from dataclasses import replace

import numpy as np
import pytest

from estimation.synthetic import record
from sea_ident.effects import base_effects, make_effect
from sea_ident.estimation import identify, information_about, what_is_known
from sea_ident.exceptions import IdentificationError

pytestmark = pytest.mark.filterwarnings("ignore::sea_ident.exceptions.SeaIdentWarning")


@pytest.fixture(scope="module")
def noisy(leg, truth):
    effects = (*base_effects(leg), make_effect("torque_offset", "hip"), make_effect("torque_offset", "ankle"))
    return identify(leg, record(leg, truth, 10, torque_noise=1.0), effects=effects, period=10.0)


def test_parameters_that_are_zero_are_not_essential(noisy):
    known = what_is_known(noisy)
    assert "hip.torque_offset" in known.dropped or "ankle.torque_offset" in known.dropped
    assert known.p_value > 0.05
    for name in known.dropped:
        assert known.reduced.values[noisy.names.index(name)] == 0.0
    assert set(known.essential) | set(known.dropped) == set(noisy.names)
    # what is left is known at least as well
    kept = [noisy.names.index(name) for name in known.essential]
    assert np.all(known.reduced.std[kept] <= noisy.std[kept] * 1.0001)
    assert "essential" in known.summary()


def test_large_parameters_are_essential(noisy):
    known = what_is_known(noisy)
    assert {"thigh.mz*", "thigh.Iyy*", "hip.coulomb_friction"} <= set(known.essential)


def test_correlated_parameters_are_named(noisy):
    k, m = 0, 1
    covariance = noisy.model_covariance.copy()
    covariance[k, m] = covariance[m, k] = 0.99 * np.sqrt(covariance[k, k] * covariance[m, m])
    known = what_is_known(
        replace(noisy, model_covariance=covariance, uncertainty=replace(noisy.uncertainty, covariance=covariance))
    )
    assert (noisy.names[m], noisy.names[k]) in [pair[:2] for pair in known.correlated]


def test_information_for_the_next_excitation(leg, noisy):
    information = information_about(noisy)
    assert information.shape == (noisy.base.rank,) * 2
    assert np.linalg.eigvalsh(information)[0] > 0.0
    less = information_about(noisy, base_effects(leg))
    assert less.shape == (16, 16)
    np.testing.assert_allclose(np.sqrt(np.diag(np.linalg.inv(information))), noisy.std, rtol=1e-6)
    with pytest.raises(IdentificationError, match="has no base parameters"):
        information_about(noisy, (*base_effects(leg), make_effect("torque_offset", "knee")))
