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
# # The exoskeleton leg
#
# The experiment of Vantilt, Aertbeliën, De Groote, De Schutter, *Optimal Excitation and Identification of the Dynamic
# Model of Robotic Systems with Compliant Actuators*, ICRA 2015, section by section, on a simulated leg: hip, knee and
# ankle, each driven through a spring. Because the leg is simulated, every estimate can be held against the truth.
#
# 1. model and parameters (paper, II.A and III.A),
# 2. the exciting trajectory (II.C and III.B),
# 3. the experiment (III.C),
# 4. processing (II.D and III.D),
# 5. parameters (II.B and III.D),
# 6. springs (II.E),
# 7. validation on a gait (IV).

# %%
import os
import warnings

import matplotlib.pyplot as plt
import numpy as np

from sea_ident import design_excitation, find_base_parameters, identify, load_robot, process, simulate, validate
from sea_ident.demo import gait
from sea_ident.demo.tables import parameter_table, performance_table, table_text
from sea_ident.effects import base_effects
from sea_ident.estimation import JointWLS, PerSampleWLS
from sea_ident.exceptions import SeaIdentWarning
from sea_ident.simulation import ComputedTorque

REDUCED = bool(os.environ.get("SEA_IDENT_REDUCED"))
STARTS, PERIODS = (1, 5) if REDUCED else (3, 20)
COLORS = {"hip": "tab:blue", "knee": "tab:green", "ankle": "tab:red"}
warnings.simplefilter("ignore", SeaIdentWarning)  # every warning is kept in its result, too

# %% [markdown]
# ## 1. Model and parameters
#
# A joint has two angles: $q$ of the link and $\theta$ of the motor after the gear. With the spring torque
# $\tau_\text{spring}$ between them (paper, eqs. 1 and 2)
#
# $$
# \begin{aligned}
# H(q)\,\ddot q + S^\top \ddot\theta + C(q,\dot q)\,\dot q + C_1 \dot q + G(q) + \tau_{\text{fr},j}(\dot q)
#   &= \tau_\text{spring} \\
# S\,\ddot q + B\,\ddot\theta + C_2 \dot q + \tau_{\text{fr},m}(\dot\theta) + \tau_\text{spring} &= \tau_\text{mot}
# \end{aligned}
# $$
#
# Added up, the spring torque is gone (eq. 4). What remains is linear in the parameters $\psi$ (eq. 8):
#
# $$ \Phi(q,\dot q,\ddot q,\dot\theta,\ddot\theta)\,\psi = \tau_\text{mot}. $$
#
# So the dynamics are identified without any model of the springs, and an error in one cannot spoil the other. Only
# combinations of the standard parameters act on the torque, the *base parameters*. In the plane the leg has ten that
# concern inertia; one viscous and one Coulomb coefficient per motor make sixteen, as in the paper's Table I.

# %%
robot = load_robot("exo_leg")
print(robot.summary())
print(find_base_parameters(robot, base_effects(robot)).summary())

# %% [markdown]
# ## 2. The exciting trajectory
#
# Each joint follows a Fourier series (eqs. 15 to 17),
#
# $$ q_i(t) = q_{i,0} + \sum_{l=1}^{10} \frac{a_{i,l}}{\omega_f l}\sin(\omega_f l t)
#      - \frac{b_{i,l}}{\omega_f l}\cos(\omega_f l t), \qquad \omega_f = 2\pi \cdot 0.1\ \text{rad/s}, $$
#
# 63 coefficients in all. They are chosen to maximise $\log\det(F^\top F)$, where $F$ stacks the regressors of all
# samples of a period. The covariance of the estimate is $\sigma^2 (F^\top F)^{-1}$, so this makes the volume of the
# confidence ellipsoid as small as possible (D-optimality). At the time of planning the springs are unknown, and the
# regressor is that of the reduced model with $\theta = q$ (eq. 19).
#
# The limits on position, speed, acceleration and $q_\text{hip} + q_\text{knee} \ge 0.1$ rad (eqs. 24 and 25) hold at
# every instant, not at samples only. The margins say how close the trajectory comes to each.

# %%
excitation = design_excitation(robot, base_frequency=0.1, harmonics=10, starts=STARTS, seed=0)
print(excitation.summary())

# %% [markdown]
# ## 3. The experiment
#
# The trajectory was planned for the links, but it is the motors that follow it: to steer the links would take the very
# model that is looked for. The springs then take the links a little elsewhere. Twenty periods are recorded, with the
# noise of encoders and current sensors, and with friction that is not the same in every pass.

# %%
simulation = simulate(robot, excitation, periods=PERIODS, seed=0)
print(simulation.summary())

# %% [markdown]
# ## 4. Processing
#
# A periodic motion can be averaged over its periods, and Fourier series fitted to the mean angles have analytic
# derivatives, so no noise is amplified by differences. The number of harmonics is found from the data, and separately
# for $q$ and $\theta$. The scatter between the $P$ periods gives the variance of the torque at *every sample* (eq. 20):
#
# $$ \sigma_i^2(k) = \frac{1}{P-1} \sum_{p=1}^{P} \bigl(\tau_{i,p}(k) - \bar\tau_i(k)\bigr)^2 . $$

# %%
processed = process(simulation.recording, robot, period=excitation.period)
print(processed.summary())

# %% [markdown]
# The next figure corresponds to the paper's Figure 1: above, the hip torque of all periods and its mean; below, the
# motor velocity and the variance of the torque. The torque scatters where the motor turns round, because friction does
# not reverse at exactly the same phase and with the same size in every pass.

# %%
half = slice(0, processed.samples // 2)
time = processed.motion.time - processed.motion.time[0]
hip = robot.joint_names.index("hip")
figure, (above, below) = plt.subplots(2, 1, figsize=(8, 5.5), sharex=True)
above.plot(time[half], processed.period_tau_motor[:, half, hip].T, color="tab:blue", linewidth=0.4, alpha=0.35)
above.plot(time[half], processed.tau_motor[half, hip], color="tab:red", linewidth=1.2, label="mean")
above.plot([], [], color="tab:blue", linewidth=0.8, label=f"{processed.periods} periods")
above.set_ylabel("hip torque [N m]")
above.legend(frameon=False)
below.plot(time[half], processed.motion.dtheta[half, hip], color="tab:blue")
below.axhline(0.0, color="0.7", linewidth=0.8)
below.set_ylabel("motor velocity [rad/s]", color="tab:blue")
below.set_xlabel("time [s]")
variance = below.twinx()
variance.plot(time[half], processed.tau_variance[half, hip], color="tab:green")
variance.set_yscale("log")
variance.set_ylabel("torque variance [(N m)$^2$]", color="tab:green")
figure.tight_layout()

# %% [markdown]
# As in the paper's Figure 3, motors (solid) follow the plan (black), and links (dashed) deviate from it by the
# deflection of the springs. It is large at the hip, which carries the whole leg, and tiny at the ankle, which carries a
# foot.

# %%
planned = excitation.series.evaluate(processed.motion.time)
figure, (angles, deflections) = plt.subplots(2, 1, figsize=(8, 6.5), sharex=True, height_ratios=(2, 1))
for i, joint in enumerate(robot.joint_names):
    angles.plot(time, planned[:, i], color="black", linewidth=0.7)
    angles.plot(time, processed.motion.theta[:, i], color=COLORS[joint], label=joint)
    angles.plot(time, processed.motion.q[:, i], color=COLORS[joint], linestyle="--")
    deflections.plot(time, 1e3 * (processed.motion.theta - processed.motion.q)[:, i], color=COLORS[joint])
angles.set_ylabel("angle [rad]")
angles.legend(frameon=False, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
deflections.set(xlabel="time [s]", ylabel="deflection [mrad]")
figure.tight_layout()

# %% [markdown]
# ## 5. Parameters
#
# With $b$ the stacked torques, the weighted least-squares estimate and its covariance are (eqs. 9 and 13)
#
# $$ \hat\psi = (F^\top \Sigma^{-1} F)^{-1} F^\top \Sigma^{-1} b, \qquad
#    \operatorname{cov}\hat\psi = (F^\top \Sigma^{-1} F)^{-1}. $$
#
# The usual $\Sigma$ has one variance per joint; the paper's has one per sample, so that reversals count for less. The
# standard deviations below do not rely on that formula alone: they are those that the spread between periods shows,
# which stays honest where noise is correlated over time.
#
# Table I: the columns are the value that the simulation was built from, the estimate, and its standard deviation.

# %%
by_joint = identify(robot, processed, estimator=JointWLS())
model = identify(robot, processed, estimator=PerSampleWLS())
parameters = parameter_table(model)
print(table_text(parameters))

# %% [markdown]
# The errors should be a few standard deviations at most, and about one in size on average. That is the test of the
# intervals, and only a simulation allows it.

# %%
dynamics = [row for row in parameters if not row.name.endswith((".K1", ".K3", ".D"))]
errors = np.array([(row.estimate - row.cad) / row.std for row in dynamics])
figure, axes = plt.subplots(figsize=(8, 3))
axes.axhspan(-2, 2, color="0.92")
axes.bar(range(len(errors)), errors)
axes.set_xticks(range(len(errors)), [row.name for row in dynamics], rotation=60, ha="right", fontsize=8)
axes.set_ylabel("error / standard deviation")
figure.tight_layout()
print(f"rms of error / standard deviation: {np.sqrt(np.mean(errors**2)):.2f}")

# %% [markdown]
# ## 6. Springs
#
# Now that the dynamics are known, the motor equation gives the spring torque, and it is fitted by (eq. 21)
#
# $$ \tau_\text{spring} = K_1 (\theta - q) + K_3 (\theta - q)^3 + D (\dot\theta - \dot q). $$
#
# The paper leaves the ankle out: the light foot hardly deflects its spring. Here that shows in the standard deviations
# and in the verdict: pieces of the period are held out, and the cubic term stays only if it predicts them better. At
# the ankle it does not, and its standard deviation says that the deflection is too small to tell.

# %%
for spring in model.springs:
    print(spring.summary())

figure, panels = plt.subplots(1, 3, figsize=(10, 3))
for spring, axes in zip(model.springs, panels, strict=True):
    truth = robot.spring(spring.joint)
    d = np.linspace(-1.0, 1.0, 200) * spring.largest_deflection
    k1, k3, _ = spring.law
    axes.plot(1e3 * d, truth.stiffness * d + truth.cubic_stiffness * d**3, color="black", linewidth=3, alpha=0.3)
    axes.plot(1e3 * d, k1 * d + k3 * d**3, color=COLORS[spring.joint])
    axes.set(title=f"{spring.joint}: {spring.verdict.replace('_', ' ')}", xlabel="deflection [mrad]")
panels[0].set_ylabel("spring torque [N m]")
panels[0].legend(["true", "identified"], frameon=False)
figure.tight_layout()

# %% [markdown]
# ## 7. Validation
#
# A model is worth what it predicts. The leg now walks, under a computed-torque controller, and the measured torque of
# the gait is compared with the one predicted from the measured motion. The measured torque is noisy itself; the
# simulation knows the exact one, which is the last row of Table II.

# %%
walk = gait()
walking = simulate(robot, walk, periods=PERIODS, seed=1, controller=ComputedTorque())
walked = process(walking.recording, robot, period=walk.period)
checks = validate(by_joint, walked), validate(model, walked)
exact = walking.tau_motor.reshape(PERIODS, -1, robot.n).mean(axis=0)
print(table_text(performance_table(excitation, by_joint, model, *checks, processed.motion, exact)))

# %%
phase = np.linspace(0.0, 100.0, walked.samples, endpoint=False)
figure, panels = plt.subplots(2, 3, figsize=(10, 4.5), sharex=True, height_ratios=(2, 1))
for i, joint in enumerate(robot.joint_names):
    panels[0, i].plot(phase, walked.tau_motor[:, i], color="0.6", linewidth=2.5, label="measured")
    panels[0, i].plot(phase, checks[1].predicted[:, i], color=COLORS[joint], linewidth=1.0, label="predicted")
    panels[0, i].set_title(joint)
    panels[0, i].legend(frameon=False, fontsize=8)
    panels[1, i].plot(phase, walked.tau_motor[:, i] - checks[1].predicted[:, i], color=COLORS[joint], linewidth=0.8)
    panels[1, i].set_xlabel("gait cycle [%]")
panels[0, 0].set_ylabel("motor torque [N m]")
panels[1, 0].set_ylabel("difference [N m]")
figure.tight_layout()

# %% [markdown]
# The planned and the measured trajectory carry about the same information, so it does no harm that the motors follow
# what was planned for the links. That and the order of the two weightings in the last rows can be compared with the
# paper's Table II. Its absolute numbers belong to its robot: the masses of that leg are not published, so this one is
# built from measures of its own.
