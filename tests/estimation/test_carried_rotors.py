"""A link has room for the rotors that it carries, where its description has."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from sea_ident.effects import base_effects
from sea_ident.estimation import JointWLS, Pull, identify, physical_parameters
from sea_ident.estimation.physical import _Problem
from sea_ident.estimation.pseudo_inertia import pseudo_inertia
from sea_ident.motion import FourierSeries, Motion
from sea_ident.processing import from_states
from sea_ident.regressor import build_total, prior_parameters
from sea_ident.robot import robot_from_text

ROTOR = 2e-4
THICK, THIN = 0.004, 1.9e-4
"""Moment about the pan axis [kg m2] of a turntable that holds a rotor of `ROTOR` about a level axis, and of none."""


def text(izz):
    """A turntable that carries the motor of a tilting arm."""
    drive = (
        '<transmission name="{0}" type="sea_ident/SeriesElastic"><joint name="{0}"/><actuator name="{0} motor">'
        "<mechanicalReduction>80</mechanicalReduction><rotorInertia>{1}</rotorInertia>"
        "<viscousFriction>1</viscousFriction><coulombFriction>1</coulombFriction></actuator>"
        '<seriesElastic stiffness="500"/></transmission>'
    )
    return f"""<robot name="pan tilt"><link name="base"/>
      <link name="table"><inertial><origin xyz="0 0 0.05"/><mass value="3"/>
        <inertia ixx="0.01" iyy="0.01" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="arm"><inertial><origin xyz="0.02 0.01 0.2"/><mass value="2"/>
        <inertia ixx="0.02" iyy="0.02" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="pan" type="continuous"><parent link="base"/><child link="table"/><axis xyz="0 0 1"/></joint>
      <joint name="tilt" type="continuous"><parent link="table"/><child link="arm"/><axis xyz="0 1 0"/></joint>
      {drive.format("pan", 1e-4)}{drive.format("tilt", ROTOR)}</robot>"""


def model_with(izz, value):
    """A model whose base parameter of the moment of the table about the pan axis has a value [kg m2]."""
    robot = robot_from_text(text(izz), "pan_tilt.urdf")
    effects = base_effects(robot)
    parameters = np.nan_to_num(prior_parameters(robot, effects))
    rng = np.random.default_rng(0)
    links, springs = (FourierSeries(0.1, np.zeros(2), *(s * rng.normal(size=(2, 2, 5)))) for s in (0.4, 0.3))
    link, spring = links.sample(samples=400), springs.sample(samples=400)
    motion = Motion(link.time, link.q, link.dq, link.ddq, link.q + spring.q, link.dq + spring.dq, link.ddq + spring.ddq)
    torque = build_total(robot, effects, motion) @ parameters + 0.01 * rng.standard_normal((400, 2))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the springs of this motion follow no law
        model = identify(robot, from_states(robot, motion, torque), effects=effects, estimator=JointWLS())
    exact = model.base.project(parameters)
    values = exact.copy()
    row = next(k for k, name in enumerate(model.names) if name.startswith("table.Izz"))
    values[row] += value - izz
    return replace(model, values=values)


def room(found):
    """Least second moment that the rotor leaves the table, about its centre of mass [kg m2]."""
    values = np.array([found.named()[f"table.{key}"] for key in ("m", "mx", "my", "mz")])
    matrix = pseudo_inertia(found.values[:10])
    about_centre = matrix[:3, :3] - np.outer(values[1:], values[1:]) / values[0]
    about_centre[1, 1] -= 0.5 * found.named()["tilt.rotor_inertia"]
    return np.linalg.eigvalsh(about_centre)[0]


@pytest.mark.parametrize("pull", Pull)
def test_a_link_that_data_make_too_small_keeps_room_for_its_rotor(pull):
    found = physical_parameters(model_with(THICK, -0.05), pull=pull)
    assert not found.consistent
    assert room(found) > 0.0
    assert found.named()["tilt.rotor_inertia"] == pytest.approx(ROTOR, rel=0.1)


@pytest.mark.parametrize("pull", Pull)
def test_what_data_leave_free_makes_room_for_the_rotor_and_keeps_the_data(pull):
    model = model_with(THICK, 5e-4)
    found = physical_parameters(model, pull=pull)
    assert found.consistent
    np.testing.assert_allclose(found.base_values, model.values, rtol=1e-9, atol=1e-12)
    assert room(found) > 0.0


def test_a_link_without_room_in_its_description_is_left_as_the_data_have_it():
    model = model_with(THIN, THIN)
    found = physical_parameters(model)
    assert found.consistent
    np.testing.assert_allclose(found.base_values, model.values, rtol=1e-9, atol=1e-12)


def test_a_solver_that_ends_outside_of_real_bodies_is_not_followed(monkeypatch):
    drawn = _Problem.drawn

    def outside(problem, target, start, pull):
        values = drawn(problem, target, start, pull)
        values[4:10] -= 0.5 * np.array([1.0, 0.0, 1.0, 0.0, 0.0, 1.0])
        return values

    monkeypatch.setattr(_Problem, "drawn", outside)
    found = physical_parameters(model_with(THICK, THICK))
    assert found.pull is None
    for first in (0, 10):
        assert np.linalg.eigvalsh(pseudo_inertia(found.values[first : first + 10]))[0] > 0.0
