"""Stiffness of the spring array's nine configurations: analytic, and by differences of the force.

Prints the table of crates/devices/src/limb/spring_array.rs. Needs NumPy only.
"""
import numpy as np

MOUNTS = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]
OUTER, INNER, REST = 0.23, 0.05, 0.10
CONFIGURATIONS = {
    "sa1": {1: 250, 5: 250, 0: 100, 4: 100, 2: 100, 6: 100},
    "sa2": {3: 250, 7: 250, 0: 100, 4: 100, 2: 100, 6: 100},
    "sa3": {1: 150, 5: 150, 0: 100, 4: 100},
    "sa4": {1: 100, 3: 100, 5: 100, 7: 100},
    "sa5": {i: 100 for i in range(8)},
    "sa6": {1: 150, 5: 150, 2: 100, 6: 100},
    "sa7": {3: 150, 7: 150, 2: 100, 6: 100},
    "sa8": {3: 150, 7: 150, 0: 100, 4: 100},
    "sa9": {1: 300, 5: 300, 3: 100, 7: 100},
}


def force(x, springs):
    total = np.zeros(2)
    for i, k in springs.items():
        v = np.array(MOUNTS[i]) * (OUTER - INNER) - x
        length = np.linalg.norm(v)
        total += max(0.0, k * (length - REST)) * v / length
    return total


def stiffness(springs, h=1e-5):
    return -np.column_stack([(force(h * e, springs) - force(-h * e, springs)) / (2 * h) for e in np.eye(2)])


for name, springs in CONFIGURATIONS.items():
    k = stiffness(springs)
    print(f'("{name}", [{k[0, 0]:.1f}, {k[0, 1]:.1f}, {k[1, 1]:.1f}]),')
