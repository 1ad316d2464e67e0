# ---
# jupyter:
#   jupytext:
#     formats: py:percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # From the plane to 3-D
#
# The paper's model is planar: all joint axes parallel, every motor parallel to its joint. Then the coupling `S` between
# motors and links is constant and rotors add no velocity terms. Here every rotor is a body of its own on the link that
# carries it, so `S(q)`, `B(q)`, `C1` and `C2` come out right for any axes.
#
# 1. the same leg in the plane and with hip abduction added,
# 2. Baxter's seven-joint arm: excite, simulate, identify, springs, validate,
# 3. the same arm with rotors askew (bevel and hypoid gears), and what the planar simplification costs there.

# %%
import os
import warnings
from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np

from sea_ident import design_excitation, find_base_parameters, identify, load_robot, simulate, validate
from sea_ident.effects import Column, Contribution, Effect, Side, base_effects
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.regressor import build_total
from sea_ident.simulation import FrictionJitter, SmoothCoulomb, plant_from_robot

REDUCED = bool(os.environ.get("SEA_IDENT_REDUCED"))
PERIODS = 2 if REDUCED else 10

# %% [markdown]
# ## 1. The leg, planar and with abduction
#
# The planar leg shows 9 combinations of its 30 inertial parameters, one rotor inertia (the three motors are identical)
# and six friction parameters: the paper's 16. One more joint across the others makes almost everything visible.

# %%
planar, abduction = load_robot("exo_leg"), load_robot("exo_leg_abduction")
for robot in (planar, abduction):
    base = find_base_parameters(robot, base_effects(robot))
    bodies = sum(base.columns[k].effect == "rigid_bodies" for k in base.independent)
    print(f"{robot.name}: {robot.n} joints, {base.rank} base parameters, {bodies} of them of the links")
print(find_base_parameters(planar, base_effects(planar)).summary())

# %% [markdown]
# The coupling says the same. In the plane it is constant and strictly lower triangular, `N_i I` below the diagonal, and
# turning rotors add no velocity terms. The leg with abduction has the motors of knee and ankle along their links, with
# bevel gears: their coupling with the hip changes with the pose, and `C1`, `C2` do not vanish.

# %%
np.set_printoptions(precision=5, suppress=True)
rng = np.random.default_rng(0)
for robot in (planar, abduction):
    one, other = (robot.coupling(q) for q in rng.uniform(-1.0, 1.0, (2, robot.n)))
    c1, c2 = robot.gyroscopic_terms(*rng.uniform(-1.0, 1.0, (3, robot.n)))
    print(f"{robot.name}: coupling S [kg m2] in one pose; largest change to another: {np.abs(one - other).max():.5f}")
    print(one)
    print(f"C1 q' = {c1} N m, C2 q' = {c2} N m at speeds of about 1 rad/s\n")

# %% [markdown]
# ## 2. Baxter's arm
#
# The URDF is not ours and stays untouched; an annotation fragment adds motors and springs. The other joints are locked.
# Friction of the links is left out of the simulated arm: with springs this stiff it can hardly be told from that of the
# motors.

# %%
BAXTER = "example:baxter_description/urdf/baxter.urdf"
ARM = [f"left_{joint}" for joint in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")]
FREQUENCY, RATE = 0.2, 50.0


def experiment(annotation):
    """The robot, an exciting recording, and one of another trajectory."""
    robot = load_robot(BAXTER, annotation, ARM)
    plant = plant_from_robot(robot).replace(link_viscous_friction=np.zeros(robot.n))
    simulations = []
    for seed, periods, starts in ((0, PERIODS, 1 if REDUCED else 3), (1, 3, 1)):
        excitation = design_excitation(
            robot, base_frequency=FREQUENCY, harmonics=4 if REDUCED else 5, starts=starts, seed=seed, rate=RATE
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeaIdentWarning)
            simulations.append(simulate(robot, excitation, periods=periods, seed=seed, plant=plant))
        print(f"{annotation}: log det {excitation.log_det:.1f}, condition number {excitation.condition_number:.1f}")
    return robot, *simulations


robot, exciting, other = experiment("baxter_sea")
model = identify(robot, exciting.recording, period=1.0 / FREQUENCY)
validation = validate(model, other.recording, period=1.0 / FREQUENCY)
print(validation.summary())

# %%
print(f"{'joint':<10}{'K1 identified':>20}{'true':>8}{'D identified':>20}{'true':>8}")
for spring in model.springs:
    truth = robot.spring(spring.joint)
    print(
        f"{spring.joint:<10}{spring.linear_stiffness:>12.1f} +- {spring.stiffness_std:4.1f}{truth.stiffness:>8.0f}"
        f"{spring.linear_damping:>12.2f} +- {spring.damping_std:4.2f}{truth.damping:>8.2f}"
    )

# %% [markdown]
# ## 3. Rotors askew
#
# In this made-up variant every motor stands at 45 or 90 degrees to its joint, one of them two links back, and the gears
# are 10:1, so that the coupling shows. The simplification that is exact in the plane becomes an effect of its own:
# coupling frozen in one pose, no velocity terms. It takes the place of the exact rotor inertia in the model.


# %%
@dataclass(frozen=True)
class FrozenCoupling(Effect):
    """Rotors with a coupling that does not depend on the pose, and without C1 and C2."""

    name: ClassVar[str] = "frozen_coupling"
    side: ClassVar[Side] = Side.BOTH
    source: ClassVar[str] = "Vantilt et al., ICRA 2015, eqs. 1-5, for planar robots"

    def columns(self, robot):
        return tuple(Column(name, "kg m2", self.name, None, self.side, True) for name in robot.rotor_groups)

    def evaluate(self, state):
        robot, motion = state.robot, state.motion
        link, motor = np.zeros((2, len(motion), robot.n, len(robot.rotor_groups)))
        for k, group in enumerate(robot.rotor_groups):
            unit = np.array([float(f"{rotor.rotor_group}.rotor_inertia" == group) for rotor in robot.rotors])
            alone = robot.with_inertial_parameters(robot.inertial_parameters, unit)
            coupling, inertia = alone.coupling(np.zeros(robot.n)), alone.motor_inertia(np.zeros(robot.n))
            link[:, :, k] = motion.ddtheta @ coupling
            motor[:, :, k] = motion.ddq @ coupling.T + motion.ddtheta @ inertia.T
        return Contribution(link, motor)


tilted, exciting, other = experiment("baxter_tilted")
exact = base_effects(tilted)
simplified = tuple(FrozenCoupling() if effect.name == "rotor_inertia" else effect for effect in exact)
candidates = {"exact": exact, "planar": simplified}
truth = {f"{rotor.rotor_group}.rotor_inertia": rotor.rotor_inertia for rotor in tilted.rotors}

# %% [markdown]
# First without noise, by least squares on the exact states and torques of a simulation whose friction is that of the
# model: neither varying from pass to pass nor different near zero speed. What error is left is that of the coupling.

# %%
with warnings.catch_warnings():
    warnings.simplefilter("ignore", SeaIdentWarning)
    clean = simulate(
        tilted,
        exciting.reference,
        seed=0,
        plant=exciting.plant,
        jitter=FrictionJitter.none(),
        friction=SmoothCoulomb(smoothing=0.01),
        rate=RATE,
    )

print(f"{'':<8}" + "".join(f"{name:>24}" for name in truth) + f"{'torque error':>20}")
for label, effects in candidates.items():
    base = find_base_parameters(tilted, effects)
    rows = build_total(tilted, effects, clean.motion, columns=base.independent).reshape(-1, base.rank)
    torque = clean.tau_motor.ravel()
    values = np.linalg.lstsq(rows, torque, rcond=None)[0]
    error = np.sqrt(np.mean((rows @ values - torque) ** 2))
    found = dict(zip(base.names, values, strict=True))
    cells = [f"{100 * (found[name] / value - 1):+.4f} %" for name, value in truth.items()]
    print(f"{label:<8}" + "".join(f"{cell:>24}" for cell in cells) + f"{error:>16.2e} N m")

# %% [markdown]
# Then as it would be measured. The planar model's inertia of the small rotors is off by about three of the standard
# deviations that it claims, by more with more periods, and it predicts the torque of another trajectory worse.

# %%
models, errors = {}, {}
for label, effects in candidates.items():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)
        models[label] = identify(tilted, exciting.recording, effects=effects, period=1.0 / FREQUENCY)
        errors[label] = validate(models[label], other.recording, period=1.0 / FREQUENCY)

print(f"{'':<8}" + "".join(f"{name:>38}" for name in truth))
print(f"{'true':<8}" + "".join(f"{value:>38.6f}" for value in truth.values()))
for label, model in models.items():
    values = {p.name: p for p in model.parameters if p.name in truth}
    cells = [f"{p.value:.6f} +- {p.std:.6f} ({100 * (p.value / truth[n] - 1):+.1f} %)" for n, p in values.items()]
    print(f"{label:<8}" + "".join(f"{cell:>38}" for cell in cells))

# %%
print(f"torque error [N m]\n{'joint':<10}{'noise':>10}{'exact':>10}{'planar':>10}")
for i, joint in enumerate(tilted.joint_names):
    print(
        f"{joint:<10}{errors['exact'].noise_std[i]:>10.4f}{errors['exact'].rms[i]:>10.4f}{errors['planar'].rms[i]:>10.4f}"
    )

figure, axes = plt.subplots(figsize=(7, 3))
place = np.arange(tilted.n)
for k, (label, error) in enumerate(errors.items()):
    axes.bar(place + 0.35 * k, error.rms / error.noise_std, 0.35, label=label)
axes.axhline(1.0, color="black", linewidth=0.8)
axes.set_xticks(place + 0.175, tilted.joint_names)
axes.set_ylabel("torque error / noise")
axes.legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
figure.tight_layout()
figure.savefig("planar_to_3d.png", dpi=120)
