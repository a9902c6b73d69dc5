"""Oracle for the force laws of the effects: the force that each needs for one prescribed motion.

Written from the equations alone (SCIENCE-style closed forms or fine quadrature with SciPy), not from the Rust code. The motion is
x = 0.01 sin(2 pi 1.3 t) + 0.004 sin(2 pi 3.1 t + 0.5), at rest before t = 0 for the hidden states. Writes effects.json beside itself.
    python effects.py        (NumPy, SciPy; versions are stored in the file)
"""

import json
import pathlib

import numpy as np
import scipy
from scipy.integrate import solve_ivp

W1, W2 = 2 * np.pi * 1.3, 2 * np.pi * 3.1


def x(t):
    return 0.01 * np.sin(W1 * t) + 0.004 * np.sin(W2 * t + 0.5)


def v(t):
    return 0.01 * W1 * np.cos(W1 * t) + 0.004 * W2 * np.cos(W2 * t + 0.5)


T = np.linspace(0.5, 3.0, 26)


def ode(rate, n):
    s = solve_ivp(lambda t, z: rate(t, z), (0, 3.0), np.zeros(n), t_eval=T, rtol=1e-10, atol=1e-14, max_step=1e-3)
    return s.y


out = []


def case(name, parameters, force):
    out.append(dict(effect=name, parameters=parameters, force=[float(f) for f in force]))


case("coulomb-friction", dict(level_n=1.5, stribeck_level_n=2.0, stribeck_velocity_m_per_s=0.02, smoothing_m_per_s=1e-3),
     (1.5 + 0.5 * np.exp(-(v(T) / 0.02) ** 2)) * np.tanh(v(T) / 1e-3))
case("cubic-stiffness", dict(k3_n_per_m3=2e5), 2e5 * x(T) ** 3)
case("asymmetric-stiffness", dict(k2_n_per_m2=3e3), 3e3 * x(T) ** 2)
case("dead-zone", dict(half_gap_m=0.003), -400 * np.clip(x(T), -0.003, 0.003))
case("end-stop", dict(position_m=0.006, stiffness_n_per_m=900), 900 * np.maximum(x(T) - 0.006, 0))
case("end-stop", dict(position_m=-0.006, stiffness_n_per_m=900), -900 * np.maximum(-x(T) - 0.006, 0))
y = 0.003
case("hysteresis", dict(stiffness_n_per_m=300, yield_m=y),
     300 * ode(lambda t, z: [v(t) - (abs(v(t)) * z[0] + v(t) * abs(z[0])) / (2 * y)], 1)[0])
case("viscoelastic", dict(modulus_n_per_m=250, time_s=0.12), 250 * (x(T) - ode(lambda t, z: [(x(t) - z[0]) / 0.12], 1)[0]))
w = 2 * np.pi * 5.0
m2 = 0.2 * 2.0
s = ode(lambda t, z: [z[1], w * w * (x(t) - z[0]) + 2 * 0.06 * w * (v(t) - z[1])], 2)
case("extra-resonance", dict(frequency_hz=5.0, damping_ratio=0.06, mass_share=0.2),
     m2 * (w * w * (x(T) - s[0]) + 2 * 0.06 * w * (v(T) - s[1])))
tau, wm = 0.04, 2 * np.pi * 3.0
s = ode(lambda t, z: [z[1], wm * wm * (100 * x(t - tau) + 6 * v(t - tau) - z[0]) - 2 * wm * z[1]], 2)
case("reflex-delay", dict(delay_s=tau, stiffness_n_per_m=100, damping_n_s_per_m=6, cutoff_hz=3.0), s[0])
s = ode(lambda t, z: [z[1], wm * wm * (6 * max(v(t - tau), 0.0) - z[0]) - 2 * wm * z[1]], 2)
case("reflex-delay", dict(delay_s=tau, damping_n_s_per_m=6, cutoff_hz=3.0, one_directional=1.0), s[0])
case("stiffness-drift", dict(fraction_per_s=0.02), 0.02 * (T - 1.5) * 400 * x(T))
case("posture-drift", dict(rate_m_per_s=0.001), -400 * 0.001 * (T - 1.5))
for name, of in [("varying-stiffness", x), ("varying-damping", v)]:
    swing = dict(swing_n_per_m=120.0) if of is x else dict(swing_n_s_per_m=3.0)
    case(name, dict(**swing, cycle_s=0.7), list(swing.values())[0] * np.cos(2 * np.pi * T / 0.7) * of(T))
for side, drive in [(0.0, v), (-1.0, lambda t: -max(-v(t), 0.0))]:
    gain = lambda t: 5 * (1 + 0.8 * np.cos(2 * np.pi * t / 0.7))
    s = ode(lambda t, z: [z[1], wm * wm * (gain(t) * drive(t - tau) - z[0]) - 2 * wm * z[1]], 2)
    case("varying-reflex", dict(delay_s=tau, damping_n_s_per_m=5, depth=0.8, cycle_s=0.7, cutoff_hz=3.0, one_directional=side), s[0])
case("gravity", dict(torque_nm=2.5, direction_rad=0.3), 2.5 * np.sin(x(T) - 0.3))
case("periodic-disturbance", dict(frequency_hz=6.0, amplitude_n=0.8), -0.8 * np.sin(2 * np.pi * 6.0 * T))
u = (T - 1.0) / 0.2
case("transient-disturbance", dict(time_s=1.0, impulse_n_s=0.3), -np.where((u >= 0) & (u < 1), 2 * 0.3 / 0.2 * np.sin(np.pi * u) ** 2, 0))

doc = dict(numpy=np.__version__, scipy=scipy.__version__, stiffness=400.0, mass=2.0, duration_s=3.0, time_s=[float(t) for t in T], cases=out)
pathlib.Path(__file__).with_suffix(".json").write_text(json.dumps(doc, indent=1) + "\n")
