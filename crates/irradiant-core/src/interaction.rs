//! Where a path met something: a surface point with all that scattering, texturing and leaving it need.

use irradiant_math::{Normal3, Point2, Point3, Ray, Vec3};

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);
    )*};
}

ids! {
    /// Index of a compiled material.
    MaterialId;
    /// Index of a compiled light.
    LightId;
    /// Index of a compiled shape as the author described it (for object ids and messages).
    ShapeId;
}

/// A point on a surface, in render space, as a ray found it.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// The point.
    pub p: Point3,
    /// Conservative bound on |computed - true| for each coordinate of `p`.
    pub p_error: Vec3,
    /// Geometric normal, unit; flipped to the side that the author calls outside.
    pub n: Normal3,
    /// Shading normal, unit; in the hemisphere of `n`.
    pub ns: Normal3,
    /// Surface parameters.
    pub uv: Point2,
    /// Derivative of position by u (geometric).
    pub dpdu: Vec3,
    /// Derivative of position by v (geometric).
    pub dpdv: Vec3,
    /// Shading tangent: the derivative of position by u of the shading geometry; not unit, about perpendicular to `ns`.
    pub dpdus: Vec3,
    /// Derivative of position by v of the shading geometry.
    pub dpdvs: Vec3,
    /// Derivative of the shading normal by u.
    pub dndus: Normal3,
    /// Derivative of the shading normal by v.
    pub dndvs: Normal3,
    /// Towards where the ray came from, unit.
    pub wo: Vec3,
    /// Ray parameter of the hit.
    pub t: f32,
    /// Shutter time.
    pub time: f32,
    /// What the surface is made of.
    pub material: MaterialId,
    /// The light that this surface is, if it emits.
    pub light: Option<LightId>,
    /// The shape as the author described it.
    pub shape: ShapeId,
    /// Face index in the author's mesh file, or the index of the primitive.
    pub face: u32,
}

/// What a light needs to know of the point that it shines on.
#[derive(Clone, Copy, Debug)]
pub struct ReferencePoint {
    /// The point, render space.
    pub p: Point3,
    /// Bound of its error.
    pub p_error: Vec3,
    /// Geometric normal; zero where there is no surface.
    pub n: Normal3,
    /// Shading normal; zero where there is no surface.
    pub ns: Normal3,
}

impl Interaction {
    /// What a ray met at `t`, of which nothing is known yet but the ray.
    #[inline]
    pub fn unknown(ray: &Ray, t: f32) -> Self {
        Self {
            p: Point3::ZERO,
            p_error: Vec3::ZERO,
            n: Normal3::ZERO,
            ns: Normal3::ZERO,
            uv: Point2::ZERO,
            dpdu: Vec3::ZERO,
            dpdv: Vec3::ZERO,
            dpdus: Vec3::ZERO,
            dpdvs: Vec3::ZERO,
            dndus: Normal3::ZERO,
            dndvs: Normal3::ZERO,
            wo: -ray.d.normalize(),
            t,
            time: ray.time,
            material: MaterialId(0),
            light: None,
            shape: ShapeId(0),
            face: 0,
        }
    }

    /// As lights see it.
    #[inline]
    pub fn reference(&self) -> ReferencePoint {
        ReferencePoint { p: self.p, p_error: self.p_error, n: self.n, ns: self.ns }
    }
}

/// How a hit looks to textures: position, parameters and how they change from pixel to pixel.
#[derive(Clone, Copy, Debug)]
pub struct TextureContext {
    /// The point, render space.
    pub p: Point3,
    /// Geometric normal (pbrt-v4's textures see it, not the shading one).
    pub n: Normal3,
    /// Surface parameters.
    pub uv: Point2,
    /// Change of `p` from one pixel to the next in x.
    pub dpdx: Vec3,
    /// Change of `p` from one pixel to the next in y.
    pub dpdy: Vec3,
    /// Change of u in x.
    pub dudx: f32,
    /// Change of u in y.
    pub dudy: f32,
    /// Change of v in x.
    pub dvdx: f32,
    /// Change of v in y.
    pub dvdy: f32,
    /// Face index, for per-face textures.
    pub face: u32,
}

impl TextureContext {
    /// Without a footprint: textures are looked up at a point.
    #[inline]
    pub fn point(at: &Interaction) -> Self {
        Self::without_footprint(at.p, at.n, at.uv, at.face)
    }

    /// Without a footprint, where there is no [`Interaction`] (yet).
    #[inline]
    pub fn without_footprint(p: Point3, n: Normal3, uv: Point2, face: u32) -> Self {
        Self { p, n, uv, dpdx: Vec3::ZERO, dpdy: Vec3::ZERO, dudx: 0.0, dudy: 0.0, dvdx: 0.0, dvdy: 0.0, face }
    }
}
