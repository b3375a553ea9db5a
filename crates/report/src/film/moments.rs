//! Choice of the moments that a film shows.

use super::MAX_FRAMES;

/// Returns the indices of evenly spaced times, at most [`MAX_FRAMES`] of the ascending `times`.
///
/// Times much closer to the one before than the usual interval are left out: pictures at events lie
/// between those at regular times, and would make the motion appear to pause.
pub fn even(times: &[f64]) -> Vec<usize> {
    let mut intervals: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    intervals.sort_by(f64::total_cmp);
    let Some(usual) = intervals.get(intervals.len() / 2).copied() else {
        return (0..times.len().min(1)).collect();
    };
    let mut kept: Vec<usize> = vec![0];
    for (index, time) in times.iter().enumerate() {
        if time - times[kept[kept.len() - 1]] > 0.75 * usual {
            kept.push(index);
        }
    }
    let every = kept.len().div_ceil(MAX_FRAMES);
    kept.into_iter().step_by(every).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_events_are_left_out() {
        let times = [0.0, 0.1, 0.2, 0.23, 0.3, 0.4, 0.41, 0.5];
        assert_eq!(even(&times), [0, 1, 2, 4, 5, 7]);
        assert_eq!(even(&[]), [0usize; 0]);
        assert_eq!(even(&[0.0]), [0]);
        assert_eq!(even(&[0.0, 0.0, 1.0]), [0, 2]);
    }

    #[test]
    fn long_runs_are_thinned() {
        let times: Vec<f64> = (0..1000).map(f64::from).collect();
        let kept = even(&times);
        assert_eq!((kept.len(), kept[1]), (200, 5));
    }
}
