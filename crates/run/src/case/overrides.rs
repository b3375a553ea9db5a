//! `key=value` overrides of a TOML file.

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use super::error::Problem;

/// Returns an override as TOML, "time.end=0.5" -> "time.end = 0.5". A value that is not TOML
/// becomes a string.
pub(super) fn override_line(item: &str) -> Result<String, Problem> {
    let usage = "write key=value, for example --set time.end=0.5 or --set grain.0.density=2600";
    let (key, value) = item
        .split_once('=')
        .ok_or_else(|| Problem::new(format!("--set {item}: there is no `=`")).help(usage))?;
    let (key, value) = (key.trim(), value.trim());
    let plain = |part: &str| {
        !part.is_empty() && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
    };
    if !key.split('.').all(plain) {
        return Err(Problem::new(format!("--set {item}: `{key}` is not a key")).help(usage));
    }
    let as_toml = format!("{key} = {value}");
    if !value.is_empty() && !value.contains('\n') && DeTable::parse(&as_toml).is_ok() {
        return Ok(as_toml);
    }
    let escaped: String = value.chars().flat_map(char::escape_default).collect();
    Ok(format!(
        "{key} = \"{}\"",
        if value.is_ascii() { escaped } else { value.replace('\\', "\\\\").replace('"', "\\\"") }
    ))
}

/// Applies `extra`, an override whose key has `parts` parts, to a table. The value of the key is
/// replaced as a whole; its siblings stay.
pub(super) fn override_table<'i>(
    base: &mut DeTable<'i>,
    extra: DeTable<'i>,
    parts: usize,
) -> Result<(), String> {
    for (key, value) in extra {
        let name = key.get_ref().to_string();
        let span = value.span();
        let old = base.get_mut(&key).map(|old| old.get_mut());
        let value = match (old, value.into_inner()) {
            (Some(DeValue::Table(old)), DeValue::Table(new)) if parts > 1 => {
                override_table(old, new, parts - 1)?;
                continue;
            }
            // `vector.formula = ...` replaces `[x, y, z]` instead.
            (Some(DeValue::Array(items)), DeValue::Table(new))
                if parts > 1 && (is_of_tables(items) || has_index(&new)) =>
            {
                override_list(&name, items, new, parts - 1)?;
                continue;
            }
            (_, value) => value,
        };
        // Without removal the map would keep the position of the old key.
        base.remove(&key);
        base.insert(key, Spanned::new(span, value));
    }
    Ok(())
}

fn is_of_tables(items: &DeArray) -> bool {
    items.iter().any(|item| item.get_ref().is_table())
}

fn has_index(table: &DeTable) -> bool {
    table.keys().any(|key| key.get_ref().parse::<usize>().is_ok())
}

/// Applies an override to elements of the list `name`.
fn override_list<'i>(
    name: &str,
    items: &mut DeArray<'i>,
    extra: DeTable<'i>,
    parts: usize,
) -> Result<(), String> {
    let count = items.len();
    for (index, value) in extra {
        let at: usize = index
            .get_ref()
            .parse()
            .map_err(|_| format!("`{name}` is a list: write {name}.0 for its first element"))?;
        let slot = items.get_mut(at).ok_or_else(|| {
            format!("`{name}` has {count} elements, there is no number {at} (they count from 0)")
        })?;
        let span = value.span();
        let value = match (slot.get_mut(), value.into_inner()) {
            (DeValue::Table(old), DeValue::Table(new)) if parts > 1 => {
                override_table(old, new, parts - 1)?;
                continue;
            }
            (_, value) => value,
        };
        *slot = Spanned::new(span, value);
    }
    Ok(())
}
