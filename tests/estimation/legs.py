"""URDFs of legs of two elastic joints, from their numbers."""

_LINK = (
    '<link name="{0}"><inertial><origin xyz="{1}"/><mass value="{2}"/>'
    '<inertia ixx="{3}" iyy="{3}" izz="{4}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
_JOINT = (
    '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="{3}"/><axis xyz="0 1 0"/>'
    '<limit lower="{4}" upper="{5}" velocity="9" effort="{6}"/></joint>'
    '<transmission name="{0}_t" type="sea_ident/SeriesElastic"><joint name="{0}"/><actuator name="{0}_m">'
    "<mechanicalReduction>{7}</mechanicalReduction>{8}<rotorInertia>{9}</rotorInertia>"
    "<viscousFriction>{10}</viscousFriction><coulombFriction>{11}</coulombFriction></actuator>"
    '<seriesElastic stiffness="{12}" damping="{13}"/></transmission>'
)

_LIGHT = "-3", "3", 80, 4, "<torqueConstant>0.9</torqueConstant>"
LIGHT_ROTORS = (
    '<robot name="light_rotors"><link name="pelvis"/>'
    + _LINK.format("thigh", "0.02 0 -0.19", 4.2, 0.06, 0.015)
    + _LINK.format("shank", "-0.01 0 -0.15", 2.3, 0.03, 0.006)
    + _JOINT.format("hip", "pelvis", "thigh", "0 0 0.9", *_LIGHT, 0.004, 0.8, 1.0, 500, 1.0)
    + _JOINT.format("knee", "thigh", "shank", "0 0 -0.4", *_LIGHT, 0.003, 0.4, 0.5, 180, 0.5)
    + "</robot>"
)
"""Motors of low gear ratio, whose inertia is small beside their friction."""

SWINGING = (
    '<robot name="swinging"><link name="pelvis"/>'
    + _LINK.format("thigh", "0.01 0.005 -0.2", 3.0, 0.04, 0.005)
    + _LINK.format("shank", "0.01 0.002 -0.12", 0.8, 0.004, 0.001)
    + _JOINT.format("hip", "pelvis", "thigh", "0 0 0", -1.5, 1.5, 100, 100, "", 1e-5, 0.8, 1.5, 900, 0.3)
    + _JOINT.format("knee", "thigh", "shank", "0 0 -0.4", -1.5, 1.5, 100, 80, "", 1e-5, 0.4, 0.6, 500, 0.05)
    + "</robot>"
)
"""Damped by less than a hundredth of what is critical; links swing at 9 and 28 Hz."""
