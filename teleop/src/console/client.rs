//! One connected browser: status and previews out, requests in.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket};
use locoman_protocol::clock::monotonic_ns;
use tokio::time::{MissedTickBehavior, interval};

use super::request::Request;
use super::{Console, preview, status};
use crate::latest::lock;
use crate::shown::Shown;

/// Numbers the connections.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// Counts the connection while it lives; when it ends, its dead-man is released.
struct Connection<'a> {
    console: &'a Console,
    id: u64,
}

impl<'a> Connection<'a> {
    fn new(console: &'a Console) -> Self {
        console.board.viewers.fetch_add(1, Ordering::Relaxed);
        Self { console, id: NEXT.fetch_add(1, Ordering::Relaxed) }
    }
}

impl Drop for Connection<'_> {
    fn drop(&mut self) {
        let board = &self.console.board;
        lock(&board.browsers).remove(&self.id);
        if board.viewers.fetch_sub(1, Ordering::Relaxed) == 1 {
            lock(&board.shown).clear();
        }
    }
}

/// Serves a browser until it leaves or the station ends.
pub(super) async fn serve(mut socket: WebSocket, console: Arc<Console>) {
    let connection = Connection::new(&console);
    let mut statuses = interval(Duration::from_secs_f64(1.0 / console.config.status_hz));
    let mut previews = interval(Duration::from_secs_f64(1.0 / console.config.preview_hz));
    statuses.set_missed_tick_behavior(MissedTickBehavior::Skip);
    previews.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut sent_ns = BTreeMap::new();
    while !console.board.stopping() {
        let sent = tokio::select! {
            received = socket.recv() => match received {
                Some(Ok(Message::Text(text))) => { obey(&connection, &text); Ok(()) }
                Some(Ok(Message::Close(_)) | Err(_)) | None => break,
                Some(Ok(_)) => Ok(()),
            },
            _ = statuses.tick() => {
                let text = serde_json::to_string(&status::status(&console)).unwrap_or_default();
                socket.send(Message::Text(text.into())).await
            }
            _ = previews.tick() => send_previews(&mut socket, &console, &mut sent_ns).await,
        };
        if sent.is_err() {
            break;
        }
    }
}

fn obey(connection: &Connection<'_>, text: &str) {
    let board = &connection.console.board;
    match serde_json::from_str(text) {
        Ok(Request::Hand(hand)) => {
            lock(&board.browsers).insert(connection.id, (hand, monotonic_ns()));
        }
        Ok(Request::Mode(mode)) => *lock(&board.mode) = Some(mode.into()),
        Ok(Request::Auto(on)) => *lock(&board.auto) = Some(on),
        Ok(Request::Stop(level)) => connection.console.stop.send(level.into()),
        Err(error) => tracing::warn!("the browser sent what is no request: {error}"),
    }
}

async fn send_previews(
    socket: &mut WebSocket,
    console: &Arc<Console>,
    sent_ns: &mut BTreeMap<usize, u64>,
) -> Result<(), axum::Error> {
    let mut newest: Vec<Arc<Shown>> = lock(&console.board.shown).values().cloned().collect();
    newest.retain(|shown| {
        let news = sent_ns.get(&shown.seen.camera).is_none_or(|sent_ns| *sent_ns < shown.seen.capture_ns);
        sent_ns.insert(shown.seen.camera, shown.seen.capture_ns);
        news
    });
    if newest.is_empty() {
        return Ok(());
    }
    let encoder = Arc::clone(console);
    // Encoding takes milliseconds: not on the thread that serves the sockets.
    let images = tokio::task::spawn_blocking(move || encode(&encoder, &newest)).await.unwrap_or_default();
    for image in images {
        socket.send(Message::Binary(Bytes::from(image))).await?;
    }
    Ok(())
}

fn encode(console: &Console, newest: &[Arc<Shown>]) -> Vec<Vec<u8>> {
    let Some((rig, _)) = &console.view else { return Vec::new() };
    let images = newest.iter().filter_map(|shown| match preview::message(rig, shown) {
        Ok(image) => image,
        Err(error) => {
            tracing::debug!("no preview: {error}");
            None
        }
    });
    images.collect()
}
