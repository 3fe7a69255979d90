//! What rays make of values, ready for the marchers: isosurfaces, Phong's reflection, and the colours of numbers.

use super::{Classifier, KnotTable};
use crate::view::{Isosurfaces, LightSource, Mode, RenderSettings, Shading};
use bytemuck::{Pod, Zeroable};

/// The values around an isosurface's for which a leaf counts as active: leaves that meet have rounded samples (17 bits), so that the
/// surface may lie between them.
const NEAR: f32 = 1.5e-5;

/// An isosurface as the marchers read it: `Surface` in `shaders/shared/style.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Surface {
    /// Linear RGB.
    pub color: [f32; 3],
    /// From 0 to 1.
    pub opacity: f32,
    /// Normalised.
    pub value: f32,
    /// Fills the struct to 32 bytes.
    pub _pad: [f32; 3],
}

/// What rays make of values: `Style` in `shaders/shared/style.wgsl`. Lengths are in edges of the root cube.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Style {
    /// Ascending by value.
    pub surfaces: [Surface; Isosurfaces::MOST],
    /// The direction that light comes from, of length 1; 0 if it comes from the eye.
    pub to_light: [f32; 3],
    /// How many of the surfaces count.
    pub surface_count: u32,
    /// K_a.
    pub ambient: f32,
    /// K_d.
    pub diffuse: f32,
    /// K_s.
    pub specular: f32,
    /// The exponent.
    pub shininess: f32,
    /// The colour of a ray's number m over the length l is that of the normalised value `m scale + m l of_product + l of_length + offset`.
    pub scale: f32,
    /// See `scale`.
    pub of_product: f32,
    /// See `scale`.
    pub of_length: f32,
    /// See `scale`.
    pub offset: f32,
    /// The gradient at which a place in the volume is shaded by half: normalised values per cube edge.
    pub gradient_floor: f32,
    /// 1 if edges of boundary faces are drawn, else 0.
    pub face_edges: f32,
    /// 1 if boundary faces have the colours of the values on them, else 0.
    pub face_values: f32,
    /// Fills up to a multiple of 16 bytes.
    pub _pad: f32,
    /// Linear RGB of boundary faces, if that is their own.
    pub face_color: [f32; 3],
    /// From 0 to 1.
    pub face_opacity: f32,
}

impl Style {
    /// What `settings` ask for, in a root cube of edge `edge_world`; `table` is the classifier's for it.
    pub fn new(settings: &RenderSettings, classifier: &Classifier, table: &KnotTable, edge_world: f64) -> Self {
        let mut style = Style::default();
        for (place, surface) in style.surfaces.iter_mut().zip(settings.surfaces().ascending()) {
            let value = classifier.normalized(surface.value) as f32;
            let within = value.clamp(0.0, 1.0);
            let color = surface.color.unwrap_or_else(|| table.classify(table.interval(within), within).color);
            *place = Surface { color, opacity: surface.opacity, value, _pad: [0.0; 3] };
            style.surface_count += 1;
        }
        let Shading { phong, .. } = settings.shading;
        if let LightSource::From(direction) = phong.light {
            style.to_light = direction.normalize_or_zero().as_vec3().to_array();
        }
        (style.ambient, style.diffuse, style.specular, style.shininess) = (phong.ambient, phong.diffuse, phong.specular, phong.shininess);
        style.scale = 1.0;
        if settings.mode == Mode::Integral {
            let ([lo, hi], [first, last]) = (classifier.value_range(), classifier.integral_range());
            let width = if last > first { last - first } else { 1.0 };
            style.scale = 0.0;
            style.of_product = ((hi - lo) * edge_world / width) as f32;
            style.of_length = (lo * edge_world / width) as f32;
            style.offset = (-first / width) as f32;
        }
        if let Some(faces) = settings.drawn_faces() {
            (style.face_opacity, style.face_color) = (faces.opacity, faces.color.unwrap_or_default());
            (style.face_values, style.face_edges) = (f32::from(faces.color.is_none()), f32::from(faces.edges));
        }
        let diagonal = classifier.bounds_diagonal();
        style.gradient_floor = (Shading::GRADIENT_FLOOR * if diagonal > 0.0 { edge_world / diagonal } else { 1.0 }) as f32;
        style
    }

    /// The values of which `settings` show something: [`Style::seen`] of the style that they ask for.
    pub fn seen_with(settings: &RenderSettings, classifier: &Classifier, edge_world: f64) -> Vec<[f32; 2]> {
        let table = classifier.table(edge_world);
        Style::new(settings, classifier, &table, edge_world).seen(settings.mode, &table)
    }

    /// The surfaces that count.
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces[..self.surface_count as usize]
    }

    /// The normalised value that has the colour of a ray's number, over a length in the data.
    pub fn colored(&self, number: f32, length: f32) -> f32 {
        let x = self.scale * number + (self.of_product * number + self.of_length) * length + self.offset;
        x.clamp(0.0, 1.0)
    }

    /// The values of which something is seen: closed intervals in [0, 1], ascending and apart.
    pub fn seen(&self, mode: Mode, table: &KnotTable) -> Vec<[f32; 2]> {
        let mut seen = match mode {
            Mode::Composite => table.seen(),
            Mode::Iso => Vec::new(),
            Mode::Maximum | Mode::Minimum | Mode::Mean | Mode::Integral => return vec![[0.0, 1.0]],
        };
        // Also where they are transparent: rays say how far away they are.
        seen.extend(self.surfaces().iter().map(|surface| [(surface.value - NEAR).max(0.0), (surface.value + NEAR).min(1.0)]));
        seen.retain(|[low, high]| low <= high);
        seen.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut apart: Vec<[f32; 2]> = Vec::new();
        for [low, high] in seen {
            match apart.last_mut() {
                Some(last) if low <= last[1] => last[1] = last[1].max(high),
                _ => apart.push([low, high]),
            }
        }
        apart
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{Isosurface, TransferFunction};

    fn settings(mode: Mode, values: &[f64]) -> RenderSettings {
        let surfaces: Vec<_> = values.iter().map(|&value| Isosurface::at(value)).collect();
        RenderSettings { mode, isosurfaces: Isosurfaces::new(&surfaces).expect("valid"), ..RenderSettings::new(1, 1) }
    }

    #[test]
    fn surfaces_are_normalised_and_have_the_colour_of_their_value() {
        let tf = TransferFunction { color: vec![[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.5, 0.0]], ..TransferFunction::standard() };
        let classifier = Classifier::new(&tf, [10.0, 20.0], 2.0);
        let style = Style::new(&settings(Mode::Iso, &[15.0, 12.0, 99.0]), &classifier, &classifier.table(4.0), 4.0);
        let found: Vec<_> = style.surfaces().iter().map(|surface| (surface.value, surface.color)).collect();
        assert_eq!(found, [(0.2, [0.2, 0.1, 0.0]), (0.5, [0.5, 0.25, 0.0]), (8.9, [1.0, 0.5, 0.0])]);
        assert_eq!(
            Style::new(&settings(Mode::Mean, &[15.0]), &classifier, &classifier.table(4.0), 4.0).surface_count,
            0,
            "numbers have no surfaces"
        );
    }

    #[test]
    fn what_is_seen_is_what_has_extinction_and_where_surfaces_are() {
        let tf = TransferFunction { opacity: vec![[0.0, 0.0], [0.5, 0.0], [0.75, 1.0], [1.0, 0.0]], ..TransferFunction::standard() };
        let classifier = Classifier::new(&tf, [0.0, 1.0], 2.0);
        let table = classifier.table(1.0);
        let seen = |mode, values: &[f64]| Style::new(&settings(mode, values), &classifier, &table, 1.0).seen(mode, &table);
        let volume = [0.5f32.next_up(), 1f32.next_down()];
        assert_eq!(seen(Mode::Composite, &[]), [volume]);
        assert_eq!(seen(Mode::Iso, &[0.25]), [[0.25 - NEAR, 0.25 + NEAR]]);
        assert_eq!(seen(Mode::Composite, &[0.25, 0.5]), [[0.25 - NEAR, 0.25 + NEAR], [0.5 - NEAR, volume[1]]]);
        assert!(seen(Mode::Iso, &[2.0, -1.0]).is_empty(), "outside the array's range");
        assert_eq!(seen(Mode::Maximum, &[]), [[0.0, 1.0]]);
    }

    #[test]
    fn integrals_have_the_colours_of_their_range() {
        let classifier = Classifier::for_mode(&TransferFunction::standard(), Mode::Integral, [2.0, 6.0], 10.0);
        assert_eq!(classifier.integral_range(), [0.0, 30.0]);
        let style = Style::new(&settings(Mode::Integral, &[]), &classifier, &classifier.table(4.0), 4.0);
        // A mean of 3 (normalised 1/4) over 2.5 world units.
        assert!((style.colored(0.25, 2.5 / 4.0) - 7.5 / 30.0).abs() < 1e-6);
        assert_eq!(style.colored(1.0, 100.0), 1.0, "clamped");
        let mean = Style::new(&settings(Mode::Mean, &[]), &classifier, &classifier.table(4.0), 4.0);
        assert_eq!(mean.colored(0.25, 0.7), 0.25);
    }
}
