slotmap::new_key_type! {
    /// A scene (set of roots).
    pub struct SceneId;
    /// A node.
    pub struct NodeId;
    /// A mesh.
    pub struct MeshId;
    /// A material.
    pub struct MaterialId;
    /// A texture.
    pub struct TextureId;
    /// An image.
    pub struct ImageId;
    /// A sampler.
    pub struct SamplerId;
    /// An accessor.
    pub struct AccessorId;
    /// A buffer view.
    pub struct BufferViewId;
    /// A buffer.
    pub struct BufferId;
    /// A skin.
    pub struct SkinId;
    /// An animation.
    pub struct AnimationId;
    /// A camera.
    pub struct CameraId;
    /// A punctual light.
    pub struct LightId;
    /// A material variant.
    pub struct VariantId;
}
