//! The nearest known word, for messages about a mistyped one.

/// The candidate within a third of the length of `word` (at least one edit, case ignored) that
/// is nearest to it; none if nothing is near.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted = word.to_lowercase().replace('-', "_");
    let reach = (wanted.chars().count() / 3).max(1);
    let (distance, best) = candidates
        .into_iter()
        .map(|c| (strsim::damerau_levenshtein(&wanted, &c.to_lowercase().replace('-', "_")), c))
        .min_by_key(|(distance, _)| *distance)?;
    (distance <= reach).then_some(best)
}

/// The question after the nearest candidate, with a blank at its end; empty if none is near.
pub fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    nearest(word, candidates).map_or(String::new(), |near| format!("did you mean \"{near}\"? "))
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn near_words_are_found_and_far_ones_are_not() {
        let keys = ["density", "viscosity", "kinematic_viscosity"];
        assert_eq!(nearest("densty", keys), Some("density"));
        assert_eq!(nearest("visocsity", keys), Some("viscosity"));
        assert_eq!(nearest("kinematic-viscosity", keys), Some("kinematic_viscosity"));
        assert_eq!(nearest("colour", keys), None);
    }
}
