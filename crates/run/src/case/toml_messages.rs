//! Messages of the TOML reader in terms of a case file.

/// Rewords "integer `3`, expected struct RawFluid".
pub(super) fn wrong_kind(text: &str) -> String {
    let (found, expected) = text.split_once(", expected ").unwrap_or((text, ""));
    let found = match found.split_once(' ') {
        Some(("integer" | "boolean", value)) => value.replace('`', "").replace(" as i128", ""),
        Some(("floating", value)) => value.replace("point ", "").replace('`', ""),
        Some(("string", value)) => format!("the text {value}"),
        _ => match found {
            "map" => "a table".into(),
            "sequence" => "a list".into(),
            other => other.into(),
        },
    };
    match expected {
        "" => format!("found {found}"),
        _ => format!("found {found}, expected {}", kind_of(expected)),
    }
}

/// Rewords a type of the TOML reader.
fn kind_of(expected: &str) -> String {
    let first = expected.split(' ').next().unwrap_or_default();
    match (first, expected) {
        ("u8" | "u16" | "u32" | "u64" | "usize", _) => "a whole number, zero or more".into(),
        ("i8" | "i16" | "i32" | "i64" | "isize", _) => "a whole number".into(),
        ("f32" | "f64", _) => "a number".into(),
        ("struct" | "map", _) | (_, "a map") => "a table of keys and values".into(),
        (_, "a sequence") => "a list".into(),
        (_, "a string" | "path string" | "string or table") => "text in quotes".into(),
        (_, "a boolean") => "true or false".into(),
        _ => match expected.strip_prefix("an array of length ") {
            Some(count) => format!("a list of {count} values"),
            None => expected.into(),
        },
    }
}

/// Rewords other messages of the TOML reader.
pub(super) fn plainly(message: &str) -> String {
    let message = message.trim_end().replace('\n', "; ");
    if let Some((count, expected)) =
        message.strip_prefix("invalid length ").and_then(|rest| rest.split_once(", expected "))
    {
        return format!("found {count} values, expected {}", kind_of(expected));
    }
    if let Some(kind) = message.strip_prefix("wanted ") {
        return format!("wrong kind of value: expected {}", kind_of(kind));
    }
    if message.starts_with("data did not match any variant") {
        return "a value of this form is not accepted here".into();
    }
    message
}
