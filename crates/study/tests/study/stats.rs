//! Rank statistics compared with textbook examples and tables.

use grainwake_study::statistics::{
    bootstrap_interval, coefficient_of_variation, false_discovery_adjusted, median, quantile,
    ranks, relative_spread_test, share_interval, sign_flip_p, signed_rank, spearman,
};
use grainwake_study::survival::{
    Duration, cumulative_incidence, log_rank, log_rank_excess, median_time,
};

#[test]
fn ties_share_their_mean_rank() {
    assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0]), [3.5, 1.0, 3.5, 2.0]);
    assert!(ranks(&[]).is_empty());
    // Times that differ by rounding are equal.
    assert_eq!(ranks(&[0.3, 0.1 + 0.2, 0.5 - 0.2]), [2.0; 3]);
    let infinity = f64::INFINITY;
    assert_eq!(ranks(&[infinity, 1.0, infinity]), [2.5, 1.0, 2.5]);
}

#[test]
fn spearman_of_known_samples() {
    // The textbook example of intelligence and hours of television: rho = -29/165.
    let iq = [106.0, 100.0, 86.0, 101.0, 99.0, 103.0, 97.0, 113.0, 112.0, 110.0];
    let hours = [7.0, 27.0, 2.0, 50.0, 28.0, 29.0, 20.0, 12.0, 6.0, 17.0];
    let found = spearman(&iq, &hours).unwrap();
    assert!((found.value + 29.0 / 165.0).abs() < 1e-12);
    // 100000 random orders; Student's t gives 0.627.
    assert!((found.p - 0.627).abs() < 0.01, "{}", found.p);
    // Fisher: atanh(-0.17576) -+ 1.96 sqrt((1 + 0.0154) / 7)
    assert!((found.low + 0.729).abs() < 2e-3 && (found.high - 0.513).abs() < 2e-3, "{found:?}");
    let rising: Vec<f64> = (0..16).map(f64::from).collect();
    let cubes: Vec<f64> = rising.iter().map(|x| x.powi(3)).collect();
    let perfect = spearman(&rising, &cubes).unwrap();
    assert!(perfect.value == 1.0 && perfect.p < 2e-5 && perfect.low > 0.9 && perfect.high < 1.0);
    // Of the 24 orders of four values two are perfect; of the 6 orders with two ties, too.
    let p = |x: &[f64]| spearman(x, &x.iter().map(|x| -x).collect::<Vec<_>>()).unwrap().p;
    assert!((p(&[1.0, 2.0, 3.0, 4.0]) - 2.0 / 24.0).abs() < 1e-15);
    assert!((p(&[1.0, 1.0, 2.0, 2.0]) - 2.0 / 6.0).abs() < 1e-15);
    // Two values of the factor that separate eight values: 2 of 70 choices, not Student's 0.0047.
    let (low, high) = ([0.0; 4], [1.0; 4]);
    let separated = spearman(&[low, high].concat(), &rising[..8]).unwrap();
    assert!((separated.p - 2.0 / 70.0).abs() < 1e-12, "{}", separated.p);
    assert!(spearman(&rising, &[1.0; 16]).is_none());
    assert!(spearman(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]).is_none());
}

#[test]
fn signed_ranks_of_known_samples() {
    // Exact tables: for n = 8 the sum 3 has a two-sided p of 2 * 5/256, and the 95 % interval
    // excludes three Walsh averages at each end.
    let d = [1.1, 2.2, 3.3, 4.4, 5.5, 6.6, -0.4, 7.7];
    let found = signed_rank(&d).unwrap();
    assert!(
        (found.p - 2.0 * 2.0 / 256.0).abs() < 1e-12,
        "only the smallest is negative: {}",
        found.p
    );
    let d = [1.1, -2.2, 3.3, 4.4, 5.5, 6.6, 7.7, 8.8];
    assert!((signed_rank(&d).unwrap().p - 2.0 * 3.0 / 256.0).abs() < 1e-12);
    let mut means: Vec<f64> = Vec::new();
    for i in 0..8 {
        means.extend((i..8).map(|j| 0.5 * (d[i] + d[j])));
    }
    means.sort_by(f64::total_cmp);
    let found = signed_rank(&d).unwrap();
    assert_eq!((found.low, found.high), (means[3], means[32]), "the tables' fourth from each end");
    // Sixteen differences: the tables' critical value is 29.
    let d: Vec<f64> = (1..=16).map(|i| 3.0f64.powi(i)).collect();
    let mut means: Vec<f64> = Vec::new();
    for i in 0..16 {
        means.extend((i..16).map(|j| 0.5 * (d[i] + d[j])));
    }
    means.sort_by(f64::total_cmp);
    let found = signed_rank(&d).unwrap();
    assert_eq!((found.low, found.high), (means[29], means[136 - 30]));
    assert!(signed_rank(&[0.0; 8]).unwrap().p == 1.0);
    // No interval of five differences reaches 95 %.
    assert!(signed_rank(&[1.0, 2.0, 3.0, 4.0, 5.0]).is_none());
    assert!(signed_rank(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).is_some());
}

#[test]
fn many_differences_have_the_normal_limit() {
    // wilcoxon(d, method="approx", correction=True) of SciPy 1.16, and the sorted pairwise means.
    let d: Vec<f64> =
        (1..=1100).map(|i| (f64::from(i) * 0.618_033_988_749_894_9) % 1.0 - 0.48).collect();
    let found = signed_rank(&d).unwrap();
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
    near(found.p, 0.020_571_446_577_368_25);
    near(found.value, 0.020_366_568_717_950_617);
    near(found.low, 0.003_145_641_843_620_428);
    near(found.high, 0.037_954_064_310_202_984);
    // The exact p value of 200 differences, and the approximate one of 201 (exact: 0.06006).
    let sample = |n: i32| -> Vec<f64> {
        (1..=n).map(|i| (f64::from(i) * 0.618_033_988_749_894_9) % 1.0 - 0.46).collect()
    };
    near(signed_rank(&sample(200)).unwrap().p, 0.052_012_230_288_729_37);
    near(signed_rank(&sample(201)).unwrap().p, 0.060_159_269_406_699_46);
    assert!(signed_rank(&[0.0; 300]).unwrap().p == 1.0);
}

#[test]
fn intervals_have_the_nominal_coverage() {
    // Differences distributed about 0.3: about 95 of 100 intervals contain it.
    let mut state = 1u64;
    let mut random = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let (mut held, mut correlated) = (0, 0);
    for _ in 0..1000 {
        let d: Vec<f64> = (0..16).map(|_| 0.3 + random() + random() - 1.0).collect();
        let found = signed_rank(&d).unwrap();
        held += usize::from(found.low <= 0.3 && 0.3 <= found.high);
        let (x, y): (Vec<f64>, Vec<f64>) = (0..8).map(|_| (random(), random())).unzip();
        let found = spearman(&x, &y).unwrap();
        correlated += usize::from(found.low > 0.0 || found.high < 0.0);
    }
    assert!((930..=975).contains(&held), "{held}");
    assert!((25..=75).contains(&correlated), "{correlated}");
}

#[test]
fn quartiles_and_spreads() {
    let v = [4.0, 1.0, 3.0, 2.0];
    assert_eq!(
        (quantile(&v, 0.0), median(&v), quantile(&v, 1.0)),
        (Some(1.0), Some(2.5), Some(4.0))
    );
    assert_eq!(quantile(&v, 0.25), Some(1.75));
    assert_eq!(median(&[]), None);
    assert!((coefficient_of_variation(&[9.0, 11.0]).unwrap() - 2f64.sqrt() / 10.0).abs() < 1e-12);
    let narrow: Vec<f64> = (0..12).map(|i| 10.0 + 0.1 * f64::from(i * 5 % 12)).collect();
    let wide: Vec<f64> = (0..12).map(|i| 10.0 + f64::from(i * 7 % 12)).collect();
    assert!(relative_spread_test(&wide, &narrow).unwrap().low > 0.0);
    assert!(relative_spread_test(&narrow, &wide).unwrap().high < 0.0);
}

/// Times to relapse in weeks of Freireich et al. (1963): treated patients and those with a placebo.
fn relapses() -> [Vec<Duration>; 2] {
    let duration = |time: i32| Duration { time: f64::from(time.abs()), censored: time < 0 };
    let treated =
        [6, 6, 6, -6, 7, -9, 10, -10, -11, 13, 16, -17, -19, -20, 22, 23, -25, -32, -32, -34, -35];
    let placebo = [1, 1, 2, 2, 3, 4, 4, 5, 5, 8, 8, 8, 8, 11, 11, 12, 12, 15, 17, 22, 23];
    [treated.map(duration).to_vec(), placebo.map(duration).to_vec()]
}

#[test]
fn medians_and_incidence_put_misses_last() {
    let sample = |times: &[f64]| -> Vec<Duration> {
        let duration = |t: &f64| Duration { time: t.abs(), censored: *t < 0.0 };
        times.iter().map(duration).collect()
    };
    assert_eq!(median_time(&sample(&[28.0, 29.0, 30.0, 31.0, -33.0])), Some(30.0));
    // Landings do not enter, even if they come before later events.
    assert_eq!(median_time(&sample(&[34.0, 36.0, 38.0, -33.0])), Some(37.0));
    assert_eq!(median_time(&sample(&[28.0, 29.0, -33.0, -33.0])), None, "half miss");
    assert_eq!(median_time(&sample(&[-33.0, -34.0])), None);
    assert_eq!(median_time(&[]), None);
    // A model with many members weighs as much as one with few.
    let found = cumulative_incidence(&[sample(&[2.0, -9.0]), sample(&[1.0, 3.0, -9.0, -9.0])]);
    assert_eq!(found, [(1.0, 0.125), (2.0, 0.375), (3.0, 0.5)]);
    let [treated, placebo] = relapses();
    assert_eq!(median_time(&placebo), Some(8.0));
    assert_eq!(median_time(&treated), None, "9 relapses of 21");
}

#[test]
fn intervals_of_shares_are_monotone() {
    let models = |kissing: usize, of: usize| -> Vec<Vec<f64>> {
        (0..of).map(|i| vec![f64::from(u8::from(i < kissing))]).collect()
    };
    let interval = |kissing| share_interval(&models(kissing, 16)).unwrap();
    // Tables of Clopper and Pearson.
    for (kissing, low, high) in [(0, 0.0, 0.2059), (8, 0.2465, 0.7535), (15, 0.6977, 0.9984)] {
        let found = interval(kissing);
        assert!((found[0] - low).abs() < 1e-4 && (found[1] - high).abs() < 1e-4, "{found:?}");
    }
    assert!((interval(16)[0] - 0.7941).abs() < 1e-4 && interval(16)[1] == 1.0);
    // One of eight members of one model misses.
    let mut almost = vec![vec![1.0; 8]; 16];
    almost[3][5] = 0.0;
    let found = share_interval(&almost).unwrap();
    assert!(interval(15)[0] < found[0] && found[0] < interval(16)[0], "{found:?}");
    assert!(share_interval(&[]).is_none());
}

#[test]
fn a_bootstrap_draws_the_same_members_for_all_models() {
    // All models miss in the same half of their members: no more certain than one model.
    let alike = vec![[[0.0; 4], [1.0; 4]].concat(); 40];
    let [low, high] = bootstrap_interval(&alike).unwrap();
    assert!(low <= 0.25 && high >= 0.75, "{low} {high}");
}

#[test]
fn log_rank_excess_of_a_known_sample() {
    // Nine relapses under treatment, where 19.25 are expected (Freireich et al. 1963).
    let found = log_rank_excess(&relapses());
    assert!((found - (9.0 - 19.2505)).abs() < 1e-4, "{found}");
    let [treated, placebo] = relapses();
    let reversed = log_rank_excess(&[placebo.clone(), treated.clone()]);
    assert!((reversed + found).abs() < 1e-12);
    assert_eq!(log_rank_excess(&[treated, Vec::new()]), 0.0, "nothing to compare");
    assert!(log_rank_excess(&[placebo.clone(), placebo]).abs() < 1e-12, "equal samples");
}

#[test]
fn log_rank_p_counts_strata_and_not_their_members() {
    // Six strata, the first sample later in all of them: 2 of 2^6 combinations are as far.
    let stratum = |members: usize| {
        let sample = |time| vec![Duration { time, censored: false }; members];
        [sample(2.0), sample(1.0)]
    };
    let p = |strata: usize, members: usize| log_rank(&vec![stratum(members); strata]);
    for members in [1, 8] {
        assert_eq!(p(6, members), Some(2.0 / 64.0));
        assert_eq!(p(5, members), None);
        assert_eq!(p(16, members), Some(2.0 / 65536.0));
    }
}

#[test]
fn sign_flips_of_known_values() {
    // Of the sums of 1 to 6 with any signs 21, 19 and 17 are as large, and as many as small.
    let p = sign_flip_p(&[1.0, -2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
    assert_eq!(p, 6.0 / 64.0);
    // Values of zero do not matter; rounding does not decide.
    assert_eq!(sign_flip_p(&[0.1, -0.2, 0.3, 0.4, 0.5, 0.6, 0.0]), Some(p));
    assert_eq!(sign_flip_p(&[0.0; 6]), Some(1.0));
    assert_eq!(sign_flip_p(&[0.0; 21]), Some(1.0));
    // Values of one size: a binomial distribution. Beyond 20 values combinations are drawn.
    let signs = |count: usize, negative: usize| {
        let mut values = vec![1.0; count];
        values[..negative].fill(-1.0);
        sign_flip_p(&values).unwrap()
    };
    assert!((signs(20, 5) - 0.041389).abs() < 1e-6, "{}", signs(20, 5));
    assert!((signs(21, 6) - 0.078354).abs() < 0.003, "{}", signs(21, 6));
}

#[test]
fn adjusted_p_values_of_a_published_example() {
    // The fifteen p values of Benjamini and Hochberg (1995): four hypotheses are rejected at 5 %.
    let p = [
        0.0201, 0.0001, 0.0278, 0.0298, 0.0344, 0.0004, 0.0459, 0.0019, 0.3240, 0.4262, 0.5719,
        0.6528, 0.0095, 0.7590, 1.0,
    ];
    let adjusted = false_discovery_adjusted(&p);
    let expected = [
        0.0603, 0.0015, 0.063_857, 0.063_857, 0.0645, 0.0030, 0.0765, 0.0095, 0.4860, 0.581_182,
        0.714_875, 0.753_231, 0.035_625, 0.813_214, 1.0,
    ];
    for (found, expected) in adjusted.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
    assert_eq!(adjusted.iter().filter(|p| **p < 0.05).count(), 4);
    assert!(false_discovery_adjusted(&[]).is_empty());
}
