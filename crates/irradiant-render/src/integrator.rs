//! The open set: what walks a scene, one call per work unit.

use irradiant_core::film::{FilmTile, PixelBounds};
use irradiant_core::interaction::ShapeId;
use irradiant_core::light::Light;
use irradiant_core::scene::Scene;
use std::ops::{AddAssign, Range};

/// Some samples of some pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkUnit {
    /// Which pixels.
    pub bounds: PixelBounds,
    /// Which samples of each.
    pub samples: Range<u32>,
}

/// What an integrator did, for reports. Merging is addition.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderStats {
    /// Samples taken, refused ones included.
    pub paths: u64,
    /// Rays from the camera.
    pub camera_rays: u64,
    /// Rays from surfaces that look for the closest hit.
    pub bounce_rays: u64,
    /// Rays that ask whether something is in the way.
    pub shadow_rays: u64,
    /// Scattering events on all paths together.
    pub scatterings: u64,
    /// Most scattering events on one path.
    pub longest_path: u32,
    /// Paths that a safety stop ended, whose light beyond it is missing (integrators without roulette).
    pub stopped_paths: u64,
    /// Closest-hit rays by the number of scattering events before them, up to [`RenderStats::MAX_DEPTHS`] of them; filled by the lectures'
    /// estimators only.
    pub rays_by_depth: Vec<u64>,
    /// The first few refused samples: pixel x, y, sample index.
    pub refused: Vec<(i32, i32, u32)>,
}

impl RenderStats {
    /// At most this many refused samples are located.
    pub const MAX_REFUSED: usize = 16;
    /// Rays after as many events as this are not counted by depth.
    pub const MAX_DEPTHS: usize = 64;

    /// Notes a sample that the film refused, if it is among the first.
    pub fn refuse(&mut self, x: i32, y: i32, index: u32) {
        self.refused.push((x, y, index));
        if self.refused.len() > 2 * Self::MAX_REFUSED {
            self.refused.sort_unstable();
            self.refused.truncate(Self::MAX_REFUSED);
        }
    }
}

impl AddAssign<&RenderStats> for RenderStats {
    fn add_assign(&mut self, other: &RenderStats) {
        self.paths += other.paths;
        self.camera_rays += other.camera_rays;
        self.bounce_rays += other.bounce_rays;
        self.shadow_rays += other.shadow_rays;
        self.scatterings += other.scatterings;
        self.longest_path = self.longest_path.max(other.longest_path);
        self.stopped_paths += other.stopped_paths;
        if self.rays_by_depth.len() < other.rays_by_depth.len() {
            self.rays_by_depth.resize(other.rays_by_depth.len(), 0);
        }
        self.rays_by_depth.iter_mut().zip(&other.rays_by_depth).for_each(|(mine, theirs)| *mine += theirs);
        self.refused.extend_from_slice(&other.refused);
        // Sorted before cutting, so that the list does not depend on which thread came first more than it must.
        self.refused.sort_unstable();
        self.refused.truncate(Self::MAX_REFUSED);
    }
}

/// Takes a unit's samples and adds them to a tile: [`Integrator::renderer`].
pub type Renderer<'a> = Box<dyn FnMut(&WorkUnit, &mut FilmTile, &mut RenderStats) + 'a>;

/// An estimator of the picture. Strangers may write one; ours are in [`crate::path`] and its neighbours.
pub trait Integrator: Send + Sync {
    /// Takes the unit's samples and adds them to `tile` (whose bounds are the unit's). A sample is a pure function of
    /// (scene, settings, pixel, sample index), whatever the unit that it comes in.
    fn render(&self, scene: &Scene, unit: &WorkUnit, tile: &mut FilmTile, stats: &mut RenderStats);

    /// What one thread calls for each of its units: does what [`Integrator::render`] does, and may keep memory from one unit to the next.
    fn renderer<'a>(&'a self, scene: &'a Scene) -> Renderer<'a> {
        Box::new(move |unit, tile, stats| self.render(scene, unit, tile, stats))
    }

    /// The most samples of one pixel that a work unit is to have, 1 or more. Small numbers are for estimators whose samples
    /// of one index have something in common that takes time to make ([`crate::photon`]): all units of an index then come
    /// one after another. Pixels do not depend on it.
    fn samples_per_unit(&self) -> u32 {
        64
    }

    /// True when the surfaces' scattering models are evaluated, whose own limits then belong to the picture.
    fn scatters(&self) -> bool {
        true
    }

    /// True when its samples bring light to other pixels than their own ([`FilmTile::splat`]), for which the film takes memory.
    fn splats(&self) -> bool {
        false
    }

    /// Whether it can estimate this scene's picture; if not, why, and what to try. Asked before rendering.
    fn check(&self, _scene: &Scene) -> Result<(), String> {
        Ok(())
    }

    /// What makes the expected picture differ from the solution of the rendering equation, whatever the scene; empty when unbiased. Of these
    /// [`Limit::concerns`] a scene.
    fn limits(&self) -> Vec<Limit>;
}

/// Something that a picture leaves out or changes, for the label in its header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Light after more scattering events than this is left out.
    MaxDepth(u32),
    /// Named truncation.
    Truncation(String),
    /// Light that the estimator cannot find; only scenes that have all of this have any.
    Unfound(&'static str, &'static [SceneHas]),
    /// The estimator computes something else than the rendering equation's solution.
    OtherQuantity(&'static str),
    /// Named bias.
    Bias(String),
}

/// What a scene may have that some estimators cannot find light by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneHas {
    /// Lights that no ray meets: points, spots, distant lights.
    DeltaLights,
    /// Materials of shapes with smooth mirrors or glass, for all that is known without looking textures up.
    DeltaLobes,
    /// A camera that paths from lights do not reach.
    UnreachedCamera,
    /// Lights that rays meet: area lights and environments.
    Lamps,
    /// Lights at a place, which something may stand behind: all but environments and distant lights.
    PlacedLights,
    /// Lamps that nothing can be drawn from: curves.
    CurvedLamps,
    /// Ways to a lamp that light samples do not find: delta lobes; a mix that comes to an interface; lamps that are curves.
    UnsampledWays,
}

impl SceneHas {
    /// Whether this scene has it.
    pub fn is_in(self, scene: &Scene) -> bool {
        let lights = scene.lights.as_slice();
        match self {
            Self::DeltaLights => lights.iter().any(Light::is_delta),
            Self::DeltaLobes => {
                let shapes = (0..scene.geometry.n_shapes() as u32).map(ShapeId);
                scene.materials.may_be_specular(shapes.map(|shape| scene.geometry.material(shape)))
            }
            Self::UnreachedCamera => scene.light_path_obstacle().is_some(),
            Self::Lamps => !lights.iter().all(Light::is_delta),
            Self::PlacedLights => lights.iter().any(|l| l.bounds().is_some()),
            Self::CurvedLamps => {
                lights.iter().any(|l| matches!(l, Light::Area(lamp) if !lamp.shape.can_be_drawn_from()))
            }
            Self::UnsampledWays => {
                Self::DeltaLobes.is_in(scene) || scene.materials.may_pass() || Self::CurvedLamps.is_in(scene)
            }
        }
    }
}

impl Limit {
    /// Of estimators that find delta lights by light samples at surfaces the eye's path comes to, and no other way: a surface whose
    /// light comes by way of delta lobes gets none of it. Takes two events at least.
    pub fn caustics_of_delta_lights(max_depth: Option<u32>) -> Option<Self> {
        (max_depth.is_none_or(|limit| limit >= 2)).then_some(Self::Unfound(
            "what delta lights shine on by way of smooth mirrors or glass",
            &[SceneHas::DeltaLights, SceneHas::DeltaLobes],
        ))
    }

    /// Whether a picture of this scene is limited so.
    pub fn concerns(&self, scene: &Scene) -> bool {
        match self {
            Self::Unfound(_, all) => all.iter().all(|what| what.is_in(scene)),
            Self::MaxDepth(_) | Self::Truncation(_) | Self::OtherQuantity(_) | Self::Bias(_) => true,
        }
    }
}

impl std::fmt::Display for Limit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::MaxDepth(n) => write!(f, "maxdepth {n}"),
            Self::OtherQuantity(what) | Self::Unfound(what, _) => write!(f, "{what}"),
            Self::Truncation(what) | Self::Bias(what) => write!(f, "{what}"),
        }
    }
}
