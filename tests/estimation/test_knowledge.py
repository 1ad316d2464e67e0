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
    together = np.zeros(len(covariance))
    together[[k, m]] = np.sqrt(covariance[[k, m], [k, m]])
    covariance += 99.0 * np.outer(together, together)
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
    stated = np.sqrt(np.diag(np.linalg.inv(information))) / noisy.std
    assert np.median(stated) == pytest.approx(1.0, abs=0.2)
    with pytest.raises(IdentificationError, match="has no base parameters"):
        information_about(noisy, (*base_effects(leg), make_effect("torque_offset", "knee")))


@pytest.mark.parametrize("freedom", [5, 9, 19, 200])
def test_the_spread_of_few_periods_has_no_false_sharp_directions(noisy, freedom):
    """Errors and spreads drawn from a known covariance: chi square per parameter is one on average, whatever the P."""
    rng = np.random.default_rng(0)
    # white noise, and noise that disturbs some combinations two and four times more than eq. 13 says
    for stretch in (1.0, 2.0, 4.0):
        root = np.linalg.cholesky(noisy.model_covariance).copy()
        root[:, -6:] *= stretch
        count, found = len(root), []
        for _ in range(100):
            spread = root @ rng.standard_normal((count, freedom))
            uncertainty = replace(noisy.uncertainty, covariance=spread @ spread.T / freedom, degrees_of_freedom=freedom)
            information = information_about(replace(noisy, uncertainty=uncertainty))
            error = root @ rng.standard_normal(count)
            found.append(error @ information @ error / count)
        assert 0.8 < np.mean(found) < 1.2
