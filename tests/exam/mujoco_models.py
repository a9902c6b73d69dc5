"""MuJoCo models of the exam's plants, with or without something hidden in them.

Everything that resists is the engine's own: joint stiffness, damping, armature, dry friction (frictionloss), limits, contacts, tendons with
slack, gravity. A plant that is `slow` by q has q² its inertia and q its damping, so that it moves alike in q times the time.
"""

import math

# By plant: joint type, measured axes, sizes of mass, damping and stiffness by joint, the holding robot (kp, kd), rms of command (force, or
# position where `position`), of displacement and effort, end of the band in Hz, instruments (effort noise, effort step, encoder step).
PLANTS = {
    "slide": dict(axes=["x"], M=[2.0], B=[12.0], K=[400.0], hold=(0.0, 0.0), command=4.0, x=8e-3, f=4.0, band=12.0, steps=(0.03, 0.025, 1.5e-5)),
    "free": dict(axes=["x"], M=[2.0], B=[4.0], K=[0.0], hold=(300.0, 20.0), command=2e-2, x=2e-2, f=5.0, band=3.0, steps=(0.03, 0.025, 1.5e-5)),
    "planar": dict(axes=["x", "y"], M=[3.0, 2.6], B=[16.0, 20.0], K=[300.0, 500.0], hold=(100.0, 5.0), command=4.0, x=4.5e-3, f=3.0, band=12.0, steps=(0.03, 0.025, 1e-5)),
    "pendulum": dict(axes=["joint"], M=[0.14], B=[0.25], K=[4.4], hold=(0.0, 0.0), command=0.15, x=0.03, f=0.15, band=8.0, steps=(1e-3, 8e-4, 4e-5)),
    "arm": dict(axes=["x", "y"], M=[0.3, 0.1], B=[1.2, 1.0], K=[30.0, 22.0], hold=(100.0, 5.0), command=0.2, x=5e-4, f=0.2, band=12.0, steps=(1.5e-3, 1.2e-3, 1e-6)),
    "ankle": dict(axes=["ankle"], M=[0.015], B=[1.0], K=[60.0], hold=(0.0, 0.0), command=0.0, x=0.02, f=1.5, band=12.0, steps=(0.015, 0.005, 2e-5)),
}
ROTATIONAL = ("pendulum", "ankle")
POSTURE_RAD = (0.8, 1.5)
LINKS_M = (0.33, 0.34)
LINKS_KG = (1.9, 1.5)


def attributes(values):
    return " ".join(f'{name}="{value}"' for name, value in values.items())


class Parts:
    """Pieces of MJCF that an effect adds."""

    def __init__(self):
        self.joint, self.children, self.world, self.tendons, self.actuators, self.bodies = {}, "", "", "", "", 0

    def passive(self, kind, host, mass, stiffness, slow, joint):
        """A light body beside the limb that a tendon couples to its joint `host`."""
        self.bodies += 1
        name = f"z{self.bodies}"
        axis = "1 0 0" if kind == "slide" else "0 0 1"
        inertial = f'<inertial pos="0 0 0" mass="{mass * slow**2}" diaginertia="{mass * slow**2} {mass * slow**2} {mass * slow**2}"/>'
        self.world += f'<body name="{name}" pos="0 0 5" gravcomp="1"><joint name="{name}" type="{kind}" axis="{axis}" {attributes(joint)}/>{inertial}</body>'
        self.tendons += f'<fixed name="{name}" stiffness="{stiffness}"><joint joint="{host}" coef="1"/><joint joint="{name}" coef="-1"/></fixed>'


# A constraint that is a spring rather than a wall: with impedance d and solref (-c, -e) MuJoCo's acceleration is (1 - d) that without it,
# less c / d times the depth and e times the speed.
SOFTNESS = 0.05
IMPEDANCE = f"{SOFTNESS} {SOFTNESS} 0.001 0.5 2"


def soft(s, k, m, slow):
    """solref of a wall of stiffness 3 s k, a tenth of critically damped."""
    stiffness = 3 * s * k / m / slow**2
    return f"{-SOFTNESS * stiffness} {-0.2 * math.sqrt(stiffness)}"


def hide(parts, sizes, kind, host, effect, form, s, slow, random):
    """Adds an effect of severity s to the joint `host`; returns its true parameters by their registry's names."""
    k, m, b, x, f = sizes["k"], sizes["m"], sizes["b"], sizes["x"], sizes["f"]
    if effect == "coulomb-friction":
        parts.joint |= dict(frictionloss=0.5 * s * f, solreffriction=f"{2e-3 * slow} 1")
        return {"level": 0.5 * s * f} if form == "" else {}
    if effect == "end-stop" and form == "limit":
        at = random.uniform(0.6, 1.2) * x
        parts.joint |= dict(limited="true", range=f"-10 {at}", solreflimit=soft(s, k, m, slow), solimplimit=IMPEDANCE)
        return {"position": at}
    if effect == "end-stop":
        at = random.uniform(0.6, 1.2) * x
        wall = f'solref="{soft(s, k, m, slow)}" solimp="{IMPEDANCE}"'
        parts.world += f'<geom name="wall" type="box" size="0.01 0.1 0.1" pos="{at + 0.02} 0 0" contype="1" conaffinity="1" condim="1" {wall}/>'
        parts.children += '<geom name="tip" type="sphere" size="0.01" mass="1e-9" contype="1" conaffinity="1" condim="1"/>'
        return {"position": at}
    if effect == "dead-zone":
        # All of the spring is a tendon with slack.
        parts.joint |= dict(stiffness=0)
        parts.tendons += f'<fixed name="slack" stiffness="{k}" springlength="{-0.7 * s * x} {0.7 * s * x}"><joint joint="{host}" coef="1"/></fixed>'
        return {"half_gap": 0.7 * s * x}
    if effect == "asymmetric-stiffness":
        parts.tendons += f'<fixed name="one" stiffness="{0.8 * s * k}" springlength="-10 0"><joint joint="{host}" coef="1"/></fixed>'
        return {}
    if effect == "cubic-stiffness":
        # Two cords across the motion: k x (1 - L / sqrt(L² + x²)), which begins as k x³ / (2 L²).
        length = 2.5 * x
        parts.world += f'<site name="a" pos="0 {length} 0"/><site name="b" pos="0 {-length} 0"/>'
        parts.children += '<site name="knot"/>'
        for end in "ab":
            parts.tendons += f'<spatial name="cord{end}" stiffness="{2 * s * k}" springlength="{length}"><site site="{end}"/><site site="knot"/></spatial>'
        return {}
    if effect == "viscoelastic":
        time = random.uniform(0.08, 0.25) * slow
        parts.passive(kind, host, 1e-3 * m, s * k, slow, dict(damping=s * k * time))
        return {"modulus": s * k, "time": time}
    if effect == "hysteresis":
        # Springs in a row with dry friction: slipping elements of unequal yields.
        for weight, width in ((1.0, 0.3), (0.6, 0.9), (0.4, 2.0)):
            stiffness = 0.6 * weight * s * k
            parts.passive(kind, host, 2e-3 * m, stiffness, slow, dict(frictionloss=stiffness * width * x, solreffriction=f"{2e-3 * slow} 1", damping=2e-3 * b * slow))
        return {}
    if effect == "extra-resonance":
        frequency, ratio = random.uniform(4.0, 8.0) / slow, random.uniform(0.03, 0.1)
        mass, w = 0.4 * s * m * slow**2, 2 * math.pi * frequency
        axis = "1 0 0" if kind == "slide" else "0 0 1"
        inertial = f'<inertial pos="0 0 0" mass="{mass}" diaginertia="{mass} {mass} {mass}"/>'
        parts.children += f'<body gravcomp="1"><joint name="mode" type="{kind}" axis="{axis}" stiffness="{mass * w * w}" damping="{2 * ratio * w * mass}"/>{inertial}</body>'
        return {"frequency": frequency, "damping_ratio": ratio}
    if effect == "reflex-delay":
        lag = random.uniform(0.04, 0.08) * slow
        parts.actuators += f'<general name="muscle" joint="{host}" dyntype="filterexact" dynprm="{lag}" gainprm="1"/>'
        return {}
    return {}


def limb(plant, size, slow, turn, parts, at):
    """The limb as bodies and joints; `parts` act on joint `at`."""
    joints = []
    for j in range(len(size["M"])):
        values = dict(stiffness=size["K"][j], damping=size["B"][j] * slow)
        joints.append(values | (parts.joint if j == at else {}))
    if plant in ("slide", "free", "planar"):
        axes = [(math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))]
        # The heavier direction is heavier by an armature.
        lightest = min(size["M"])
        text = "".join(
            f'<joint name="j{j}" type="slide" axis="{axes[j][0]} {axes[j][1]} 0" armature="{(size["M"][j] - lightest) * slow**2}" {attributes(v)}/>' for j, v in enumerate(joints)
        )
        point = f'<inertial pos="0 0 0" mass="{lightest * slow**2}" diaginertia="1 1 1"/>'
        return f'<body name="limb">{text}{point}<site name="hand"/>{parts.children}</body>'
    if plant == "pendulum":
        # Gravity is its spring: K = m g l.
        length = 0.3 * slow**2
        mass = size["K"][0] / 9.81 / length
        rest = max(size["M"][0] * slow**2 - mass * length**2, 0.0)
        joint = attributes(joints[0] | dict(stiffness=0, armature=rest))
        weight = f'<inertial pos="0 {-length} 0" mass="{mass}" diaginertia="1e-6 1e-6 1e-6"/>'
        return f'<body name="limb"><joint name="j0" type="hinge" axis="0 0 1" {joint}/>{weight}{parts.children}</body>'
    if plant == "ankle":
        inertia = size["M"][0] * slow**2
        return f'<body name="limb"><joint name="j0" type="hinge" axis="0 0 1" {attributes(joints[0])}/><inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/>{parts.children}</body>'
    (upper, fore), (m1, m2) = LINKS_M, [mass * slow**2 for mass in LINKS_KG]
    rod = lambda mass, length: f'<inertial pos="{0.45 * length} 0 0" mass="{mass}" diaginertia="{mass * length**2 / 12} {mass * length**2 / 12} {mass * length**2 / 12}"/>'
    first, second = (attributes(v) for v in joints)
    child = f'<body name="fore" pos="{upper} 0 0" euler="0 0 {POSTURE_RAD[1]}"><joint name="j1" type="hinge" axis="0 0 1" {second}/>{rod(m2, fore)}<site name="hand" pos="{fore} 0 0"/>{parts.children if at == 1 else ""}</body>'
    return f'<body name="limb" euler="0 0 {POSTURE_RAD[0]}"><joint name="j0" type="hinge" axis="0 0 1" {first}/>{rod(m1, upper)}{child}{parts.children if at == 0 else ""}</body>'


def model(plant, size, slow, turn, parts, at):
    """MJCF of a plant."""
    gravity = "0 -9.81 0" if plant == "pendulum" else "0 0 0"
    hand = [f'<general name="m{i}" site="hand" refsite="world" gear="{1 - i} {i} 0 0 0 0"/>' for i in range(2)]
    motors = hand if plant == "arm" else hand[:1] if plant in ("slide", "free") else hand if plant == "planar" else ['<general name="m0" joint="j0"/>']
    option = f'<option timestep="{5e-4 * slow}" integrator="implicitfast" gravity="{gravity}" cone="elliptic"/>'
    compiler = '<compiler angle="radian" inertiafromgeom="auto" balanceinertia="true"/>'
    default = '<default><geom contype="0" conaffinity="0"/></default>'
    # The limb comes first, so that its joints have the first places in all of the engine's vectors.
    return (
        f"<mujoco>{compiler}{option}{default}<worldbody><site name=\"world\"/>{limb(plant, size, slow, turn, parts, at)}{parts.world}</worldbody>"
        f"<tendon>{parts.tendons}</tendon><actuator>{''.join(motors)}{parts.actuators}</actuator></mujoco>"
    )
