//! Whom the page is shown to.
//!
//! On a loopback address every program of this computer may look; a page of another site may not, not even after it has
//! turned its name to this computer's address (DNS rebinding), for then the `Host` it asks for is that name. Everywhere else,
//! and wherever robots can be driven, the address has a token in it that nobody can guess.

use std::net::{IpAddr, SocketAddr};

use base16ct::lower::encode_string;
use ctutils::CtEq;

/// Length of a token before it is written in hexadecimal digits.
const TOKEN_BYTES: usize = 16;

/// Where a server of HTTP listens that no address names a port of.
const HTTP_PORT: u16 = 80;

/// What a request must bring.
#[derive(Clone, Debug)]
pub struct Access {
    port: u16,
    token: Option<String>,
}

/// Why a request is not answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Denied {
    /// Its `Host` is no number, or another port.
    Host,
    /// It comes from the page of another site.
    Origin,
    /// It has no token, or a wrong one.
    Token,
}

impl Denied {
    /// For the person who sees it in the browser.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Host => {
                "open this page by the address that `scram view --live` printed, with the computer's number in it"
            }
            Self::Origin => "another site's page may not look here",
            Self::Token => {
                "open this page by the whole address that `scram view --live` printed, with the token at its end"
            }
        }
    }
}

impl Access {
    /// For a server at an address; without a token only on loopback.
    ///
    /// # Errors
    /// The system has no randomness.
    pub fn new(address: SocketAddr, drive: bool) -> Result<Self, getrandom::Error> {
        let token = if address.ip().is_loopback() && !drive { None } else { Some(token()?) };
        Ok(Self { port: address.port(), token })
    }

    /// What follows the path of every address: nothing, or the token.
    #[must_use]
    pub fn query(&self) -> String {
        self.token.as_ref().map(|token| format!("?token={token}")).unwrap_or_default()
    }

    /// Checks the `Host` of a request and its query.
    ///
    /// # Errors
    /// What is wrong.
    pub fn page(&self, host: &str, query: &str) -> Result<(), Denied> {
        if !self.is_ours(host) {
            return Err(Denied::Host);
        }
        let given = query.split('&').find_map(|pair| pair.strip_prefix("token=")).unwrap_or_default();
        match &self.token {
            Some(token) if !token.as_bytes().ct_eq(given.as_bytes()).to_bool() => Err(Denied::Token),
            _ => Ok(()),
        }
    }

    /// The same for the page's own connection, which browsers mark with the site that it comes from.
    ///
    /// # Errors
    /// What is wrong.
    pub fn socket(&self, host: &str, origin: &str, query: &str) -> Result<(), Denied> {
        self.page(host, query)?;
        if origin.strip_prefix("http://") == Some(host) { Ok(()) } else { Err(Denied::Origin) }
    }

    /// A number, which no site can claim, or `localhost`, and the port, which browsers leave out where it is HTTP's own.
    fn is_ours(&self, host: &str) -> bool {
        let (name, port) = match host.rsplit_once(':') {
            // The colons of `[::1]` are in the number.
            Some((name, port)) if !port.ends_with(']') => (name, port.parse().ok()),
            _ => (host, Some(HTTP_PORT)),
        };
        let number = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        let is_number = number.parse::<IpAddr>().is_ok();
        (is_number || name.eq_ignore_ascii_case("localhost")) && port == Some(self.port)
    }
}

fn token() -> Result<String, getrandom::Error> {
    let mut bytes = [0; TOKEN_BYTES];
    getrandom::fill(&mut bytes)?;
    Ok(encode_string(&bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access(address: &str, drive: bool) -> Access {
        Access::new(address.parse().unwrap(), drive).unwrap()
    }

    #[test]
    fn on_loopback_a_number_is_enough_and_a_name_is_not() {
        let access = access("127.0.0.1:8080", false);
        for host in ["127.0.0.1:8080", "localhost:8080", "[::1]:8080", "192.168.1.7:8080"] {
            assert_eq!(access.page(host, ""), Ok(()), "{host}");
        }
        for host in
            ["evil.example:8080", "127.0.0.1", "127.0.0.1:80", "127.0.0.1.evil.example:8080", "", "localhost.:8080"]
        {
            assert_eq!(access.page(host, ""), Err(Denied::Host), "{host}");
        }
    }

    #[test]
    fn the_port_of_http_itself_is_left_out() {
        let access = access("127.0.0.1:80", false);
        for host in ["127.0.0.1", "127.0.0.1:80", "localhost", "[::1]", "[::1]:80"] {
            assert_eq!(access.page(host, ""), Ok(()), "{host}");
            assert_eq!(access.socket(host, &format!("http://{host}"), ""), Ok(()), "{host}");
        }
        for host in ["evil.example", "127.0.0.1:8080", "127.0.0.1:", "[::1", "[::1]:", "", "[]"] {
            assert_eq!(access.page(host, ""), Err(Denied::Host), "{host}");
        }
        assert_eq!(access.socket("127.0.0.1", "http://evil.example", ""), Err(Denied::Origin));
    }

    #[test]
    fn elsewhere_and_where_robots_are_driven_a_token_is_asked_for() {
        for (address, drive) in [("0.0.0.0:8080", false), ("127.0.0.1:8080", true), ("[::]:8080", false)] {
            let access = access(address, drive);
            let query = access.query();
            let token = query.strip_prefix("?token=").unwrap();
            assert_eq!(token.len(), 2 * TOKEN_BYTES);
            assert_eq!(access.page("10.0.0.2:8080", &query[1..]), Ok(()));
            let shorter = format!("token={}", &token[1..]);
            for wrong in ["", "token=", "token=00", &shorter, token] {
                assert_eq!(access.page("10.0.0.2:8080", wrong), Err(Denied::Token), "{wrong}");
            }
        }
        assert_ne!(access("0.0.0.0:1", false).query(), access("0.0.0.0:1", false).query());
        assert_eq!(access("127.0.0.1:8080", false).query(), "");
    }

    #[test]
    fn only_the_page_itself_may_connect() {
        let access = access("127.0.0.1:8080", false);
        let host = "127.0.0.1:8080";
        assert_eq!(access.socket(host, "http://127.0.0.1:8080", ""), Ok(()));
        for origin in ["", "null", "http://evil.example", "https://127.0.0.1:8080", "http://127.0.0.1:8081"] {
            assert_eq!(access.socket(host, origin, ""), Err(Denied::Origin), "{origin}");
        }
        assert_eq!(access.socket("evil.example:8080", "http://evil.example:8080", ""), Err(Denied::Host));
    }
}
