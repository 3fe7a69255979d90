//! What the user has chosen.

use super::furniture::Look;
use crate::format::transfer_file::NamedTransfer;
use crate::mesh::{Component, FieldSelection};
use crate::octree::OctreeParams;
use crate::view::{Camera, RenderSettings, Scale, TransferFunction, View};

/// Everything that decides the picture, the mesh and the window's size aside.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Array and component.
    pub field: FieldSelection,
    /// Thresholds of the octree.
    pub params: OctreeParams,
    /// From where.
    pub camera: Camera,
    /// Colours and opacity.
    pub transfer: Transfer,
    /// Renderer, steps and quality; the size is the viewport's.
    pub render: RenderSettings,
    /// What is around and behind the picture.
    pub look: Look,
}

/// A transfer function and what the window changes of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer {
    /// The colour map's name, [`Transfer::FROM_FILE`] or [`Transfer::EDITED`].
    pub name: String,
    /// As the preset or file has it, or as it was edited.
    pub base: TransferFunction,
    /// What extinction is multiplied by, above 0.
    pub density: f64,
    /// The range that was chosen for the user, of the steps of a series.
    pub chosen_range: Option<[f64; 2]>,
}

impl Transfer {
    /// Leaves out what is in data units: the values of other data are others.
    pub fn forget_data(&mut self) {
        (self.base.range, self.base.threshold) = (None, None);
        if matches!(self.base.scale, Scale::Symlog(_)) {
            self.base.scale = Scale::Symlog(None);
        }
    }

    /// The name of a transfer function that is no preset.
    pub const FROM_FILE: &str = "from file";

    /// A transfer function as it is; a preset is recognized.
    pub fn new(base: TransferFunction) -> Self {
        let same = |name: &&&str| TransferFunction::preset(name).is_ok_and(|preset| preset == base);
        let name = TransferFunction::PRESETS.iter().find(same).unwrap_or(&Self::FROM_FILE);
        Transfer { name: (*name).to_owned(), base, density: 1.0, chosen_range: None }
    }

    /// The name of colours that were edited.
    pub const EDITED: &str = "edited";

    /// Takes the colours of a map, and its opacity unless the present one is the user's own; range, scale and the rest stay.
    pub fn choose(&mut self, map: &NamedTransfer, keep_opacity: bool) {
        self.name = map.name.clone();
        self.base.color = map.function.color.clone();
        self.base.nan = map.function.nan.or(self.base.nan);
        if !keep_opacity {
            (self.base.opacity, self.base.opacity_model) = (map.function.opacity.clone(), map.function.opacity_model);
        }
        if self.base.scale != Scale::Linear {
            self.base = self.base.over_unit_range();
        }
    }

    /// Takes all that a file says; a range and a threshold that it leaves open stay.
    pub fn import(&mut self, map: &NamedTransfer) {
        self.name = map.name.clone();
        let range = map.function.range.or(self.base.range).filter(|range| map.function.scale.fits(*range));
        let threshold = map.function.threshold.or(self.base.threshold);
        self.base = TransferFunction { range, threshold, ..map.function.clone() };
    }

    /// Names the colours after the known map that they are, or as edited.
    pub fn rename(&mut self, known: &[NamedTransfer]) {
        let same = known.iter().find(|map| map.function.color == self.base.color);
        self.name = same.map_or(Self::EDITED.to_owned(), |map| map.name.clone());
    }

    /// The transfer function to draw with. `diagonal` is the length of the diagonal of the mesh's bounds in world units.
    pub fn function(&self, diagonal: f64) -> TransferFunction {
        let mut tf = self.base.clone();
        if self.density != 1.0 {
            tf.unit_distance = Some(tf.unit_distance_world(diagonal) / self.density);
        }
        tf
    }
}

impl Settings {
    /// The view of a viewport of `size` pixels.
    pub fn view(&self, size: [u32; 2], diagonal: f64) -> View {
        let settings = RenderSettings { width: size[0], height: size[1], ..self.render };
        View { camera: self.camera, transfer_function: self.transfer.function(diagonal), settings }
    }
}

/// What a component of a vector of `components` numbers is called.
pub fn component_label(component: Component, components: usize) -> String {
    match component {
        Component::Magnitude => "magnitude".into(),
        Component::Index(i @ 0..3) if components <= 3 => ["x", "y", "z"][i].into(),
        Component::Index(i) => i.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_recognized_and_density_shortens_the_unit_distance() {
        let mut transfer = Transfer::new(TransferFunction::preset("turbo").expect("a preset"));
        assert_eq!(transfer.name, "turbo");
        assert_eq!(transfer.function(100.0), transfer.base, "unchanged, as the command draws it");
        transfer.density = 4.0;
        assert_eq!(transfer.function(100.0).unit_distance, Some(0.5));
        let own = TransferFunction { unit_distance: Some(3.0), ..TransferFunction::standard() };
        assert_eq!(Transfer::new(own).name, Transfer::FROM_FILE);
    }
}
