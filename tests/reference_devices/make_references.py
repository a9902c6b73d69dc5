"""Reference dynamics of the simulated robots by independent engines.

Writes, into this folder, chain_two_link.csv, chain_three_link.csv, chain_six_joint.csv and wrist.csv (Pinocchio) and
five_bar.csv, five_bar_motion.csv (MuJoCo: a tree of four bodies whose parallelogram is closed by projection). Each row of the first
five is a random state: q, rates, mass matrix (rows), bias torques, Jacobian of the tip (rows x, y, z; left out where the
joints are the axes), its rate times the joint rates. five_bar_motion.csv is a free motion of 1 s by RK4 at 1e-4 s.

    pip install numpy mujoco pin
    python make_references.py
"""
import csv
import pathlib

import mujoco
import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).parent
STATES = 100


def write(name, header, rows):
    with open(HERE / name, "w", newline="") as file:
        file.write(f"# numpy {np.__version__}, mujoco {mujoco.__version__}, pinocchio {pin.__version__}\n")
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([[repr(float(v)) for v in row] for row in rows])


def header(n, tip):
    names = [f"q{i}" for i in range(n)] + [f"v{i}" for i in range(n)]
    names += [f"h{i}{j}" for i in range(n) for j in range(n)] + [f"b{i}" for i in range(n)]
    if tip:
        names += [f"{a}" for a in "xyz"] + [f"j{a}{i}" for a in "xyz" for i in range(n)] + [f"d{a}" for a in "xyz"]
    return names


def states(model, data, frame, seed, span):
    """Random states of a Pinocchio model; `frame` is the tip, or None."""
    rng = np.random.default_rng(seed)
    for _ in range(STATES):
        q, v = rng.uniform(-span, span, model.nq), rng.uniform(-3, 3, model.nv)
        upper = pin.crba(model, data, q)
        mass = np.triu(upper) + np.triu(upper, 1).T
        bias = pin.rnea(model, data, q, v, np.zeros(model.nv))
        row = [*q, *v, *mass.ravel(), *bias]
        if frame is not None:
            align = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            jacobian = pin.computeFrameJacobian(model, data, q, frame, align)[:3]
            pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
            pin.updateFramePlacements(model, data)
            drift = pin.getFrameClassicalAcceleration(model, data, frame, align).linear
            row += [*data.oMf[frame].translation, *jacobian.ravel(), *drift]
        yield row


def urdf(name, seed, span):
    model = pin.buildModelFromUrdf(str(HERE / f"{name}.urdf"))
    model.gravity.linear = np.array([0, 0, -9.81])
    write(f"chain_{name}.csv", header(model.nv, True), states(model, model.createData(), model.getFrameId("tip"), seed, span))


def wrist():
    """Gimbal PS (x), FE (z), AA (y) with the defaults of the device `wrist`."""
    model = pin.Model()
    model.gravity.linear = np.array([0, 0, -9.81])
    here = pin.SE3.Identity()
    bodies = [
        (pin.JointModelRX(), 0.0, [5e-4, 4e-4, 4e-4]),
        (pin.JointModelRZ(), 0.0, [4e-4, 4e-4, 5e-4]),
        (pin.JointModelRY(), 0.3, [1.3e-3, 1.8e-3, 1.3e-3]),
    ]
    parent = 0
    for k, (joint, mass, inertia) in enumerate(bodies):
        parent = model.addJoint(parent, joint, here, f"joint{k}")
        model.appendBodyToJoint(parent, pin.Inertia(mass, np.array([0.03 if mass else 0.0, 0, 0]), np.diag(inertia)), here)
    rotor = 7e-6 * np.array([10.5**2, 2 * 49, 2 * 49])
    rows = []
    for row in states(model, model.createData(), None, 4, 0.9):
        mass = np.array(row[6:15]).reshape(3, 3)
        row[6:15] = (mass + np.diag(rotor)).ravel()
        rows.append(row)
    write("wrist.csv", header(3, False), rows)


def five_bar():
    """Bodies whose sums are the inertias of the device `mit-manus`: H11 0.215, H22 0.180, H12 0.030."""
    l1, l2, l3 = 0.4064, 0.51435, 0.1524
    m1, c1, m2, c2, m3, c3, m4, c4 = 0.4, 0.2, 0.2, 0.2, 0.3, 0.05, 0.3, 0.15
    # H12 = m2 l1 c2 + m4 l3 c4 with a coupler on the far side where that balances.
    l3 = (0.030 - m2 * l1 * c2) / (m4 * c4)
    i4 = 0.002
    i1 = 0.215 - i4 - m1 * c1**2 - m4 * c4**2 - m2 * l1**2
    i3 = 0.002
    i2 = 0.180 - i3 - m2 * c2**2 - m3 * c3**2 - m4 * l3**2
    assert min(i1, i2) > 0

    def body(name, joint, pos, centre, mass, izz, inside=""):
        tensor = f"{0.6 * izz} {0.6 * izz} {izz}"
        return (
            f'<body name="{name}" pos="{pos} 0 0"><joint name="{joint}" axis="0 0 1"/>'
            f'<inertial pos="{centre} 0 0" mass="{mass}" diaginertia="{tensor}"/>{inside}</body>'
        )

    tip = f'<site name="tip" pos="{l2} 0 0"/>'
    xml = '<mujoco><option gravity="0 0 -9.81"/><worldbody>'
    xml += body("upper", "a", 0, c1, m1, i1, body("fore", "b", l1, c2, m2, i2, tip))
    xml += body("crank", "c", 0, c3, m3, i3, body("coupler", "e", l3, c4, m4, i4))
    xml += "</worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    # Tree joints (a, b, c, e) of the parallelogram with absolute angles q: forearm and crank parallel, coupler and upper link too.
    tree = np.array([[1, 0], [-1, 1], [0, 1], [1, -1.0]])

    def projected(q, v):
        data.qpos[:], data.qvel[:] = tree @ q, tree @ v
        mujoco.mj_forward(model, data)
        full = np.zeros((4, 4))
        mujoco.mj_fullM(model, data, full) if mujoco.__version__ >= "4" else mujoco.mj_fullM(model, full, data.qM)
        jacobian = np.zeros((3, 4))
        mujoco.mj_jacSite(model, data, jacobian, None, 0)
        place = data.site_xpos[0].copy()
        return tree.T @ full @ tree, tree.T @ data.qfrc_bias, place, jacobian @ tree

    def drift(q, v, h=1e-4):
        # Fourth-order difference of J(q + t v) v in t.
        j = [projected(q + k * h * v, v)[3] @ v for k in (-2, -1, 1, 2)]
        return (j[0] - 8 * j[1] + 8 * j[2] - j[3]) / (12 * h)

    rng, rows = np.random.default_rng(1), []
    for _ in range(STATES):
        q, v = rng.uniform(-3, 3, 2), rng.uniform(-3, 3, 2)
        mass, bias, place, jacobian = projected(q, v)
        rows.append([*q, *v, *mass.ravel(), *bias, *place, *jacobian.ravel(), *drift(q, v)])
    write("five_bar.csv", header(2, True), rows)

    q, v, h, motion = np.array([0.6, 2.2]), np.array([1.5, -2.0]), 1e-4, []

    def acceleration(q, v):
        mass, bias, _, _ = projected(q, v)
        return np.linalg.solve(mass, -bias)

    for k in range(10001):
        if k % 500 == 0:
            motion.append([k * h, *q, *v])
        k1v, k1 = v, acceleration(q, v)
        k2v, k2 = v + h / 2 * k1, acceleration(q + h / 2 * k1v, v + h / 2 * k1)
        k3v, k3 = v + h / 2 * k2, acceleration(q + h / 2 * k2v, v + h / 2 * k2)
        k4v, k4 = v + h * k3, acceleration(q + h * k3v, v + h * k3)
        q, v = q + h / 6 * (k1v + 2 * k2v + 2 * k3v + k4v), v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    write("five_bar_motion.csv", ["t", "q0", "q1", "v0", "v1"], motion)


urdf("two_link", 1, 3.0)
urdf("three_link", 2, 3.0)
urdf("six_joint", 3, 3.0)
wrist()
five_bar()
