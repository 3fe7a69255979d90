//! WGSL sources, put together from a stage's file and the shared files it names.
//!
//! A line `// #import shared/NAME.wgsl` asks for a file of `shaders/`. Imported files are appended once each after the stage, since
//! order at module scope is free in WGSL: compilers then report the stage's own line numbers. A debug build reads the files from the
//! source tree if it is there, so that a change shows at the next start; otherwise the embedded text serves.

use std::borrow::Cow;

macro_rules! embedded {
    ($($name:literal),* $(,)?) => {
        /// Every shader file by its path in `shaders/`.
        pub const FILES: &[(&str, &str)] = &[$(($name, include_str!(concat!("../../shaders/", $name)))),*];
    };
}

embedded![
    "activity.wgsl",
    "boxes.wgsl",
    "cut_edges.wgsl",
    "intervals.wgsl",
    "lines.wgsl",
    "march_exact.wgsl",
    "march_fixed.wgsl",
    "march_leaf.wgsl",
    "march_paper.wgsl",
    "march_voxels.wgsl",
    "shared/brick.wgsl",
    "shared/classify.wgsl",
    "shared/clearance.wgsl",
    "shared/corners.wgsl",
    "shared/cuts.wgsl",
    "shared/descent.wgsl",
    "shared/faces.wgsl",
    "shared/frame.wgsl",
    "shared/interval.wgsl",
    "shared/leap.wgsl",
    "shared/light.wgsl",
    "shared/main.wgsl",
    "shared/march.wgsl",
    "shared/nodes_buffer.wgsl",
    "shared/nodes_texture.wgsl",
    "shared/output.wgsl",
    "shared/parts.wgsl",
    "shared/pass.wgsl",
    "shared/phong.wgsl",
    "shared/placing.wgsl",
    "shared/probe.wgsl",
    "shared/ray.wgsl",
    "shared/segment.wgsl",
    "shared/spans.wgsl",
    "shared/steps.wgsl",
    "shared/style.wgsl",
    "shared/surface.wgsl",
    "slices.wgsl",
    "viewport.wgsl",
];

/// How the octree's nodes reach the shader: what `// #import shared/nodes` stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NodeStorage {
    /// A storage buffer of one u32 a node, the nodes of a block together.
    Buffer,
    /// A 3D texture of RGBA8 texels.
    Texture,
}

impl NodeStorage {
    fn file(self) -> &'static str {
        match self {
            NodeStorage::Buffer => "shared/nodes_buffer.wgsl",
            NodeStorage::Texture => "shared/nodes_texture.wgsl",
        }
    }
}

/// The WGSL of a stage (a path in `shaders/`) with all it imports.
pub fn source(stage: &str, storage: NodeStorage) -> String {
    let mut names = vec![stage.to_owned()];
    let mut text = String::new();
    let mut next = 0;
    while next < names.len() {
        let file = read(&names[next]);
        let imports = file.lines().filter_map(|line| line.strip_prefix("// #import "));
        let imports = imports.map(|name| if name == "shared/nodes" { storage.file() } else { name });
        for name in imports {
            if !names.iter().any(|n| n == name) {
                names.push(name.to_owned());
            }
        }
        text.push_str(&file);
        next += 1;
    }
    text
}

fn read(name: &str) -> Cow<'static, str> {
    #[cfg(debug_assertions)]
    if let Ok(text) = std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders").join(name)) {
        return text.into();
    }
    FILES.iter().find(|(n, _)| *n == name).map(|(_, text)| *text).expect("shaders import files of FILES").into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn imports_are_appended_once() {
        let text = source("march_leaf.wgsl", NodeStorage::Buffer);
        let stage = FILES.iter().find(|(name, _)| *name == "march_leaf.wgsl").expect("a stage").1;
        assert!(text.starts_with(stage), "the stage comes first and keeps its line numbers");
        for definition in ["fn pixel_ray(", "fn segment(", "fn node(", "fn find("] {
            assert_eq!(text.matches(definition).count(), 1, "{definition}");
        }
        assert!(source("march_leaf.wgsl", NodeStorage::Texture).contains("texture_3d"));
    }
}
