"""The exam's three robots by one set of numbers: as MJCF for the simulator and as URDF for the program that is examined.

A link is its joint's place in the parent link, the joint's axis, and the link's mass, centre (m) and inertia about the centre (kg m², the axes
of the link). Nominal robots have no friction, no rotor inertia and nothing elastic.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

GRAVITY = 9.81


@dataclass(frozen=True)
class Link:
    joint: str
    place: tuple  # m, in the parent link
    turn: tuple  # roll, pitch, yaw in rad, about fixed axes, as in URDF
    axis: tuple
    mass: float
    centre: tuple
    inertia: tuple  # xx, yy, zz, xy, xz, yz


@dataclass(frozen=True)
class Robot:
    name: str
    links: tuple
    flange: tuple  # in the last link
    middle: tuple  # of the movements, rad
    reach: tuple  # the most that a movement goes from the middle, rad
    speed: tuple  # rad/s
    duration_s: float

    @property
    def joints(self):
        return [link.joint for link in self.links]

    def with_link(self, number, **changed):
        links = list(self.links)
        links[number] = replace(links[number], **changed)
        return replace(self, links=tuple(links))


def rod(mass, length, radius, along):
    """Inertia of a solid cylinder along an axis, 0 to 2."""
    across, own = mass * (3 * radius**2 + length**2) / 12, mass * radius**2 / 2
    return tuple(own if axis == along else across for axis in range(3)) + (0.0, 0.0, 0.0)


def pendulum():
    link = Link("pivot", (0, 0, 1), (0, 0, 0), (0, 1, 0), 1.8, (0, 0, -0.31), rod(1.8, 0.5, 0.03, 2))
    return Robot("pendulum", (link,), (0, 0, -0.5), (0.25,), (1.3,), (4.0,), 20.0)


def planar():
    upper = Link("shoulder", (0, 0, 1), (0, 0, 0), (0, 1, 0), 4.2, (0, 0, -0.17), rod(4.2, 0.4, 0.045, 2))
    fore = Link("elbow", (0, 0, -0.4), (0, 0, 0), (0, 1, 0), 2.1, (0, 0, -0.14), rod(2.1, 0.35, 0.035, 2))
    return Robot("planar", (upper, fore), (0, 0, -0.35), (0.3, -0.6), (1.0, 1.2), (3.0, 3.5), 60.0)


def six():
    """Lengths (0.0892, 0.425, 0.392, 0.109, 0.0947, 0.0823 m) and masses near those of a common cobot for 5 kg, with a tool; the inertias
    are those of cylinders."""
    half = math.pi / 2
    tool = (2.4e-3, 2.1e-3, 1.7e-3, 2e-4, -1e-4, 3e-4)
    links = (
        Link("shoulder_pan", (0, 0, 0.0892), (0, 0, 0), (0, 0, 1), 3.7, (0, 0.0038, -0.012), rod(3.7, 0.18, 0.06, 2)),
        Link("shoulder_lift", (0, 0.1358, 0), (0, half, 0), (0, 1, 0), 8.4, (0, -0.02, 0.212), rod(8.4, 0.45, 0.055, 2)),
        Link("elbow", (0, -0.1197, 0.425), (0, 0, 0), (0, 1, 0), 2.3, (0, 0.01, 0.17), rod(2.3, 0.42, 0.042, 2)),
        Link("wrist_1", (0, 0, 0.3922), (0, half, 0), (0, 1, 0), 1.22, (0, 0.09, 0.01), rod(1.22, 0.12, 0.04, 1)),
        Link("wrist_2", (0, 0.093, 0), (0, 0, 0), (0, 0, 1), 1.22, (0, 0.008, 0.085), rod(1.22, 0.12, 0.04, 2)),
        Link("wrist_3", (0, 0, 0.0947), (0, 0, 0), (0, 1, 0), 1.6, (0.03, 0.11, 0.025), tool),
    )
    return Robot("six", links, (0, 0.16, 0), (0.0, -1.2, 1.3, -0.7, 1.1, 0.3), (1.2, 0.6, 0.8, 1.2, 1.2, 1.5), (1.6, 1.0, 1.3, 2.0, 2.0, 2.5), 60.0)


ROBOTS = {robot.name: robot for robot in (pendulum(), planar(), six())}


def text(values):
    return " ".join(repr(float(v)) for v in values)


def quaternion(turn):
    """Of roll, pitch and yaw about fixed axes, as w x y z."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in turn)
    return (cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy)


@dataclass
class Parts:
    """What hidden causes add to a robot's MJCF."""

    step_s: float = 5e-4
    gravity: tuple = (0, 0, -GRAVITY)
    joint: dict = field(default_factory=dict)  # by joint: attributes of it
    behind: dict = field(default_factory=dict)  # by joint: attributes of the joint that follows its motor in series
    rotor: dict = field(default_factory=dict)  # by joint: the motor's inertia where it turns by itself, kg m²
    load: str = ""  # bodies at the flange


# A body that turns by itself must weigh something.
LIGHT = '<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>'


def mjcf(robot, parts=None):
    """MJCF. A joint that has something in series is a motor's joint of its name and `JOINT.load` behind it."""
    parts = parts or Parts()
    out, end = [], ""
    for link in robot.links:
        attributes = lambda values: "".join(f' {key}="{value}"' for key, value in values.items())
        joint = lambda name, values: f'<joint name="{name}" type="hinge" axis="{text(link.axis)}"{attributes(values)}/>'
        out.append(f'<body name="{link.joint}" pos="{text(link.place)}" quat="{text(quaternion(link.turn))}">')
        own = dict(parts.joint.get(link.joint, {}))
        end = "</body>" + end
        if link.joint in parts.behind:
            out.append(joint(link.joint, own | dict(armature=parts.rotor[link.joint])) + LIGHT + "<body>" + joint(f"{link.joint}.load", parts.behind[link.joint]))
            end = "</body>" + end
        else:
            out.append(joint(link.joint, own))
        out.append(f'<inertial pos="{text(link.centre)}" mass="{float(link.mass)!r}" fullinertia="{text(link.inertia)}"/>')
    out.append(parts.load)
    option = f'<option timestep="{parts.step_s}" integrator="implicitfast" gravity="{text(parts.gravity)}"/>'
    motors = "".join(f'<motor joint="{name}"/>' for name in robot.joints)
    return f'<mujoco><compiler angle="radian"/>{option}<worldbody>{"".join(out)}{end}</worldbody><actuator>{motors}</actuator></mujoco>'


def urdf(robot):
    out = [f'<?xml version="1.0"?>\n<robot name="{robot.name}">\n  <link name="base"/>\n']
    parent = "base"
    for number, link in enumerate(robot.links):
        child = f"link_{number + 1}"
        names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        inertia = " ".join(f'{name}="{float(value)!r}"' for name, value in zip(names, link.inertia))
        out.append(
            f'  <joint name="{link.joint}" type="revolute">\n    <parent link="{parent}"/>\n    <child link="{child}"/>\n'
            f'    <origin xyz="{text(link.place)}" rpy="{text(link.turn)}"/>\n    <axis xyz="{text(link.axis)}"/>\n'
            f'    <limit lower="-6.2832" upper="6.2832" effort="300" velocity="10"/>\n  </joint>\n'
            f'  <link name="{child}">\n    <inertial>\n      <origin xyz="{text(link.centre)}" rpy="0 0 0"/>\n'
            f'      <mass value="{float(link.mass)!r}"/>\n      <inertia {inertia}/>\n    </inertial>\n  </link>\n'
        )
        parent = child
    out.append(
        f'  <joint name="flange" type="fixed">\n    <parent link="{parent}"/>\n    <child link="tool"/>\n    <origin xyz="{text(robot.flange)}" rpy="0 0 0"/>\n  </joint>\n'
        '  <link name="tool"/>\n</robot>\n'
    )
    return "".join(out)


def turned(vector):
    """Rotation matrix of a rotation vector."""
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = np.asarray(vector) / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
