"""The messages that carry a recording in ROS bags, and the names of their topics and columns.

A bag holds three topics, every message of which has a stamp:

    /sea_ident/link/joint_states    sensor_msgs/JointState          position q, velocity dq, effort tau_spring
    /sea_ident/motor/joint_states   sensor_msgs/JointState          position theta, velocity dtheta,
                                                                    effort tau_motor (all after the gear)
    /sea_ident/channels             control_msgs/DynamicJointState  everything else, named as in a recording:
                                                                    current, temperature, q_reference, ...

In other bags the columns are called `<topic>:<field>:<joint>`, such as `/joint_states:effort:knee`.
"""

from typing import Any, Final

from sea_ident.exceptions import MissingExtraError

LINK_TOPIC: Final = "/sea_ident/link/joint_states"
MOTOR_TOPIC: Final = "/sea_ident/motor/joint_states"
CHANNELS_TOPIC: Final = "/sea_ident/channels"

FIELDS: Final = ("position", "velocity", "effort")
KINDS: Final[dict[str, tuple[str, str, str]]] = {
    LINK_TOPIC: ("q", "dq", "tau_spring"),
    MOTOR_TOPIC: ("theta", "dtheta", "tau_motor"),
}
"""Topic -> kinds in its position, velocity and effort."""

JOINT_STATE: Final = "sensor_msgs/msg/JointState"
DYNAMIC_JOINT_STATE: Final = "control_msgs/msg/DynamicJointState"
_INTERFACE_VALUE: Final = "control_msgs/msg/InterfaceValue"

_DEFINITIONS: Final = {
    _INTERFACE_VALUE: "string[] interface_names\nfloat64[] values\n",
    DYNAMIC_JOINT_STATE: (
        "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n"
    ),
}


def message_types(ros_version: int, purpose: str) -> Any:
    """Types of the messages above, from this file alone: definitions inside a bag are never compiled.

    Args:
        ros_version: 1 or 2.
        purpose: What they are needed for, for the message when rosbags is absent.

    Returns:
        A rosbags type store.

    Raises:
        MissingExtraError: rosbags is not installed.
    """
    try:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError as error:
        raise MissingExtraError("rosbags", "bags", purpose) from error
    store = get_typestore(Stores.ROS1_NOETIC if ros_version == 1 else Stores.ROS2_HUMBLE)
    for name, text in _DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    return store
