//! Answers with their header fields.

use std::io::{self, Write};

/// Answer to a request.
#[derive(Clone, Debug)]
pub struct Response {
    status: u16,
    kind: &'static str,
    body: String,
    policy: String,
    allow: bool,
}

impl Response {
    /// Creates a page with its content security policy.
    pub fn html(body: String, policy: &str) -> Response {
        let policy = format!("{policy}; frame-ancestors 'none'");
        Response { policy, ..Response::new(200, "text/html; charset=utf-8", body) }
    }

    /// Creates an answer of JSON.
    pub fn json(body: String) -> Response {
        Response::new(200, "application/json", body)
    }

    /// Creates an answer of plain text.
    pub fn text(status: u16, body: &str) -> Response {
        Response::new(status, "text/plain; charset=utf-8", format!("{body}\n"))
    }

    /// Adds the list of methods.
    pub fn allow(self) -> Response {
        Response { allow: true, ..self }
    }

    fn new(status: u16, kind: &'static str, body: String) -> Response {
        let policy = "default-src 'none'; frame-ancestors 'none'".to_owned();
        Response { status, kind, body, policy, allow: false }
    }

    /// Writes the answer; the connection is closed afterwards.
    pub fn write(&self, stream: &mut impl Write, head_only: bool) -> io::Result<()> {
        let reason = match self.status {
            200 => "OK",
            400 => "Bad Request",
            403 => "Forbidden",
            404 => "Not Found",
            405 => "Method Not Allowed",
            431 => "Request Header Fields Too Large",
            _ => "Internal Server Error",
        };
        let allow = if self.allow { "Allow: GET, HEAD\r\n" } else { "" };
        let head = format!(
            "HTTP/1.1 {} {reason}\r\nContent-Type: {}\r\nContent-Length: {}\r\n{allow}\
             Content-Security-Policy: {}\r\nX-Content-Type-Options: nosniff\r\n\
             Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\
             Cross-Origin-Opener-Policy: same-origin\r\nCache-Control: no-store\r\n\
             Connection: close\r\n\r\n",
            self.status,
            self.kind,
            self.body.len(),
            self.policy
        );
        stream.write_all(head.as_bytes())?;
        if !head_only {
            stream.write_all(self.body.as_bytes())?;
        }
        Ok(())
    }
}
