//! The server over a real socket: routes, refusals, and runs that go on.

mod common;

use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::path::Path;

use grainwake_view::server::Server;
use grainwake_view::{Source, Viewer};

fn serve(folder: &Path) -> SocketAddr {
    let source = Source { name: "run".into(), folder: folder.to_owned() };
    let server = Server::bind(Viewer::new(vec![source], None).unwrap(), 0).unwrap();
    let address = server.address();
    std::thread::spawn(move || server.run());
    address
}

/// Sends bytes and returns the answer.
fn send(address: SocketAddr, request: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

/// Sends a request with a correct host and further header lines.
fn ask(address: SocketAddr, line: &str, headers: &str) -> String {
    let port = address.port();
    send(address, &format!("{line} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{headers}\r\n"))
}

fn status(answer: &str) -> u16 {
    answer.split(' ').nth(1).and_then(|code| code.parse().ok()).unwrap_or(0)
}

#[test]
fn only_the_loopback_address_is_bound() {
    let run = common::run_folder();
    let address = serve(run.path());
    assert_eq!(address.ip(), Ipv4Addr::LOCALHOST);
    // Another address of the loopback network reaches a server that is bound to all addresses.
    let other = SocketAddr::from((Ipv4Addr::new(127, 0, 0, 2), address.port()));
    assert!(TcpStream::connect(other).is_err(), "the server listens on more than 127.0.0.1");
}

#[test]
fn the_routes_answer() {
    let run = common::run_folder();
    let address = serve(run.path());
    let page = ask(address, "GET /", "");
    assert_eq!(status(&page), 200);
    assert!(page.contains("Content-Type: text/html") && page.contains("<script>"));
    let index = ask(address, "GET /index.json", "");
    assert!(index.contains(r#""live":true"#) && index.contains(r#""runs":["run"]"#), "{index}");
    let run = ask(address, "GET /runs/0.json", "");
    assert_eq!(status(&run), 200);
    assert!(run.contains(r#""label":"kiss""#) && run.contains(r#""name":"y-grain0""#), "{run}");
    assert_eq!(status(&ask(address, "GET /runs/1.json", "")), 404);
    let picture = ask(address, "GET /pictures/0.json", "");
    assert!(status(&picture) == 200 && picture.contains("\"frames\":[{\"name\":"), "{picture}");
    assert_eq!(status(&ask(address, "GET /pictures/1.json", "")), 404);
    assert_eq!(status(&ask(address, "GET /runs/99999999999999999999999.json", "")), 404);
    let head = ask(address, "HEAD /", "");
    assert_eq!(status(&head), 200);
    assert!(head.ends_with("\r\n\r\n"), "HEAD has no body");
}

#[test]
fn no_path_names_a_file() {
    let run = common::run_folder();
    let secret = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(secret.path(), "secret").unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(secret.path(), run.path().join("link.json")).unwrap();
    let address = serve(run.path());
    let mut paths = vec!["/link.json".to_owned(), "/runs/link.json".to_owned()];
    for path in [
        "/grains.csv",
        "/runs/../grains.csv",
        "/../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/runs/..%2f0.json",
        "/runs/-0.json",
        "/runs/.json",
        "/pictures/.json",
        "/pictures/../runs/0.json",
        "//etc/passwd",
        "/index.json/../grains.csv",
    ] {
        paths.push(path.to_owned());
    }
    paths.push(secret.path().display().to_string());
    for path in paths {
        let answer = ask(address, &format!("GET {path}"), "");
        assert_eq!(status(&answer), 404, "{path}: {answer}");
        assert!(!answer.contains("secret") && !answer.contains("root:"), "{path}: {answer}");
    }
}

#[test]
fn foreign_hosts_are_refused() {
    let run = common::run_folder();
    let address = serve(run.path());
    let port = address.port();
    let with = |hosts: &str| status(&send(address, &format!("GET / HTTP/1.1\r\n{hosts}\r\n")));
    assert_eq!(with(&format!("Host: localhost:{port}\r\n")), 200);
    assert_eq!(with(&format!("Host: LOCALHOST:{port}\r\n")), 200);
    for host in
        ["evil.example", "127.0.0.1", "127.0.0.1:1", "127.0.0.1.evil.example", "localhost.evil:80"]
    {
        assert_eq!(with(&format!("Host: {host}\r\n")), 403, "{host}");
        assert_eq!(
            with(&format!("Host: {host}:{port}\r\n")),
            if host == "127.0.0.1" { 200 } else { 403 }
        );
    }
    assert_eq!(with(""), 400, "without a host");
    assert_eq!(with(&format!("Host: localhost:{port}\r\nHost: evil.example\r\n")), 400);
}

#[test]
fn foreign_origins_are_refused() {
    let run = common::run_folder();
    let address = serve(run.path());
    let port = address.port();
    let with = |headers: &str| ask(address, "GET /index.json", headers);
    assert_eq!(status(&with(&format!("Origin: http://127.0.0.1:{port}\r\n"))), 200);
    for origin in ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1", ""] {
        let answer = with(&format!("Origin: {origin}\r\n"));
        assert_eq!(status(&answer), 403, "{origin}");
    }
    for site in ["cross-site", "same-site"] {
        assert_eq!(status(&with(&format!("Sec-Fetch-Site: {site}\r\n"))), 403, "{site}");
    }
    assert_eq!(status(&with("Sec-Fetch-Site: same-origin\r\n")), 200);
    // No answer allows a foreign page to read it.
    let answer = with("");
    assert!(!answer.to_ascii_lowercase().contains("access-control-allow"), "{answer}");
    assert!(answer.contains("Cross-Origin-Resource-Policy: same-origin"));
}

#[test]
fn only_get_and_head_are_answered() {
    let run = common::run_folder();
    let address = serve(run.path());
    for method in ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT", "get"] {
        let answer = ask(address, &format!("{method} /"), "");
        assert_eq!(status(&answer), 405, "{method}");
        assert!(answer.contains("Allow: GET, HEAD"));
    }
}

#[test]
fn malformed_requests_are_refused() {
    let run = common::run_folder();
    let address = serve(run.path());
    assert_eq!(status(&send(address, "hello\r\n\r\n")), 400);
    assert_eq!(status(&send(address, "GET / HTTP/1.1\r\nbad header\r\n\r\n")), 400);
    let many = "X: y\r\n".repeat(100);
    assert_eq!(status(&ask(address, "GET /", &many)), 431);
    // The server goes on.
    assert_eq!(status(&ask(address, "GET /", "")), 200);
}

#[test]
fn the_policy_allows_nothing_from_outside() {
    let run = common::run_folder();
    let address = serve(run.path());
    let page = ask(address, "GET /", "");
    let policy = page.lines().find(|l| l.starts_with("Content-Security-Policy: ")).unwrap();
    assert!(policy.contains("default-src 'none'"), "{policy}");
    assert!(policy.contains("script-src 'sha256-") && policy.contains("frame-ancestors 'none'"));
    for loose in ["unsafe-inline", "unsafe-eval", "*", "http:", "https:"] {
        assert!(!policy.contains(loose), "{policy}");
    }
    assert!(page.contains("X-Content-Type-Options: nosniff"));
}

#[test]
fn a_run_that_goes_on_has_a_new_revision() {
    let run = common::run_folder();
    let address = serve(run.path());
    let body = |answer: String| answer.split("\r\n\r\n").nth(1).unwrap_or_default().to_owned();
    let revision = || body(ask(address, "GET /revisions.json", ""));
    let before = revision();
    assert_eq!(before, revision());
    common::append_row(run.path(), 0.2);
    assert_ne!(before, revision());
}

/// `grainwake run --force` writes other slices under the same names.
#[test]
fn a_replaced_run_shows_its_own_slices() {
    let run = common::run_folder();
    let later = run.path().join("slices/y-grain0_000001.vti");
    common::write_slice(&later, 0.1, 0.5);
    let address = serve(run.path());
    let before = ask(address, "GET /runs/0.json", "");
    assert_eq!(before.matches("[0.5,0.5]").count(), 6, "{before}");
    let written = std::fs::metadata(&later).unwrap().modified().unwrap();
    common::write_slice(&later, 0.1, 2.5);
    // The clock of the file system may be coarse.
    let file = std::fs::File::options().append(true).open(&later).unwrap();
    file.set_modified(written + std::time::Duration::from_secs(1)).unwrap();
    let after = ask(address, "GET /runs/0.json", "");
    let counts = ["[0.5,0.5]", "[2.5,2.5]"].map(|range| after.matches(range).count());
    assert_eq!(counts, [3, 3], "{after}");
}
