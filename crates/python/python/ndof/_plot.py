"""Figures with matplotlib, which is imported only here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._diagnose import Diagnosis
    from ._fit import Fit
    from ._response import FrequencyResponse
    from ._spectra import CrossSpectra

FREQUENCY = "frequency (Hz)"


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.subplots(layout="constrained")[1]


def plot_power(spectra: CrossSpectra, ax: Any) -> Any:
    ax = _axes(ax)
    hz = spectra.frequency_hz[1:]
    for name in spectra.names:
        ax.loglog(hz, spectra.power(name)[1:], label=name)
    ax.set_xlabel(FREQUENCY)
    ax.set_ylabel("power density (unit² / Hz)")
    ax.legend()
    return ax


def plot_bode(response: FrequencyResponse, model: Fit | None, fig: Any) -> Any:
    hz, value = response.frequency_hz, response.value
    gain_ci, phase_ci = response.gain_ci95, np.degrees(response.phase_ci95_rad)
    rows, columns = value.shape[:2]
    if fig is None:
        from matplotlib import pyplot

        fig = pyplot.figure(figsize=(4 * columns, 3.6 * rows), layout="constrained")
    axes = fig.subplots(2 * rows, columns, squeeze=False, sharex=True, height_ratios=[2, 1] * rows)
    drawn = hz > 0
    fitted = model.response(hz[drawn], response.kind) if model is not None else None
    for i, output in enumerate(response.outputs):
        for j, input in enumerate(response.inputs):
            gain, phase = axes[2 * i, j], axes[2 * i + 1, j]
            gain.set_title(f"{output} ← {input}")
            gain.loglog(hz[drawn], np.abs(value[i, j])[drawn], color="C0")
            gain.fill_between(hz[drawn], gain_ci[i, j, drawn, 0], gain_ci[i, j, drawn, 1], color="C0", alpha=0.25, lw=0)
            phase.semilogx(hz[drawn], np.degrees(np.angle(value[i, j]))[drawn], color="C0")
            phase.fill_between(hz[drawn], phase_ci[i, j, drawn, 0], phase_ci[i, j, drawn, 1], color="C0", alpha=0.25, lw=0)
            if fitted is not None:
                gain.loglog(hz[drawn], np.abs(fitted[i, j]), color="C1", ls="--")
                phase.semilogx(hz[drawn], np.degrees(np.angle(fitted[i, j])), color="C1", ls="--")
            phase.set_ylim(-180, 180)
            phase.set_yticks([-180, -90, 0, 90, 180])
            if j == 0:
                gain.set_ylabel(response.kind)
                phase.set_ylabel("phase (°)")
            if i == rows - 1:
                phase.set_xlabel(FREQUENCY)
    return fig


def plot_coherence(response: FrequencyResponse, kind: str, ax: Any) -> Any:
    ax = _axes(ax)
    hz, values = response.frequency_hz, response.coherence(kind)
    for i, row in enumerate(values):
        for j, line in enumerate(np.atleast_2d(row)):
            name = response.outputs[i] if kind == "multiple" else f"{response.outputs[i]} ← {response.inputs[j]}"
            ax.semilogx(hz[hz > 0], line[hz > 0], label=name)
    threshold = response.significance_95[kind]
    if threshold is not None:
        ax.axhline(threshold, color="0.5", ls=":", label="95 % by chance")
    ax.set_ylim(0, 1)
    ax.set_xlabel(FREQUENCY)
    ax.set_ylabel(f"{kind} coherence γ²")
    ax.legend()
    return ax


def plot_parameters(fit: Fit, ax: Any) -> Any:
    ax = _axes(ax)
    parameters = fit.parameters
    for k, p in enumerate(parameters):
        size = abs(p["value"] or 1.0) or 1.0
        low, high = p["ci95"] or (np.nan, np.nan)
        ax.plot([low / size, high / size], [k, k], color="C0" if p["identifiable"] else "0.7")
        ax.plot([(p["value"] or np.nan) / size], [k], "o", color="C0" if p["identifiable"] else "0.7")
    ax.set_yticks(range(len(parameters)), [p["name"] for p in parameters])
    ax.invert_yaxis()
    ax.set_xlabel("value with 95 % interval, over its own size")
    return ax


def plot_gain(diagnosis: Diagnosis, ax: Any) -> Any:
    ax = _axes(ax)
    result = diagnosis.to_dict()
    outputs = result["outputs"]
    bars = {
        "baseline": result["baseline"]["held_out"]["nrmse"],
        "with its causes": result["extended"]["held_out"]["nrmse"],
        "noise floor": result["noise_floor"]["nrmse"],
    }
    for k, (label, values) in enumerate(bars.items()):
        ax.bar(np.arange(len(outputs)) + 0.27 * (k - 1), [np.nan if v is None else v for v in values], 0.25, label=label)
    ax.set_xticks(range(len(outputs)), outputs)
    ax.set_ylabel("held-out NRMSE")
    ax.legend()
    return ax
