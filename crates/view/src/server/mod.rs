//! HTTP on 127.0.0.1. The routes are fixed: no path names a file.
//!
//! | route | answer |
//! |---|---|
//! | `/` | page |
//! | `/index.json` | list of runs |
//! | `/revisions.json` | one text per run that changes when the run goes on |
//! | `/runs/N.json` | contents of run N |
//! | `/pictures/N.json` | small picture of run N |

mod request;
mod response;

use std::io::Write as _;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use crate::error::ViewError;
use crate::page;
use crate::viewer::Viewer;

use request::{Refusal, Request};
use response::Response;

/// Time after which a silent connection is closed.
const TIMEOUT: Duration = Duration::from_secs(10);
/// Largest number of connections at a time; further ones are closed.
const CONNECTIONS: usize = 32;

/// Server of the page of a viewer.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    viewer: Arc<Mutex<Viewer>>,
}

impl Server {
    /// Binds to 127.0.0.1; port 0 takes any free port.
    ///
    /// # Errors
    /// [`ViewError::Listen`].
    pub fn bind(viewer: Viewer, port: u16) -> Result<Server, ViewError> {
        let failed = |source| ViewError::Listen { port, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        Ok(Server { listener, address, viewer: Arc::new(Mutex::new(viewer)) })
    }

    /// Returns the address.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Answers requests until the program ends; each connection has a thread.
    pub fn run(&self) {
        let active = Arc::new(());
        for stream in self.listener.incoming() {
            let Ok(stream) = stream else {
                // Mostly too many open files: wait until some are closed.
                thread::sleep(Duration::from_millis(50));
                continue;
            };
            if Arc::strong_count(&active) > CONNECTIONS {
                continue;
            }
            let (token, viewer, port) = (active.clone(), self.viewer.clone(), self.address.port());
            thread::spawn(move || {
                let _token = token;
                // A client that leaves early is no error.
                let _ = answer(stream, &viewer, port);
            });
        }
    }
}

/// Reads one request and writes its answer.
fn answer(mut stream: TcpStream, viewer: &Mutex<Viewer>, port: u16) -> std::io::Result<()> {
    stream.set_read_timeout(Some(TIMEOUT))?;
    stream.set_write_timeout(Some(TIMEOUT))?;
    let (response, head_only) = match Request::read(&mut stream).and_then(|r| r.check(port)) {
        Ok(request) => (route(&request.path, viewer), request.head_only),
        Err(refusal) => (refused(&refusal), false),
    };
    response.write(&mut stream, head_only)?;
    stream.flush()
}

fn refused(refusal: &Refusal) -> Response {
    match refusal {
        Refusal::Malformed => Response::text(400, "malformed request"),
        Refusal::TooLarge => Response::text(431, "request too large"),
        Refusal::ForeignHost => Response::text(403, "requests must name 127.0.0.1 or localhost"),
        Refusal::ForeignOrigin => Response::text(403, "requests from other pages are refused"),
        Refusal::Method => Response::text(405, "only GET and HEAD").allow(),
    }
}

fn route(path: &str, viewer: &Mutex<Viewer>) -> Response {
    // A panic in another connection leaves the cache of frames complete.
    let lock = || viewer.lock().unwrap_or_else(PoisonError::into_inner);
    let number = |folder: &str| -> Option<usize> {
        let number = path.strip_prefix(folder)?.strip_suffix(".json")?;
        number.bytes().all(|b| b.is_ascii_digit()).then(|| number.parse().ok())?
    };
    let document = match path {
        "/" => return Response::html(page::served(), &page::policy("'self'")),
        "/index.json" => return Response::json(lock().index(true)),
        "/revisions.json" => return Response::json(lock().revisions()),
        _ => match (number("/runs/"), number("/pictures/")) {
            (Some(run), _) => lock().run(run),
            (_, Some(run)) => lock().picture(run),
            _ => return Response::text(404, "no such page"),
        },
    };
    match document {
        Some(Ok(document)) => Response::json(document),
        Some(Err(error)) => Response::text(500, &error.to_string()),
        None => Response::text(404, "no such run"),
    }
}
