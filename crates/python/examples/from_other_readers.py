"""Recordings from files by the ordinary readers of their formats, for what `ndof.read` leaves out or where you want the choice.

    pip install pyxdf mcap-ros2-support ezc3d npTDMS

Each function gives an `ndof.Recording`; the units are converted as in files.
"""

import numpy as np

import ndof


# ANCHOR: xdf
def from_xdf(path, stream):
    """One stream of a recording of the Lab Streaming Layer, on the clock of the recording computer (pyxdf)."""
    import pyxdf

    streams, _ = pyxdf.load_xdf(path)
    one = next(s for s in streams if s["info"]["name"][0] == stream)
    channels = one["info"]["desc"][0]["channels"][0]["channel"]
    names = [f"{c['label'][0]} [{c['unit'][0]}]" for c in channels]
    stamps = one["time_stamps"]
    rate = one["info"]["effective_srate"] or float(one["info"]["nominal_srate"][0])
    return ndof.Recording(dict(zip(names, one["time_series"].T)), round(rate, 6), start_s=stamps[0], name=f"{path}: {stream}")


# ANCHOR_END: xdf
# ANCHOR: mcap
def from_mcap(path, topic, sample_rate_hz):
    """The joints of a topic of JointState, interpolated onto a regular clock (mcap-ros2-support)."""
    from mcap_ros2.reader import read_ros2_messages

    messages = [m.ros_msg for m in read_ros2_messages(path, topics=[topic])]
    seconds = np.array([m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for m in messages])
    seconds -= seconds[0]
    times = np.arange(0.0, seconds[-1], 1.0 / sample_rate_hz)
    channels = {}
    for prefix, unit, field in [("angle", "rad", "position"), ("vel", "rad/s", "velocity"), ("torque", "N m", "effort")]:
        values = np.array([getattr(m, field) for m in messages])
        for k, joint in enumerate(messages[0].name if values.size else []):
            channels[f"{prefix}_{joint} [{unit}]"] = np.interp(times, seconds, values[:, k])
    return ndof.Recording(channels, sample_rate_hz, name=f"{path}: {topic}")


# ANCHOR_END: mcap
# ANCHOR: c3d
def from_c3d(path):
    """The analog channels of a C3D file at their own rate (ezc3d)."""
    import ezc3d

    analog = (file := ezc3d.c3d(path))["parameters"]["ANALOG"]
    names = [f"{label} [{unit}]" for label, unit in zip(analog["LABELS"]["value"], analog["UNITS"]["value"])]
    return ndof.Recording(dict(zip(names, file["data"]["analogs"][0])), float(analog["RATE"]["value"][0]), name=str(path))


# ANCHOR_END: c3d
# ANCHOR: tdms
def from_tdms(path, group):
    """A group of a file of LabVIEW (npTDMS)."""
    from nptdms import TdmsFile

    channels = [c for c in TdmsFile.read(path)[group].channels() if "wf_increment" in c.properties]
    names = [f"{c.name} [{c.properties.get('unit_string', '')}]" for c in channels]
    rate = 1.0 / channels[0].properties["wf_increment"]
    return ndof.Recording({name: c[:] for name, c in zip(names, channels)}, rate, name=f"{path}: {group}")


# ANCHOR_END: tdms
