//! `key=value` overrides of a file: their text, and how they are laid over its tables.

use toml::de::{DeTable, DeValue};

use super::error::Problem;

/// "time.end=0.5" -> "time.end = 0.5"; a value that is not TOML is taken as a string.
pub(super) fn override_line(item: &str) -> Result<String, Problem> {
    let usage = "write key=value, for example --set time.end=0.5 or --set grain.0.density=2600";
    let (key, value) = item
        .split_once('=')
        .ok_or_else(|| Problem::new(format!("--set {item}: there is no `=`")).help(usage))?;
    let (key, value) = (key.trim(), value.trim());
    let plain = |part: &str| {
        !part.is_empty()
            && part
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
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
        if value.is_ascii() {
            escaped
        } else {
            value.replace('\\', "\\\\").replace('"', "\\\"")
        }
    ))
}

/// Whether a table that overrides another is of another `kind`.
fn changes_kind(old: &DeTable, new: &DeTable) -> bool {
    let kind = |table: &DeTable| {
        let value = table.get("kind")?.get_ref().as_str();
        value.map(str::to_owned)
    };
    kind(new).is_some_and(|kind_of_new| kind(old).is_some_and(|old| old != kind_of_new))
}

/// Lays the overrides of a table over it.
pub(super) fn merge<'i>(base: &mut DeTable<'i>, extra: DeTable<'i>) -> Result<(), String> {
    for (key, value) in extra {
        let name = key.get_ref().to_string();
        let old = base.get_mut(&key).map(|v| v.get_mut());
        match (old, value.get_ref()) {
            // A shape of another kind shares no key with the one before.
            (Some(DeValue::Table(old)), DeValue::Table(new)) if changes_kind(old, new) => {
                base.remove(&key);
                base.insert(key, value);
            }
            (Some(DeValue::Table(_)), DeValue::Table(_)) => {
                if let (Some(DeValue::Table(old)), DeValue::Table(new)) =
                    (base.get_mut(&key).map(|v| v.get_mut()), value.into_inner())
                {
                    merge(old, new)?;
                }
            }
            // `{ formula = ... }` in place of `[x, y, z]`, not `vector.0 = ...`.
            (Some(DeValue::Array(items)), DeValue::Table(new))
                if items.iter().all(|item| !item.get_ref().is_table())
                    && new
                        .keys()
                        .all(|key| key.get_ref().parse::<usize>().is_err()) =>
            {
                base.remove(&key);
                base.insert(key, value);
            }
            (Some(DeValue::Array(items)), DeValue::Table(_)) => {
                let DeValue::Table(new) = value.into_inner() else {
                    continue;
                };
                let count = items.len();
                for (index, item) in new {
                    let at: usize = index.get_ref().parse().map_err(|_| {
                        format!("`{name}` is a list: write {name}.0 for its first element")
                    })?;
                    let slot = items.get_mut(at).ok_or_else(|| format!("`{name}` has {count} elements, there is no number {at} (they count from 0)"))?;
                    match (slot.get_mut(), item.get_ref()) {
                        (DeValue::Table(_), DeValue::Table(_)) => {
                            if let (DeValue::Table(old), DeValue::Table(new)) =
                                (slot.get_mut(), item.into_inner())
                            {
                                merge(old, new)?;
                            }
                        }
                        _ => *slot = item,
                    }
                }
            }
            _ => {
                // The map would keep the old key and its place.
                base.remove(&key);
                base.insert(key, value);
            }
        }
    }
    Ok(())
}
