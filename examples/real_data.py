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
# 1. EMPS, a ball-screw axis with published parameters: estimate and diagnosis can be compared with what is known,
# 2. the Quanser flexible link, two joints with elastic stages: the maker's model is wrong, and the data do not say why,
# 3. a HEBI X5 series-elastic module: its torque channel is computed from the deflection, so a spring fitted to it would
#    prove nothing.
#
# The lesson of all three is the same: a name is worth as much as the experiment behind it. None of these recordings was
# made for a diagnosis, so we will also see what is *not* said.
#
# The recordings are not part of this project. They are looked for in the folder that the environment variable
# `SEA_IDENT_DATA` names, else in `../shared/data` beside the checkout. What is not there is skipped.

# %%
import os
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from sea_ident import close_gap, diagnose, identify, load_robot, process, read_recording, validate
from sea_ident.discrepancy.measured.circular import circular_springs
from sea_ident.effects import State, make_effect
from sea_ident.estimation import identify_measured_springs
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.processing import filter_recording

warnings.simplefilter("ignore", SeaIdentWarning)  # every warning is kept in its result, too
here = Path(__file__).resolve().parent if "__file__" in globals() else Path.cwd()
DATA = Path(os.environ.get("SEA_IDENT_DATA", here / ".." / ".." / "shared" / "data"))


told = set()


def find(name):
    """Path of a recording, None where it is absent."""
    path = DATA / name
    if not path.is_file():
        if name not in told:
            print(f"{name} is not on this machine: this part is skipped")
        told.add(name)
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
# ### Would the software have found this model by itself?
#
# Suppose we did not know the four parameters and started from a mass and viscous friction only. `close_gap` diagnoses,
# adds what is missing, and diagnoses again. A model without the friction that every drive has is completed first: any
# finer form of friction (Stribeck, a power law, presliding) holds Coulomb friction as a limit, and would stand in for
# it.

# %%
path = find("emps/identification.csv")
if path:
    first_guess = identify(emps, recorded := read_recording(path), effects=effects[:2])
    closed = close_gap(first_guess, recorded)
    for number, found in enumerate(closed.rounds, 1):
        print(f"round {number}: {found.verdict}\n  {found.text}")
        for m in found.missing:
            print(
                f"    {m.effect}: " + ", ".join(f"{p.name} {p.value:.4g} +- {p.std:.2g} {p.unit}" for p in m.parameters)
            )
    print("\nto know before trusting this:")
    for text in closed.warnings:
        print(f"  - {text.replace(str(path), path.name)}")
    residual = {
        label: m.fit.rms_residual[0]
        for label, m in (("start", first_guess), ("closed", closed.model), ("published form", axis))
    }
    print("\nresidual [N]: " + ", ".join(f"{label} {value:.3f}" for label, value in residual.items()))
    names = dict(zip(closed.model.names, closed.model.values, strict=True))
    print("values: " + ", ".join(f"{name} {value:.3f}" for name, value in names.items()))

# %% [markdown]
# Three things to take from this.
#
# - The two terms that were left out are named, and the repaired model is the one we identified above: the residual is
#   the same to a fifth of a percent, the values are well within their intervals. But note the small print: on a
#   horizontal axis a constant force is the same column as a tilt of the base (0.2 degrees would do). The data cannot
#   choose, so the software says so instead of choosing.
# - Beyond the published model something is still missing: the scatter between the three periods is some 0.1 N, and the
#   model leaves more than ten times as much. A published reference model is not a perfect one. The second round says
#   how much is left, 3 % of the force, and no more: from three periods it cannot be told how they scatter along what a
#   finer effect does, so none is looked for. Nothing is added, and the history stops here.
# - Three periods are few. Each verdict says so.
#
# ### Who pushed the carriage?
#
# Back to the recording with the pulses. They come every half second, the motion repeats itself every 6.24 s, so no two
# periods are alike and a mean over them would smear every pulse. The diagnosis notices: friction at reversals comes
# again in every pass, a push does not. It leaves the mean alone and looks at the whole stretch. It is not told the
# column with the truth (a test takes the column out, and the times found are the same).

# %%
path = find("emps/validation_pulses.csv")
if path:
    pulses = read_recording(path)
    pushed = diagnose(axis, pulses)
    print(f"{pushed.verdict}: {pushed.text}")
    signal = pulses.columns["external_force_slider"]
    truth = pulses.time[1:][np.diff(signal) != 0.0]
    begins = np.array([float(x.regime.split()[2]) for x in pushed.locations if x.regime.startswith("push")])
    apart = np.abs(begins[:, None] - truth)
    print(f"\nedges of the pulse signal: {len(truth)}; found within 10 ms: {np.sum(apart.min(axis=0) < 0.01)}")
    late = 1e3 * np.median(begins - truth[apart.argmin(axis=1)])
    print(f"pushes without an edge: {np.sum(apart.min(axis=1) > 0.01)}; begin against the edge: {late:.0f} ms (median)")
    figure, axes = plt.subplots(figsize=(9, 2.6))
    axes.plot(time, difference, color="0.6", linewidth=0.6, label="measured less predicted")
    for k, x in enumerate(pushed.locations):
        _, _, begin, _, end, _ = x.regime.split()
        axes.axvspan(
            float(begin), float(end), color="tab:orange", alpha=0.5, label="named external_force" if k == 0 else None
        )
    axes.set(xlabel="time [s]", ylabel="difference [N]", xlim=(0.0, 6.5), ylim=(-60, 60))
    axes.legend(frameon=False, ncols=2, fontsize=8)
    figure.tight_layout()

# %% [markdown]
# All are found and nothing else is. They begin a few milliseconds early, for a push is looked for in means over 5 ms.
# The signal is a square wave that changes every 0.5 s, but what reaches the carriage is a kick of some 50 ms at each
# of its edges: that is what the data show, and what is named.
#
# The name is right, the words are weak on purpose: "hints and not names". Without a mean over periods the software has
# no noise floor, so it never says `none` or `named` here; slow noise and a missing effect look the same.
#
# How much does one pass tell? We cut the first 11 s out of the recording without pulses and start again from mass and
# viscous friction. What is told now rests on cross-validation: twelve blocks of the recording, each predicted from the
# others, with and without the effect.

# %%
path = find("emps/identification.csv")
if path:
    once = diagnose(first_guess, read_recording(path).crop(0.0, 11.0))
    print(f"{once.verdict}: {once.text}")

# %% [markdown]
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
# ### Where is the maker's model wrong?
#
# Start from the nominal values instead, and look at each equation by itself. The link equation of a stage says that its
# spring turns its inertia, $0 = Y \pi_\text{nominal} - K d - D \dot d$: no motor, no friction, no current in it. The
# inertia is held at the maker's value and $K$ and $D$ are fitted. In the motor equation everything is nominal.

# %%
if path:
    stretch = filter_recording(read_recording(path), link, cutoff=15.0)
    motion, state = stretch.motion, State(link, stretch.motion)
    bodies = make_effect("rigid_bodies")
    inertia = bodies.evaluate(state).link @ bodies.prior(link)
    rotor = make_effect("rotor_inertia")
    rotors = rotor.evaluate(state)
    inertia += rotors.link @ rotor.prior(link)
    print("link equation, inertia as the maker says:")
    for i, joint in enumerate(link.joint_names):
        columns = np.column_stack([motion.deflection[:, i], motion.deflection_rate[:, i], np.ones(stretch.samples)])
        (k, d, _), *_ = np.linalg.lstsq(columns, inertia[:, i], rcond=None)
        left = inertia[:, i] - columns @ np.linalg.lstsq(columns, inertia[:, i], rcond=None)[0]
        nominal = link.spring(joint).stiffness
        print(
            f"  {joint}: K {k:.2f} N m/rad, the maker says {nominal:.2f} ({nominal / k:.2f} times); "
            f"D {d:.3f} N m s/rad; unexplained {100 * left.var() / inertia[:, i].var():.0f} % of the power"
        )
    print("motor equation, everything as the maker says:")
    for i, joint in enumerate(link.joint_names):
        viscous = make_effect("viscous_friction", joint).prior(link)[0]
        torque = stretch.tau_motor[:, i]
        nominal = (rotors.motor @ rotor.prior(link))[:, i] + viscous * motion.dtheta[:, i]
        nominal = nominal + link.spring(joint).stiffness * motion.deflection[:, i]
        moving = np.abs(motion.dtheta[:, i]) > 0.02
        columns = np.column_stack(
            [
                motion.ddtheta[:, i],
                motion.deflection[:, i],
                motion.dtheta[:, i],
                np.sign(motion.dtheta[:, i]),
                np.ones(len(torque)),
            ]
        )
        b, c = np.linalg.lstsq(columns[moving], torque[moving], rcond=None)[0][2:4]
        print(
            f"  {joint}: torque {torque.std():.3f} N m (rms), nominal model leaves {np.std(torque - nominal):.3f}; "
            f"viscous friction {viscous:.1f} by the maker, {b:.2f} beside a Coulomb friction of {c:.2f} N m here"
        )

# %% [markdown]
# So the maker's model is off in two ways that can be located:
#
# - In the link equations both springs are too stiff for the inertias, by a factor of 1.6 and 2.8. This does not depend
#   on friction or current, and hardly on the filter (8 to 80 Hz). But a link equation has nothing on its right-hand
#   side: only the ratio of stiffness and inertia is seen. A softer spring, a larger inertia and a strain gauge whose
#   scale is off are the *same* column. No recording of free motion can choose; a known mass on the end or a push with a
#   force gauge can.
# - In the motor equations viscous friction stands in for Coulomb friction. At stage 2 the nominal viscous torque alone
#   is several times the torque that was measured.
#
# What does the diagnosis name?

# %%
if path:
    found = diagnose(model, read_recording(path))
    print(f"{found.verdict}: {found.text}")
    for x in found.locations[:6]:
        print(f"  {x.joint} {x.equation}, {x.regime}: {x.excess_rms:.3f} N m beyond the noise")
    print(
        "  residual over noise (power): ",
        {j: {e: round(v) for e, v in p.items()} for j, p in found.lack_of_fit.per_joint.items()},
    )
    for text in found.warnings:
        print(f"  - {text.replace(str(path), path.name)}")

# %% [markdown]
# Nothing, and that is the right answer. The motors rest more than half of the time, where friction may hold any torque;
# two periods give one number for the scatter; and whatever is missing (a beam that bends along its length has more than
# one mode) is far larger than that scatter. The diagnosis says where and by how much. For a name: excite with a
# multisine that keeps the motors moving, ten periods of it.
#
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
    for text in circular_springs(module, recording.replace_columns({"q_output": rebuilt})):
        print(text)

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

# %% [markdown]
# `diagnose` puts the same among its warnings, so that nobody builds a spring on this channel without having read it.
# For the log as it is it can only doubt:

# %%
if path:
    for text in circular_springs(module, recording):
        print(text)
