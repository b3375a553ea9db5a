"""Checks a study's analysis.json by a second route.

Recomputes it from table.csv with pandas, SciPy and lifelines. Table `kissing`: shares, their
intervals, median times, stratified log-rank tests, Hodges-Lehmann shifts, and the differences
between grids. Table `factor_means`: means and their intervals. All claims about kissing times,
contact stages, speeds and counts: effects, intervals, p values, the adjustment for the number of
claims, and verdicts.

    pip install lifelines scipy
    python studies/second_route.py results/dkt-morphology-ensemble orientation cells

The second argument is the axis of the table `kissing`, the third the axis of the grids.
"""

import json
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
from lifelines import NelsonAalenFitter
from scipy import stats

SAMPLES = 4000
INTERVAL_TOLERANCE = 0.02
# Of the part of the samples beyond an end of an interval, which is 0.025: four standard deviations
# for 2000 samples there and 4000 here.
RANK_TOLERANCE = 0.017
# table.csv has six digits.
TIME_TOLERANCE = 1e-3
# Of counted p values, relative; drawn ones scatter with the number of draws.
P_TOLERANCE = 1e-3
DRAWS = 100_000
TIMES = ["kiss_time", "contact_stage", "kissing_stage"]
FACTORS = ["sphericity", "roundness", "krumbein_sphericity", "wadell_roundness"]
# Number of groups of a factor that has more values than these.
FEW, GROUPS = 6, 4
# Stands for the time of an event that did not occur.
LAST = 1e9


def read(folder, by):
    table = pd.read_csv(folder / "table.csv")
    table = table[(table.state == "finished") & table[by].notna()].copy()
    table["kissed"] = table.kiss_time.notna()
    table["time"] = table.kiss_time.fillna(table.landing_time)
    return table


def bootstrap(groups, seed=1):
    """Samples of the mean over models of the mean over members.

    Models are drawn anew, and numbers of members once for all models.
    """
    random = np.random.default_rng(seed)
    models = random.integers(len(groups), size=(SAMPLES, len(groups)))
    at = random.random((SAMPLES, max(len(group) for group in groups)))
    means = []
    for group in groups:
        members = (at[:, : len(group)] * len(group)).astype(int)
        means.append(group[members].mean(axis=1))
    return np.take_along_axis(np.stack(means, axis=1), models, axis=1).mean(axis=1)


def interval(groups):
    """95 % interval of the mean over models of the mean over members."""
    return np.quantile(bootstrap(groups), [0.025, 0.975])


def close_ends(what, groups, expected):
    """Checks the ends of a 95 % interval of a bootstrap by the parts of the samples beyond them."""
    samples = bootstrap(groups)
    # table.csv has six digits.
    size = 1e-5 * np.abs(samples).max()
    for sign, end in zip((1, -1), expected):
        beyond = [np.mean(sign * (samples - end) < shift) for shift in (-size, size)]
        if beyond[0] > 0.025 + RANK_TOLERANCE or beyond[1] < 0.025 - RANK_TOLERANCE:
            sys.exit(f"{what}: {end} in analysis.json has {beyond} of the samples beyond it")


def share_interval(groups):
    """Interval of Clopper and Pearson with models as units, for any sum of shares."""
    n, events = len(groups), sum(group.mean() for group in groups)
    low = stats.beta.ppf(0.025, events, n - events + 1) if events > 0 else 0.0
    high = stats.beta.ppf(0.975, events + 1, n - events) if events < n else 1.0
    return [low, high]


def difference_interval(groups):
    """As `interval`; if all differences are equal, with the limit of Clopper and Pearson."""
    outcomes = np.concatenate(groups)
    if outcomes.min() < outcomes.max():
        return interval(groups)
    other = stats.binomtest(0, len(groups)).proportion_ci(0.95, "exact").high
    return [outcomes[0] + other * (end - outcomes[0]) for end in (-1, 1)]


def tolerance(groups):
    """Tolerance of an interval: a share of few runs moves in steps of one run."""
    return INTERVAL_TOLERANCE + 1.0 / sum(len(group) for group in groups)


def middle(values):
    """Median with infinite values last."""
    values = np.sort(values)
    n = len(values)
    return 0.5 * (values[(n - 1) // 2] + values[n // 2])


def median_time(table):
    time = middle(np.where(table.kissed, table.time, np.inf))
    return float(time) if np.isfinite(time) else None


def half_time(table):
    """Time by which half of the runs have kissed, models weighing alike."""
    weight = 1.0 / (table.model.nunique() * table.groupby("model").time.transform("size"))
    events = table.assign(weight=weight)[table.kissed].sort_values("time")
    reached = events.time[events.weight.cumsum() >= 0.5 - 1e-12]
    return float(reached.iloc[0]) if len(reached) else None


def log_rank_excess(first, second):
    """Events of the first sample less those expected: the sum of its martingale residuals."""
    both = pd.concat([first, second])
    if not both.kissed.any():
        return 0.0
    pooled = NelsonAalenFitter(nelson_aalen_smoothing=False).fit(both.time, both.kissed)
    hazard = pooled.cumulative_hazard_at_times(first.time).to_numpy()
    return float(first.kissed.sum() - hazard.sum())


def sign_flip_p(values):
    """Two-sided p value of the sum if every value has either sign (all combinations)."""
    values = np.asarray(values)
    permutations = stats.permutation_test(
        (values, -values),
        # Sums that are equal but for rounding are equal.
        lambda x, y, axis: np.sum(x - y, axis=axis).round(6),
        permutation_type="samples",
        n_resamples=2**20,
        vectorized=True,
    )
    return float(permutations.pvalue)


def pairs(first, second, other):
    """Models of two tables that are equal on the axes `other`."""
    left = {key: group for key, group in first.groupby(other)}
    right = {key: group for key, group in second.groupby(other)}
    return [(left[key], right[key]) for key in left if key in right]


def common_differences(two):
    out = []
    for a, b in two:
        first, second = (g.set_index("member").kissed.astype(float) for g in (a, b))
        both = (first - second).dropna().to_numpy()
        if len(both):
            out.append(both)
    return out


def close(what, found, expected, tolerance=1e-9):
    missing = (found is None) != (expected is None)
    if missing or found is not None and abs(found - expected) > tolerance:
        sys.exit(f"{what}: {expected} in analysis.json, {found} by the second route")


def hodges_lehmann(differences):
    pairs = [(a + b) / 2 for a, b in combinations(differences, 2)]
    return float(np.median(np.append(differences, pairs)))


def meets(table, where):
    """Rows that meet the conditions: a level, several levels, or a range of a factor."""
    keep = pd.Series(True, table.index)
    for name, condition in where.items():
        if isinstance(condition, str):
            keep &= table[name] == condition
        elif isinstance(condition, list):
            keep &= table[name].isin(condition)
        else:
            low, high = condition.get("at_least"), condition.get("at_most")
            keep &= table[name].notna()
            keep &= (low is None or table[name] >= low) & (high is None or table[name] <= high)
    return table[keep]


def observations(table, quantity, axes):
    """One row per model of which more than half of the members have the quantity.

    Times are medians with misses last, other quantities means; `runs` holds the members.
    """
    table = table.copy()
    table["value"] = table[quantity].astype(float)
    table["kissed"] = True
    if quantity == "kiss_time":
        table["kissed"] = table.value.notna()
        table["value"] = table.value.fillna(table.landing_time)
    elif quantity == "contact_stage":
        table["kissed"] = table.parted.astype(float) != 0
    elif quantity == "kissing_stage":
        table["kissed"] = (table.parted.astype(float) != 0) | table.tumble_time.notna()
    factors = [name for name in FACTORS if name in table]
    rows = []
    for model, every in table.groupby("model", sort=False):
        runs = every[every.value.notna()]
        if 2 * len(runs) <= len(every):
            continue
        values = runs.value.to_numpy()
        if quantity in TIMES:
            value = middle(np.where(runs.kissed, values, np.inf))
        else:
            value = values.mean()
        row = {name: every[name].iloc[0] for name in axes + factors}
        row |= {"model": model, "value": value, "censored": np.isinf(value)}
        rows.append(row | {"runs": runs.assign(time=runs.value)})
    return pd.DataFrame(rows)


def order_p(x, y):
    """Two-sided p value of a rank correlation by permutations, and whether they are all."""
    x, y = stats.rankdata(x), stats.rankdata(y)
    everything = len(x) <= 8
    found = stats.permutation_test(
        (y,),
        lambda y, axis: np.abs(np.sum((x - x.mean()) * y, axis=axis)).round(6),
        permutation_type="pairings",
        alternative="greater",
        n_resamples=np.inf if everything else DRAWS,
        vectorized=True,
        rng=np.random.default_rng(1),
    )
    return float(found.pvalue), everything


def correlation(x, y):
    r = float(stats.spearmanr(x, y).statistic)
    n = len(x)
    step = 6 / (n * (n * n - 1))
    z = np.arctanh(np.clip(r, -1 + step, 1 - step))
    width = stats.norm.ppf(0.975) * np.sqrt((1 + r * r / 2) / (n - 3))
    p, everything = order_p(x, y)
    return r, np.tanh(z - width), np.tanh(z + width), p, everything


def signed_ranks(differences):
    """Hodges-Lehmann shift, its interval and the exact p value, ties included."""
    differences = np.asarray(differences)
    n = len(differences)
    if n < 6:
        return None
    averages = [(a + b) / 2 for a, b in combinations(differences, 2)]
    averages = np.sort(np.append(averages, differences))
    # Counts of the sums of the ranks 1 to n over all signs.
    counts = np.ones(1)
    for rank in range(1, n + 1):
        counts = np.append(counts, np.zeros(rank)) + np.append(np.zeros(rank), counts)
    cut = int(np.searchsorted(np.cumsum(counts) / 2**n, 0.025, side="right")) - 1
    kept = differences[differences != 0]
    ranks = stats.rankdata(np.abs(kept).round(9)) * np.sign(kept)
    # Every sign of every rank: the share of sums as far from zero.
    sums = np.zeros(1)
    for rank in np.abs(ranks):
        sums = np.concatenate([sums + rank, sums - rank])
    p = float(np.mean(np.abs(sums) >= abs(ranks.sum()) - 1e-9))
    low, high = averages[cut], averages[-1 - cut]
    return [unbounded(v) for v in (np.median(averages), low, high)] + [p, True]


def unbounded(value):
    return float(np.sign(value) * np.inf if abs(value) > 1e-3 * LAST else value)


def paired(here, axis, first, second, axes):
    """Observations at two levels of an axis that are equal on all others."""
    other = [name for name in axes if name != axis]
    at = [here[here[axis] == level] for level in (first, second)]
    return at[0].merge(at[1], on=other)


def expected_claim(claim, table, every, axes):
    """Effect, interval and p value of a claim; None where they cannot be computed."""
    [(kind, test)] = claim["test"].items()
    here = observations(meets(table, claim["where"]), claim["quantity"], axes)
    if claim["observed"]:
        here = here[~here.censored]
    last = np.where(here.censored, LAST, here.value)
    here = here.assign(last=last)
    if kind == "trend":
        here = here[here[test["with"]].notna()]
        return correlation(here[test["with"]], here["last"]) if len(here) >= 4 else None
    if kind == "range":
        other = [name for name in axes if name != test["over"]]
        here = here[here[test["over"]].notna()]
        groups = here.groupby(other)
        sizes = groups.value.size()
        ranges = groups.value.max() - groups.value.min()
        ranges = ranges.where(~groups.censored.any(), LAST)[sizes == sizes.max()]
        factor = groups[test["with"]].first()[sizes == sizes.max()]
        return correlation(factor, ranges)
    if kind == "near":
        pattern = test["model"].replace("*", "")
        reference = observations(every, claim["quantity"], axes)
        reference = reference[reference.model.str.startswith(pattern)].value.iloc[0]
        if np.isinf(reference):
            return signed_ranks(np.full((~here.censored).sum(), -LAST))
        others = here[~here.model.str.startswith(pattern)]
        return signed_ranks(np.where(others.censored, LAST, others.value / reference - 1))
    first, second = test["values"] if kind == "equal" else (test["more"], test["less"])
    both = paired(here, test["axis"], first, second, axes)
    a, b = both.last_x.to_numpy(), both.last_y.to_numpy()
    # Pairs that miss on both sides.
    missing = (a >= LAST) & (b >= LAST)
    if kind == "equal":
        a, b = a[~missing], b[~missing]
        return signed_ranks(np.where(a == b, 0.0, (a - b) / (0.5 * (a + b))))
    if kind == "spread":
        a, b = a[(a < LAST) & (b < LAST)], b[(a < LAST) & (b < LAST)]
        return correlation(np.log(a) + np.log(b), np.log(a) - np.log(b))
    found = signed_ranks(a - b)
    if found and claim["quantity"] in TIMES and not claim["observed"]:
        excesses = [log_rank_excess(x, y) for x, y in zip(both.runs_x, both.runs_y)]
        found[3] = sign_flip_p(excesses)
    return found


def informative(claim, here, axes):
    """Whether an order has six pairs with the event on either side."""
    [(kind, test)] = claim["test"].items()
    if kind != "order":
        return True
    both = paired(here, test["axis"], test["more"], test["less"], axes)
    return (~(both.censored_x & both.censored_y)).sum() >= 6


def expected_verdict(claim, rate, found, adjusted, enough):
    """Verdict by the rules of docs/reference/study-file.md."""
    _, low, high, _, _ = found
    [(kind, test)] = claim["test"].items()
    size = claim["negligible"]
    inside = enough and size is not None and low >= -size and high <= size
    outside = size is not None and (low > size or high < -size)
    if kind in ("equal", "near") or test.get("sign") == "none" and size is not None:
        return "holds" if inside else "contradicted" if outside else "open"
    significant = rate is None or adjusted < rate
    rises, falls = significant and low > 0, significant and high < 0
    if test.get("sign") == "none":
        return "contradicted" if rises or falls else "open"
    if test.get("sign") == "falls":
        rises, falls = falls, rises
    return "holds" if rises else "contradicted" if falls or inside else "open"


def close_p(what, found, exact, expected):
    scatter = 0.0 if exact else 6.0 * np.sqrt(2.0 * expected / DRAWS) + 2.0 / DRAWS
    close(f"{what}: p", found, expected, P_TOLERANCE * expected + 1e-12 + scatter)


def check_claims(analysis, folder, axes):
    """Checks effects, intervals, p values, their adjustment and verdicts of all claims."""
    every = pd.read_csv(folder / "table.csv")
    every = every[every.state == "finished"]
    table = meets(every, analysis.get("where", {}))
    # The adjustment and the verdicts use the p values that have been checked.
    family = [claim for claim in analysis["claims"] if claim["adjusted_p"] is not None]
    adjusted = stats.false_discovery_control([claim["p"] for claim in family]) if family else []
    for claim, p in zip(family, adjusted):
        close(f"{claim['claim']}: adjusted p", float(p), claim["adjusted_p"], 1e-9)
    rate = 0.05 if family else None
    checks = len(family)
    for claim in analysis["claims"]:
        what = f"{claim['claim']} ({claim['quantity']})"
        found = expected_claim(claim, table, meets(every, analysis.get("where", {})), axes)
        if found is None or claim["p"] is None:
            close(what, None if found is None else 1.0, claim["p"])
            continue
        value, low, high, p, exact = found
        ends = claim["interval"] or [None, None]
        for name, here, there in zip(
            ("effect", "low", "high"), (value, low, high), [claim["value"]] + ends
        ):
            # JSON has no infinity.
            close(f"{what}: {name}", here if np.isfinite(here) else None, there, TIME_TOLERANCE)
        close_p(what, p, exact, claim["p"])
        here = observations(meets(table, claim["where"]), claim["quantity"], axes)
        enough = informative(claim, here[~here.censored] if claim["observed"] else here, axes)
        verdict = expected_verdict(claim, rate, found, claim["adjusted_p"], enough)
        unconverged = "not converged" in claim["says"] and verdict == "contradicted"
        if verdict != claim["verdict"] and not unconverged:
            sys.exit(f"{what}: {claim['verdict']} in analysis.json, {verdict} by the second route")
        checks += 5
    return checks


def factor_groups(table, factor):
    """Models in groups of ascending factor: one for each of few values, else of equal size."""
    models = table.groupby("model", sort=False)[factor].first().dropna()
    models = models.sort_values(kind="stable")
    if models.nunique() <= FEW:
        groups = [models[models == value] for value in models.unique()]
    else:
        ends = [i * len(models) // GROUPS for i in range(GROUPS + 1)]
        groups = [models.iloc[low:high] for low, high in zip(ends, ends[1:])]
    return [(group.mean(), table[table.model.isin(group.index)]) for group in groups]


def check_factor_means(analysis, folder, by):
    """Checks the means over the models of groups of a factor, and their intervals."""
    table = pd.read_csv(folder / "table.csv")
    table = meets(table[table.state == "finished"], analysis.get("where", {}))
    checks = 0
    for entry in analysis["factor_means"]:
        quantity, factor = entry["quantity"], entry["factor"]
        here = table[table[by] == entry["level"]]
        if quantity == "kissing_share":
            values = here.kiss_time.notna().astype(float)
        else:
            values = here[quantity].astype(float)
            if quantity == "contact_stage":
                values = values.where(here.parted.astype(float) != 0)
        here = here.assign(value=values)[values.notna()]
        what = f"{quantity} at {factor} {entry['at']} {entry['level']}"
        here = [group for at, group in factor_groups(here, factor) if abs(at - entry["at"]) < 1e-9]
        if len(here) != 1:
            sys.exit(f"{what}: no such group by the second route")
        groups = [g.value.to_numpy() for _, g in here[0].groupby("model")]
        close(f"{what}: models", float(len(groups)), entry["models"])
        close(f"{what}: mean", float(np.mean([g.mean() for g in groups])), entry["mean"], 1e-4)
        checks += 2
        if entry["interval"] is not None:
            if quantity == "kissing_share":
                for end, expected in zip(share_interval(groups), entry["interval"]):
                    close(f"{what}: interval", end, expected, 1e-6)
            else:
                close_ends(f"{what}: interval", groups, entry["interval"])
            checks += 2
    return checks


def main(folder, by, grid):
    folder = Path(folder)
    table = read(folder, by)
    analysis = json.loads((folder / "analysis.json").read_text())
    axes = [name for name in ("grain", "orientation", "cells") if name in table.columns]
    checks = check_claims(analysis, folder, axes) + check_factor_means(analysis, folder, by)
    analysis = analysis["kissing"]

    def on(level, cells):
        here = table[table[by] == level]
        return here if cells is None else here[here[grid] == cells]

    for entry in analysis["levels"]:
        here = on(entry["level"], entry["grid"])
        what = f"{entry['level']} {entry['grid']}"
        groups = [g.kissed.to_numpy(float) for _, g in here.groupby("model")]
        close(f"{what}: runs", float(len(here)), entry["runs"])
        close(f"{what}: share", float(np.mean([g.mean() for g in groups])), entry["share"])
        close(f"{what}: median time", half_time(here), entry["median_time"], TIME_TOLERANCE)
        for end, expected in zip(share_interval(groups), entry["interval"]):
            close(f"{what}: interval", end, expected, 1e-6)
        checks += 5
    for entry in analysis["differences"]:
        what = f"{entry['first']} - {entry['second']} {entry['grid']}"
        other = [axis for axis in axes if axis != by]
        two = pairs(on(entry["first"], entry["grid"]), on(entry["second"], entry["grid"]), other)
        groups = common_differences(two)
        close(f"{what}: share", float(np.mean([g.mean() for g in groups])), entry["share"])
        for end, expected in zip(difference_interval(groups), entry["interval"]):
            close(f"{what}: interval", end, expected, tolerance(groups))
        if len(two) >= 6:
            p = sign_flip_p([log_rank_excess(a, b) for a, b in two])
            close_p(f"{what}: log-rank", p, True, entry["log_rank_p"])
            p = sign_flip_p([group.mean() for group in groups])
            close_p(f"{what}: share", p, True, entry["share_p"])
        medians = [(median_time(a), median_time(b)) for a, b in two]
        shifts = np.array([a - b for a, b in medians if a is not None and b is not None])
        if len(shifts) >= 6:
            close(f"{what}: shift", hodges_lehmann(shifts), entry["time_shift"], TIME_TOLERANCE)
        checks += 5
    for entry in analysis["grids"]:
        what = f"{entry['coarse']} - {entry['fine']} {entry['level']}"
        here = table if entry["level"] is None else table[table[by] == entry["level"]]
        other = [axis for axis in axes if axis != grid]
        two = pairs(
            here[here[grid] == entry["coarse"]], here[here[grid] == entry["fine"]], other
        )
        groups = common_differences(two)
        close(f"{what}: share", float(np.mean([g.mean() for g in groups])), entry["share"])
        same = [(a.kissed.mean() > 0.5) == (b.kissed.mean() > 0.5) for a, b in two]
        close(f"{what}: agreement", float(np.mean(same)), entry["agreement"])
        checks += 2
    if not checks:
        sys.exit("analysis.json has no table `kissing`")
    print(f"{folder}: {checks} values agree by the second route")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
