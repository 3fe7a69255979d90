//! Every shader is valid, and what it shares with Rust has the same names, offsets, sizes and values on both sides.

use octetra::gpu::layout::{Counter, Frame, Knot, Style, Surface};
use octetra::gpu::shader::{FILES, NodeStorage, source};
use octetra::gpu::{BLOCK_CELLS, CLEARANCE_BITS, Placing, SliceLevel, SliceLook, SliceQuad};
use octetra::mesh::{adjacency, boundary};
use octetra::{cpu, optics};
use wgpu::naga::back::{PipelineConstants, pipeline_constants::process_overrides};
use wgpu::naga::front::wgsl;
use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
use wgpu::naga::{Expression, Literal, Module, TypeInner};

/// Each stage with each form of the volume.
fn modules() -> Vec<(String, Module)> {
    let stages = FILES.iter().map(|(name, _)| *name).filter(|name| !name.starts_with("shared/"));
    let sources = stages.flat_map(|stage| {
        [NodeStorage::Buffer, NodeStorage::Texture].map(|storage| (format!("{stage} ({storage:?})"), source(stage, storage)))
    });
    let parsed = sources.map(|(name, text)| {
        let module = wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
        (name, module)
    });
    parsed.collect()
}

#[test]
fn every_stage_is_valid() {
    for (name, module) in modules() {
        let info = Validator::new(ValidationFlags::all(), Capabilities::default()).validate(&module);
        let info = info.unwrap_or_else(|e| panic!("{name}: {e:?}"));
        // With its overrides replaced a module is validated again: not all that is valid before is valid then.
        let names = module.overrides.iter().filter_map(|(_, number)| number.name.clone());
        let constants = PipelineConstants::from_iter(names.map(|name| (name, 8.0)));
        let replaced = process_overrides(&module, &info, None, &constants);
        assert!(replaced.is_ok(), "{name}: {:?}", replaced.err());
    }
}

#[test]
fn every_file_is_used_and_nothing_else_lies_in_the_folder() {
    let stages = FILES.iter().map(|(name, _)| *name).filter(|name| !name.starts_with("shared/"));
    let stages: Vec<_> = stages.map(|stage| source(stage, NodeStorage::Buffer) + &source(stage, NodeStorage::Texture)).collect();
    for (name, text) in FILES {
        assert!(stages.iter().any(|s| s.contains(text)), "{name} is imported by no stage");
    }
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let count = |folder: &str| {
        std::fs::read_dir(root.join(folder)).expect("exists").filter(|e| e.as_ref().is_ok_and(|e| e.path().is_file())).count()
    };
    assert_eq!(count("") + count("shared"), FILES.len(), "each file of shaders/ is embedded");
}

/// The name, offset and size of a Rust struct's fields, `_pad` aside.
macro_rules! mirror {
    ($type:ident { $($field:ident),* $(,)? }) => {
        (stringify!($type), size_of::<$type>(), vec![$((stringify!($field), std::mem::offset_of!($type, $field))),*])
    };
}

#[test]
fn structs_mirror_their_shaders() {
    let mirrors = [
        mirror!(Frame {
            origin,
            eye_distance,
            right_origin,
            width,
            up_origin,
            height,
            forward,
            min_transmittance,
            right,
            step,
            up,
            depth,
            pixel_size,
            cell_edge,
            split_axis,
            split_position,
            clips,
            cuts,
            cut_looks
        }),
        mirror!(Knot { color, extinction, value, inverse_width }),
        mirror!(Surface { color, opacity, value }),
        mirror!(Style {
            surfaces,
            to_light,
            surface_count,
            ambient,
            diffuse,
            specular,
            shininess,
            scale,
            of_product,
            of_length,
            offset,
            gradient_floor,
            face_edges,
            face_values,
            face_color,
            face_opacity,
        }),
        mirror!(Counter { low, high }),
        mirror!(Placing { to_image, w, pixel }),
        mirror!(SliceLevel { tint, first }),
        mirror!(SliceLook { dims, level_count, low, inverse_width, is_smooth, bits, bias, tint }),
        mirror!(SliceQuad { clip_from_plane, origin, detail, along_u, border_width, along_v, opacity, border }),
    ];
    let mut seen = std::collections::BTreeSet::new();
    for (file, module) in modules() {
        for (name, size, fields) in &mirrors {
            let Some((_, r#type)) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)) else { continue };
            seen.insert((*name, file.starts_with("march")));
            let TypeInner::Struct { members, span } = &r#type.inner else { panic!("{file}: {name} is no struct") };
            let members: Vec<_> = members.iter().map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize)).collect();
            assert_eq!(&members, fields, "{file}: fields of {name}");
            assert_eq!(*span as usize, *size, "{file}: size of {name}");
        }
    }
    let marched = [("Frame", true), ("Knot", true), ("Surface", true), ("Style", true), ("Counter", true)];
    let other = ["Frame", "Placing", "SliceLevel", "SliceLook", "SliceQuad"].map(|name| (name, false));
    for found in marched.into_iter().chain(other) {
        assert!(seen.contains(&found), "{found:?} is in no shader");
    }
}

#[test]
fn constants_have_one_value() {
    let constants: &[(&str, f64)] = &[
        ("ABSENT", f64::from(octetra::gpu::ABSENT)),
        ("BRICK", f64::from(octetra::bricks::BRICK_EDGE)),
        ("BLOCK_CELLS", f64::from(BLOCK_CELLS)),
        ("CLEARANCE_BITS", f64::from(CLEARANCE_BITS)),
        ("FAR", f64::from(cpu::FAR)),
        ("INDEX_SIZE", optics::INDEX_SIZE as f64),
        ("INTERIOR", f64::from(cpu::INTERIOR)),
        ("MAX_DEPTH", cpu::MAX_DEPTH as f64),
        ("MAX_HITS", cpu::MAX_HITS as f64),
        ("MAX_LEVELS", f64::from(boundary::MAX_LEVELS)),
        ("MOST_PLANES", octetra::view::Planes::MOST as f64),
        ("MOST_SURFACES", octetra::view::Isosurfaces::MOST as f64),
        ("MAX_STEPS", f64::from(cpu::MAX_STEPS)),
        ("CLOSE", f64::from(cpu::CLOSE)),
        ("MAX_LOOKUPS", f64::from(cpu::MAX_LOOKUPS)),
        ("MIN_STEP", f64::from(cpu::MIN_STEP)),
        ("NONE", f64::from(adjacency::NONE)),
        ("PARALLEL", f64::from(cpu::PARALLEL)),
        ("PSI_SIZE", optics::PSI_SIZE as f64),
        ("TINY", f64::from(cpu::TINY)),
    ];
    let mut seen = std::collections::BTreeSet::new();
    for (file, module) in modules() {
        for (_, constant) in module.constants.iter() {
            let Some((name, expected)) = constants.iter().find(|(name, _)| constant.name.as_deref() == Some(name)) else { continue };
            let value = match module.global_expressions[constant.init] {
                Expression::Literal(Literal::U32(v)) => f64::from(v),
                Expression::Literal(Literal::F32(v)) => f64::from(v),
                ref other => panic!("{file}: {name} is {other:?}"),
            };
            assert_eq!(value, *expected, "{file}: {name}");
            seen.insert(*name);
        }
    }
    assert_eq!(seen.len(), constants.len(), "only {seen:?} were found");
}
