"""Reference dynamics of the simulated robots by independent engines.

Writes, into this folder, chain_two_link.csv, chain_three_link.csv, chain_six_joint.csv and wrist.csv (Pinocchio) and
five_bar.csv (MuJoCo: a tree of four bodies whose parallelogram is closed by projection); chain_mjcf_arm.csv and chain_mjcf_gantry.csv (MuJoCo)
are of robots in MJCF, chain_corrected_three_link.csv (Pinocchio), chain_corrected_mjcf_arm.csv and chain_corrected_mjcf_gantry.csv (MuJoCo) of
files that `write_back` corrected, which the engines read here. Each row of these is a random state: q, rates, mass matrix (rows), bias torques, Jacobian of the tip (rows x, y, z; left out where the
joints are the axes), its rate times the joint rates.

regressor_three_link.csv and regressor_six_joint.csv (Pinocchio) hold a few states with rates and accelerations, the torques of the
inverse dynamics and the regressor in the ten inertial parameters of each body (rows); the comment counts the base parameters, the rank
of that regressor over 100 states with its columns scaled to unit norm.

motion_five_bar.csv, motion_wrist.csv and motion_three_link.csv are what the recordings of a robot with a linear limb behind a
transducer hold: struck for 0.04 s, then free to 1 s, without a hold; means of position and force over each 2 ms, from the engine's
dynamics by DOP853 at a relative tolerance of 1e-12.

    NDOF_WRITE_REFERENCES=1 cargo test --release -p ndof-devices written_files
    pip install numpy scipy mujoco pin
    python make_references.py
"""
import csv
import pathlib

import mujoco
import numpy as np
import pinocchio as pin
import scipy
from scipy.integrate import solve_ivp

HERE = pathlib.Path(__file__).parent
STATES = 100
FEW = 20


def write(name, header, rows, note=""):
    with open(HERE / name, "w", newline="") as file:
        file.write(f"# numpy {np.__version__}, scipy {scipy.__version__}, mujoco {mujoco.__version__}, pinocchio {pin.__version__}{note}\n")
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows([[repr(float(v)) for v in row] for row in rows])


def header(n, tip):
    names = [f"q{i}" for i in range(n)] + [f"v{i}" for i in range(n)]
    names += [f"h{i}{j}" for i in range(n) for j in range(n)] + [f"b{i}" for i in range(n)]
    if tip:
        names += [f"{a}" for a in "xyz"] + [f"j{a}{i}" for a in "xyz" for i in range(n)] + [f"d{a}" for a in "xyz"]
    return names


def states(model, data, frame, seed, span, count=STATES):
    """Random states of a Pinocchio model; `frame` is the tip, or None."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
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


def urdf(name, seed, span, count=STATES):
    model = pin.buildModelFromUrdf(str(HERE / f"{name}.urdf"))
    model.gravity.linear = np.array([0, 0, -9.81])
    write(f"chain_{name}.csv", header(model.nv, True), states(model, model.createData(), model.getFrameId("tip"), seed, span, count))


def mjcf(name, tip, seed, span):
    """Random states of a chain that MuJoCo reads."""
    model = mujoco.MjModel.from_xml_path(str(HERE / f"{name}.xml"))
    data, n, rng = mujoco.MjData(model), model.nv, np.random.default_rng(seed)
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, tip)
    rows = []
    for _ in range(FEW):
        q, v = rng.uniform(-span, span, n), rng.uniform(-3, 3, n)
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        mass, jacobian, rate = np.zeros((n, n)), np.zeros((3, n)), np.zeros((3, n))
        mujoco.mj_fullM(model, data, mass) if mujoco.__version__ >= "4" else mujoco.mj_fullM(model, mass, data.qM)
        place = data.xpos[body].copy()
        mujoco.mj_jac(model, data, jacobian, None, place, body)
        mujoco.mj_jacDot(model, data, rate, None, place, body)
        rows.append([*q, *v, *mass.ravel(), *data.qfrc_bias, *place, *jacobian.ravel(), *(rate @ v)])
    write(f"chain_{name}.csv", header(n, True), rows)
    return model


def regressor(name, seed):
    model = pin.buildModelFromUrdf(str(HERE / f"{name}.urdf"))
    model.gravity.linear = np.array([0, 0, -9.81])
    data, n, rng = model.createData(), model.nv, np.random.default_rng(seed)
    rows, stacked = [], []
    for k in range(STATES):
        q, v, a = rng.uniform(-3, 3, n), rng.uniform(-3, 3, n), rng.uniform(-9, 9, n)
        linear = pin.computeJointTorqueRegressor(model, data, q, v, a).copy()
        stacked.append(linear)
        if k < 4:
            rows.append([*q, *v, *a, *pin.rnea(model, data, q, v, a), *linear.ravel()])
    stacked = np.vstack(stacked)
    norm = np.linalg.norm(stacked, axis=0)
    rank = np.linalg.matrix_rank(stacked / np.where(norm > 1e-9, norm, np.inf), tol=1e-8)
    names = [f"{letter}{i}" for letter in "qvat" for i in range(n)] + [f"y{i}_{j}" for i in range(n) for j in range(10 * n)]
    write(f"regressor_{name}.csv", names, rows, f"; base parameters: {rank}")


def wrist_model():
    """Gimbal PS (x), FE (z), AA (y) with the defaults of the device `wrist`, and what its rotors add to the inertia."""
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
    return model, 7e-6 * np.array([10.5**2, 2 * 49, 2 * 49])


def wrist():
    model, rotor = wrist_model()
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

    def dynamics(q, v):
        mass, bias, place, jacobian = projected(q, v)
        return mass, bias, place[:2], jacobian[:2]

    rest = inverse(l1, l2, 0.0, 0.65)
    limb = [np.array(x) for x in ([[2.1, -0.55], [-0.55, 1.9]], [[11.0, -2.0], [-2.0, 15.0]], [[300.0, -60.0], [-60.0, 520.0]])]
    motion("five_bar", dynamics, rest, limb, (1e6, 800.0), np.array([20.0, -15.0]))


def inverse(l1, l2, x, y):
    """Absolute angles of a two-link arm, its forearm counter-clockwise of the upper arm."""
    between = np.arccos((x * x + y * y - l1 * l1 - l2 * l2) / (2 * l1 * l2))
    q1 = np.arctan2(y, x) - np.arctan2(l2 * np.sin(between), l1 + l2 * np.cos(between))
    return np.array([q1, q1 + between])


def motion(name, dynamics, rest, limb, transducer, push, friction=None, compensated=None, fs=500.0):
    """Robot, transducer and linear limb after a push of 20 samples; `compensated(q)` is a torque held like the command's."""
    inertia, damping, stiffness = limb
    n, m, (k, b) = len(rest), len(push), transducer
    _, _, start, _ = dynamics(rest, np.zeros(n))
    mobility = np.linalg.inv(inertia)
    y, rows = np.concatenate([rest, np.zeros(n + 4 * m)]), []
    for sample in range(int(fs)):
        _, _, _, jacobian = dynamics(y[:n], np.zeros(n))
        held = jacobian.T @ (push if sample < 20 else 0 * push)
        if compensated is not None:
            held = held + compensated(y[:n])

        def slope(_, y):
            q, v, x, u = np.split(y[: 2 * (n + m)], [n, 2 * n, 2 * n + m])
            mass, bias, place, jacobian = dynamics(q, v)
            force = k * (place - start - x) + b * (jacobian @ v - u)
            torque = held - jacobian.T @ force - bias
            if friction is not None:
                torque = torque - friction(v)
            pull = force - damping @ u - stiffness @ x
            return np.concatenate([v, np.linalg.solve(mass, torque), u, mobility @ pull, place, force])

        y[2 * (n + m) :] = 0
        y = solve_ivp(slope, (0, 1 / fs), y, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        rows.append(y[2 * (n + m) :] * fs)
    write(f"motion_{name}.csv", [f"p{i}" for i in range(m)] + [f"f{i}" for i in range(m)], rows)


def wrist_motion():
    """The wrist robot under its own weight, which nothing compensates, with a linear limb."""
    model, rotor = wrist_model()
    data = model.createData()

    def dynamics(q, v):
        upper = pin.crba(model, data, q)
        mass = np.triu(upper) + np.triu(upper, 1).T + np.diag(rotor)
        return mass, pin.rnea(model, data, q, v, np.zeros(3)), q, np.eye(3)

    limb = [np.diag([0.0042, 0.0049, 0.0052]), np.diag([0.03, 0.03, 0.05]), np.diag([0.756, 0.992, 2.92])]
    viscous = lambda v: 0.001 * v
    motion("wrist", dynamics, np.array([0.3, -0.2, 0.1]), limb, (3000.0, 2.4), np.array([0.6, -0.5, 0.7]), viscous)


def chain_motion():
    """The three-link chain, its weight carried at the ticks of the controller."""
    model = pin.buildModelFromUrdf(str(HERE / "three_link.urdf"))
    model.gravity.linear = np.array([0, 0, -9.81])
    data, tip = model.createData(), model.getFrameId("tip")

    def dynamics(q, v):
        upper = pin.crba(model, data, q)
        jacobian = pin.computeFrameJacobian(model, data, q, tip, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)[:3]
        place = data.oMf[tip].translation.copy()
        return np.triu(upper) + np.triu(upper, 1).T, pin.rnea(model, data, q, v, np.zeros(3)), place, jacobian

    weight = lambda q: pin.rnea(model, data, q, np.zeros(3), np.zeros(3))
    limb = [np.diag([1.5, 1.2, 1.0]), np.diag([12.0, 10.0, 9.0]), np.diag([300.0, 250.0, 200.0])]
    rest = np.array([0.3, 0.1, 0.8])
    mass, _, _, jacobian = dynamics(rest, np.zeros(3))
    # The transducer that a robot from a URDF has: a mode near 200 Hz, damped by a third.
    inertia = np.linalg.inv(jacobian @ np.linalg.inv(mass) @ jacobian.T).diagonal().max()
    stiffness = max(1e6, (2 * np.pi * 200) ** 2 * inertia)
    transducer = (stiffness, 0.6 * np.sqrt(stiffness * inertia))
    motion("three_link", dynamics, rest, limb, transducer, np.array([15.0, -10.0, 8.0]), compensated=weight)


urdf("two_link", 1, 3.0)
urdf("three_link", 2, 3.0)
urdf("six_joint", 3, 3.0)
mjcf("mjcf_arm", "tip", 7, 2.0)
mjcf("mjcf_gantry", "end", 8, 2.0)
urdf("corrected_three_link", 9, 3.0, FEW)
arm = mjcf("corrected_mjcf_arm", "tip", 10, 2.0)
# What the dynamics do not show: the numbers of `corrections` in crates/devices/tests/suite/write.rs.
assert np.allclose(arm.dof_damping, [0.35, 0.1, 0.15, 0.1]) and np.allclose(arm.dof_frictionloss, [0.05, 0.08, 0.05, 0.01])
assert np.allclose(arm.actuator_delay, [0, 0.0125, 0]) and arm.actuator_history[1, 0] >= 13 and np.allclose(arm.jnt_range[2], [-1.0, 1.5]) and arm.jnt_limited[2]
gantry = mjcf("corrected_mjcf_gantry", "end", 11, 2.0)
assert np.allclose(gantry.jnt_stiffness, [0, 0, 0, 1.8, 0]) and np.allclose(gantry.jnt_range[0], [-1.5, 2.0])
regressor("three_link", 5)
regressor("six_joint", 6)
wrist()
five_bar()
wrist_motion()
chain_motion()
