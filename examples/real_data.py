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
# # Real data
#
# Three measured machines, none of them ours, and what the recordings do and do not say:
#
# 1. EMPS, a ball-screw axis with published parameters: the estimate can be compared,
# 2. the Quanser flexible link, two joints with elastic stages: the model visibly lacks something,
# 3. a HEBI X5 series-elastic module: its torque channel is computed from the deflection, so a spring fitted to it would
#    prove nothing.
#
# The recordings are not part of this project. They are looked for in the folder that the environment variable
# `SEA_IDENT_DATA` names, else in `../shared/data` beside the checkout. What is not there is skipped.

# %%
import os
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from sea_ident import identify, load_robot, process, read_recording, validate
from sea_ident.effects import make_effect
from sea_ident.estimation import identify_measured_springs
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning

warnings.simplefilter("ignore", SeaIdentWarning)  # every warning is kept in its result, too
here = Path(__file__).resolve().parent if "__file__" in globals() else Path.cwd()
DATA = Path(os.environ.get("SEA_IDENT_DATA", here / ".." / ".." / "shared" / "data"))


def find(name):
    """Path of a recording, None where it is absent."""
    path = DATA / name
    if not path.is_file():
        print(f"{name} is not on this machine: this part is skipped")
        return None
    return path


# %% [markdown]
# ## 1. EMPS
#
# The Electro-Mechanical Positioning System (Janot, Gautier, Brunot, 2019) is a carriage on a ball screw. Its model has
# four parameters,
#
# $$ M \ddot q + F_v \dot q + F_c \operatorname{sgn}(\dot q) + F_0 = \tau, $$
#
# and each is an effect. The sign is approximated by $\tanh(\dot q / v_\text{off})$, with a $v_\text{off}$ far below the
# speed of the axis (0.125 m/s).

# %%
path = find("emps/identification.csv")
if path:
    emps = load_robot("emps")
    effects = (
        make_effect("rigid_bodies"),
        make_effect("viscous_friction", "slider"),
        make_effect("coulomb_friction", "slider", smoothing=1e-3),
        make_effect("torque_offset", "slider"),
    )
    processed = process(read_recording(path), emps)
    print(processed.summary().replace(str(path), path.name))
    axis = identify(emps, processed, effects=effects)
    published = dict(zip(("M", "Fv", "Fc", "F0"), (95.1089, 203.5034, 20.3935, -3.1648), strict=True))
    lower, upper = axis.interval()
    print(f"\n{'':<4}{'published':>12}{'identified':>12}{'difference':>12}   95 % interval")
    for k, (name, value) in enumerate(published.items()):
        found = axis.values[k]
        off = 100 * (found / value - 1)
        print(f"{name:<4}{value:12.4f}{found:12.4f}{off:10.2f} %   {lower[k]:.3f} .. {upper[k]:.3f}")

# %% [markdown]
# The published values lie inside the intervals. Now a second recording, in which something pushes against the carriage
# now and then. Samples with a push, and shortly after one, are left out of the comparison: there the force of the drive
# is not all that acts.

# %%
path = find("emps/validation_pulses.csv")
if path:
    checked = validate(axis, read_recording(path))
    print(checked.summary().replace(str(path), path.name))
    time = checked.processed.motion.time
    measured = checked.processed.tau_motor[:, 0]
    figure, (force, rest) = plt.subplots(2, 1, figsize=(9, 5), sharex=True, height_ratios=(2, 1))
    force.plot(time, measured, color="0.6", linewidth=2.0, label="measured")
    force.plot(time, checked.predicted[:, 0], color="tab:blue", linewidth=0.9, label="predicted")
    difference = measured - checked.predicted[:, 0]
    rest.plot(time, np.where(checked.used, difference, np.nan), color="tab:blue", linewidth=0.7, label="compared")
    rest.plot(time, np.where(checked.used, np.nan, difference), color="tab:orange", linewidth=0.7, label="left out")
    force.set_ylabel("force [N]")
    rest.set(xlabel="time [s]", ylabel="difference [N]")
    for axes in (force, rest):
        axes.legend(frameon=False, ncols=2, fontsize=8)
    figure.tight_layout()

# %% [markdown]
# What is left is not noise: it peaks where the carriage turns round. A sign function is a crude model of friction near
# zero speed.
#
# ## 2. The flexible link
#
# A motor, an elastic stage, a second motor on it, and a second elastic stage; horizontal, so that no gravity acts. The
# deflection of both stages is measured by strain gauges. The reference is a square wave, two periods of which were
# recorded.

# %%
path = find("quanser_2dof_flexible_link/square_wave.csv")
if path:
    link = load_robot("quanser_2dof")
    model = identify(link, read_recording(path))
    print(model.summary().replace(str(path), path.name))

# %% [markdown]
# The warnings are the result here. The residual is several times the noise: the model lacks something. Inertias and a
# stiffness come out negative, which no machine has, and the intervals are wide: with two periods only, and a model that
# does not hold, they have to be. The maker's nominal stiffnesses are 39.96 and 6.858 N m/rad; these data neither
# confirm nor refute them in this way, and the verdict on both springs is that they are not excited enough.
#
# The figure shows where model and data part. Where the motors rest, they hold a torque that the model does not
# predict: the Coulomb term is smoothed to zero there, while real friction can hold any torque up to its bound. And the
# measured torque swings on while the beams ring. What the cause is, this recording cannot decide.

# %%
if path:
    for spring in model.springs:
        print(f"{spring.joint}: K1 {spring.stiffness:.2f} +- {spring.stiffness_std:.2f} N m/rad, {spring.verdict}")
    processed = process(read_recording(path), link, period=model.fit.period)
    time = processed.motion.time - processed.motion.time[0]
    predicted = model.predict(processed.motion)
    figure, panels = plt.subplots(2, 2, figsize=(10, 5), sharex=True)
    for i, joint in enumerate(link.joint_names):
        panels[0, i].plot(time, processed.motion.theta[:, i], label="motor")
        panels[0, i].plot(time, processed.motion.q[:, i], label="link", linewidth=0.9)
        panels[0, i].set(title=joint, ylabel="angle [rad]")
        panels[1, i].plot(time, processed.tau_motor[:, i], color="0.6", label="measured")
        panels[1, i].plot(time, predicted[:, i], linewidth=0.9, label="predicted")
        panels[1, i].set(xlabel="time [s]", ylabel="torque [N m]")
    for axes in panels.flat:
        axes.legend(frameon=False, fontsize=8)
    figure.tight_layout()

# %% [markdown]
# ## 3. A series-elastic module
#
# The log of a HEBI X5 holds current, both encoders and a torque. A current is not a torque, and the torque constant of
# this motor is not published. The library says so and does not guess:

# %%
path = find("hebi_x5/example_log.csv")
if path:
    module = load_robot("hebi_x5")
    recording = read_recording(path)
    try:
        identify(module, recording)
    except SeaIdentError as error:
        print(str(error).replace(str(path), path.name))

# %% [markdown]
# The torque channel is of no help: in these modules it is computed, as a constant (-40 N m/rad) times the deflection
# that the firmware sees. A regression of it on that deflection returns the constant with a perfect fit and proves
# nothing. When we rebuild the firmware's deflection from the channel, the library notices: the verdict is `circular`.

# %%
if path:
    columns = recording.columns
    rebuilt = columns["theta_output"] + columns["tau_spring_output"] / 40.0
    (spring,) = identify_measured_springs(module, recording.replace_columns({"q_output": rebuilt}))
    print(spring.summary())

# %% [markdown]
# The two encoders of the log itself have different zeros, so the offset between them is one more unknown, and they are
# too coarse to see the deflection well: more than half of the torque channel stays unexplained, and no stiffness should
# be read from this.

# %%
if path:
    (spring,) = identify_measured_springs(module, recording, unknown_zero=["output"])
    print(f"unexplained: {spring.rms_residual:.3f} of {spring.rms_torque:.3f} N m (rms)")
    deflection = recording.columns["theta_output"] - recording.columns["q_output"]
    figure, axes = plt.subplots(figsize=(6, 4))
    axes.plot(1e3 * (deflection - deflection.mean()), recording.columns["tau_spring_output"], ".", markersize=3)
    axes.set(xlabel="theta - q, less its mean [mrad]", ylabel="torque channel [N m]")
    figure.tight_layout()
