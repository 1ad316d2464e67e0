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
# # Find the missing effect
#
# A model can fit and still lack something. Here the leg's hip has a friction that the model does not know: it is larger
# at low speed than at high speed (the Stribeck effect). The recording is made with it, the model is identified without
# it, and `diagnose` has to find where model and data part, which effect it is, and how large. Whether it found the
# right one can be checked, since we hid it ourselves.

# %%
import os
import warnings

import matplotlib.pyplot as plt
import numpy as np

from sea_ident import design_excitation, diagnose, identify, load_robot, simulate, validate
from sea_ident.effects import make_effect
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.simulation import PlantedEffect

REDUCED = bool(os.environ.get("SEA_IDENT_REDUCED"))
PERIODS = 10 if REDUCED else 20
warnings.simplefilter("ignore", SeaIdentWarning)  # every warning is kept in its result, too

# %% [markdown]
# ## 1. The hidden effect
#
# On top of the Coulomb friction that every motor has,
#
# $$ \tau = c_s \operatorname{sgn}(\dot\theta)\, e^{-|\dot\theta / v_s|^a}, \qquad
#    c_s = 0.8\ \text{N m},\quad v_s = 0.08\ \text{rad/s},\quad a = 2 , $$
#
# acts at the motor of the hip. The whole torque of the hip goes up to some 30 N m, so this is a small matter.
#
# Two different motions are recorded. The second is kept back: what is found in the first must hold in the second.

# %%
robot = load_robot("exo_leg")
hidden = PlantedEffect(make_effect("stribeck_friction", "hip", speed=0.08, exponent=2.0), np.array([0.8]))
recordings = []
for seed, periods in ((0, PERIODS), (1, 6)):
    motion = design_excitation(robot, base_frequency=0.2, harmonics=6, starts=1 if REDUCED else 3, seed=seed)
    recordings.append(simulate(robot, motion, periods=periods, seed=seed, effects=[hidden]).recording)
recording, held_out = recordings

# %% [markdown]
# ## 2. A model that fits
#
# Nothing here looks wrong at first sight: the residual of the hip is about 2 % of its torque. But it is larger than the
# noise of the mean, which the scatter between the periods tells. A residual that repeats in every period is not noise.

# %%
model = identify(robot, recording, period=5.0)
print(model.summary())

# %% [markdown]
# ## 3. Where, what, and how much
#
# With the residual $r(k)$ of the mean over $P$ periods and the variance of a single period, $\sigma^2(k)$, noise alone
# gives
#
# $$ \sum_k \frac{r(k)^2}{\sigma^2(k)/P} \approx \text{number of samples} - \text{number of parameters} . $$
#
# What exceeds this is the *gap*. Link and motor rows are looked at separately: a cause at the motor shows in the motor
# equation alone, one in the spring shows in both with opposite signs. Then every effect of the library is tried at
# every joint. Each is judged by what it explains *beyond* what a refit of the other parameters would absorb, and the
# p-value allows for how many were tried. In the end the effect is tested, with its parameters as they are, on the
# motion that was kept back.

# %%
diagnosis = diagnose(model, recording, holdout=held_out, period=5.0)
print(diagnosis.summary())

# %%
truth = {"stribeck_friction": 0.8, "stribeck_friction_speed": 0.08, "stribeck_friction_exponent": 2.0}
for missing in diagnosis.missing:
    for parameter in missing.parameters:
        known = truth.get(parameter.name.split(".")[-1])
        text = "" if known is None else f", hidden: {known:g}"
        print(f"{parameter.name}: {parameter.value:.3f} +- {parameter.std:.3f} {parameter.unit}{text}")

# %% [markdown]
# ## 4. The gap before and after
#
# Above, the mean residual of the hip's motor equation over one period, before (the refitted model) and after (with the
# effect). Below, the same against the speed of the motor: the residual has the shape of the friction that was missing,
# and it is gone where the effect is added. The grey band is twice the noise.

# %%
waves = diagnosis.waveforms
row = waves.equations.index("hip motor")
time = waves.time - waves.time[0]
speed = waves.dtheta[:, robot.joint_names.index("hip")]
figure, (above, below) = plt.subplots(2, 1, figsize=(8.5, 6.5))
for axes, x in ((above, time), (below, speed)):
    axes.axhspan(-2 * waves.noise[row], 2 * waves.noise[row], color="0.92")
    style = "-" if axes is above else "."
    for label, values, color in (("before", waves.before, "tab:red"), ("after", waves.after, "tab:blue")):
        axes.plot(x, values[:, row], style, color=color, linewidth=0.8, markersize=3, label=label)
    axes.set_ylabel("residual, hip motor [N m]")
    axes.legend(frameon=False, ncols=2)
above.set_xlabel("time [s]")
below.set_xlabel("motor speed [rad/s]")
figure.tight_layout()

# %%
figure, panels = plt.subplots(1, 2, figsize=(8.5, 3), sharey=True)
place = np.arange(robot.n)
gaps = {"this recording": diagnosis.training, "held out": diagnosis.holdout}
for axes, (title, gap) in zip(panels, gaps.items(), strict=True):
    axes.bar(place - 0.2, [gap.before[joint] for joint in robot.joint_names], 0.4, color="tab:red", label="before")
    axes.bar(place + 0.2, [gap.after[joint] for joint in robot.joint_names], 0.4, color="tab:blue", label="after")
    axes.plot(place, [gap.noise[joint] for joint in robot.joint_names], "k_", markersize=30, label="noise")
    axes.set_xticks(place, robot.joint_names)
    axes.set_title(title)
panels[0].set_ylabel("gap [N m]")
panels[0].legend(frameon=False)
figure.tight_layout()

# %% [markdown]
# ## 5. The repaired model
#
# `diagnosis.model` is the model with the effect in it, a model like any other: it predicts, it can be saved and
# exported, and it can be diagnosed again. The second diagnosis should find nothing.

# %%
for label, candidate in (("without the effect", model), ("with it", diagnosis.model)):
    found = validate(candidate, held_out, period=5.0)
    print(f"held-out torque, hip: rms {found.rms[0]:.3f} N m {label} (noise {found.noise_std[0]:.3f} N m)")

again = diagnose(diagnosis.model, recording, holdout=held_out, period=5.0)
print(again.summary())
