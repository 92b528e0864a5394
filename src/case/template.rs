//! The case that `taut init` writes.

/// A commented case file that runs as it stands.
pub const TEMPLATE: &str = include_str!("template.toml");
