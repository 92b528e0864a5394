//! Machines that travel with the library: case files of the folder `stages`.

/// Case files as pairs of path and text.
macro_rules! bundled {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_str!(concat!("../stages/", $path)))),*]
    };
}

/// The bundled case files: path within `stages`, and text.
pub const STAGES: &[(&str, &str)] = bundled![
    "sollmann-jouaneh/table4.toml",
    "sollmann-jouaneh/table1.toml",
    "sollmann-jouaneh/table2.toml",
    "printer-axis/printer-axis.toml",
    "laser-gantry/laser-gantry.toml",
    "two-mass/two-mass.toml",
    "pendulepi/pendulepi.toml",
    "sollmann-jouaneh/controllers/pid.toml",
    "h-frame/h-frame.toml",
    "h-frame/follows.toml",
    "h-frame/square.toml",
    "h-frame/racking.toml",
    "core-xy/core-xy.toml",
    "core-xy/follows.toml",
    "core-xy/square.toml",
    "dual-belt/dual-belt.toml",
    "dual-belt/follows.toml",
    "dual-belt/square.toml",
    "sollmann-jouaneh/controllers/pid-rigid.toml",
    "sollmann-jouaneh/controllers/pid-elastic.toml",
    "sollmann-jouaneh/controllers/pid-observer.toml",
    "sollmann-jouaneh/controllers/cascade.toml",
    "sollmann-jouaneh/controllers/cascade-current.toml",
    "sollmann-jouaneh/controllers/lqi.toml",
    "sollmann-jouaneh/controllers/lqg.toml",
    "sollmann-jouaneh/controllers/sliding.toml",
    "sollmann-jouaneh/controllers/fuzzy-pd.toml",
    "sollmann-jouaneh/controllers/fuzzy-pi.toml",
];

/// The text of the bundled case file at this path within `stages`; none if there is no such file.
///
/// ```
/// let text = taut::stages::text("sollmann-jouaneh/table4.toml").unwrap();
/// assert!(text.contains("[drive_pulley]"));
/// assert_eq!(taut::stages::text("no-such.toml"), None);
/// ```
pub fn text(path: &str) -> Option<&'static str> {
    STAGES.iter().find(|(known, _)| *known == path).map(|(_, text)| *text)
}

/// The bundled case files of a folder of `stages`: names within it, and texts.
pub fn inside(folder: &str) -> impl Iterator<Item = (&'static str, &'static str)> {
    STAGES.iter().filter_map(move |(path, text)| Some((path.strip_prefix(folder)?.strip_prefix('/')?, *text)))
}
