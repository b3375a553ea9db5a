//! Prime factors.

/// Returns the largest prime factor of `n`; 1 for 1.
pub fn largest_prime_factor(mut n: usize) -> usize {
    let (mut largest, mut factor) = (1, 2);
    while factor * factor <= n {
        while n.is_multiple_of(factor) {
            (largest, n) = (factor, n / factor);
        }
        factor += 1;
    }
    largest.max(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prime_factors_are_found() {
        let found = [1, 2, 97, 100, 131, 390, 2 * 53].map(largest_prime_factor);
        assert_eq!(found, [1, 2, 97, 5, 131, 13, 53]);
    }
}
