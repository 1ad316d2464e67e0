import numpy as np
import pinocchio as pin
import pytest

from sea_ident import SeaIdentError
from sea_ident.effects import base_effects, make_effect, spring_effects
from sea_ident.simulation import plant_from_model, plant_from_robot, simulate


def test_model_with_the_values_of_the_description_is_the_description(leg, leg_series, quiet, exact):
    effects = (*base_effects(leg), *spring_effects(leg))
    model = plant_from_model(leg, effects, plant_from_robot(leg).values_of(effects))
    assert model.effects == ()
    options = {**quiet, "friction": model.friction}
    run = simulate(leg, leg_series, periods=1, plant=model.plant, effects=model.effects, **options)
    np.testing.assert_allclose(run.motion.q, exact.motion.q[: len(run.motion)], atol=1e-10)
    np.testing.assert_allclose(
        run.recording.columns["current_hip"], exact.recording.columns["current_hip"][: len(run.motion)], atol=1e-9
    )


def test_a_body_of_less_than_no_mass_moves_as_one_whose_joint_holds_the_rest(leg, leg_series, quiet, exact):
    """An estimate may put mass on the axis of a joint into either body: shank and foot together have less than none."""
    effects = (*base_effects(leg), *spring_effects(leg))
    inertial = leg.inertial_parameters.reshape(-1, 10)
    knee = leg.extended_model.jointPlacements[int(leg.body_indices[1])].translation
    inertial[1, 0] -= 20.0
    inertial[0] += 20.0 * pin.Inertia(1.0, knee, np.zeros((3, 3))).toDynamicParameters()
    values = plant_from_robot(leg).values_of(effects)
    names = [column.name for effect in effects for column in effect.columns(leg)]
    values[[names.index(name) for name in leg.inertial_names]] = inertial.ravel()
    model = plant_from_model(leg, effects, values)
    run = simulate(leg, leg_series, periods=1, plant=model.plant, **{**quiet, "friction": model.friction})
    np.testing.assert_allclose(run.motion.q, exact.motion.q[: len(run.motion)], atol=1e-9)


def test_what_is_no_number_of_a_plant_is_planted(leg):
    extra = make_effect("torque_offset", "knee")
    effects = (*base_effects(leg), *spring_effects(leg), extra)
    values = np.append(plant_from_robot(leg).values_of(effects[:-1]), 0.4)
    model = plant_from_model(leg, effects, values)
    assert [p.effect for p in model.effects] == [extra]
    assert model.effects[0].values.tolist() == [0.4]
    assert [law.smoothing for law in model.friction] == [0.01] * 3


def test_model_without_springs_cannot_move_a_leg(leg):
    effects = base_effects(leg)
    with pytest.raises(SeaIdentError, match="'hip': the stiffness of its spring is 0"):
        plant_from_model(leg, effects, plant_from_robot(leg).values_of(effects))


def test_a_negative_rotor_inertia_is_refused(leg):
    effects = (*base_effects(leg), *spring_effects(leg))
    values = plant_from_robot(leg).values_of(effects)
    names = [column.name for effect in effects for column in effect.columns(leg)]
    values[names.index("motor.rotor_inertia")] = -1e-9
    with pytest.raises(SeaIdentError, match="the rotor of 'hip' the inertia -1e-09 kg m2"):
        plant_from_model(leg, effects, values)


def test_missing_values_are_named(leg):
    effects = (*base_effects(leg), *spring_effects(leg))
    values = plant_from_robot(leg).values_of(effects)
    values[-1] = np.nan
    with pytest.raises(SeaIdentError, match=r"no value for 'ankle\.spring_damping'"):
        plant_from_model(leg, effects, values)
    with pytest.raises(SeaIdentError, match="parameters"):
        plant_from_model(leg, effects, values[:-1])
