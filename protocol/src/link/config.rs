//! The Zenoh configuration of every process.
//!
//! What the defaults would do and why not: multicast and gossip scouting find strangers' robots; `lowlatency`
//! excludes priorities and loses messages above 64 KiB; the admin space lets any peer read the session;
//! limits of 1 GiB a message and 1000 sessions invite a flood; a lease of 10 s leaves a dead peer's place
//! taken for so long (liveness itself is judged from the age of messages, much sooner).

use super::{Endpoints, LinkError};

/// Peer with explicit endpoints; see the module.
pub(super) fn peer(endpoints: &Endpoints) -> Result<zenoh::Config, LinkError> {
    // Checked endpoints have printable ASCII alone, so Rust's debug form of the lists is JSON's.
    let Endpoints { listen, connect } = endpoints;
    let text = format!(
        r#"{{
            mode: "peer",
            listen: {{ endpoints: {listen:?}, timeout_ms: 0, exit_on_failure: true }},
            connect: {{
                endpoints: {connect:?},
                timeout_ms: -1,
                exit_on_failure: false,
                retry: {{ period_init_ms: 200, period_max_ms: 1000, period_increase_factor: 2 }},
            }},
            scouting: {{ multicast: {{ enabled: false }}, gossip: {{ enabled: false }} }},
            open: {{ return_conditions: {{ connect_scouted: false, declares: false }} }},
            adminspace: {{ enabled: false }},
            transport: {{
                unicast: {{
                    open_timeout: 2000,
                    accept_timeout: 2000,
                    accept_pending: 8,
                    max_sessions: 8,
                    max_links: 1,
                    lowlatency: false,
                    qos: {{ enabled: true }},
                }},
                link: {{
                    tx: {{ lease: 2000, keep_alive: 4 }},
                    rx: {{ max_message_size: 1048576 }},
                }},
            }},
        }}"#
    );
    zenoh::Config::from_json5(&text).map_err(LinkError::zenoh("accept the configuration"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zenoh_knows_every_key_of_the_configuration() {
        let endpoints = Endpoints {
            listen: vec!["tcp/127.0.0.1:7447".to_owned(), "tcp/[::1]:7448#iface=lo".to_owned()],
            connect: vec!["tcp/localhost:7449".to_owned()],
        };
        let config = peer(&endpoints).unwrap().to_string();
        assert!(config.contains("tcp/[::1]:7448#iface=lo"), "{config}");
        assert!(config.contains(r#""lease":2000"#), "{config}");
    }
}
