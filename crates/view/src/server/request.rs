//! Reading and checking of requests.

use std::io::Read;

/// Largest head of a request [bytes].
const LARGEST: usize = 16 * 1024;
/// Largest number of header fields.
const FIELDS: usize = 64;

/// Reason why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Not HTTP/1, incomplete, or without exactly one host.
    Malformed,
    /// Head too large.
    TooLarge,
    /// The `Host` is not this machine under a local name: the name of another site may lead here.
    ForeignHost,
    /// A page of another origin asks.
    ForeignOrigin,
    /// Neither GET nor HEAD.
    Method,
}

/// Head of a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// Path, without query.
    pub path: String,
    /// True for HEAD: the answer has no body.
    pub head_only: bool,
    method: String,
    hosts: Vec<String>,
    origins: Vec<String>,
    fetch_sites: Vec<String>,
}

impl Request {
    /// Reads the head of a request. Bodies are not read.
    pub fn read(stream: &mut impl Read) -> Result<Request, Refusal> {
        let mut head = Vec::new();
        let mut part = [0; 2048];
        loop {
            let count = stream.read(&mut part).map_err(|_| Refusal::Malformed)?;
            if count == 0 {
                return Err(Refusal::Malformed);
            }
            head.extend_from_slice(&part[..count]);
            if head.len() > LARGEST {
                return Err(Refusal::TooLarge);
            }
            if let Some(request) = Request::parse(&head)? {
                return Ok(request);
            }
        }
    }

    /// Parses a head; `None` if it is incomplete.
    fn parse(head: &[u8]) -> Result<Option<Request>, Refusal> {
        let mut fields = [httparse::EMPTY_HEADER; FIELDS];
        let mut parsed = httparse::Request::new(&mut fields);
        match parsed.parse(head) {
            Ok(httparse::Status::Complete(_)) => {}
            Ok(httparse::Status::Partial) => return Ok(None),
            Err(httparse::Error::TooManyHeaders) => return Err(Refusal::TooLarge),
            Err(_) => return Err(Refusal::Malformed),
        }
        let values = |name: &str| {
            let named = parsed.headers.iter().filter(|f| f.name.eq_ignore_ascii_case(name));
            named.map(|f| String::from_utf8_lossy(f.value).trim().to_ascii_lowercase()).collect()
        };
        let path = parsed.path.ok_or(Refusal::Malformed)?;
        let method = parsed.method.ok_or(Refusal::Malformed)?;
        Ok(Some(Request {
            path: path.split('?').next().unwrap_or_default().to_owned(),
            head_only: method == "HEAD",
            method: method.to_owned(),
            hosts: values("host"),
            origins: values("origin"),
            fetch_sites: values("sec-fetch-site"),
        }))
    }

    /// Refuses foreign hosts, foreign pages and other methods.
    pub fn check(self, port: u16) -> Result<Request, Refusal> {
        let names = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{port}"));
        let is_local = |host: &str| names.iter().any(|name| name == host);
        match &self.hosts[..] {
            [host] if is_local(host) => {}
            [_] => return Err(Refusal::ForeignHost),
            _ => return Err(Refusal::Malformed),
        }
        let own = |origin: &String| origin.strip_prefix("http://").is_some_and(is_local);
        if !self.origins.iter().all(own) {
            return Err(Refusal::ForeignOrigin);
        }
        // Browsers send no origin with pictures and scripts. A link to the page is harmless.
        let crossing = |site: &String| !matches!(site.as_str(), "none" | "same-origin");
        if self.path != "/" && self.fetch_sites.iter().any(crossing) {
            return Err(Refusal::ForeignOrigin);
        }
        match self.method.as_str() {
            "GET" | "HEAD" => Ok(self),
            _ => Err(Refusal::Method),
        }
    }
}
