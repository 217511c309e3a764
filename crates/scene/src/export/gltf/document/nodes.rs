//! Nodes, scenes and animations, and what hangs at nodes: skins, cameras, lights.

use super::{Document, Typed, number, numbers};
use crate::export::json::Object;
use crate::model::*;
use std::f64::consts::FRAC_PI_4;

impl Document<'_> {
    pub(super) fn scene_roots(&self, o: &mut Object<'_>, x: &SceneRoots) {
        o.optional_string("name", &x.name);
        self.indices(o, "nodes", x.roots.iter());
        self.rest(o, &x.extra);
    }

    pub(super) fn node(&self, o: &mut Object<'_>, x: &Node) {
        let stated = x.extra.stated;
        o.optional_string("name", &x.name);
        self.index(o, "mesh", x.mesh);
        self.index(o, "skin", x.skin);
        self.index(o, "camera", x.camera);
        match &x.transform {
            Transform::Matrix(matrix) => o.numbers("matrix", &**matrix),
            Transform::Trs { translation, rotation, scale } => {
                numbers(o, stated, Member::Translation, translation, &[0.0; 3]);
                numbers(o, stated, Member::Rotation, rotation, &[0.0, 0.0, 0.0, 1.0]);
                numbers(o, stated, Member::Scale, scale, &[1.0; 3]);
            }
        }
        if let Some(weights) = &x.weights {
            o.numbers("weights", weights);
        }
        self.indices(o, "children", x.children.iter());
        if x.light.is_none() && x.visible.is_none() && x.instancing.is_none() {
            return self.rest(o, &x.extra);
        }
        let light = |o: &mut Object<'_>| self.index(o, "light", x.light);
        let visible = |o: &mut Object<'_>| {
            let visible = x.visible.unwrap_or(true);
            if !visible || stated.has(Member::Visible) {
                o.boolean(Member::Visible.name(), visible);
            }
        };
        let instancing = |o: &mut Object<'_>| {
            if let Some(instancing) = &x.instancing {
                self.instancing(o, instancing);
            }
        };
        let typed: [(bool, Typed<'_>); 3] = [
            (x.light.is_some(), ("KHR_lights_punctual", &light)),
            (x.visible.is_some(), ("KHR_node_visibility", &visible)),
            (x.instancing.is_some(), ("EXT_mesh_gpu_instancing", &instancing)),
        ];
        self.rest_with(o, &x.extra, typed.into_iter().filter_map(|(has, typed)| has.then_some(typed)));
    }

    fn instancing(&self, o: &mut Object<'_>, x: &Instancing) {
        o.object("attributes", |o| {
            self.index(o, "TRANSLATION", x.translation);
            self.index(o, "ROTATION", x.rotation);
            self.index(o, "SCALE", x.scale);
            self.attributes(o, &x.custom);
        });
        self.rest(o, &x.extra);
    }

    pub(super) fn skin(&self, o: &mut Object<'_>, x: &Skin) {
        o.optional_string("name", &x.name);
        self.index(o, "inverseBindMatrices", x.inverse_bind_matrices);
        self.index(o, "skeleton", x.skeleton);
        self.indices(o, "joints", x.joints.iter().copied());
        self.rest(o, &x.extra);
    }

    pub(super) fn camera(&self, o: &mut Object<'_>, x: &Camera) {
        o.optional_string("name", &x.name);
        match &x.projection {
            CameraProjection::Perspective { aspect_ratio, yfov, znear, zfar, extra } => {
                o.string("type", "perspective");
                o.object("perspective", |o| {
                    o.optional_number("aspectRatio", *aspect_ratio);
                    o.number("yfov", *yfov);
                    o.optional_number("zfar", *zfar);
                    o.number("znear", *znear);
                    self.rest(o, extra);
                });
            }
            CameraProjection::Orthographic { xmag, ymag, znear, zfar, extra } => {
                o.string("type", "orthographic");
                o.object("orthographic", |o| {
                    o.number("xmag", *xmag);
                    o.number("ymag", *ymag);
                    o.number("zfar", *zfar);
                    o.number("znear", *znear);
                    self.rest(o, extra);
                });
            }
        }
        self.rest(o, &x.extra);
    }

    pub(super) fn light(&self, o: &mut Object<'_>, x: &Light) {
        let stated = x.extra.stated;
        o.optional_string("name", &x.name);
        o.string(
            "type",
            match x.kind {
                LightKind::Directional => "directional",
                LightKind::Point => "point",
                LightKind::Spot { .. } => "spot",
            },
        );
        numbers(o, stated, Member::Color, &x.color, &[1.0; 3]);
        number(o, stated, Member::Intensity, x.intensity, 1.0);
        o.optional_number("range", x.range);
        if let LightKind::Spot { inner_cone_angle, outer_cone_angle } = x.kind {
            // A spot light has to have it.
            o.object(Member::Spot.name(), |o| {
                let stated = x.spot_extra.stated;
                number(o, stated, Member::InnerConeAngle, inner_cone_angle, 0.0);
                number(o, stated, Member::OuterConeAngle, outer_cone_angle, FRAC_PI_4);
                self.rest(o, &x.spot_extra);
            });
        } else if stated.has(Member::Spot) {
            o.object(Member::Spot.name(), |o| self.rest(o, &x.spot_extra));
        }
        self.rest(o, &x.extra);
    }

    pub(super) fn animation(&self, o: &mut Object<'_>, x: &Animation) {
        o.optional_string("name", &x.name);
        o.array("channels", &x.channels, |json, x| {
            json.object(|o| {
                o.integer("sampler", x.sampler as u64);
                o.object("target", |o| {
                    self.index(o, "node", x.node);
                    o.string(
                        "path",
                        match x.path {
                            AnimationPath::Translation => "translation",
                            AnimationPath::Rotation => "rotation",
                            AnimationPath::Scale => "scale",
                            AnimationPath::Weights => "weights",
                            AnimationPath::Pointer => "pointer",
                        },
                    );
                    self.rest(o, &x.target_extra);
                });
                self.rest(o, &x.extra);
            });
        });
        o.array("samplers", &x.samplers, |json, x| {
            json.object(|o| {
                self.index(o, "input", Some(x.input));
                if x.interpolation != Interpolation::default() || x.extra.stated.has(Member::Interpolation) {
                    o.string(
                        Member::Interpolation.name(),
                        match x.interpolation {
                            Interpolation::Linear => "LINEAR",
                            Interpolation::Step => "STEP",
                            Interpolation::CubicSpline => "CUBICSPLINE",
                        },
                    );
                }
                self.index(o, "output", Some(x.output));
                self.rest(o, &x.extra);
            });
        });
        self.rest(o, &x.extra);
    }
}
