"""Whether the questions are what they say, by NumPy alone: the torque that the true causes explain is taken from the log's own, and what is left
must be no more than instruments make.

    python3 tests/joints/oracle.py FOLDER [SEED …]

Inverse dynamics are a recursive Newton-Euler of its own, on the numbers of robot.urdf. The floor is what the same steps leave of sim.csv when it
gets the log's noise and encoder steps.
"""

import json
import math
import pathlib
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
from scipy.signal import butter, sosfiltfilt

BAND_HZ = 4.0  # above the movement and its low harmonics, below what encoders of 12 bits leave of an acceleration


def read_urdf(path):
    """Links of a chain as dictionaries of arrays."""
    root = ElementTree.parse(path).getroot()
    numbers = lambda text: np.array([float(v) for v in text.split()])
    bodies = {link.get("name"): link for link in root.findall("link")}
    out = []
    for joint in root.findall("joint"):
        if joint.get("type") != "revolute":
            continue
        inertial = bodies[joint.find("child").get("link")].find("inertial")
        i = {key: float(value) for key, value in inertial.find("inertia").attrib.items()}
        roll, pitch, yaw = numbers(joint.find("origin").get("rpy"))
        out.append({
            "name": joint.get("name"), "place": numbers(joint.find("origin").get("xyz")), "turn": about((0, 0, 1), yaw) @ about((0, 1, 0), pitch) @ about((1, 0, 0), roll),
            "axis": numbers(joint.find("axis").get("xyz")), "mass": float(inertial.find("mass").get("value")), "centre": numbers(inertial.find("origin").get("xyz")),
            "inertia": np.array([[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]]),
        })
    return out


def about(axis, angle):
    """Rotation matrices about an axis, by angle (a number or a column of them)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], float)
    angle = np.asarray(angle, float)[..., None, None]
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def newton_euler(links, q, v, a, gravity=(0.0, 0.0, -9.81)):
    """Torques (samples × joints) that a motion needs; forces and moments in the axes of each link."""
    samples = len(q)
    w, dw = np.zeros((samples, 3)), np.zeros((samples, 3))
    lift = np.tile(-np.asarray(gravity, float), (samples, 1))
    turn = lambda r, x: np.einsum("kij,kj->ki", r, x)
    seen = []
    for j, link in enumerate(links):
        rotation = link["turn"] @ about(link["axis"], q[:, j])  # link -> parent
        back = rotation.transpose(0, 2, 1)
        place = link["place"]
        lift = turn(back, lift + np.cross(dw, place) + np.cross(w, np.cross(w, place)))
        w, dw = turn(back, w), turn(back, dw)
        spin = v[:, j, None] * link["axis"]
        dw = dw + a[:, j, None] * link["axis"] + np.cross(w, spin)
        w = w + spin
        centre = link["centre"]
        force = link["mass"] * (lift + np.cross(dw, centre) + np.cross(w, np.cross(w, centre)))
        moment = dw @ link["inertia"] + np.cross(w, w @ link["inertia"]) + np.cross(centre, force)
        seen.append((rotation, force, moment))
    out = np.empty_like(q)
    force, moment = np.zeros((samples, 3)), np.zeros((samples, 3))
    for j in reversed(range(len(links))):
        rotation, own_force, own_moment = seen[j]
        if j + 1 < len(links):
            below, place = seen[j + 1][0], links[j + 1]["place"]
            force = turn(below, force)
            moment = turn(below, moment) + np.cross(place, force)
        force, moment = force + own_force, moment + own_moment
        out[:, j] = moment @ links[j]["axis"]
    return out


def elements(q, parts):
    """Torque of springs that slip, side by side: (level, stiffness)."""
    out = np.zeros(len(q))
    for level, stiffness in parts:
        state = 0.0
        for k in range(1, len(q)):
            state = min(max(state + stiffness * (q[k] - q[k - 1]), -level), level)
            out[k] += state
    return out


def explained(links, cause, q, v, a, needed, rate_hz, low, told):
    """Torques (samples × joints) that the log has beside the nominal ones because of a cause, before they are filtered; `told` are the log's torques."""
    p, effect = cause["parameters"], cause["effect"]
    out = np.zeros_like(q)
    names = [link["name"] for link in links]
    j = names.index(cause["axis"]) if cause["axis"] else None
    if j is not None:
        speed, torque, angle = v[:, j], needed[:, j], q[:, j]
        side = np.tanh(speed / (0.01 * np.sqrt(np.mean(speed**2))))
    changed = lambda **values: newton_euler([dict(link, **values) if i == j else link for i, link in enumerate(links)], q, v, a) - needed
    bent = lambda by: newton_euler(links, *moved(q - by[:, None] * (np.arange(len(links)) == j), rate_hz, low)) - needed
    if effect == "viscous-friction":
        out[:, j] = p["viscous_nm_s_per_rad"] * speed
    elif effect == "coulomb-friction":
        top = p.get("stribeck_level_nm", p["level_nm"]) - p["level_nm"]
        out[:, j] = (p["level_nm"] + top * np.exp(-((speed / p.get("stribeck_velocity_rad_per_s", 1.0)) ** 2))) * side
    elif effect == "load-friction":
        out[:, j] = p["coefficient"] * np.abs(torque) * side
    elif effect == "motor-inertia":
        out[:, j] = p["rotor_kg_m2"] * a[:, j]
    elif effect == "torque-offset":
        out[:, j] = p["offset_nm"]
    elif effect == "torque-scale":
        out[:, j] = (p["scale"] - 1) * torque
    elif effect == "torque-delay":
        t = np.arange(len(q)) / rate_hz
        out[:, j] = np.interp(t - p["delay_s"], t, torque) - torque
    elif effect == "payload":
        at, last = np.array([p["x_m"], p["y_m"], p["z_m"]]), links[-1]
        ball = dict(last, mass=p["mass_kg"], centre=at, inertia=np.eye(3) * 0.4 * p["mass_kg"] * 0.04**2)
        massless = [dict(link, mass=0.0, inertia=np.zeros((3, 3))) for link in links[:-1]]
        out = newton_euler([*massless, ball], q, v, a)
    elif effect == "link-parameters":
        part, factor = next(iter(p.items()))
        link = links[j]
        out = changed(centre=factor * link["centre"]) if part == "centre_factor" else changed(inertia=factor * link["inertia"], mass=link["mass"] * (factor if part == "mass_factor" else 1))
    elif effect == "base-tilt":
        vector = np.array([p["tilt_x_rad"], p["tilt_y_rad"], 0.0])
        angle = np.linalg.norm(vector)
        out = newton_euler(links, q, v, a, about(vector / angle, angle).T @ (0, 0, -9.81)) - needed
    elif effect == "joint-flexibility":
        out = bent(told[:, j] / p["stiffness_nm_per_rad"])
    elif effect == "backlash":
        # Away from its crossings, which are flights and knocks of the link: the angle that the play leaves.
        by = p["gap_rad"] / 2 * np.sign(told[:, j])
        out = newton_euler(links, q - by[:, None] * (np.arange(len(links)) == j), v, a) - needed
    elif effect == "end-stop":
        up = 1 if p["stop_rad"] > np.mean(angle) else -1
        out[:, j] = up * p["stiffness_nm_per_rad"] * np.maximum(0, up * (angle - p["stop_rad"]))
    elif effect == "cable-force" and "taut_nm_per_rad" in p:
        up = p["side"]
        out[:, j] = up * p["taut_nm_per_rad"] * p["soft_rad"] * np.logaddexp(0, up * (angle - p["rest_rad"]) / p["soft_rad"])
    elif effect == "cable-force":
        out[:, j] = p["linear_nm_per_rad"] * (angle - p["rest_rad"]) + p["cubic_nm_per_rad3"] * (angle - p["rest_rad"]) ** 3
    elif effect == "gear-hysteresis":
        shares = ((1.0, 1.0),) if cause["variant"] == "one-element" else ((0.5, 0.3), (0.3, 1.0), (0.2, 2.0))
        distance = p["level_nm"] * sum(s / t for s, t in shares) / p["stiffness_nm_per_rad"]
        out[:, j] = elements(angle, [(s * p["level_nm"], s * p["level_nm"] / (t * distance)) for s, t in shares])
    return out


def moved(q, rate_hz, low):
    """Low-passed angles, speeds, accelerations."""
    q = low(q)
    v = np.gradient(q, 1 / rate_hz, axis=0)
    return q, v, np.gradient(v, 1 / rate_hz, axis=0)


def judge(folder):
    """By joint: shares of the torque that the nominal model lacks, that is left with the truth, and that instruments make."""
    truth = json.loads((folder / "question.json").read_text())
    links, rate_hz, n = read_urdf(folder / "robot.urdf"), truth["rate_hz"], len(truth["joints"])
    sos = butter(4, BAND_HZ, fs=rate_hz, output="sos")
    low = lambda x: sosfiltfilt(sos, x, axis=0)
    inner = slice(round(rate_hz), -round(rate_hz))
    rms = lambda x: np.sqrt(np.mean(x[inner] ** 2, axis=0))
    log = np.loadtxt(folder / "log.csv", delimiter=",", skiprows=1)
    q, v, a = moved(log[:, 1 + n : 1 + 2 * n], rate_hz, low)
    needed = newton_euler(links, q, v, a)
    told = low(log[:, 1 : 1 + n])
    before = told - low(needed)
    after, scale = before.copy(), rms(needed)
    for cause in truth["causes"]:
        after = after - low(explained(links, cause, q, v, a, needed, rate_hz, low, told))
    sim = np.loadtxt(folder / "sim.csv", delimiter=",", skiprows=1)
    rng, step = np.random.default_rng(truth["seed"]), 2 * math.pi / 2 ** truth["encoder_bits"]
    noise = rng.standard_normal((len(sim), n))
    if truth["noise_coloured"]:
        keep = math.exp(-2 * math.pi * 10 / rate_hz)
        for k in range(1, len(noise)):
            noise[k] = keep * noise[k - 1] + math.sqrt(1 - keep**2) * noise[k]
    floor = low(sim[:, 1 : 1 + n] + truth["noise_share"] * scale * noise) - low(newton_euler(links, *moved(np.round(sim[:, 1 + n : 1 + 2 * n] / step) * step, rate_hz, low)))
    return truth, rms(before) / scale, rms(after) / scale, rms(floor) / scale


def main():
    folder, seeds = pathlib.Path(sys.argv[1]), sys.argv[2:]
    for path in sorted(folder.glob("*/question.json")):
        if seeds and path.parent.name not in seeds:
            continue
        truth, before, after, floor = judge(path.parent)
        # The joint that lacks the most beyond the floor.
        worst = int(np.argmax(before / floor))
        left = np.sqrt(np.maximum(after**2 - floor**2, 0))[worst] / before[worst] if truth["causes"] else 0.0
        names = " + ".join(f"{c['effect']}/{c['variant']}@{c['axis'] or '-'} {c['strength']}" for c in truth["causes"]) or "nothing"
        print(f"{truth['id']} {truth['robot']:8} {names:70} {truth['joints'][worst]:13} lacks {100 * before[worst]:6.2f} % left {100 * after[worst]:6.2f} % floor {100 * floor[worst]:6.2f} %  unexplained {100 * left:5.1f} %")


if __name__ == "__main__":
    main()
