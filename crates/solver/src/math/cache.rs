//! Size of the processor's caches.

use std::sync::OnceLock;

/// Size assumed if the system does not report one [bytes].
const COMMON: usize = 32 << 20;

/// Size of the last-level cache [bytes].
pub fn last_cache() -> usize {
    static SIZE: OnceLock<usize> = OnceLock::new();
    *SIZE.get_or_init(|| {
        (0..8)
            .filter_map(|index| {
                let path = format!("/sys/devices/system/cpu/cpu0/cache/index{index}/size");
                bytes(std::fs::read_to_string(path).ok()?.trim())
            })
            .max()
            .unwrap_or(COMMON)
    })
}

/// Parses a size such as `32768K` [bytes].
fn bytes(text: &str) -> Option<usize> {
    let unit = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let shift = match &text[unit..] {
        "" => 0,
        "K" => 10,
        "M" => 20,
        _ => return None,
    };
    text[..unit].parse::<usize>().ok()?.checked_mul(1 << shift)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units() {
        let sizes = ["512", "48K", "32M", "3T", "K", ""].map(bytes);
        assert_eq!(sizes, [Some(512), Some(48 << 10), Some(32 << 20), None, None, None]);
        assert!(last_cache() >= 32 << 10);
    }
}
