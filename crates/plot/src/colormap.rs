//! Perceptually uniform colour maps: lightness is linear in Oklab (B. Ottosson, 2020), also legible
//! in greyscale print and for colour-blind readers.

/// A colour map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorMap {
    /// White at 0 through green to dark blue, for magnitudes.
    Magnitude,
    /// Blue through white to red, for signed values.
    Signed,
}

impl ColorMap {
    /// Returns the sRGB colour at `position`, clamped to 0 to 1.
    pub fn colour(self, position: f64) -> [u8; 3] {
        let s = position.clamp(0.0, 1.0);
        match self {
            ColorMap::Magnitude => {
                let lightness = 0.985 - 0.715 * s;
                // The chroma stays inside the sRGB gamut: clipping would cause kinks.
                let rise = 1.0 - (1.0 - (s / 0.3).min(1.0)).powi(2);
                let fall = 1.0 - 0.45 * ((s - 0.35).max(0.0) / 0.65).powf(1.5);
                let chroma = 0.104 * rise * fall;
                let hue = 105.0 + 170.0 * s;
                from_oklch(lightness, chroma, hue)
            }
            ColorMap::Signed => {
                let u = 2.0 * s - 1.0;
                let strength = u.abs();
                let lightness = 0.985 - 0.585 * strength;
                let chroma = 0.13 * (1.0 - (1.0 - strength).powf(1.6));
                let hue = if u < 0.0 { 255.0 } else { 32.0 };
                from_oklch(lightness, chroma, hue)
            }
        }
    }

    /// Returns 256 evenly spaced colours.
    pub fn palette(self) -> Vec<[u8; 3]> {
        (0..256).map(|i| self.colour(f64::from(i) / 255.0)).collect()
    }
}

/// Returns a colour of viridis-like lightness for `s` from 0 (dark) to 1 (light), clamped.
pub fn sequential(s: f64) -> [u8; 3] {
    let s = s.clamp(0.0, 1.0);
    from_oklch(0.36 + 0.5 * s, 0.092, 275.0 - 175.0 * s)
}

/// Formats a colour as `#rrggbb`.
pub fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Converts Oklab lightness, chroma and hue [deg] to sRGB; reduces the chroma to the gamut.
fn from_oklch(lightness: f64, chroma: f64, hue: f64) -> [u8; 3] {
    let shown = |chroma: f64| {
        linear_from_oklch(lightness, chroma, hue).iter().all(|v| (-1e-4..=1.0001).contains(v))
    };
    let (mut low, mut high) = if shown(chroma) { (chroma, chroma) } else { (0.0, chroma) };
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if shown(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    linear_from_oklch(lightness, low, hue).map(gamma)
}

fn linear_from_oklch(lightness: f64, chroma: f64, hue: f64) -> [f64; 3] {
    let (a, b) = (chroma * hue.to_radians().cos(), chroma * hue.to_radians().sin());
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ]
}

fn gamma(linear: f64) -> u8 {
    let v = linear.clamp(0.0, 1.0);
    let v = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (255.0 * v).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness([r, g, b]: [u8; 3]) -> f64 {
        let linear = |v: u8| {
            let v = f64::from(v) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        let (r, g, b) = (linear(r), linear(g), linear(b));
        let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
        let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
        let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
        0.210_454_255_3 * l + 0.793_617_785 * m - 0.004_072_046_8 * s
    }

    #[test]
    fn magnitude_darkens_in_equal_steps() {
        let steps: Vec<f64> =
            (0..=16).map(|i| lightness(ColorMap::Magnitude.colour(f64::from(i) / 16.0))).collect();
        for pair in steps.windows(2) {
            assert!((pair[0] - pair[1] - 0.715 / 16.0).abs() < 0.008, "step {}", pair[0] - pair[1]);
        }
    }

    #[test]
    fn no_map_has_kinks() {
        let sequential: Vec<_> = (0..256).map(|i| sequential(f64::from(i) / 255.0)).collect();
        for palette in [ColorMap::Magnitude.palette(), ColorMap::Signed.palette(), sequential] {
            let step = |a: &[u8; 3], b: &[u8; 3]| (0..3).map(|c| a[c].abs_diff(b[c])).max();
            let steps: Vec<_> = palette.windows(2).map(|pair| step(&pair[0], &pair[1])).collect();
            assert!(steps.iter().all(|s| *s <= Some(5)), "{steps:?}");
        }
    }

    #[test]
    fn signed_is_symmetric_and_white_at_zero() {
        let middle = ColorMap::Signed.colour(0.5);
        assert!(middle.iter().all(|&v| v > 245), "{middle:?}");
        for i in 1..=8 {
            let s = f64::from(i) / 16.0;
            let (low, high) = (ColorMap::Signed.colour(0.5 - s), ColorMap::Signed.colour(0.5 + s));
            assert!((lightness(low) - lightness(high)).abs() < 0.012);
            assert!(low[2] > low[0] && high[0] > high[2], "{low:?} {high:?}");
        }
    }

    #[test]
    fn values_outside_are_clamped() {
        assert_eq!(ColorMap::Magnitude.colour(-3.0), ColorMap::Magnitude.colour(0.0));
        assert_eq!(ColorMap::Signed.colour(7.0), ColorMap::Signed.colour(1.0));
        assert_eq!(hex([1, 171, 255]), "#01abff");
    }
}
