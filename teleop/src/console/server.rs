//! HTTP and WebSocket, on a thread with a small runtime of its own.

use std::net::TcpListener;
use std::sync::Arc;
use std::thread::JoinHandle;

use anyhow::{Context, Result};
use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use rust_embed::RustEmbed;
use tokio::sync::oneshot;

use super::{Console, client, operator};

/// A request is small: hands, modes, stops.
const MAX_REQUEST_BYTES: usize = 4096;

/// The page, inside the program.
#[derive(RustEmbed)]
#[folder = "console/"]
struct Page;

/// The running console; dropped, it ends.
#[derive(Debug)]
pub struct Server {
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Some(end) = self.end.take() {
            // An error means that it has ended already.
            let _ = end.send(());
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Serves the console on a socket that is already bound.
pub fn start(listener: TcpListener, console: Console) -> Result<Server> {
    listener.set_nonblocking(true)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .max_blocking_threads(2)
        .thread_name("console")
        .enable_all()
        .build()?;
    let router = Router::new()
        .route("/", get(|| async { page("index.html") }))
        .route("/ws", get(connect))
        .route("/robot.urdf", get(urdf))
        .route("/operator.json", get(operator))
        .route("/{*path}", get(|Path(path): Path<String>| async move { page(&path) }))
        .with_state(Arc::new(console));
    let (end, ended) = oneshot::channel();
    let serve = async move {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        // Not a graceful end: that would wait for the browsers to leave.
        tokio::select! {
            served = async { axum::serve(listener, router).await } => served,
            _ = ended => Ok(()),
        }
    };
    let run = move || {
        if let Err(error) = runtime.block_on(serve) {
            tracing::error!("the console ended: {error}");
        }
        runtime.shutdown_background();
    };
    let thread =
        std::thread::Builder::new().name("console".into()).spawn(run).context("cannot start a thread")?;
    Ok(Server { end: Some(end), thread: Some(thread) })
}

fn page(path: &str) -> Response {
    let Some(file) = Page::get(path) else {
        return (StatusCode::NOT_FOUND, format!("{path} is no part of the console")).into_response();
    };
    let kind = match path.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        _ => "text/plain; charset=utf-8",
    };
    ([(header::CONTENT_TYPE, kind), (header::CACHE_CONTROL, "no-cache")], file.data.into_owned())
        .into_response()
}

async fn operator(State(console): State<Arc<Console>>) -> Response {
    axum::Json(console.view.as_ref().map(|(rig, shells)| operator::operator(rig, shells))).into_response()
}

async fn urdf(State(console): State<Arc<Console>>) -> Response {
    match tokio::fs::read_to_string(&console.urdf).await {
        Ok(text) => ([(header::CONTENT_TYPE, "application/xml")], text).into_response(),
        Err(error) => (StatusCode::NOT_FOUND, format!("{}: {error}", console.urdf.display())).into_response(),
    }
}

async fn connect(
    upgrade: WebSocketUpgrade,
    headers: HeaderMap,
    State(console): State<Arc<Console>>,
) -> Response {
    if !same_origin(&headers) {
        return (StatusCode::FORBIDDEN, "only the console's own page may connect").into_response();
    }
    upgrade.max_message_size(MAX_REQUEST_BYTES).on_upgrade(move |socket| client::serve(socket, console))
}

/// Browsers let any page open a WebSocket to any address, and say which page it was: another site must not
/// reach the robot through a browser that is open on this computer.
fn same_origin(headers: &HeaderMap) -> bool {
    let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
    match (text(header::ORIGIN), text(header::HOST)) {
        (None, _) => true,
        (Some(origin), Some(host)) => origin.split_once("://").is_some_and(|(_, from)| from == host),
        (Some(_), None) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_of_other_sites_are_refused() {
        let headers = |origin: Option<&'static str>| {
            let mut headers = HeaderMap::new();
            headers.insert(header::HOST, "127.0.0.1:8080".parse().unwrap());
            if let Some(origin) = origin {
                headers.insert(header::ORIGIN, origin.parse().unwrap());
            }
            headers
        };
        assert!(same_origin(&headers(None)), "not a browser");
        assert!(same_origin(&headers(Some("http://127.0.0.1:8080"))));
        assert!(!same_origin(&headers(Some("http://evil.example"))));
        assert!(!same_origin(&headers(Some("null"))));
    }

    #[test]
    fn every_file_that_the_page_names_is_inside_the_program() {
        for file in Page::iter() {
            let text = Page::get(&file).map(|f| String::from_utf8_lossy(&f.data).into_owned()).unwrap();
            if file.contains("vendor/") {
                continue;
            }
            for quoted in text.split(['\'', '"']).filter_map(|word| word.strip_prefix("./").or(Some(word))) {
                let is_file = [".js", ".css", ".html"].iter().any(|end| quoted.ends_with(end));
                if is_file && !quoted.contains(' ') {
                    assert!(Page::get(quoted).is_some(), "{file} names {quoted}");
                }
            }
            assert!(!text.contains("https://") && !text.contains("//cdn"), "{file} needs the network");
        }
    }
}
