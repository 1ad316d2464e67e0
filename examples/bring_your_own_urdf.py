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
# # Bring your own URDF
#
# From a URDF that knows nothing of springs to an identified model for your simulator. The robot here is a UR3 of
# example-robot-data; put the path of your own file instead. Its URDF stays as it is: what it lacks comes in a fragment.

# %%
import os
import warnings
from pathlib import Path

from sea_ident import (
    design_excitation,
    export_mjcf,
    export_urdf,
    find_base_parameters,
    identify,
    load_robot,
    read_recording,
    simulate,
    validate,
    write_recording,
)
from sea_ident.effects import base_effects
from sea_ident.exceptions import SeaIdentError, SeaIdentWarning
from sea_ident.excitation import write_trajectory_csv

REDUCED = bool(os.environ.get("SEA_IDENT_REDUCED"))
URDF = "example:ur_description/urdf/ur3_robot.urdf"

# %% [markdown]
# ## 1. What is there
#
# Without an annotation every joint is rigid and has no motor; a warning says so.

# %%
with warnings.catch_warnings(record=True) as heard:
    warnings.simplefilter("always")
    robot = load_robot(URDF)
print(robot.summary())

# %% [markdown]
# ## 2. The annotation
#
# One transmission for every motor, in a file of its own. Only the gear ratio is needed; what else is known is a prior,
# and what is left out is identified. This one gives the first three joints motors, and springs to the second and third.
# The three joints of the wrist are locked: name the joints that move.
#
# Accelerations are not in a URDF, so they have their place in the annotation too.

# %%
JOINTS = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"]


def transmission(joint, spring):
    kind = "transmission_interface/SimpleTransmission" if spring is None else "sea_ident/SeriesElastic"
    return f"""
  <transmission name="{joint}_drive" type="{kind}">
    <joint name="{joint}"><limit acceleration="6"/></joint>
    <actuator name="{joint}_motor">
      <mechanicalReduction>101</mechanicalReduction>
      <torqueConstant>0.08</torqueConstant>      <!-- N m/A, motor shaft -->
      <rotorInertia>2.0e-5</rotorInertia>        <!-- kg m2, motor shaft -->
      <efficiency>0.9</efficiency>
      <viscousFriction>1.5</viscousFriction>     <!-- N m s/rad, joint side -->
      <coulombFriction>2.0</coulombFriction>     <!-- N m, joint side -->
    </actuator>
    {"" if spring is None else f'<seriesElastic stiffness="{spring}" damping="1.5"/>'}
  </transmission>"""


fragment = Path("ur3_sea.urdf")
springs = {"shoulder_pan_joint": None, "shoulder_lift_joint": 800, "elbow_joint": 400}
fragment.write_text('<robot name="ur3">' + "".join(transmission(*item) for item in springs.items()) + "\n</robot>\n")
robot = load_robot(URDF, fragment, JOINTS)
print(robot.summary())

# %% [markdown]
# Mistakes are found at the border, with the place and the way out:

# %%
fragment.with_name("wrong.urdf").write_text(fragment.read_text().replace('"elbow_joint"', '"elbow"'))
try:
    load_robot(URDF, "wrong.urdf", JOINTS)
except SeaIdentError as error:
    print(error)

# %% [markdown]
# ## 3. What can be identified
#
# Only combinations of the inertial parameters act on the torque: the base parameters. They are found before anything is
# measured, with the singular values beside them: a clear gap means that the number is certain.

# %%
base = find_base_parameters(robot, base_effects(robot))
print(base.summary())

# %% [markdown]
# ## 4. The experiment
#
# A periodic trajectory inside all limits, at every instant and not at samples alone. `write_trajectory_csv` gives the
# table that a robot's controller plays.

# %%
excitation = design_excitation(robot, base_frequency=0.2, harmonics=5, starts=1 if REDUCED else 4, seed=0)
print(excitation.summary())
write_trajectory_csv(excitation, "trajectory.csv", rate=100.0)

# %% [markdown]
# Here the recording is simulated. Yours is a table with the columns `time`, `q_<joint>`, `theta_<joint>` (elastic
# joints) and `tau_motor_<joint>` or `current_<joint>`, in CSV, Parquet, NPZ, MAT, HDF5, or a ROS bag.

# %%
with warnings.catch_warnings():
    warnings.simplefilter("ignore", SeaIdentWarning)
    for name, seed, periods in (("excitation.csv", 0, 5 if REDUCED else 20), ("held_out.csv", 1, 3)):
        trajectory = excitation if seed == 0 else design_excitation(robot, base_frequency=0.2, starts=1, seed=seed)
        write_recording(simulate(robot, trajectory, periods=periods, seed=seed).recording, name)
recording = read_recording("excitation.csv")
print(recording.source, recording.joints)

# %% [markdown]
# ## 5. The model, and whether to trust it

# %%
model = identify(robot, recording, period=5.0)
print(model.summary())
print(validate(model, read_recording("held_out.csv"), period=5.0).summary())

# %% [markdown]
# ## 6. For other tools
#
# The URDF is your own file with the identified values in it and every other byte as it was. The MJCF holds rotors and
# springs, ready for MuJoCo. Data fix combinations only; the freedom that is left has the physically possible values
# nearest to those of your URDF.

# %%
for write, path in ((export_urdf, "ur3_identified.urdf"), (export_mjcf, "ur3_identified.xml")):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SeaIdentWarning)  # they are in the summary too
        print(write(model, path).summary())

identified = load_robot("ur3_identified.urdf", joints=JOINTS)
for joint in ("shoulder_lift_joint", "elbow_joint"):
    print(f"{joint}: stiffness {identified.spring(joint).stiffness:.1f} N m/rad, true {springs[joint]}")
before, after = robot.urdf.splitlines(), Path("ur3_identified.urdf").read_text().splitlines()
print(f"{len(set(after) - set(before))} of {len(after)} lines are new")
