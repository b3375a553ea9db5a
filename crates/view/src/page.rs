//! HTML page with its content security policy.

use std::io::Read as _;
use std::sync::LazyLock;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::read::DeflateDecoder;
use sha2::{Digest as _, Sha256};

/// Bundle of the page's scripts, made by `web/build.mjs`. The program holds it compressed.
static SCRIPT: LazyLock<String> = LazyLock::new(|| {
    let packed: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/view.js.deflate"));
    let mut text = String::new();
    DeflateDecoder::new(packed).read_to_string(&mut text).expect("the bundle of the build");
    text
});
/// Style sheet of the page, made by `web/build.mjs`.
const STYLE: &str = include_str!("../web/dist/view.css");

/// Returns the content security policy: the embedded script and style alone, nothing from outside.
/// `connect` is the source of later data, `'self'` or `'none'`.
pub fn policy(connect: &str) -> String {
    let hash = |text: &str| STANDARD.encode(Sha256::digest(text.as_bytes()));
    format!(
        "default-src 'none'; script-src 'sha256-{}'; style-src 'sha256-{}'; img-src data: blob:; \
         media-src blob:; connect-src {connect}; base-uri 'none'; form-action 'none'",
        hash(&SCRIPT),
        hash(STYLE)
    )
}

/// Returns the page of a server, which fetches its data.
pub fn served() -> String {
    document(&policy("'self'"), "")
}

/// Returns a page that contains the list of runs, all runs and their small pictures, given as JSON.
pub fn saved(index: &str, runs: &[String], pictures: &[String]) -> String {
    let mut data = data_block("index", index);
    for (kind, documents) in [("run", runs), ("picture", pictures)] {
        for (i, document) in documents.iter().enumerate() {
            data += &data_block(&format!("{kind}-{i}"), document);
        }
    }
    document(&policy("'none'"), &data)
}

/// Returns a block of JSON that no text in it can end.
fn data_block(id: &str, json: &str) -> String {
    let json = json.replace('<', "\\u003c");
    format!("<script type=\"application/json\" id=\"{id}\">{json}</script>\n")
}

fn document(policy: &str, data: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"referrer\" content=\"no-referrer\">\n\
         <link rel=\"icon\" href=\"data:,\">\n\
         <title>Grainwake</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <noscript>This page needs JavaScript. The figures are in report.html.</noscript>\n\
         {data}<script>{}</script>\n</body>\n</html>\n",
        *SCRIPT
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_cannot_end_its_block() {
        let page =
            saved(r#"{"title":"</script><script>alert(1)</script>"}"#, &["{}".to_owned()], &[]);
        assert!(!page.contains("alert(1)</script>"));
        assert!(page.contains(r"\u003c/script>\u003cscript>alert(1)"));
    }

    #[test]
    fn the_bundle_stays_in_its_elements() {
        assert!(!SCRIPT.contains("</script"), "the bundle would end its script element");
        assert!(!SCRIPT.contains("<!--"), "the bundle would open a comment");
        assert!(!STYLE.contains("</style"));
        assert!(SCRIPT.contains("three.js authors"), "the licence notice of three.js is missing");
    }
}
