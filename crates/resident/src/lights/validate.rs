//! Whether tables that have followed batches are those of the rows as they are.

use super::{LightChanges, LightRows, LightTables};

impl LightTables {
    /// Compares with tables that are made anew, but for the shape of the trees; `radius` is that of the scene
    /// ([`crate::extent::scene_radius`]). Looks at everything.
    ///
    /// # Errors
    /// The first difference, with the row.
    pub fn validate(&self, scene: &impl LightRows, radius: f32) -> Result<(), String> {
        let mut fresh = Self::default();
        let everything = LightChanges {
            lights: (0..scene.lights().len() as u32).collect(),
            lights_len: 0,
            emitters: (0..scene.emitters().len() as u32).collect(),
            primitives: Vec::new(),
            scene_radius: radius,
        };
        fresh.update(scene, &everything);
        if self.radius != radius {
            return Err(format!("the radius of the scene is {}, and should be {radius}", self.radius));
        }
        self.emitters.validate().map_err(|what| format!("emitter tree: {what}"))?;
        self.punctual.tree.validate().map_err(|what| format!("light tree: {what}"))?;

        let emitters = self.primitives.len().max(fresh.primitives.len()).max(self.emitters.leaves.len());
        for emitter in 0..emitters as u32 {
            let known = |tables: &Self| {
                (tables.emitters.get(emitter).copied(), tables.quad(emitter).copied(), tables.primitive(emitter))
            };
            if known(self) != known(&fresh) {
                return Err(format!("emitter {emitter} is {:?}, and should be {:?}", known(self), known(&fresh)));
            }
        }
        if self.by_primitive != fresh.by_primitive {
            return Err("the emitters by primitive are others".to_owned());
        }
        if self.power != fresh.power {
            return Err(format!("emitters have {} W, and should have {}", self.power.total(), fresh.power.total()));
        }

        let sorted = |rows: &[u32]| {
            let mut rows = rows.to_vec();
            rows.sort_unstable();
            rows
        };
        for (kind, a, b) in [
            ("directional", self.punctual.directional(), fresh.punctual.directional()),
            ("local", self.punctual.local(), fresh.punctual.local()),
        ] {
            if sorted(a) != b {
                return Err(format!("the {kind} lights are {a:?}, and should be {b:?}"));
            }
        }
        for light in 0..self.punctual.tree.leaves.len().max(scene.lights().len()) as u32 {
            let (a, b) = (self.punctual.tree.get(light), fresh.punctual.tree.get(light));
            if a != b {
                return Err(format!("light {light} is {a:?} in its tree, and should be {b:?}"));
            }
        }
        Ok(())
    }
}
