//! From a hit to texture coordinates, with how they change from pixel to pixel.
//!
//! The mappings are pbrt-v4's (Pharr, Jakob and Humphreys 2023, 10.2), worked out once per scene to act on render space.
//!
//! One difference: pbrt-v4's spherical mapping pairs s with the derivative of t and the other way round. Ours pairs
//! them right; both choose the same level of a trilinear pyramid, which goes by the longest derivative.

use crate::interaction::TextureContext;
use irradiant_math::elementary::{atan2, safe_acos};
use irradiant_math::{Affine, Point3, Transform, Vec3};
use irradiant_scene::desc::MappingDesc;
use std::f32::consts::{FRAC_1_PI, PI};

/// Texture coordinates of a hit; (0, 0) is an image's *lower* left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinates {
    /// First.
    pub s: f32,
    /// Second.
    pub t: f32,
    /// Change of (s, t) from one pixel to the next in x.
    pub dx: [f32; 2],
    /// Change of (s, t) from one pixel to the next in y.
    pub dy: [f32; 2],
}

/// A point in texture space, for textures that fill space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidCoordinates {
    /// The point.
    pub p: Point3,
    /// Its change from one pixel to the next in x.
    pub dpdx: Vec3,
    /// Its change from one pixel to the next in y.
    pub dpdy: Vec3,
}

/// How a hit is given (s, t).
#[derive(Clone, Debug, PartialEq)]
pub enum Mapping {
    /// From the surface's own parameters.
    Uv {
        /// Factors of u and v.
        scale: [f32; 2],
        /// Shifts.
        delta: [f32; 2],
    },
    /// Polar and azimuthal angle about texture space's origin, over pi and 2 pi.
    Spherical(Box<Affine>),
    /// Azimuth about texture space's z axis, over 2 pi from -x, and z itself.
    Cylindrical(Box<Affine>),
    /// Two linear functions of render space: coefficients of x, y, z and a shift.
    Planar([[f32; 4]; 2]),
}

/// Texture space from render space, if that is affine and not singular.
pub fn texture_from_render(render_from_world: &Transform, world_from_texture: &Transform) -> Option<Affine> {
    Affine::from_transform(&render_from_world.compose(world_from_texture).inverse())
}

impl Mapping {
    /// A mapping; `None` if it needs texture space and that is not affine.
    pub fn compile(desc: &MappingDesc, render_from_world: &Transform, world_from_texture: &Transform) -> Option<Self> {
        let affine = || texture_from_render(render_from_world, world_from_texture).map(Box::new);
        Some(match *desc {
            MappingDesc::Uv { u_scale, v_scale, u_delta, v_delta } => {
                Self::Uv { scale: [u_scale, v_scale], delta: [u_delta, v_delta] }
            }
            MappingDesc::Spherical => Self::Spherical(affine()?),
            MappingDesc::Cylindrical => Self::Cylindrical(affine()?),
            MappingDesc::Planar { v1, v2, u_delta, v_delta } => {
                affine()?;
                let m = render_from_world.compose(world_from_texture).inv;
                let row = |v: [f32; 3], delta: f32| {
                    std::array::from_fn(|j| {
                        let dot: f64 = (0..3).map(|i| f64::from(v[i]) * m[i][j]).sum();
                        if j == 3 { (dot + f64::from(delta)) as f32 } else { dot as f32 }
                    })
                };
                Self::Planar([row(v1, u_delta), row(v2, v_delta)])
            }
        })
    }

    /// The coordinates of a hit.
    #[inline]
    pub fn map(&self, at: &TextureContext) -> Coordinates {
        match self {
            Self::Uv { scale: [su, sv], delta: [du, dv] } => Coordinates {
                s: su * at.uv.x + du,
                t: sv * at.uv.y + dv,
                dx: [su * at.dudx, sv * at.dvdx],
                dy: [su * at.dudy, sv * at.dvdy],
            },
            Self::Spherical(space) => spherical(space, at),
            Self::Cylindrical(space) => cylindrical(space, at),
            Self::Planar([f, g]) => {
                let linear = |f: &[f32; 4], v: Vec3| f[0] * v.x + f[1] * v.y + f[2] * v.z;
                let p = at.p.as_vec();
                Coordinates {
                    s: linear(f, p) + f[3],
                    t: linear(g, p) + g[3],
                    dx: [linear(f, at.dpdx), linear(g, at.dpdx)],
                    dy: [linear(f, at.dpdy), linear(g, at.dpdy)],
                }
            }
        }
    }
}

/// The point in texture space.
#[inline]
pub fn solid(texture_from_render: &Affine, at: &TextureContext) -> SolidCoordinates {
    SolidCoordinates {
        p: texture_from_render.point(at.p),
        dpdx: texture_from_render.vector(at.dpdx),
        dpdy: texture_from_render.vector(at.dpdy),
    }
}

/// The gradient of azimuth / 2 pi; 0 on the axis, where it has none.
fn azimuth_gradient(p: Point3) -> Vec3 {
    let rho2 = p.x * p.x + p.y * p.y;
    if rho2 > 0.0 { Vec3::new(-p.y, p.x, 0.0) / (2.0 * PI * rho2) } else { Vec3::ZERO }
}

fn spherical(space: &Affine, at: &TextureContext) -> Coordinates {
    let SolidCoordinates { p, dpdx, dpdy } = solid(space, at);
    let rho2 = p.x * p.x + p.y * p.y;
    let (rho, r2) = (rho2.sqrt(), rho2 + p.z * p.z);
    let dphi = azimuth_gradient(p);
    let dtheta = if rho > 0.0 { Vec3::new(p.x * p.z / rho, p.y * p.z / rho, -rho) / (PI * r2) } else { Vec3::ZERO };
    let phi = atan2(p.y, p.x);
    let phi = if phi < 0.0 { phi + 2.0 * PI } else { phi };
    let cos = if r2 > 0.0 { p.z / r2.sqrt() } else { 1.0 };
    Coordinates {
        s: safe_acos(cos) * FRAC_1_PI,
        t: phi * (0.5 * FRAC_1_PI),
        dx: [dtheta.dot(dpdx), dphi.dot(dpdx)],
        dy: [dtheta.dot(dpdy), dphi.dot(dpdy)],
    }
}

fn cylindrical(space: &Affine, at: &TextureContext) -> Coordinates {
    let SolidCoordinates { p, dpdx, dpdy } = solid(space, at);
    let dphi = azimuth_gradient(p);
    Coordinates {
        s: (PI + atan2(p.y, p.x)) * (0.5 * FRAC_1_PI),
        t: p.z,
        dx: [dphi.dot(dpdx), dpdx.z],
        dy: [dphi.dot(dpdy), dpdy.z],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_math::{Normal3, Point2};

    fn context(p: Point3, dpdx: Vec3, dpdy: Vec3) -> TextureContext {
        let n = Normal3::new(0.0, 0.0, 1.0);
        let uv = Point2::new(0.3, 0.6);
        TextureContext { p, n, uv, dpdx, dpdy, dudx: 0.01, dudy: 0.02, dvdx: -0.03, dvdy: 0.04, face: 0 }
    }

    fn transforms() -> (Transform, Transform) {
        let render_from_world = Transform::translate(0.5, -1.0, 2.0);
        let turn = Transform::rotate(40.0, [1.0, 2.0, -0.5]).unwrap();
        let world_from_texture = Transform::translate(0.2, 0.1, -0.3).compose(&turn);
        (render_from_world, world_from_texture.compose(&Transform::scale(2.0, 0.5, 1.5).unwrap()))
    }

    // Power: a derivative wrong by 2 % of the largest fails.
    #[test]
    fn derivatives_are_differences() {
        let (r, w) = transforms();
        let planar = MappingDesc::Planar { v1: [1.0, 2.0, 0.5], v2: [0.0, -1.0, 1.0], u_delta: 0.5, v_delta: 0.25 };
        for desc in [MappingDesc::Spherical, MappingDesc::Cylindrical, planar] {
            let mapping = Mapping::compile(&desc, &r, &w).unwrap();
            let (dx, dy) = (Vec3::new(1e-3, -5e-4, 2e-4), Vec3::new(3e-4, 1e-3, 7e-4));
            for p in [Point3::new(1.3, 0.4, 2.2), Point3::new(-0.7, 2.0, 1.0), Point3::new(3.0, -2.0, 5.0)] {
                let c = mapping.map(&context(p, dx, dy));
                for (d, step) in [(c.dx, dx), (c.dy, dy)] {
                    let a = mapping.map(&context(p + step * -0.5, dx, dy));
                    let b = mapping.map(&context(p + step * 0.5, dx, dy));
                    for (got, expected) in d.into_iter().zip([b.s - a.s, b.t - a.t]) {
                        assert!((got - expected).abs() < 2e-5, "{desc:?} {p:?}: {got} {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn coordinates_are_pbrts() {
        let identity = Transform::IDENTITY;
        let map = |desc, p| {
            let c = Mapping::compile(&desc, &identity, &identity).unwrap().map(&context(p, Vec3::ZERO, Vec3::ZERO));
            [c.s, c.t]
        };
        let close = |a: [f32; 2], b: [f32; 2]| assert!((a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-6, "{a:?} {b:?}");
        close(map(MappingDesc::Spherical, Point3::new(0.0, 0.0, 2.0)), [0.0, 0.0]);
        close(map(MappingDesc::Spherical, Point3::new(0.0, 3.0, 0.0)), [0.5, 0.25]);
        close(map(MappingDesc::Spherical, Point3::new(0.0, -3.0, 0.0)), [0.5, 0.75]);
        close(map(MappingDesc::Spherical, Point3::new(0.0, 0.0, 0.0)), [0.0, 0.0]);
        close(map(MappingDesc::Cylindrical, Point3::new(2.0, 0.0, 1.5)), [0.5, 1.5]);
        close(map(MappingDesc::Cylindrical, Point3::new(0.0, 1.0, -2.0)), [0.75, -2.0]);
        let uv = MappingDesc::Uv { u_scale: 2.0, v_scale: 3.0, u_delta: 0.1, v_delta: -0.2 };
        close(map(uv, Point3::new(0.0, 0.0, 0.0)), [0.7, 1.6]);
        let c = Mapping::compile(&uv, &identity, &identity).unwrap();
        let c = c.map(&context(Point3::new(0.0, 0.0, 0.0), Vec3::ZERO, Vec3::ZERO));
        close(c.dx, [0.02, -0.09]);
        close(c.dy, [0.04, 0.12]);
        let planar = MappingDesc::Planar { v1: [1.0, 0.0, 0.0], v2: [0.0, 2.0, 0.0], u_delta: 0.5, v_delta: 1.0 };
        close(map(planar, Point3::new(3.0, 4.0, 5.0)), [3.5, 9.0]);
    }

    #[test]
    fn render_space_does_not_matter() {
        let (_, w) = transforms();
        for desc in [MappingDesc::Spherical, MappingDesc::Cylindrical] {
            let here = Mapping::compile(&desc, &Transform::IDENTITY, &w).unwrap();
            let there = Mapping::compile(&desc, &Transform::translate(10.0, 20.0, 30.0), &w).unwrap();
            let (p, d) = (Point3::new(1.0, 2.0, 3.0), Vec3::new(0.01, 0.0, 0.02));
            let (a, b) = (here.map(&context(p, d, d)), there.map(&context(p + Vec3::new(10.0, 20.0, 30.0), d, d)));
            assert!((a.s - b.s).abs() < 1e-5 && (a.t - b.t).abs() < 1e-5 && (a.dx[1] - b.dx[1]).abs() < 1e-6);
        }
    }
}
