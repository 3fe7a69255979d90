//! Writing PLY: binary, little-endian, f64.

use crate::image::write_atomically;
use glam::DVec3;
use std::io;
use std::path::Path;

/// Writes triangles with a number at each point, as a property of that name (one word). Points are given in world coordinates.
pub fn write_ply(path: &Path, points: &[DVec3], triangles: &[[u32; 3]], name: &str, values: &[f64]) -> io::Result<()> {
    write_atomically(path, |out| {
        write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", points.len())?;
        write!(out, "property double x\nproperty double y\nproperty double z\nproperty double {name}\n")?;
        write!(out, "element face {}\nproperty list uchar uint vertex_indices\nend_header\n", triangles.len())?;
        for (point, value) in points.iter().zip(values) {
            for number in point.to_array().into_iter().chain([*value]) {
                out.write_all(&number.to_le_bytes())?;
            }
        }
        for corners in triangles {
            out.write_all(&[3])?;
            for corner in corners {
                out.write_all(&corner.to_le_bytes())?;
            }
        }
        Ok(())
    })
}
