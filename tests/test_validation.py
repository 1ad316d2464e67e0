import numpy as np
import pytest
from estimation.synthetic import leg_series, record, truth_of

from sea_ident.estimation import identify, read_model
from sea_ident.exceptions import ModelFileError
from sea_ident.robot import load_robot
from sea_ident.validation import validate


@pytest.fixture(scope="module")
def leg():
    return load_robot("exo_leg")


@pytest.fixture(scope="module")
def model(leg):
    return identify(leg, record(leg, truth_of(leg, leg_series()), 8, torque_noise=0.2, encoder_noise=1e-6), period=10.0)


def test_prediction_of_another_motion_is_as_good_as_its_noise(leg, model):
    other = truth_of(leg, leg_series(seed=11))
    found = validate(model, record(leg, other, 8, seed=1, torque_noise=0.2, encoder_noise=1e-6), period=10.0)
    np.testing.assert_allclose(found.rms, found.noise_std, rtol=0.15)
    np.testing.assert_allclose(found.noise_std, 0.2 / 8**0.5, rtol=0.05)


def test_a_saved_model_predicts_the_same(leg, model, tmp_path):
    model.save(tmp_path / "model.json")
    again = read_model(tmp_path / "model.json")
    motion = truth_of(leg, leg_series(seed=12)).motion
    np.testing.assert_array_equal(again.predict(motion), model.predict(motion))
    assert again.names == model.names
    assert again.springs == model.springs
    assert again.to_dict() == model.to_dict()


def test_damaged_model_file(model, tmp_path):
    path = tmp_path / "model.json"
    model.save(path)
    text = path.read_text()
    path.write_text(text[: len(text) // 2])
    with pytest.raises(ModelFileError, match="not JSON"):
        read_model(path)
    path.write_text(text.replace('"version": 1', '"version": 99'))
    with pytest.raises(ModelFileError, match="99"):
        read_model(path)
    path.write_text(text.replace('"covariance"', '"covarianze"'))
    with pytest.raises(ModelFileError, match="missing"):
        read_model(path)
