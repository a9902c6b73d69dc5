"""The exam's own rules: intervals against closed forms, marks and checks of agreement on answers made up for them.

    python3 tests/exam/test_exam.py
"""

import copy
import unittest

import agreement
import marks
import tables
from statistics_of import calibration, clopper_pearson, quantile


def cause(effect, axis="x", side="limb", probability=0.95, before=0.2, after=0.1, fraction=0.8, interval=(0.7, 0.9), gained=(50.0, 40.0, 60.0), parameters=()):
    gain = {"nrmse_before": [before], "nrmse_after": [after], "vaf_before": [96.0], "vaf_after": [99.0], "log_likelihood": gained[0], "log_likelihood_ci95": list(gained[1:]), "explained_fraction": fraction, "explained_fraction_ci95": list(interval), "delta_bic": 1.0}
    return {"effect": effect, "site": {"side": side, "axis": axis}, "parameters": list(parameters), "probability": probability, "p_value": 1e-9, "gain": gain, "evidence": []}


def answer(*causes, verdict="explained", baseline=0.2, extended=0.1, floor=0.05, confusable=()):
    model = lambda error: {"model": "m", "parameters": [{"name": "M", "value": 2.0, "std_error": 0.01}, {"name": "K", "value": 300.0, "std_error": 1.0}], "held_out": {"nrmse": [error], "vaf_percent": [90.0]}}
    return {
        "verdict": verdict, "causes": list(causes), "baseline": model(baseline), "extended": model(extended) | {"residual_white": None}, "noise_floor": {"nrmse": [floor]},
        "discrepancy": {"linear_share": 0.2, "nonlinear_share": 0.5, "time_varying_share": 0.1, "noise_share": 0.2, "notes": []}, "confusable": [{"effects": list(group)} for group in confusable],
    }


def truth(kind="single", effects=(("hysteresis", ["hysteresis"]),), present=(), strength="clear", parameters=None):
    listed = [{"effect": name, "names": names, "sides": ["limb"], "axis": "x", "parameters": parameters or {}} for name, names in effects]
    return {"id": "q", "kind": kind, "class": strength, "generator": "challenge", "effects": listed, "present": list(present), "axes": ["x", "y"], "plant": "planar", "family": "f",
            "true_model": {"nrmse": [0.05]}, "strength": {"size": 0.0, "output": 0.0}}


def marked(truth, answer):
    return marks.mark(truth, {"result": answer, "error": None, "seconds": 1.0})


class Statistics(unittest.TestCase):
    def test_clopper_and_pearson_where_the_interval_has_a_closed_form(self):
        for n in (1, 10, 500):
            low, high = clopper_pearson(0, n)
            self.assertEqual(low, 0.0)
            self.assertAlmostEqual(high, 1 - 0.025 ** (1 / n), places=12)
            self.assertAlmostEqual(clopper_pearson(n, n)[0], 0.025 ** (1 / n), places=12)

    def test_clopper_and_pearson_against_scipy(self):
        # scipy 1.17.1: stats.binomtest(k, n).proportion_ci(method="exact")
        for k, n, low, high in ((7, 20, 0.153909205, 0.592188535), (222, 246, 0.858318897, 0.936485872), (5, 500, 0.003254721, 0.023181388)):
            self.assertAlmostEqual(clopper_pearson(k, n)[0], low, places=8)
            self.assertAlmostEqual(clopper_pearson(k, n)[1], high, places=8)

    def test_quantiles_lie_between_the_order_statistics(self):
        self.assertEqual(quantile([3, 1, 2], 0.5), 2)
        self.assertAlmostEqual(quantile([0, 10], 0.9), 9)

    def test_calibration_is_zero_where_probabilities_come_true_and_the_distance_where_not(self):
        said = [(0.5, k % 2 == 0) for k in range(100)]
        self.assertAlmostEqual(calibration(said)[0], 0.0)
        self.assertAlmostEqual(calibration([(0.9, False)] * 50)[0], 0.9)


class Marks(unittest.TestCase):
    def test_the_first_name_counts_and_one_that_cannot_be_told_from_it(self):
        self.assertTrue(marked(truth(), answer(cause("hysteresis"), cause("dead-zone"))).first_right)
        self.assertFalse(marked(truth(), answer(cause("dead-zone"), cause("hysteresis"))).first_right)
        beside = marked(truth(), answer(cause("dead-zone"), confusable=[("dead-zone", "hysteresis")]))
        self.assertTrue(beside.first_right)
        self.assertFalse(beside.itself)

    def test_the_limbs_own_force_is_no_wrong_name_where_it_is_large_and_one_where_it_is_not(self):
        said = answer(cause("limb-noise"), cause("hysteresis"))
        self.assertTrue(marked(truth(present=["limb-noise"]), said).first_right)
        self.assertFalse(marked(truth(), said).first_right)
        self.assertEqual(len(marked(truth("null", ()), answer(cause("limb-noise"))).named), 1)

    def test_a_confident_wrong_name_is_sure_alone_and_wrong(self):
        outside = truth("outside", (("x-fatigue", ["stiffness-drift"]),))
        self.assertTrue(marked(outside, answer(cause("dead-zone"))).confident_wrong)
        self.assertFalse(marked(outside, answer(cause("dead-zone", probability=0.9))).confident_wrong)
        self.assertFalse(marked(outside, answer(cause("stiffness-drift"))).confident_wrong)
        self.assertFalse(marked(outside, answer(cause("dead-zone"), confusable=[("dead-zone", "end-stop")])).confident_wrong)

    def test_a_pair_needs_both_and_exactly_means_no_third(self):
        pair = truth("pair", (("hysteresis", ["hysteresis"]), ("channel-filter", ["channel-filter"])))
        two = answer(cause("hysteresis"), cause("channel-filter"))
        three = answer(cause("hysteresis"), cause("channel-filter"), cause("dead-zone"))
        self.assertTrue(marked(pair, two).exactly)
        self.assertTrue(marked(pair, three).both)
        self.assertFalse(marked(pair, three).exactly)
        self.assertFalse(marked(pair, answer(cause("hysteresis"))).both)

    def test_parameters_are_found_by_the_beginning_of_their_names(self):
        said = cause("hysteresis", parameters=[{"name": "stiffness_n_per_m", "value": 90.0, "ci95": [80.0, 110.0]}, {"name": "yield_m", "value": 1.0, "ci95": None}])
        found = marked(truth(parameters={"stiffness": 100.0, "yield": 1.0}), answer(said)).intervals
        self.assertEqual([(group, inside) for group, _, inside, _ in found], [("hysteresis", True), ("hysteresis", None)])
        late = cause("measurement-delay", parameters=[{"name": "delay_s", "value": -0.01, "ci95": [-0.012, -0.008]}])
        found = marked(truth(effects=(("measurement-delay", ["measurement-delay"]),), parameters={"delay": 0.01}), answer(late)).intervals
        self.assertEqual(found[0][2], True)

    def test_no_answer_earns_nothing(self):
        silent = marks.mark(truth("pair"), {"result": None, "error": "none", "seconds": 300.0})
        self.assertFalse(silent.first_right or silent.both or silent.confident_wrong)
        row = next(r for r in tables.rows([silent]) if r.what == "no answer")
        self.assertEqual((row.k, row.n, row.status()), (1, 1, "missed"))


class Agreement(unittest.TestCase):
    def violated(self, answer, periodic=False):
        return {name for check in (*agreement.ALL, *([agreement.harmonics] if periodic else [])) for name in [check.__name__] if list(check(answer))}

    def test_an_answer_that_agrees_violates_nothing(self):
        self.assertEqual(self.violated(answer(cause("hysteresis")), True), set())
        self.assertEqual(self.violated(answer(verdict="adequate", baseline=0.055, extended=0.055)), set())

    def test_each_disagreement_is_seen(self):
        negative = answer(cause("hysteresis"))
        negative["extended"]["parameters"][0]["value"] = -1.0
        flagged = copy.deepcopy(negative)
        flagged["extended"]["parameters"][0]["flag"] = "negative"
        self.assertEqual(self.violated(flagged), set())
        stray = {"name": "level_n", "value": 5.0, "ci95": [1.0, 2.0]}
        round_one = {"name": "level_n", "value": 5.0, "ci95": [4.5, 5.5]}
        drift = answer(cause("hysteresis"))
        drift["discrepancy"]["noise_share"] = 0.5
        for made, check in (
            (answer(verdict="adequate", baseline=0.07, extended=0.07), "adequate"),
            (answer(cause("hysteresis", after=0.2)), "free_run"),
            (answer(cause("hysteresis", gained=(-5.0, -7.0, -3.0))), "contradicted"),
            (answer(cause("hysteresis", fraction=0.3), cause("dead-zone", fraction=0.6)), "ordered"),
            (answer(cause("hysteresis"), verdict="partly-explained", extended=0.3), "not_worse"),
            (answer(verdict="unexplained", extended=0.19), "not_worse"),
            (answer(cause("hysteresis"), floor=0.11), "floor_lowest"),
            (negative, "physical"),
            (answer(cause("coulomb-friction", parameters=[stray])), "computed"),
            (answer(cause("coulomb-friction", parameters=[round_one])), "computed"),
            (answer(cause("coulomb-friction", probability=1.2)), "computed"),
            (drift, "shares"),
            (answer(cause("hysteresis", fraction=1.02)), "shares"),
        ):
            self.assertEqual(self.violated(made), {check})
        self.assertEqual(self.violated(answer(cause("hysteresis"), extended=0.3)), {"not_worse", "explained"})
        self.assertEqual(self.violated(answer(cause("hysteresis", gained=(3.0, -1.0, 7.0)))), set())
        self.assertEqual(self.violated(answer(cause("hysteresis", after=0.2, gained=(3.0, -1.0, 7.0)))), {"free_run", "worsening"})
        self.assertEqual(self.violated(answer(cause("periodic-disturbance")), True), {"harmonics"})


if __name__ == "__main__":
    unittest.main()
