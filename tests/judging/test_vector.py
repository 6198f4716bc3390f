"""A table as one random vector: probabilities by closed forms, false alarms, power, tails."""

import numpy as np
import pytest
from scipy.stats import binom, binomtest, chi2, norm

from tmalib.judging import simulated
from tmalib.judging.vector import ALPHA, POWER, draw_tables, statistic_of

SIZE = 500


def gaussian(cells, runs=20_000, seed=0):
    return np.random.default_rng(seed).standard_normal((runs, cells))


@pytest.mark.parametrize("statistic", ["mean", "magnitude", "std"])
def test_probability_of_a_gaussian_cell_by_its_distribution(statistic):
    """Means are Gaussian, magnitudes folded, variances chi-square; the spread holds the noise of ours."""
    runs = gaussian(1, runs=100_000) + 0.05
    found = draw_tables(runs, [statistic], SIZE)
    centre, std = runs.mean(), runs.std()
    error = std * np.sqrt(1 / SIZE + 1 / len(runs))

    def below(x):
        if statistic == "std":
            return chi2.cdf((SIZE - 1) * (x / std) ** 2, SIZE - 1)
        mean = norm(centre, error)
        return mean.cdf(x) - (mean.cdf(-x) if statistic == "magnitude" else 0)

    places = {
        "mean": (-0.05, 0.0, 0.03, 0.15),
        "magnitude": (0.001, 0.02, 0.1, 0.16),
        "std": (0.93, 0.99, 1.07),
    }
    for x in places[statistic]:
        unit = 0.001
        exact = 2 * min(below(x + unit), 1 - below(x - unit))
        spread = 2 * np.sqrt(exact / 2 * (1 - exact / 2) / len(found.drawn))
        probability = found.probability(np.array([x]), np.array([unit]))[0]
        assert abs(probability - min(1, exact)) < 5 * spread + 0.015 * (statistic == "std")


def test_few_runs_of_the_paper_and_few_of_ours():
    """Variances of experiments of ten runs are not biased; with as many runs as the paper's the spread of a
    mean is that of a difference of two."""
    runs = gaussian(1)
    squares = draw_tables(runs, ["std"], 10).drawn[:, 0] ** 2
    assert abs(squares.mean() - runs.var()) < 5 * squares.std() / np.sqrt(len(squares))
    few = gaussian(1, runs=400)
    spread = draw_tables(few, ["mean"], 400).drawn[:, 0].std()
    assert spread == pytest.approx(few.std() * np.sqrt(2 / 400), rel=0.03)


def test_the_table_together_by_chi_square():
    """Means of correlated Gaussian errors: Mahalanobis' distance."""
    errors = simulated.correlated_errors(np.random.default_rng(1), 50_000, 3, 0.8)
    tables = draw_tables(errors, ["mean"] * 3, SIZE)
    covariance = np.cov(errors.T) * (1 / SIZE + 1 / len(errors))
    for printed in ([0.05, 0.05, 0.05], [0.05, -0.01, 0.05], [0.06, -0.03, 0.02]):
        off = np.array(printed) - errors.mean(axis=0)
        exact = chi2.sf(off @ np.linalg.solve(covariance, off), 3)
        found = tables.compare(printed, np.full(3, 1e-6)).together
        assert abs(found - exact) < 5 * np.sqrt(exact * (1 - exact) / len(tables.drawn)) + 0.1 * exact


def test_cells_that_pass_alone_and_fail_together():
    """Two spreads that go up together: one up and one down, by less than two standard errors each."""
    errors = simulated.correlated_errors(np.random.default_rng(2), 20_000, 2, 0.98)
    tables = draw_tables(errors[:, [0, 1, 0]], ["std", "std", "mean"], SIZE)
    found = tables.compare([1.05, 0.95, 0.0], [0.001] * 3)
    assert not found.alone.any()
    assert found.together < found.level_together
    assert found.questioned.sum() == 1, "one of the two is left out, and the rest agrees"
    assert not found.questioned[2]
    both_up = tables.compare([1.05, 1.05, 0.0], [0.001] * 3)
    assert not both_up.questioned.any()


def test_a_cell_that_fails_alone_does_not_take_others_with_it():
    tables = draw_tables(gaussian(4), ["mean", "std"] * 2, SIZE)
    found = tables.compare([0.3, 1.0, 0.0, 1.0], [0.01] * 4)
    assert found.questioned.tolist() == [True, False, False, False]
    assert found.together < found.level_together


@pytest.mark.parametrize("printed", [1.05, 0.95])
def test_rounded_or_cut_off_the_most_favourable_value_counts(printed):
    """A printed value with a coarse last digit is as probable as the nearest value that it stands for."""
    tables = draw_tables(gaussian(1), ["std"], SIZE)
    nearest = printed + np.sign(1 - printed) * 0.04
    fine = tables.probability(np.array([nearest]), np.array([0.0]))
    np.testing.assert_allclose(tables.probability(np.array([printed]), np.array([0.04])), fine)


def test_too_small_is_found_whatever_the_tail():
    """One run in 2000 strays by 300 standard deviations: a symmetric test would let even zero pass."""
    runs = gaussian(1, seed=3)
    runs[::2000] *= 300
    tables = draw_tables(runs, ["std"], SIZE)
    found = tables.compare([0.0], [0.01])
    assert found.spread > runs.std() / 3
    assert found.questioned.all()
    low, high = found.accepted[:, 0]
    assert 0.7 < low < 1 < 10 < high, "many experiments have no such run"


def test_rare_runs_have_their_weight():
    """A kind that is one in ten thousand: experiments of 500 have one in five cases of a hundred."""
    runs = np.append(gaussian(1, seed=4)[:, 0], [1000.0] * 4)
    weights = np.repeat([(1 - 1e-4) / 20_000, 1e-4 / 4], [20_000, 4])
    tables = draw_tables(runs[:, None], ["std"], SIZE, weights=weights)
    share = np.mean(tables.drawn > 20)
    k = SIZE * 20_000 / (SIZE + 20_000)
    assert abs(share - (1 - (1 - 1e-4) ** k)) < 4 * np.sqrt(0.05 / len(tables.drawn))
    assert statistic_of(runs, "std", weights) == pytest.approx(np.sqrt(1 + 100), rel=0.02)
    equal = np.full(10, 0.1)
    assert statistic_of(runs[:10], "std", equal) == pytest.approx(np.std(runs[:10], ddof=1))


def false_alarms(seed, cells, pools, papers=20, **kind):
    """How many of ``pools * papers`` tables whose every number is right are questioned."""
    rng, settings = np.random.default_rng(seed), {"experiments": 4000, **kind}
    made = (simulated.synthetic_tables(rng, cells, papers, **settings) for _ in range(pools))
    return int(sum(tables.questioned().sum() for tables in made)), pools * papers


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cells", "kind"),
    [
        (1, {}),
        (2, {"correlation": 0.5}),
        (4, {"correlation": 0.9999, "folded": True}),
        (8, {"correlation": 0.9}),
        (10, {"runs": 1000}),  # ours are not many more than the paper's
        (16, {"folded": True, "correlation": 0.5}),
        (28, {"correlation": 0.99}),
        (28, {"folded": True}),
        (16, {"correlation": 0.5, "freedom": 8}),
        (16, {"correlation": 0.5, "freedom": 5, "folded": True, "runs": 100_000}),
        (28, {"correlation": 0.5, "freedom": 5, "runs": 100_000}),
    ],
)
def test_a_right_table_is_questioned_in_at_most_one_case_of_twenty(cells, kind):
    """Families of 1 to 28 rows, correlated cells, heavy tails, folded biases."""
    questioned, tables = false_alarms(cells, cells, pools=15, **kind)
    assert questioned <= binom.ppf(0.999, tables, ALPHA)


@pytest.mark.slow
def test_nor_much_more_seldom():
    """Without rounding and folding the level is used up."""
    questioned, tables = false_alarms(99, 6, pools=30, correlation=0.3)
    low, _ = binomtest(questioned, tables).proportion_ci(0.999)
    assert low < ALPHA
    assert binomtest(questioned, tables).proportion_ci(0.999)[1] > 0.8 * ALPHA


@pytest.mark.slow
def test_twenty_thousand_runs_do_not_hold_every_tail():
    """With Student's t of three degrees more is questioned than is due; five times as many runs mend it."""
    few, tables = false_alarms(7, 16, pools=20, correlation=0.5, freedom=3)
    many, _ = false_alarms(7, 16, pools=20, correlation=0.5, freedom=3, runs=100_000)
    assert few > binom.ppf(0.95, tables, ALPHA)
    assert many <= binom.ppf(0.999, tables, ALPHA)


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", [{}, {"correlation": 0.9}, {"folded": True}, {"freedom": 6, "correlation": 0.5}]
)
@pytest.mark.parametrize("cells", [1, 6, 28])
def test_shifts_up_and_down_are_found_with_the_power_stated(cells, kind):
    """In every cell that states one, over 25 pools of ours with 20 papers each; none is stated in vain."""
    rng, found, lowest = np.random.default_rng(5), {-1: [], 1: []}, []
    for _ in range(25):
        made = simulated.synthetic_tables(rng, cells, 20, experiments=4000, **kind)
        shifts = made.tables.compare(made.printed[0], made.unit).detectable
        for shift, sign in zip(shifts, found, strict=True):
            share = made.found(sign * np.nan_to_num(shift)).mean(axis=0)
            found[sign].append(np.where(np.isnan(shift), np.nan, share))
        lowest.append(made.tables.ordered[0] > 0)
    positive = np.all(lowest, axis=0)  # what cannot be below zero
    for sign, shares in found.items():
        stated = ~np.isnan(shares).any(axis=0)
        mean, error = np.mean(shares, axis=0), np.std(shares, axis=0, ddof=1) / 5
        assert np.all((mean - POWER > -4.5 * error - 0.01)[stated])
        exact = stated & ~positive if sign < 0 else stated
        assert np.all((np.abs(mean - POWER) < 4.5 * error + 0.01)[exact])
        assert stated.all() or (kind.get("folded") and sign < 0), "a magnitude cannot be too small"


def test_what_is_accepted_ends_where_the_probability_reaches_the_level():
    made = simulated.synthetic_tables(np.random.default_rng(6), 4, 1, experiments=4000)
    (low, high), level = made.tables.compare(made.printed[0], made.unit).accepted, made.tables.levels[0]
    for edge, outwards in ((low, -1), (high, 1)):
        inside = made.tables.probability(edge - outwards * 1e-9, made.unit)
        outside = made.tables.probability(edge + outwards * 1e-9, made.unit)
        assert np.all(inside > level)
        assert np.all(outside <= level)


def test_at_the_limit_our_own_runs_decide():
    """A Gaussian mean at the limit is on either side with other runs of ours, three errors away not."""
    rng = np.random.default_rng(8)
    error = np.sqrt(1 / SIZE + 1 / 20_000)
    own, limit = np.sqrt(1 / 20_000), norm.ppf(1 - ALPHA / 2) * error
    places, sides, near = (limit, limit + 3 * own, limit - 3 * own), [], []
    for _ in range(40):
        tables = draw_tables(rng.standard_normal((20_000, 1)), ["mean"], SIZE, experiments=4000)
        found = [tables.compare([place], [1e-9]) for place in places]
        sides.append([bool(one.alone[0]) for one in found])
        near.append([bool(one.at_limit[0]) for one in found])
    share, flagged = np.mean(sides, axis=0), np.mean(near, axis=0)
    assert 0.2 < share[0] < 0.8
    assert share[1] > 0.97
    assert share[2] < 0.03
    assert flagged[0] > 0.85, "two of them"
    assert np.all(flagged[1:] < 0.4), "it is one of them off itself"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"runs": [[1.0], [np.nan]]}, "runs must be two finite numbers"),
        ({"runs": [[1.0]]}, "runs must be two finite numbers"),
        ({"statistics": ["median"]}, r"statistics must be of .* got \['median'\]"),
        ({"weights": [0.5, 0.6]}, "weights must be 2 positive numbers with the sum 1"),
        ({"size": 0}, "size"),
    ],
)
def test_bad_input(change, message):
    given = {"runs": [[1.0], [2.0]], "statistics": ["mean"], "size": 2} | change
    with pytest.raises(ValueError, match=message):
        draw_tables(given.pop("runs"), given.pop("statistics"), given.pop("size"), **given)
