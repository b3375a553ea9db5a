//! `key=value` overrides of a TOML file.

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use super::error::Problem;

/// Returns an override as TOML, "time.end=0.5" -> "time.end = 0.5". A value that is not TOML
/// becomes a string, unless it begins as a table, an array or a string does.
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
    let like_toml = value.starts_with(['{', '[', '"', '\'']);
    let parsed = DeTable::parse(&as_toml);
    if parsed.is_ok() && !value.is_empty() && (like_toml || !value.contains('\n')) {
        return Ok(as_toml);
    }
    if let (Err(error), true) = (parsed, like_toml) {
        let message = format!("--set {item}: the value is not TOML: {}", error.message());
        let help = "close all brackets and quotes; a shell needs the argument in single quotes";
        return Err(Problem::new(message).help(help));
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

/// Removes a key such as "time.step" or "grain.0.velocity" from a table.
pub(super) fn remove_key(table: &mut DeTable, key: &str) -> Result<(), Problem> {
    if let Some((key, _)) = key.split_once('=') {
        let help = "--unset takes a key alone, and no key begins with `-`";
        return Err(Problem::new(format!("--unset {key}: a value follows the key")).help(help));
    }
    let absent = |known: Vec<String>| {
        let help = match known.is_empty() {
            true => "there are no keys at this place".to_owned(),
            false => format!("present are {}", known.join(", ")),
        };
        Problem::new(format!("--unset {key}: the case has no such key")).help(help)
    };
    let names = |table: &DeTable| table.keys().map(|key| key.get_ref().to_string()).collect();
    let (parents, last) = key.rsplit_once('.').map_or((None, key), |(p, l)| (Some(p), l));
    let list = parents.and_then(|list| table.get(list)).map(Spanned::get_ref);
    if let (Some(DeValue::Array(items)), Ok(index)) = (list, last.parse::<usize>())
        && index < items.len()
    {
        let help = "a row cannot be removed; leave it out of the case file";
        let message = format!("--unset {key}: this is a row of a list, not a key");
        return Err(Problem::new(message).help(help));
    }
    let mut table = table;
    let mut parts = parents.into_iter().flat_map(|parents| parents.split('.'));
    while let Some(part) = parts.next() {
        if !table.contains_key(part) {
            return Err(absent(names(table)));
        }
        let value = match table.get_mut(part).map(Spanned::get_mut) {
            Some(DeValue::Array(items)) => {
                let count = items.len();
                let index = parts.next().and_then(|part| part.parse::<usize>().ok());
                let item = index.and_then(|index| items.get_mut(index));
                let item =
                    item.ok_or_else(|| absent((0..count).map(|n| format!("{part}.{n}")).collect()));
                Some(item?.get_mut())
            }
            value => value,
        };
        table = match value {
            Some(DeValue::Table(inner)) => inner,
            _ => return Err(absent(Vec::new())),
        };
    }
    match table.remove(last) {
        Some(_) => Ok(()),
        None => Err(absent(names(table))),
    }
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
            let accepted = match count {
                0 => "the list is empty".to_owned(),
                1 => "accepted is 0, its only element".to_owned(),
                _ => format!("accepted are 0 to {}", count - 1),
            };
            format!("`{name}` has no element {at}: {accepted}")
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
