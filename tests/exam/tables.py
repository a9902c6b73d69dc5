"""The table of what is asked of a diagnosis, from marks."""

import math

import agreement
from statistics_of import calibration, clopper_pearson, quantile


class Row:
    """A share with its exact interval: proven where the whole interval is what is asked, reached where the share is, else missed."""

    def __init__(self, what, k, n, least=None, most=None):
        self.what, self.k, self.n, self.least, self.most = what, k, n, least, most

    def asked(self):
        if self.least is not None and self.most is not None:
            return f"{100 * self.least:.0f} to {100 * self.most:.0f} %"
        return "" if self.least is None and self.most is None else f">= {100 * self.least:.0f} %" if self.most is None else f"<= {100 * self.most:.0f} %"

    def allows(self, share):
        return (self.least is None or share >= self.least) and (self.most is None or share <= self.most)

    def status(self):
        if self.least is None and self.most is None:
            return ""
        if self.n == 0:
            return "no case"
        return "proven" if all(map(self.allows, clopper_pearson(self.k, self.n))) else "reached" if self.allows(self.k / self.n) else "missed"

    def text(self):
        low, high = clopper_pearson(self.k, self.n)
        share = f"{100 * self.k / self.n:5.1f} %" if self.n else "      –"
        interval = f"{100 * low:.1f} to {100 * high:.1f} %" if self.n else ""
        return f"{self.what:58} {self.asked():>11} {self.k:>5} of {self.n:<4} {share}  {interval:17} {self.status()}".rstrip()


class Number:
    """A number against the most that it may be."""

    def __init__(self, what, value, most, count):
        self.what, self.value, self.most, self.count = what, value, most, count

    def text(self):
        value = "–" if self.value is None else f"{self.value:.3f}"
        status = "no case" if self.value is None else "" if self.most is None else "reached" if self.value <= self.most else "missed"
        asked = "" if self.most is None else f"<= {self.most:g}"
        return f"{self.what:58} {asked:>11} {value:>13} of {self.count:<4} {status}".rstrip()


def share(what, marks, hit, least=None, most=None):
    marks = list(marks)
    return Row(what, sum(bool(hit(m)) for m in marks), len(marks), least, most)


def rows(marks):
    of = lambda *kinds, foreign=False: [m for m in marks if m.kind in kinds and (foreign is None or m.foreign == foreign)]
    graded = lambda found, strength: [m for m in found if m.strength == strength]
    right = lambda m: m.first_right
    out = []
    for name, found, clear, weak in (
        ("single", of("single"), 0.97, 0.9), ("other form", of("other"), 0.95, 0.85),
        ("MuJoCo, registry's form", of("single", foreign=True), 0.97, 0.9), ("MuJoCo, other form", of("other", foreign=True), 0.95, 0.85),
    ):
        out.append(share(f"{name}, clear: right first", graded(found, "clear"), right, clear))
        out.append(share(f"{name}, 20 to 50 %: right first", graded(found, "middle"), right))
        out.append(share(f"{name}, weak: right first", graded(found, "weak"), right, weak))
    placed = [m for m in of("single", "other", foreign=None) if m.itself]
    out.append(share("right axis, of those that have one of several", [m for m in placed if m.truth["effects"][0]["axis"] and len(m.truth["axes"]) > 1], lambda m: m.named[0].axis == m.truth["effects"][0]["axis"], 0.98))
    out.append(share("right side, of those named first", placed, lambda m: m.named[0].side in m.truth["effects"][0]["sides"], 0.98))
    out.append(share("hidden in the robot: nothing of the limb named", of("robot"), lambda m: m.answer is not None and not m.on_the_limb, 0.98))
    out.append(share("against given parameters: right first", of("against"), right))
    out.append(share("limb's own force, large: right first", of("noise"), right))
    intervals = [i for m in marks if m.strength != "faint" for i in m.intervals]
    for group in ("friction", "hysteresis", "springs", "delays", "reflex", "others"):
        inside = [i[2] for i in intervals if i[0] == group and i[2] is not None]
        out.append(Row(f"true parameter in its 95 % interval: {group}", sum(inside), len(inside), 0.9, 0.98))
    out.append(share("parameters without an interval", intervals, lambda i: i[2] is None))
    nulls = of("null", foreign=None)
    out.append(share("nothing hidden: a cause named (limb-noise included)", nulls, lambda m: m.named, most=0.01))
    out.append(share("nothing hidden: called unexplained", nulls, lambda m: m.verdict == "unexplained", most=0.02))
    small = [m for m in of("background") if max(m.truth["strength"]["size"], m.truth["strength"]["output"]) < 0.01]
    out.append(share("small imperfections below the tolerance: a cause named", small, lambda m: m.named, most=0.05))
    outside = of("outside")
    out.append(share("outside the registry: a confident wrong name", outside, lambda m: m.confident_wrong, most=0.05))
    out.append(share("outside the registry: called unexplained, or partly", outside, lambda m: m.verdict in ("unexplained", "partly-explained")))
    out.append(share("pairs: both named", of("pair"), lambda m: m.both, 0.9))
    out.append(share("pairs: exactly the two", of("pair"), lambda m: m.exactly, 0.75))
    out.append(share("no answer", marks, lambda m: m.answer is None, most=0.0))
    return out


def numbers(marks):
    out = []
    said = lambda found: [(n.probability, n.right) for m in found for n in m.named if n.probability is not None]
    known = said(m for m in marks if not m.foreign and m.kind in ("single", "pair", "null", "background", "noise"))
    unseen = said(m for m in marks if m.foreign or m.kind in ("other", "outside"))
    for what, found, most in (("calibration error, registry's forms on new seeds", known, 0.05), ("calibration error, other families", unseen, 0.08)):
        out.append(Number(what, calibration(found)[0] if found else None, most, len(found)))
    ratios = [m.over_true for m in marks if m.kind == "single" and m.strength in ("clear", "middle", "weak") and m.over_true is not None]
    for what, at, most in (("median", 0.5, 1.1), ("90 %", 0.9, 1.5)):
        out.append(Number(f"extended over true model's held-out error, {what}", quantile(ratios, at) if ratios else None, most, len(ratios)))
    return out


def bins(marks):
    said = [(n.probability, n.right) for m in marks for n in m.named if n.probability is not None]
    return calibration(said)[1] if said else []


def families(marks):
    """Right first by family, as (family, right, asked)."""
    found = {}
    for m in marks:
        if m.kind in ("single", "other", "against", "noise") and m.strength != "faint":
            right, asked = found.get(m.truth["family"], (0, 0))
            found[m.truth["family"]] = (right + m.first_right, asked + 1)
    return [(family, *counts) for family, counts in sorted(found.items())]


def answers(marks):
    """What was named first, by what was hidden."""
    found = {}
    for m in marks:
        if len(m.truth["effects"]) <= 1 and m.strength != "faint":
            hidden = m.truth["effects"][0]["effect"] if m.truth["effects"] else "nothing"
            told = "no answer" if m.answer is None else m.named[0].effect if m.named else "nothing" if m.verdict == "adequate" else m.verdict
            counts = found.setdefault(hidden, {})
            counts[told] = counts.get(told, 0) + 1
    return sorted(found.items())


def parameters(marks):
    """By parameter: inside, with an interval, all, and the median relative error."""
    found = {}
    for m in marks:
        if m.strength != "faint":
            for _, name, inside, error in m.intervals:
                found.setdefault(name, []).append((inside, error))
    return [(name, sum(bool(i) for i, _ in v), sum(i is not None for i, _ in v), len(v), quantile([e for _, e in v], 0.5)) for name, v in sorted(found.items())]


def seconds(marks):
    found = {}
    for m in marks:
        found.setdefault(m.truth["plant"], []).append(m.seconds)
    return [(plant, len(v), quantile(v, 0.5), quantile(v, 0.9)) for plant, v in sorted(found.items())]


def violations(judged, fits):
    """By check: violated answers and examples; judged is (name, answer, whether the input repeats), fits are those of the baselines' data."""
    told = [(name, agreement.like_the_fit(answer, fit)) for (name, answer, _), fit in zip(judged, fits)]
    far = [(name, "another baseline than `fit` finds") for name, holds in told if holds is False]
    out = [("the baseline is what `ndof fit` finds in the same data", len(far), sum(holds is not None for _, holds in told), far)]
    for check in (*agreement.ALL, agreement.harmonics):
        found = [(name, sentence) for name, answer, periodic in judged if check is not agreement.harmonics or periodic for sentence in check(answer)]
        asked = sum(check is not agreement.harmonics or periodic for _, _, periodic in judged)
        out.append((agreement.NAMES[check], len({name for name, _ in found}), asked, found))
    return out


def text(marks, judged, fits, verbose=False):
    """Everything as lines."""
    kinds = sorted({m.kind for m in marks})
    lines = [f"{len(marks)} questions: " + ", ".join(f"{k} {sum(m.kind == k for m in marks)}" for k in kinds)]
    lines.append(f"{'':58} {'asked':>11} {'measured':>21}   95 % interval")
    lines += [row.text() for row in rows(marks)] + [number.text() for number in numbers(marks)]
    lines.append("\nprobabilities in five bins of equal count: mean stated, share right, names")
    lines += [f"  {stated:.3f} {right:.3f} {count}" for stated, right, count in bins(marks)]
    lines.append("\nnumbers that disagree: answers, of")
    for name, count, asked, found in violations(judged, fits):
        lines.append(f"{name:88} {count:>5} of {asked}")
        lines += [f"    {where}: {sentence}" for where, sentence in (found if verbose else found[:2])]
    lines.append("\nhidden -> named first")
    lines += [f"{hidden:24} " + ", ".join(f"{told} {count}" for told, count in sorted(counts.items(), key=lambda c: -c[1])) for hidden, counts in answers(marks)]
    lines.append("\nfamilies: right first")
    lines += [f"{family:52} {right:>3} of {asked}" for family, right, asked in families(marks)]
    lines.append("\nparameter: inside its interval, intervals, values, median relative error")
    lines += [f"{name:40} {inside:4} {given:4} {count:4} {error:.4f}" for name, inside, given, count, error in parameters(marks)]
    lines.append("\nplant: questions, seconds of a diagnosis on one thread (median, 90 %)")
    lines += [f"{plant:18} {count:5} {middle:7.2f} {most:7.2f}" for plant, count, middle, most in seconds(marks)]
    for m in marks:
        if m.error:
            lines.append(f"no answer: {m.truth['id']}: {m.error.splitlines()[-1] if m.error else ''}")
    return "\n".join(lines) + "\n"


def rivals(marks, told):
    """What others name of the questions of one axis; a name is for sure, since neither says how sure it is."""
    lines = ["rivals, on the questions of one axis"]
    for rival in ("PySINDy", "correlation", "ndof"):
        first, false = {}, {}
        for m in marks:
            if m.truth["id"] not in told or m.strength == "faint":
                continue
            names = [n.effect for n in m.named] if rival == "ndof" else told[m.truth["id"]][rival]
            right = m.first_right if rival == "ndof" else bool(names) and any(names[0] in effect["names"] for effect in m.truth["effects"])
            if m.kind in ("single", "other"):
                first.setdefault((m.kind, m.strength), []).append(right)
            elif m.kind == "null":
                false.setdefault("nothing hidden: a cause named", []).append(bool(names))
            elif m.kind == "outside":
                wrong = m.confident_wrong if rival == "ndof" else bool(names) and names[0] not in m.truth["effects"][0]["names"]
                false.setdefault("outside the registry: a confident wrong name", []).append(wrong)
        for (kind, strength), hits in sorted(first.items()):
            lines.append(Row(f"{rival}: {'single' if kind == 'single' else 'other form'}, {strength}: right first", sum(hits), len(hits)).text())
        for what, hits in sorted(false.items()):
            lines.append(Row(f"{rival}: {what}", sum(hits), len(hits)).text())
    return "\n".join(lines) + "\n"
