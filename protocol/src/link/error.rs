//! What can go wrong with a link, and what to do about it.

use crate::keys::KeyError;
use std::io;

/// Why a link could not be opened or used.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// A name that cannot stand in a key.
    #[error(transparent)]
    Key(#[from] KeyError),
    /// An endpoint that is not one.
    #[error(
        "`{endpoint}` is not an endpoint: {problem}; write tcp/HOST:PORT, for example tcp/127.0.0.1:7447"
    )]
    Endpoint {
        /// As given.
        endpoint: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// Somebody else listens there.
    #[error(
        "cannot listen on `{endpoint}`: port {port} is in use, most likely by another process of this \
         program; find it with `ss -ltnp 'sport = :{port}'` and end it, or listen elsewhere with \
         `--listen tcp/HOST:PORT` (and `--connect` on the other side)"
    )]
    PortInUse {
        /// Where it wanted to listen.
        endpoint: String,
        /// The TCP port.
        port: u16,
    },
    /// Not an address of this machine, an unknown host, or not permitted.
    #[error(
        "cannot listen on `{endpoint}`: {source}; give an address of this machine and a port above 1023 \
         with `--listen tcp/HOST:PORT`"
    )]
    CannotListen {
        /// Where it wanted to listen.
        endpoint: String,
        /// What the system says.
        source: io::Error,
    },
    /// Zenoh refused.
    #[error("Zenoh could not {action}: {source}")]
    Zenoh {
        /// What was tried.
        action: &'static str,
        /// What Zenoh says.
        source: zenoh::Error,
    },
}

impl LinkError {
    /// Wraps Zenoh's error with what was tried.
    pub(super) fn zenoh(action: &'static str) -> impl FnOnce(zenoh::Error) -> Self {
        move |source| Self::Zenoh { action, source }
    }
}
