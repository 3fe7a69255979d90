//! The structure that the crate's documentation promises: what each module may import, and where foreign crates may be named.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules, lowest layer first.
const LAYERS: [&[&str]; 9] = [
    &["geometry", "progress", "words"],
    &["mesh", "volume", "view", "image"],
    &["optics", "format", "octree", "exact", "furniture"],
    &["bricks"],
    &["cpu", "gpu", "compare", "session"],
    &["render"],
    &["study"],
    &["app"],
    &["cli"],
];

/// Crates and the places under `src/` that may name them.
const PLACES: [(&str, &[&str]); 6] = [
    ("wgpu", &["gpu/", "app/viewport.rs"]),
    ("egui", &["app/"]),
    ("eframe", &["app/"]),
    ("egui_plot", &["app/"]),
    ("clap", &["cli/", "main.rs"]),
    ("anyhow", &["cli/", "app/", "main.rs"]),
];

fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|modules| modules.contains(&module))
}

/// Every Rust file under `src/` by its path there, without comments and without what follows `#[cfg(test)]` before a module.
fn sources() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut folders = vec![root.clone()];
    let mut files: Vec<PathBuf> = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a readable folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() { folders.push(path) } else { files.push(path) }
        }
    }
    let relative = |path: &Path| path.strip_prefix(&root).expect("under src").to_string_lossy().replace('\\', "/");
    let code = |path: &Path| {
        let text = fs::read_to_string(path).expect("a readable file");
        let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default().to_owned();
        text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
    };
    files.iter().map(|path| (relative(path), code(path))).collect()
}

/// The modules named after `crate::`, those of `use crate::{a::.., b}` included.
fn imports(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for rest in code.split("crate::").skip(1) {
        let names: Vec<&str> = match rest.strip_prefix('{') {
            Some(group) => group.split('}').next().unwrap_or_default().split(',').collect(),
            None => vec![rest],
        };
        found.extend(names.iter().map(|n| n.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()));
    }
    found
}

#[test]
fn modules_import_lower_layers_only() {
    let mut checked = 0;
    for (file, code) in sources() {
        let module = file.split(['/', '.']).next().unwrap_or_default();
        let Some(own) = layer(module) else { continue };
        for import in imports(&code).iter().filter(|import| *import != module) {
            let Some(other) = layer(import) else { continue };
            assert!(other < own, "{file} (layer {own}) imports {import} (layer {other})");
            checked += 1;
        }
    }
    assert!(checked > 50, "only {checked} imports were found");
}

#[test]
fn foreign_crates_stay_in_their_places() {
    for (file, code) in sources() {
        for (name, places) in PLACES {
            let named = code.split(|c: char| !(c.is_alphanumeric() || c == '_')).any(|word| word == name);
            assert!(!named || places.iter().any(|place| file.starts_with(place)), "{file} names {name}, which belongs to {places:?}");
        }
    }
}

#[test]
fn the_exact_renderer_shares_nothing_with_what_it_judges() {
    for (file, code) in sources().into_iter().filter(|(file, _)| file.starts_with("exact/")) {
        let shared: Vec<String> = imports(&code).into_iter().filter(|m| ["optics", "octree", "cpu", "gpu"].contains(&m.as_str())).collect();
        assert!(shared.is_empty(), "{file} imports {shared:?}");
    }
}

#[test]
fn every_module_has_a_layer() {
    for (file, _) in sources() {
        let module = file.split(['/', '.']).next().unwrap_or_default();
        assert!(layer(module).is_some() || ["lib", "main"].contains(&module), "{module} is in no layer");
    }
}
