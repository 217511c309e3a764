//! Comparisons of a live scene: the rows that a batch has touched, which debug builds compare after each, and everything.

use super::{Live, aovs, geometry, rays};
use crate::failure::{Exit, Failure};
use crate::job::backend::{AnyBackend, backend_failure};
use crate::job::validate::{validate, validate_vulkan};
use orthant_cpu::ResidentScene;
use orthant_render::DerivedScene;
use orthant_resident::Backend;
use orthant_resident::compare::Touched;
use orthant_vulkan::VulkanBackend;
use orthant_vulkan::device::DeviceOptions;

impl Live {
    /// Compares the rows that a batch has touched with those that are resident. O(touched) in memory; of a device all rows are
    /// read back.
    pub(super) fn check_touched(&mut self, touched: Option<Touched>) -> Result<(), Failure> {
        let (Some(touched), Some(backend)) = (touched, &mut self.backend) else { return Ok(()) };
        let derived = self.derived.rows();
        let compared = match backend {
            AnyBackend::Cpu(cpu) => derived.compare_touched(&cpu.scene().rows(), &touched),
            AnyBackend::Vulkan(vulkan) => {
                let resident = vulkan.read_back().map_err(|e| backend_failure(e.into()))?;
                derived.compare_touched(&resident.rows(), &touched)
            }
        };
        compared.map_err(|mismatch| Failure::new(Exit::Internal, format!("after a batch: {mismatch}")))
    }

    /// What debug builds do when nothing more is to follow: every row is compared with the resident one, and the acceleration
    /// structures and tables of lights with the rows. Release builds do nothing here. O(scene).
    ///
    /// # Errors
    /// The first difference: a fault of the program.
    pub fn finish(&mut self) -> Result<(), Failure> {
        if !cfg!(debug_assertions) {
            return Ok(());
        }
        self.check_resident().map_err(|what| Failure::new(Exit::Internal, format!("at the end: {what}")))
    }

    fn check_resident(&mut self) -> Result<(), String> {
        let Some(backend) = &mut self.backend else { return Ok(()) };
        match backend {
            AnyBackend::Cpu(cpu) => {
                validate(&self.derived, cpu.scene())?;
                cpu.validate_lights().map_err(|what| format!("lights: {what}"))
            }
            AnyBackend::Vulkan(vulkan) => {
                validate_vulkan(&self.derived, &vulkan.read_back().map_err(|e| e.to_string())?)?;
                backend.quiet()
            }
        }
    }

    /// Compares everything. The incremental state with a full derivation, field by field; with a backend also the resident rows
    /// with the incremental state, and resident geometry and the hits of random rays (on a device: the AOVs of small pictures)
    /// with what a backend has that is loaded from the full derivation. `seed` chooses the rays. Gives how many of them hit.
    /// O(scene).
    ///
    /// # Errors
    /// The first difference.
    pub fn check(&mut self, seed: u64) -> Result<u64, String> {
        let mut fresh = self.derived.fresh(&self.scene)?;
        self.derived.check_against(&self.scene, &fresh)?;
        self.check_resident()?;
        match &mut self.backend {
            None => Ok(0),
            Some(AnyBackend::Cpu(cpu)) => {
                let mut loaded = ResidentScene::new();
                let batch = fresh.load_batch();
                loaded.apply(batch).map_err(|e| format!("a backend refuses the full derivation: {e}"))?;
                let (synced, fresh) = ((&self.derived, cpu.scene()), (&fresh, &loaded));
                geometry::compare((synced.0, synced.1.into()), (fresh.0, fresh.1.into()))?;
                rays::compare(synced, fresh, seed)
            }
            Some(AnyBackend::Vulkan(vulkan)) => {
                let loaded = match self.loaded.take() {
                    Some(loaded) => self.loaded.insert(loaded),
                    None => self.loaded.insert(Box::new(beside(vulkan)?)),
                };
                check_device((&self.derived, vulkan), (&mut fresh, loaded), seed)
            }
        }
    }
}

/// Another backend on the same device, to be loaded with what is derived anew.
fn beside(vulkan: &VulkanBackend) -> Result<VulkanBackend, String> {
    let device = Some(vulkan.vulkan_device().info().index.to_string());
    VulkanBackend::new(&DeviceOptions { device, validate: vulkan.messages().is_some(), ..DeviceOptions::default() })
        .map_err(|e| e.to_string())
}

fn check_device(
    synced: (&DerivedScene, &mut VulkanBackend),
    fresh: (&mut DerivedScene, &mut VulkanBackend),
    seed: u64,
) -> Result<u64, String> {
    fresh.1.clear().map_err(|e| e.to_string())?;
    let batch = fresh.0.load_batch();
    fresh.1.apply(batch).map_err(|e| format!("a backend refuses the full derivation: {e}"))?;
    let rows = |backend: &mut VulkanBackend| backend.read_back().map_err(|e| e.to_string());
    let (is, should) = (rows(synced.1)?, rows(fresh.1)?);
    geometry::compare((synced.0, (&is).into()), (fresh.0, (&should).into()))?;
    aovs::compare(synced.1, fresh.1, (&should).into(), seed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::Stopped;
    use orthant_cpu::CpuBackend;
    use orthant_render::DeriveOptions;
    use orthant_scene::edit::script::{Operation, Session};
    use orthant_scene::import::{ImportOptions, import_slice};
    use std::path::Path;

    /// Two materials without users, and two lights.
    fn live() -> Live {
        let text = r#"{"asset": {"version": "2.0"}, "materials": [{}, {}], "scenes": [{"nodes": [0, 1]}], "nodes": [
            {"extensions": {"KHR_lights_punctual": {"light": 0}}}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
            "extensionsUsed": ["KHR_lights_punctual"],
            "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point"}]}}}"#;
        let imported = import_slice(text.as_bytes().to_vec(), None, "a.gltf", &ImportOptions::default());
        let session = Session::new(Path::new("."), ImportOptions::default());
        Live::new(imported.expect("valid").scene, session, DeriveOptions::default(), Some(cpu()))
            .expect("it can be derived")
    }

    fn cpu() -> AnyBackend {
        AnyBackend::Cpu(Box::new(CpuBackend::new()))
    }

    fn run(live: &mut Live, line: &str) -> Result<(), Stopped> {
        live.edit(&Operation::parse(line).expect("an operation"))?;
        live.follow().map(|_| ())
    }

    #[test]
    fn touched_rows_that_are_not_resident_are_found_at_once_and_others_at_the_end() {
        let mut live = live();
        let paint = |material: usize| {
            format!(r#"{{"op": "set_material", "material": {material}, "set": {{"doubleSided": true}}}}"#)
        };
        run(&mut live, &paint(0)).expect("what follows is as it should be");
        live.finish().expect("everything is");
        // As if a batch had left a row out.
        live.derived.materials[2].roughness += 0.5;
        run(&mut live, &paint(0)).expect("the row that is touched is right");
        let touched = |range| Some(Touched { materials: vec![range], ..Touched::default() });
        assert_eq!(live.check_touched(touched(0..2)), Ok(()));
        let failure = live.check_touched(touched(1..3)).expect_err("row 2 is another");
        assert!(failure.what.contains("row 2 of materials: roughness is"), "{failure}");
        let failure = live.finish().expect_err("row 2 is another");
        assert!(failure.what.starts_with("at the end: row 2 of materials"), "{failure}");
        assert!(live.check(0).is_err());
    }

    #[test]
    fn a_row_that_a_sync_leaves_out_is_missed_by_nothing() {
        let mut live = live();
        // The backend has another light than the derived scene from here on.
        live.derived.lights[1].position[0] += 1.0;
        let failure = live.finish().expect_err("row 1 is another");
        assert!(failure.what.contains("row 1 of lights: position"), "{failure}");
        // A sync that moves the light writes the row, and all is well.
        run(&mut live, r#"{"op": "set_transform", "node": 1, "translation": [3, 0, 0]}"#).expect("it is followed");
        live.finish().expect("everything is as it should be");
    }
}
