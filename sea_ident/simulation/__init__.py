"""Closed-loop forward dynamics of the elastic robot, and what its sensors see."""

from sea_ident.simulation.controller import ComputedTorque, Controller, Drive, VelocityController
from sea_ident.simulation.experiment import Settling, simulate
from sea_ident.simulation.friction import FrictionJitter, FrictionLaw, PreslidingCoulomb, SmoothCoulomb
from sea_ident.simulation.model_plant import ModelPlant, plant_from_identified, plant_from_model
from sea_ident.simulation.plant import Plant, PlantedEffect, plant_from_robot
from sea_ident.simulation.result import Simulation
from sea_ident.simulation.sensors import SensorNoise, WarmUp, motor_current

__all__ = [
    "ComputedTorque",
    "Controller",
    "Drive",
    "FrictionJitter",
    "FrictionLaw",
    "ModelPlant",
    "Plant",
    "PlantedEffect",
    "PreslidingCoulomb",
    "SensorNoise",
    "Settling",
    "Simulation",
    "SmoothCoulomb",
    "VelocityController",
    "WarmUp",
    "motor_current",
    "plant_from_identified",
    "plant_from_model",
    "plant_from_robot",
    "simulate",
]
