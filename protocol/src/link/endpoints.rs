//! Where a process listens and whom it connects to.

use super::LinkError;
use std::io::ErrorKind;
use std::net::{TcpListener, ToSocketAddrs};

/// Zenoh endpoints, as `tcp/127.0.0.1:7447`.
///
/// At least one side of each pair must connect; it does not matter which, nor which starts first.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Endpoints {
    /// Where others reach this process.
    pub listen: Vec<String>,
    /// Where this process finds others.
    pub connect: Vec<String>,
}

impl Endpoints {
    /// Endpoints of a process that others connect to.
    pub fn listen(endpoint: &str) -> Self {
        Self { listen: vec![endpoint.to_owned()], connect: Vec::new() }
    }

    /// Endpoints of a process that connects to others.
    pub fn connect<S: AsRef<str>>(endpoints: &[S]) -> Self {
        Self { listen: Vec::new(), connect: endpoints.iter().map(|e| e.as_ref().to_owned()).collect() }
    }

    /// Refuses what Zenoh would refuse, but with a sentence that says what to do.
    pub(super) fn check(&self) -> Result<(), LinkError> {
        for endpoint in &self.connect {
            address(endpoint)?;
        }
        for endpoint in &self.listen {
            check_free(endpoint)?;
        }
        Ok(())
    }
}

/// `host:port` of a TCP endpoint; what follows `?` or `#` is Zenoh's business.
fn address(endpoint: &str) -> Result<&str, LinkError> {
    let fail = |problem| LinkError::Endpoint { endpoint: endpoint.to_owned(), problem };
    if !endpoint.bytes().all(|byte| byte.is_ascii_graphic() && byte != b'"' && byte != b'\\') {
        return Err(fail("it has blanks, quotes or characters beyond ASCII"));
    }
    let Some((protocol, rest)) = endpoint.split_once('/') else {
        return Err(fail("the protocol is missing"));
    };
    if protocol != "tcp" {
        return Err(fail("only tcp is built in"));
    }
    let address = rest.split(['?', '#']).next().unwrap_or(rest);
    let Some((host, port)) = address.rsplit_once(':') else {
        return Err(fail("the port is missing"));
    };
    if host.is_empty() || (host.contains(':') && !(host.starts_with('[') && host.ends_with(']'))) {
        return Err(fail("the host is not a name, an IPv4 address or an [IPv6 address]"));
    }
    if port.parse::<u16>().is_err() {
        return Err(fail("the port is not a number from 0 to 65535"));
    }
    Ok(address)
}

/// Binds the address for a moment, with the same options as Zenoh does.
fn check_free(endpoint: &str) -> Result<(), LinkError> {
    let address = address(endpoint)?;
    let cannot_listen = |source| LinkError::CannotListen { endpoint: endpoint.to_owned(), source };
    let addresses: Vec<_> = address.to_socket_addrs().map_err(cannot_listen)?.collect();
    match TcpListener::bind(addresses.as_slice()) {
        Ok(_) => Ok(()),
        Err(error) if error.kind() == ErrorKind::AddrInUse => Err(LinkError::PortInUse {
            endpoint: endpoint.to_owned(),
            port: addresses.first().map_or(0, std::net::SocketAddr::port),
        }),
        Err(error) => Err(cannot_listen(error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn well_formed_endpoints_pass() {
        for good in ["tcp/127.0.0.1:7447", "tcp/localhost:0", "tcp/[::1]:7447", "tcp/host:1#iface=lo"] {
            assert!(address(good).is_ok(), "{good}");
        }
    }

    #[test]
    fn an_ill_formed_endpoint_is_named_with_the_right_form() {
        for bad in [
            "",
            "127.0.0.1:7447",
            "tcp/",
            "tcp/127.0.0.1",
            "tcp/127.0.0.1:",
            "tcp/127.0.0.1:70000",
            "tcp/:1",
            "udp/127.0.0.1:1",
            "tcp/::1:7447",
            "tcp/a b:1",
            "tcp/\":1",
            "tcp/ä:1",
        ] {
            let error = address(bad).unwrap_err().to_string();
            assert!(error.contains(&format!("`{bad}`")) && error.contains("tcp/127.0.0.1:7447"), "{error}");
        }
    }
}
