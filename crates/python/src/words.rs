//! Names of Python in the messages of the libraries, which name options of the command line and
//! tables of a case file.

/// Phrases of messages and their form in Python. Earlier rows are replaced first.
const PHRASES: &[(&str, &str)] = &[
    // Run folders.
    ("leave out --resume, write --resume-or-start, or give", "leave out resume=True, or give"),
    ("the folder of the run with -o", "the folder of the run"),
    ("the run folder with -o", "the run folder"),
    ("another folder with -o", "another folder"),
    ("or --force to replace it", "or replace it with force=True"),
    ("or --force to start over", "or start over with force=True"),
    ("--resume", "resume=True"),
    ("--force", "force=True"),
    ("--from names", "start_from names"),
    ("another run with --from", "another run with start_from"),
    ("--from runs/heap", "start_from=\"runs/heap\""),
    ("--from ", "start_from="),
    // Overrides.
    (
        "write key=value, for example --set time.end=0.5 or --set grain.0.density=2600",
        "write \"key=value\", for example \"time.end=0.5\" or \"grain.0.density=2600\"",
    ),
    ("; a shell needs the argument in single quotes", ""),
    ("--set ", "override "),
    ("--set", "overrides"),
    ("--unset ", "None for "),
    // Cases and grain files.
    ("`grainwake schema`", "Case.schema()"),
    ("`grainwake grain from-scan`, `from-mesh` or `make`", "Grain.save"),
    ("`grainwake grain ... --nodes`", "nodes=N"),
    ("[run] precision = \"f32\"", "the key precision = \"f32\" of the table run"),
    // Scans.
    (
        "(--threshold otsu, otsu3, or a grey value)",
        "(threshold=\"otsu\", \"otsu3\" or a grey value)",
    ),
    ("--labels", "labels=True"),
    ("--largest-piece", "largest_piece=True"),
    ("--median", "median=True"),
    ("--smoothing ", "smoothing="),
    // Studies and validations.
    ("(--only 'g04-*,sphere')", "(only=\"g04-*,sphere\")"),
    ("(--only 3/65)", "(only=\"3/65\")"),
    ("--only", "only"),
    ("--list shows all names", "Study.runs lists all names"),
    ("`grainwake study`", "Study.run"),
    ("--level full, in Python level=\"full\"", "level=\"full\""),
];

/// Phrases about TOML, and their form for a case that was given as a dict.
const OF_DICTS: &[(&str, &str)] = &[
    ("each row of this list has double brackets: ", "give a list of dicts for "),
    ("write it once, with single brackets: ", "give one dict for "),
    ("paths are relative to the case file", "paths are relative to `folder`"),
];

/// Returns a message with the names of Python.
pub fn python_words(text: &str) -> String {
    PHRASES.iter().fold(text.to_owned(), |text, (phrase, other)| replaced(&text, phrase, other))
}

/// Returns a message about a case that was given as a dict: tables have the names of its keys.
pub fn words_of_dict(text: &str) -> String {
    let text = OF_DICTS
        .iter()
        .fold(python_words(text), |text, (phrase, other)| replaced(&text, phrase, other));
    without_brackets(&text)
}

/// Replaces a phrase wherever it stands alone: "--force" is no part of "--force-all".
fn replaced(text: &str, phrase: &str, other: &str) -> String {
    let in_word = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    let ends_in_word = phrase.ends_with(in_word);
    let (mut result, mut rest) = (String::new(), text);
    while let Some(at) = rest.find(phrase) {
        let (before, after) = (&rest[..at], &rest[at + phrase.len()..]);
        let joined = before.ends_with(in_word) || ends_in_word && after.starts_with(in_word);
        result += before;
        result += if joined { phrase } else { other };
        rest = after;
    }
    result + rest
}

/// Replaces `[fluid]` and `[[grain]]` by `fluid` and `grain` in backticks.
fn without_brackets(text: &str) -> String {
    let (mut result, mut rest) = (String::new(), text);
    while let Some(at) = rest.find('[') {
        let (before, from) = rest.split_at(at);
        let name = from.trim_start_matches('[');
        let length = name.find(|c: char| !c.is_ascii_lowercase() && c != '_').unwrap_or(0);
        let depth = from.len() - name.len();
        let (name, after) = name.split_at(length);
        let closed = after.len() - after.trim_start_matches(']').len();
        result += before;
        if name.is_empty() || closed < depth || depth > 2 {
            result += &from[..depth];
            rest = &from[depth..];
        } else {
            result += &format!("`{name}`");
            rest = &after[depth..];
        }
    }
    result + rest
}
