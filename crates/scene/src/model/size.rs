use super::{Primitive, Scene};

impl Scene {
    /// Bytes of the objects of the document: their slots, names and lists. What extras and extensions hold is not counted,
    /// nor are buffers and encoded images, nor what the allocator adds: it is a lower bound.
    pub fn object_bytes(&self) -> u64 {
        let slots = self.scenes.slot_bytes()
            + self.nodes.slot_bytes()
            + self.meshes.slot_bytes()
            + self.materials.slot_bytes()
            + self.textures.slot_bytes()
            + self.images.slot_bytes()
            + self.samplers.slot_bytes()
            + self.accessors.slot_bytes()
            + self.buffer_views.slot_bytes()
            + self.buffers.slot_bytes()
            + self.skins.slot_bytes()
            + self.animations.slot_bytes()
            + self.cameras.slot_bytes()
            + self.lights.slot_bytes()
            + self.variants.slot_bytes()
            + self.packets.slot_bytes();
        let name = |name: &Option<String>| name.as_ref().map_or(0, String::len);
        let nodes = self
            .nodes
            .values()
            .map(|node| name(&node.name) + node.children.heap_bytes() + node.weights.as_deref().map_or(0, size_of_val));
        let meshes = self.meshes.values().map(|mesh| {
            let of = |p: &Primitive| size_of::<Primitive>() + size_of_val(p.attributes.0.as_slice());
            name(&mesh.name) + mesh.primitives.iter().map(of).sum::<usize>()
        });
        let bounds = |bounds: &Option<Vec<f64>>| bounds.as_deref().map_or(0, size_of_val);
        let accessors = self.accessors.values().map(|a| name(&a.name) + bounds(&a.min) + bounds(&a.max));
        (slots + nodes.sum::<usize>() + meshes.sum::<usize>() + accessors.sum::<usize>()) as u64
    }
}
