"""Checks a study's analysis.json by a second route.

Recomputes it from table.csv with pandas, SciPy and lifelines. Table `kissing`: shares,
their intervals, medians of Kaplan and Meier, stratified log-rank tests, Hodges-Lehmann
shifts, and the differences between grids. Table `factor_means`: means and their intervals. Claims
about trends and orders: rank correlations, Hodges-Lehmann shifts, their p values, and the
adjustment for the number of claims.

    pip install lifelines scipy
    python studies/second_route.py results/dkt-morphology-ensemble orientation cells
"""

import json
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
from lifelines import KaplanMeierFitter, NelsonAalenFitter
from scipy import stats

SAMPLES = 4000
INTERVAL_TOLERANCE = 0.02
# table.csv has six digits.
TIME_TOLERANCE = 1e-3
P_TOLERANCE = 1e-3


def read(folder, by):
    table = pd.read_csv(folder / "table.csv")
    table = table[(table.state == "finished") & table[by].notna()].copy()
    table["kissed"] = table.kiss_time.notna()
    table["time"] = table.kiss_time.fillna(table.landing_time)
    return table


def interval(groups, seed=1):
    """95 % interval of the mean over models of the mean over members, both drawn anew."""
    random = np.random.default_rng(seed)
    samples = np.empty(SAMPLES)
    for i in range(SAMPLES):
        models = random.integers(len(groups), size=len(groups))
        samples[i] = np.mean([np.mean(random.choice(groups[m], len(groups[m]))) for m in models])
    return np.quantile(samples, [0.025, 0.975])


def outcome_interval(groups, least, most):
    """As `interval`; if all outcomes are equal, with the limit of Clopper and Pearson."""
    outcomes = np.concatenate(groups)
    if outcomes.min() < outcomes.max():
        return interval(groups)
    other = stats.binomtest(0, len(groups)).proportion_ci(0.95, "exact").high
    return [outcomes[0] + other * (end - outcomes[0]) for end in (least, most)]


def tolerance(groups):
    """Tolerance of an interval: a share of few runs moves in steps of one run."""
    return INTERVAL_TOLERANCE + 1.0 / sum(len(group) for group in groups)


def median_time(table):
    survival = KaplanMeierFitter().fit(table.time, table.kissed).survival_function_.iloc[:, 0]
    # A survival of one half, computed as a product, may differ by rounding.
    half = survival.index[survival <= 0.5 + 1e-9]
    return float(half[0]) if len(half) else None


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
    values = np.round(values, 9)
    permutations = stats.permutation_test(
        (values, -values),
        lambda x, y, axis: np.sum(x - y, axis=axis),
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
    """One row per model: median over the members, and whether most of them are censored."""
    table = table.copy()
    table["value"], table["censored"] = table[quantity].astype(float), False
    if quantity == "kiss_time":
        table["censored"] = table.value.isna()
        table["value"] = table.value.fillna(table.landing_time)
    elif quantity == "contact_stage":
        table["censored"] = table.parted.astype(float) == 0
    table = table[table.value.notna()]
    factors = [name for name in ("sphericity", "roundness") if name in table]
    rules = {name: (name, "first") for name in axes + factors}
    rules |= {"value": ("value", "median"), "censored": ("censored", "mean")}
    models = table.groupby("model").agg(**rules).reset_index()
    models["censored"] = models.censored >= 0.5
    return models


def check_claims(analysis, folder, axes):
    """Checks trends and orders, and the adjusted p values of all claims."""
    table = pd.read_csv(folder / "table.csv")
    table = meets(table[table.state == "finished"], analysis.get("where", {}))
    checks = 0
    for claim in analysis["claims"]:
        [(kind, test)] = claim["test"].items()
        timed = claim["quantity"] in ("tumble_time", "pass_time", "separation_time")
        if kind not in ("trend", "order") or claim["value"] is None or timed:
            continue
        here = observations(meets(table, claim["where"]), claim["quantity"], axes)
        if claim["observed"]:
            here = here[~here.censored]
        if kind == "trend":
            here = here[here[test["with"]].notna()]
            last = here.value.where(~here.censored, np.inf)
            value, p = stats.spearmanr(here[test["with"]], last)
        else:
            other = [axis for axis in axes if axis != test["axis"]]
            at = [here[here[test["axis"]] == test[side]] for side in ("more", "less")]
            both = at[0].merge(at[1], on=other)
            differences = (both.value_x - both.value_y).to_numpy()
            value = hodges_lehmann(differences)
            p = stats.wilcoxon(differences, method="exact").pvalue
        close(f"{claim['claim']}: effect", float(value), claim["value"], TIME_TOLERANCE)
        checks += 1
        # The exact p value of SciPy does not hold for ties.
        if kind == "trend" or len(set(np.abs(differences))) == len(differences):
            close(f"{claim['claim']}: p", float(p), claim["p"], P_TOLERANCE)
            checks += 1
    adjusted = [claim for claim in analysis["claims"] if claim.get("adjusted_p") is not None]
    if adjusted:
        found = stats.false_discovery_control([claim["p"] for claim in adjusted])
        for claim, p in zip(adjusted, found):
            close(f"{claim['claim']}: adjusted p", float(p), claim["adjusted_p"], 1e-9)
        checks += len(adjusted)
    return checks


def check_factor_means(analysis, folder, by):
    """Checks the means at the values of factors that have few values, and their intervals."""
    table = pd.read_csv(folder / "table.csv")
    table = meets(table[table.state == "finished"], analysis.get("where", {}))
    checks = 0
    for entry in analysis["factor_means"]:
        quantity, factor = entry["quantity"], entry["factor"]
        here = table[(table[by] == entry["level"]) & ((table[factor] - entry["at"]).abs() < 1e-9)]
        if quantity == "kissing_share":
            values = here.kiss_time.notna().astype(float)
        else:
            values = here[quantity].astype(float)
            if quantity == "contact_stage":
                values = values.where(here.parted.astype(float) != 0)
        here = here.assign(value=values)[values.notna()]
        groups = [g.value.to_numpy() for _, g in here.groupby("model")]
        what = f"{quantity} at {factor} {entry['at']} {entry['level']}"
        close(f"{what}: models", float(len(groups)), entry["models"])
        close(f"{what}: mean", float(np.mean([g.mean() for g in groups])), entry["mean"], 1e-4)
        checks += 2
        if entry["interval"] is not None:
            # An end of the interval of few models is one of few values.
            spread = here.value.max() - here.value.min()
            share = quantity == "kissing_share"
            ends = outcome_interval(groups, 0, 1) if share else interval(groups)
            for end, expected in zip(ends, entry["interval"]):
                close(f"{what}: interval", end, expected, 0.1 * spread + 1e-4)
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
        close(f"{what}: median time", median_time(here), entry["median_time"], TIME_TOLERANCE)
        for end, expected in zip(outcome_interval(groups, 0, 1), entry["interval"]):
            close(f"{what}: interval", end, expected, tolerance(groups))
        checks += 5
    for entry in analysis["differences"]:
        what = f"{entry['first']} - {entry['second']} {entry['grid']}"
        other = [axis for axis in axes if axis != by]
        two = pairs(on(entry["first"], entry["grid"]), on(entry["second"], entry["grid"]), other)
        groups = common_differences(two)
        close(f"{what}: share", float(np.mean([g.mean() for g in groups])), entry["share"])
        for end, expected in zip(outcome_interval(groups, -1, 1), entry["interval"]):
            close(f"{what}: interval", end, expected, tolerance(groups))
        if len(two) >= 6:
            p = sign_flip_p([log_rank_excess(a, b) for a, b in two])
            close(f"{what}: log-rank", p, entry["log_rank_p"], P_TOLERANCE)
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
        same = [(a.kissed.mean() >= 0.5) == (b.kissed.mean() >= 0.5) for a, b in two]
        close(f"{what}: agreement", float(np.mean(same)), entry["agreement"])
        checks += 2
    if not checks:
        sys.exit("analysis.json has no table `kissing`")
    print(f"{folder}: {checks} values agree by the second route")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
