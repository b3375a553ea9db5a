//! Spherical-harmonic coefficients of a grain: lines "n m Re Im" of a_nm in r(theta, phi) = sum of
//! a_nm Y_nm, with orthonormal Y_nm and the Condon-Shortley phase, the format of the collections of
//! the National Institute of Standards and Technology. Only star-shaped grains (every ray from the
//! origin leaves once) have this representation.
//!
//! Series of degree N >= [`TRUNCATED`] are digitised grains, truncated at N: Lanczos factors,
//! sin(x) / x at x = pi n / (N + 1), suppress their ringing. Series of lower degree are exact.

use crate::error::{Result, ShapeError};
use crate::limits::ReadLimits;
use crate::triangles::{TriangleMesh, cube_sphere};
use glam::DVec3;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;

/// Quadrilaterals along an edge of the cube from which the grain is meshed.
const FACETS: usize = 56;
/// Highest degree that is read.
const HIGHEST: usize = 100;
/// Lowest degree of a series that is damped. Digitised grains have 14 to 28.
const TRUNCATED: usize = 12;
/// Tolerance of the symmetry of the coefficients, relative to the largest: rounding to four digits.
const TOLERANCE: f64 = 1e-4;

/// Coefficients of m >= 0, by degree, then order; those of m < 0 follow because the radius is real.
struct Series {
    coefficients: Vec<Vec<(f64, f64)>>,
}

pub(super) fn read(path: &Path, bytes: Vec<u8>, _: &ReadLimits) -> Result<TriangleMesh> {
    let series = Series::parse(path, &String::from_utf8_lossy(&bytes))?;
    let radius = |u: DVec3| series.radius(u);
    let mesh = cube_sphere(FACETS, |u| radius(u) * u);
    // A negative radius moves its vertex to the opposite side.
    let positive = |v: &DVec3| v.length() > 0.0 && radius(v.normalize_or_zero()) > 0.0;
    if !mesh.vertices.iter().all(positive) {
        let reason = "the radius is not positive in every direction";
        return Err(ShapeError::malformed(path, reason));
    }
    Ok(mesh)
}

impl Series {
    fn parse(path: &Path, text: &str) -> Result<Series> {
        let mut lines: BTreeMap<(usize, i64), (usize, f64, f64)> = BTreeMap::new();
        for (number, line) in text.lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let words: Vec<&str> = line.split_whitespace().collect();
            let parsed = || {
                let [n, m, re, im] = words[..] else {
                    return None;
                };
                let (n, m): (usize, i64) = (n.parse().ok()?, m.parse().ok()?);
                let (re, im): (f64, f64) = (re.parse().ok()?, im.parse().ok()?);
                let sound = n <= HIGHEST && m.unsigned_abs() <= n as u64;
                (sound && re.is_finite() && im.is_finite()).then_some((n, m, re, im))
            };
            let number = number + 1;
            let Some((n, m, re, im)) = parsed() else {
                let reason = format!(
                    "line {number}: expected four numbers n m Re Im with |m| <= n <= {HIGHEST}, \
                     found {:?}",
                    line.chars().take(60).collect::<String>()
                );
                return Err(ShapeError::malformed(path, reason));
            };
            if let Some((first, ..)) = lines.insert((n, m), (number, re, im)) {
                let reason =
                    format!("lines {first} and {number} both give n = {n}, m = {m}; remove one");
                return Err(ShapeError::malformed(path, reason));
            }
        }
        let largest = lines.values().fold(0.0, |most: f64, (_, re, im)| most.max(re.hypot(*im)));
        let mut coefficients: Vec<Vec<(f64, f64)>> = Vec::new();
        for (&(n, m), &(number, re, im)) in &lines {
            // The radius is real: a_(n,-m) = (-1)^m conj(a_nm).
            let sign = if m % 2 == 0 { 1.0 } else { -1.0 };
            let mirror = (sign * re, -sign * im);
            let expected = lines.get(&(n, -m)).map_or(mirror, |(_, re, im)| (*re, *im));
            if (mirror.0 - expected.0).hypot(mirror.1 - expected.1) > TOLERANCE * largest {
                let rule = if m == 0 {
                    "must have no imaginary part".to_owned()
                } else {
                    let opposite = -m;
                    format!("must be (-1)^m times the conjugate of that of m = {opposite}")
                };
                let reason = format!(
                    "line {number}: the coefficient of n = {n}, m = {m} {rule}, because the radius \
                     is real; correct it, or omit the lines of m < 0"
                );
                return Err(ShapeError::malformed(path, reason));
            }
            while coefficients.len() <= n {
                coefficients.push(vec![(0.0, 0.0); coefficients.len() + 1]);
            }
            // Lines of m < 0 precede those of m > 0, which override them.
            coefficients[n][m.unsigned_abs() as usize] = if m < 0 { mirror } else { (re, im) };
        }
        while coefficients.pop_if(|terms| terms.iter().all(|term| *term == (0.0, 0.0))).is_some() {}
        if coefficients.is_empty() {
            return Err(ShapeError::malformed(path, "it holds no coefficients other than 0"));
        }
        if coefficients.len() > TRUNCATED {
            let top = coefficients.len() as f64;
            for (n, terms) in coefficients.iter_mut().enumerate().skip(1) {
                let x = PI * n as f64 / top;
                for term in terms {
                    term.0 *= x.sin() / x;
                    term.1 *= x.sin() / x;
                }
            }
        }
        Ok(Series { coefficients })
    }

    /// Returns the radius along the unit vector `u`.
    fn radius(&self, u: DVec3) -> f64 {
        let (cos, sin) = (u.z, u.truncate().length());
        let (c1, s1) = if sin > 0.0 { (u.x / sin, u.y / sin) } else { (1.0, 0.0) };
        let top = self.coefficients.len();
        let mut sum = 0.0;
        // Normalised Legendre functions by their stable recurrence in n, for one m at a time.
        let mut diagonal = (0.25 / PI).sqrt();
        let (mut cm, mut sm) = (1.0, 0.0);
        for m in 0..top {
            if m > 0 {
                let m = m as f64;
                diagonal *= -sin * ((2.0 * m + 1.0) / (2.0 * m)).sqrt();
                (cm, sm) = (cm * c1 - sm * s1, sm * c1 + cm * s1);
            }
            let (mut before, mut here) = (0.0, diagonal);
            for n in m..top {
                if n > m {
                    let (nf, mf) = (n as f64, m as f64);
                    let a = ((4.0 * nf * nf - 1.0) / (nf * nf - mf * mf)).sqrt();
                    let lower = nf - 1.0;
                    let b = ((lower * lower - mf * mf) / (4.0 * lower * lower - 1.0)).max(0.0);
                    (before, here) = (here, a * (cos * here - b.sqrt() * before));
                }
                let (re, im) = self.coefficients[n][m];
                let twice = if m > 0 { 2.0 } else { 1.0 };
                sum += twice * here * (re * cm - im * sm);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(text: &str) -> Result<TriangleMesh> {
        read(Path::new("a.anm"), text.into(), &ReadLimits::default())
    }

    #[test]
    fn low_degrees_are_the_textbook_functions() {
        let text = "# first\n0 0 3.0 0\n1 0 0.3 0\n1 1 0.2 -0.1\n1 -1 -0.2 -0.1\n2 1 0.05 0.02\n";
        let series = Series::parse(Path::new("a.anm"), text).unwrap();
        for u in [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.3, 0.5, 0.4).normalize()] {
            let y00 = (0.25 / PI).sqrt();
            let y10 = (0.75 / PI).sqrt() * u.z;
            let along = -(0.375 / PI).sqrt();
            let first = 2.0 * along * (0.2 * u.x + 0.1 * u.y);
            let second = 2.0 * -(1.875 / PI).sqrt() * u.z * (0.05 * u.x - 0.02 * u.y);
            let exact = 3.0 * y00 + 0.3 * y10 + first + second;
            assert!((series.radius(u) - exact).abs() < 1e-12, "{u}");
        }
    }

    /// r = 1 + 0.5 P2(cos theta) has the volume 2 pi / 3 times the integral of r^3 over cos theta.
    #[test]
    fn a_low_degree_is_exact_and_zeros_change_nothing() {
        let mut text = format!("0 0 {} 0\n2 0 {} 0\n", 2.0 * PI.sqrt(), (PI / 5.0).sqrt());
        let plain = open(&text).unwrap();
        let exact = 2.0 * PI / 3.0 * (2.0 + 3.0 * 0.25 * 0.4 + 0.125 * 4.0 / 35.0);
        assert!((plain.signed_volume() / exact - 1.0).abs() < 2e-3, "{}", plain.signed_volume());
        for n in 3..30 {
            text += &format!("{n} 0 0 0\n{n} 1 0 0\n");
        }
        assert_eq!(open(&text).unwrap(), plain);
    }

    #[test]
    fn digitised_grains_are_damped() {
        let text = format!("0 0 3 0\n{TRUNCATED} 0 0.1 0\n");
        let series = Series::parse(Path::new("a.anm"), &text).unwrap();
        let x = PI * TRUNCATED as f64 / (TRUNCATED + 1) as f64;
        assert!((series.coefficients[TRUNCATED][0].0 - 0.1 * x.sin() / x).abs() < 1e-15);
    }

    #[test]
    fn negative_orders_are_checked_against_positive_ones() {
        let read = |lines: &str| Series::parse(Path::new("a.anm"), &format!("0 0 9 0\n{lines}"));
        let [positive, negative] = ["2 1 0.4 0.1\n", "2 -1 -0.4 0.1\n"];
        let whole = read(&format!("{positive}{negative}")).unwrap().coefficients;
        assert_eq!(read(positive).unwrap().coefficients, whole);
        assert_eq!(read(negative).unwrap().coefficients, whole);
        for (bad, place) in [
            (format!("{positive}2 -1 0.4 -0.1\n"), "line 3"),
            (format!("{positive}2 -1 0 0\n"), "line 3"),
            ("1 0 0.3 0.2\n".to_owned(), "line 2"),
            ("1 0 0.3 0\n1 0 0.2 0\n".to_owned(), "lines 2 and 3"),
        ] {
            let error = read(&bad).err().unwrap().to_string();
            assert!(error.contains(place), "{error}");
        }
    }

    #[test]
    fn a_ball_is_meshed_and_nonsense_is_refused_with_its_line() {
        let mesh = open("0 0 3.5449077018 0\n").unwrap();
        assert!((mesh.signed_volume() / (4.0 / 3.0 * PI) - 1.0).abs() < 2e-3);
        mesh.check_closed().unwrap();
        for bad in
            ["", "0 0 3.5", "0 1 1 1", "5000 0 1 1", "0 0 NaN 0", "a b c d", "0 0 -1 0", "0 0 0 0"]
        {
            assert!(open(bad).is_err(), "{bad:?}");
        }
        let error = open("0 0 3 0\n1 0 x 0\n").unwrap_err();
        assert!(error.to_string().contains("line 2"), "{error}");
    }
}
