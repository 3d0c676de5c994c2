use super::*;
use crate::interaction::{MaterialId, ShapeId};
use irradiant_math::{Normal3, Transform};
use irradiant_scene::assets::MemoryAssets;
use irradiant_scene::desc::camera::ApertureShape;
use irradiant_scene::desc::settings::RenderSpace;
use irradiant_scene::desc::{CameraDesc, CameraKind, FileDesc, FilmDesc, MotionDesc};
use irradiant_scene::{Diagnostics, Span, Spanned};
use irradiant_testkit::{Mean, Rng, assert_mean_close, chi2_sphere};

fn spanned<T>(value: T) -> Spanned<T> {
    Spanned::unplaced(value)
}

pub(super) fn perspective(fov: f32, lens_radius: f32, focal_distance: f32) -> CameraKind {
    CameraKind::Perspective {
        fov: spanned(fov),
        lens_radius: spanned(lens_radius),
        focal_distance: spanned(focal_distance),
        frame_aspect_ratio: None,
        screen_window: None,
    }
}

pub(super) fn orthographic(window: [f32; 4], lens_radius: f32, focal_distance: f32) -> CameraKind {
    CameraKind::Orthographic {
        lens_radius: spanned(lens_radius),
        focal_distance: spanned(focal_distance),
        frame_aspect_ratio: None,
        screen_window: Some(spanned(window)),
    }
}

/// Tronnier's double Gauss, US patent 2,673,491, scaled to a focal length of 50 mm; f/2, half field of view 22 degrees.
pub(super) const DOUBLE_GAUSS: [[f32; 4]; 11] = [
    [29.475, 3.76, 1.67, 25.2],
    [84.83, 0.12, 1.0, 25.2],
    [19.275, 4.025, 1.67, 23.0],
    [40.77, 3.275, 1.699, 23.0],
    [12.75, 5.705, 1.0, 18.0],
    [0.0, 4.5, 0.0, 17.1],
    [-14.495, 1.18, 1.603, 17.0],
    [40.77, 6.065, 1.658, 20.0],
    [-20.385, 0.19, 1.0, 20.0],
    [437.065, 3.22, 1.717, 20.0],
    [-39.73, 5.0, 1.0, 20.0],
];

pub(super) fn realistic(aperture_diameter: f32, focus_distance: f32, aperture: ApertureShape) -> CameraKind {
    CameraKind::Realistic {
        lens_file: None,
        lens: DOUBLE_GAUSS.as_slice().into(),
        aperture_diameter: spanned(aperture_diameter),
        focus_distance: spanned(focus_distance),
        aperture,
    }
}

pub(super) struct Setup {
    kind: CameraKind,
    resolution: [u32; 2],
    pub camera_from_world: MotionDesc,
    samples: u32,
    space: RenderSpace,
    pub assets: MemoryAssets,
}

impl Setup {
    pub fn new(kind: CameraKind, resolution: [u32; 2]) -> Self {
        let space = RenderSpace::CameraWorld;
        Self {
            kind,
            resolution,
            camera_from_world: MotionDesc::default(),
            samples: 1,
            space,
            assets: MemoryAssets::default(),
        }
    }

    fn try_compile(&self) -> (Option<CompiledCamera>, Vec<&'static str>) {
        let desc =
            CameraDesc { kind: self.kind.clone(), camera_from_world: self.camera_from_world, ..CameraDesc::default() };
        let film = FilmDesc { resolution: spanned(self.resolution), ..FilmDesc::default() };
        let mut diagnostics = Diagnostics::default();
        let compiled = compile(&desc, &film, self.samples, self.space, &self.assets, &mut diagnostics);
        (compiled, diagnostics.iter().map(|d| d.code).collect())
    }

    pub fn compile(&self) -> CompiledCamera {
        let (compiled, codes) = self.try_compile();
        compiled.unwrap_or_else(|| panic!("{codes:?}"))
    }
}

const MIDDLE: Point2 = Point2::new(0.5, 0.5);

fn camera_of(kind: CameraKind, resolution: [u32; 2]) -> Camera {
    Setup::new(kind, resolution).compile().camera
}

fn ray_of(camera: &Camera, x: f32, y: f32) -> Ray {
    camera.generate_ray(Point2::new(x, y), MIDDLE, 0.5).unwrap().ray
}

fn assert_vec(a: Vec3, b: Vec3, tolerance: f32) {
    assert!((a - b).length() <= tolerance, "{a:?} is not {b:?}");
}

/// A plane that a ray meets at `p`.
fn plane(p: Point3, n: Vec3) -> Interaction {
    let n = n.normalize().as_normal();
    Interaction {
        p,
        p_error: Vec3::ZERO,
        n,
        ns: n,
        uv: MIDDLE,
        dpdu: Vec3::new(2.0, 0.0, 0.0),
        dpdv: Vec3::new(0.0, 3.0, 0.0),
        dpdus: Vec3::X,
        dpdvs: Vec3::Y,
        dndus: Normal3::ZERO,
        dndvs: Normal3::ZERO,
        wo: -p.as_vec().normalize(),
        t: 1.0,
        time: 0.5,
        material: MaterialId(0),
        light: None,
        shape: ShapeId(0),
        face: 0,
    }
}

#[test]
fn the_field_of_view_spans_the_shorter_side() {
    let tan = (30f32).to_radians().tan();
    for (resolution, [x, y]) in [([200, 100], [2.0, 1.0]), ([100, 200], [1.0, 2.0]), ([64, 64], [1.0, 1.0])] {
        let camera = camera_of(perspective(60.0, 0.0, 1e6), resolution);
        let [w, h] = resolution.map(|n| n as f32);
        for (film, sx, sy) in
            [([0.0, 0.0], -x, y), ([w, 0.0], x, y), ([0.0, h], -x, -y), ([0.5 * w, 0.25 * h], 0.0, 0.5 * y)]
        {
            let ray = ray_of(&camera, film[0], film[1]);
            assert_vec(ray.d, Vec3::new(sx * tan, sy * tan, 1.0).normalize(), 2e-6);
            assert_eq!(ray.o, Point3::ZERO);
        }
    }
}

#[test]
fn frames_and_windows_replace_the_films_aspect() {
    let mut kind = perspective(90.0, 0.0, 1e6);
    if let CameraKind::Perspective { frame_aspect_ratio, .. } = &mut kind {
        *frame_aspect_ratio = Some(spanned(0.5));
    }
    assert_vec(ray_of(&camera_of(kind.clone(), [100, 100]), 0.0, 0.0).d, Vec3::new(-1.0, 2.0, 1.0).normalize(), 1e-6);
    if let CameraKind::Perspective { screen_window, .. } = &mut kind {
        *screen_window = Some(spanned([-1.0, 3.0, -0.5, 0.25]));
    }
    let camera = camera_of(kind, [100, 100]);
    assert_vec(ray_of(&camera, 0.0, 0.0).d, Vec3::new(-1.0, 0.25, 1.0).normalize(), 1e-6);
    assert_vec(ray_of(&camera, 100.0, 100.0).d, Vec3::new(3.0, -0.5, 1.0).normalize(), 1e-6);
}

// 20,000 draws: a bias of the mean of 0.7 % of the radius, or of the mean squared radius of 1 %, is seen; four tests at
// 4.9 sigma raise a false alarm in one of 250,000 seeds.
#[test]
fn a_thin_lens_is_a_uniform_disk_and_sharp_in_its_plane_of_focus() {
    let camera = camera_of(perspective(40.0, 0.25, 3.0), [80, 60]);
    let sharp = camera_of(perspective(40.0, 0.0, 3.0), [80, 60]);
    let film = Point2::new(71.3, 12.9);
    let pinhole = sharp.generate_ray(film, MIDDLE, 0.5).unwrap().ray;
    let focus = pinhole.at(3.0 / pinhole.d.z);
    let mut rng = Rng::new(1);
    let [mut x, mut y, mut r2] = [Mean::new(), Mean::new(), Mean::new()];
    for _ in 0..20_000 {
        let u = Point2::new(rng.next_f32(), rng.next_f32());
        let ray = camera.generate_ray(film, u, 0.5).unwrap().ray;
        assert!(ray.o.z == 0.0 && ray.o.as_vec().length() < 0.250001 && (ray.d.length() - 1.0).abs() < 1e-6);
        assert_vec(ray.at((3.0 - ray.o.z) / ray.d.z) - focus, Vec3::ZERO, 2e-6);
        x.add(ray.o.x as f64);
        y.add(ray.o.y as f64);
        r2.add(ray.o.as_vec().length_squared() as f64);
    }
    for (mean, exact) in [(x, 0.0), (y, 0.0), (r2, 0.5 * 0.25 * 0.25)] {
        assert_mean_close(&mean, exact, 4.9);
    }
}

#[test]
fn orthographic_rays_are_parallel_and_with_a_lens_do_as_pbrt() {
    let camera = camera_of(orthographic([-4.0, 4.0, -2.0, 2.0], 0.0, 1e6), [80, 40]);
    for (x, y, p) in [(0.0, 0.0, [-4.0, 2.0, 0.0]), (80.0, 40.0, [4.0, -2.0, 0.0]), (40.0, 10.0, [0.0, 1.0, 0.0])] {
        let ray = ray_of(&camera, x, y);
        assert_vec(ray.o - Point3::from(p), Vec3::ZERO, 2e-6);
        assert_eq!(ray.d, Vec3::Z);
    }
    let setup = Setup::new(orthographic([-4.0, 4.0, -2.0, 2.0], 0.5, 10.0), [80, 40]);
    let (compiled, codes) = setup.try_compile();
    assert_eq!(codes, ["W0912"]);
    let ray = compiled.unwrap().camera.generate_ray(Point2::new(80.0, 0.0), Point2::new(1.0, 0.5), 0.0).unwrap().ray;
    assert_vec(ray.o.as_vec(), Vec3::new(0.5, 0.0, 0.0), 1e-6);
    assert_vec(ray.d, Vec3::new(3.5, 2.0, 10.0).normalize(), 1e-6);
}

// 200,000 directions; a cell that is some 3 % off is seen, false alarms below one in a million.
#[test]
fn an_equal_area_sphere_sees_all_directions_alike() {
    let camera = camera_of(CameraKind::Spherical { equirectangular: false }, [64, 64]);
    let mut rng = Rng::new(7);
    let report = chi2_sphere(
        |_| 0.25 / std::f64::consts::PI,
        || Some(ray_of(&camera, rng.next_f32() * 64.0, rng.next_f32() * 64.0).d.to_array()),
        200_000,
    );
    report.assert_above(1e-6, "equal-area camera");
    assert_vec(ray_of(&camera, 32.0, 32.0).d, Vec3::Y, 1e-6);
    // pbrt-v4's orientation.
    assert_vec(ray_of(&camera, 64.0, 32.0).d, Vec3::X, 1e-6);
    assert_vec(ray_of(&camera, 32.0, 64.0).d, Vec3::Z, 1e-6);
}

#[test]
fn latitude_and_longitude_run_down_and_around() {
    let camera = camera_of(CameraKind::Spherical { equirectangular: true }, [360, 180]);
    for (x, y, d) in [
        (0.0, 90.0, Vec3::X),
        (90.0, 90.0, Vec3::Z),
        (180.0, 90.0, -Vec3::X),
        (13.0, 0.0, Vec3::Y),
        (13.0, 180.0, -Vec3::Y),
    ] {
        assert_vec(ray_of(&camera, x, y).d, d, 1e-6);
    }
}

fn looking(eye: [f64; 3]) -> Transform {
    Transform::look_at(eye, [eye[0] + 1.0, eye[1] - 0.5, eye[2] + 2.0], [0.0, 1.0, 0.0]).unwrap()
}

#[test]
fn cameras_far_from_the_worlds_origin_lose_no_digits() {
    let near = Setup {
        camera_from_world: MotionDesc::still(looking([0.0; 3])),
        ..Setup::new(perspective(2.0, 0.01, 5.0), [500, 300])
    };
    let far = Setup {
        camera_from_world: MotionDesc::still(looking([1e5, -2e5, 3e5])),
        ..Setup::new(perspective(2.0, 0.01, 5.0), [500, 300])
    };
    let (near, far) = (near.compile(), far.compile());
    for i in 0..50 {
        let film = Point2::new(i as f32 * 10.1, i as f32 * 6.1);
        let lens = Point2::new(i as f32 / 50.0, 0.3);
        let [a, b] = [&near, &far].map(|c| c.camera.generate_ray(film, lens, 0.5).unwrap().ray);
        assert_vec(a.d, b.d, 1e-6);
        assert_vec(a.o - b.o, Vec3::ZERO, 1e-7);
    }
    assert_eq!(far.render_from_world.point64([1e5, -2e5, 3e5]), [0.0; 3]);
    let p = far.camera_from_world.point64([1e5 + 1.0, -2e5 - 0.5, 3e5 + 2.0]);
    assert!(p[0].abs() < 1e-9 && p[1].abs() < 1e-9 && (p[2] - 5.25f64.sqrt()).abs() < 1e-9);
}

#[test]
fn render_spaces_are_those_that_the_option_names() {
    let eye = [3.0, 4.0, 5.0];
    for (space, camera_at, looks) in [
        (RenderSpace::World, [3.0, 4.0, 5.0], Vec3::new(1.0, -0.5, 2.0).normalize()),
        (RenderSpace::CameraWorld, [0.0; 3], Vec3::new(1.0, -0.5, 2.0).normalize()),
        (RenderSpace::Camera, [0.0; 3], Vec3::Z),
    ] {
        let camera_from_world = MotionDesc::still(looking(eye));
        let setup = Setup { camera_from_world, space, ..Setup::new(perspective(50.0, 0.0, 1.0), [10, 10]) };
        let compiled = setup.compile();
        let ray = ray_of(&compiled.camera, 5.0, 5.0);
        assert_vec(ray.o - Point3::from(camera_at), Vec3::ZERO, 1e-6);
        assert_vec(ray.d, looks, 1e-6);
        let p = compiled.render_from_world.point(Point3::new(3.0, 4.0, 5.0));
        assert_vec(p - Point3::from(camera_at), Vec3::ZERO, 1e-6);
    }
}

#[test]
fn a_moving_camera_is_where_the_shutter_finds_it() {
    let world_from_camera =
        |x: f64| Transform::translate(x, 0.0, 0.0).compose(&Transform::rotate(9.0 * x, [0.0, 1.0, 0.0]).unwrap());
    let camera_from_world = MotionDesc {
        start: world_from_camera(0.0).inverse(),
        end: world_from_camera(10.0).inverse(),
        start_time: 0.0,
        end_time: 1.0,
    };
    let setup = Setup { camera_from_world, ..Setup::new(perspective(50.0, 0.0, 1.0), [10, 10]) };
    let compiled = setup.compile();
    // Render space has its origin where the camera is half way.
    for (u, x) in [(0.0, -5.0), (0.25, -2.5), (0.5, 0.0), (1.0, 5.0)] {
        let ray = compiled.camera.generate_ray(Point2::new(5.0, 5.0), MIDDLE, u).unwrap().ray;
        assert_eq!(ray.time, u);
        assert_vec(ray.o.as_vec(), Vec3::new(x, 0.0, 0.0), 1e-5);
        let angle = (90.0 * u).to_radians();
        assert_vec(ray.d, Vec3::new(angle.sin(), 0.0, angle.cos()), 1e-5);
    }
    assert_eq!(compiled.camera_from_world.point(Point3::ZERO), Point3::ZERO);
    assert_eq!((compiled.exposure_time, compiled.camera.shutter()), (1.0, [0.0, 1.0]));
}

/// All cameras, resting and moving, at a pixel where lenses let light through.
fn all_cameras() -> Vec<(&'static str, CompiledCamera)> {
    let kinds = [
        ("pinhole", perspective(50.0, 0.0, 1.0)),
        ("thin lens", perspective(50.0, 0.1, 4.0)),
        ("orthographic", orthographic([-2.0, 2.0, -1.5, 1.5], 0.0, 1.0)),
        ("orthographic with lens", orthographic([-2.0, 2.0, -1.5, 1.5], 0.1, 4.0)),
        ("equal-area", CameraKind::Spherical { equirectangular: false }),
        ("latitude-longitude", CameraKind::Spherical { equirectangular: true }),
        ("realistic", realistic(10.0, 2.0, ApertureShape::Circular)),
    ];
    let (start, end) = (looking([1.0, 2.0, 3.0]), looking([1.5, 2.0, 2.0]));
    let motions = [MotionDesc::still(start), MotionDesc { start, end, start_time: 0.0, end_time: 1.0 }];
    let mut cameras = Vec::new();
    for (name, kind) in kinds {
        for camera_from_world in motions {
            let setup = Setup { camera_from_world, samples: 16, ..Setup::new(kind.clone(), [400, 300]) };
            cameras.push((name, setup.compile()));
        }
    }
    cameras
}

#[test]
fn neighbours_are_where_the_next_pixels_rays_go() {
    for (name, CompiledCamera { camera, footprint, .. }) in all_cameras() {
        for film in [Point2::new(190.3, 160.2), Point2::new(230.0, 130.5)] {
            let lens = Point2::new(0.45, 0.6);
            let at_film = |x: f32, y: f32| camera.generate_ray(Point2::new(film.x + x, film.y + y), lens, 0.3);
            let ray = at_film(0.0, 0.0).unwrap();
            let p = ray.ray.at(5.0);
            let n = Vec3::new(-0.2, 0.3, -1.0).normalize();
            let n = (n - ray.ray.d).normalize();
            let at = Interaction { time: ray.ray.time, ..plane(p, n) };
            let changes = ray.position_change(&at).unwrap();
            // 16 samples: neighbours are a quarter of a pixel away; central differences over a whole one.
            for (change, [x, y]) in changes.into_iter().zip([[0.5, 0.0], [0.0, 0.5]]) {
                let meet = |r: CameraRay| {
                    let r = r.ray;
                    r.at((p - r.o).dot(n) / r.d.dot(n))
                };
                let expected = (meet(at_film(x, y).unwrap()) - meet(at_film(-x, -y).unwrap())) * 0.25;
                assert!(
                    (change - expected).length() < 0.02 * expected.length(),
                    "{name}: {change:?} is not {expected:?}"
                );
            }
            let context = footprint.texture_context(&at, Some(&ray));
            assert_eq!([context.dpdx, context.dpdy], changes);
            let slope = ray.depth_slope(&at, &Affine::IDENTITY);
            assert_eq!(slope, [changes[0].z, changes[1].z]);
        }
    }
}

#[test]
fn estimates_are_of_the_size_of_the_sharpest_pixel() {
    for samples in [1, 16, 10_000] {
        let scale = [1.0, 0.25, 0.125][[1, 16, 10_000].iter().position(|&s| s == samples).unwrap()];
        let setup = Setup { samples, ..Setup::new(perspective(5.0, 0.0, 1.0), [100, 100]) };
        let CompiledCamera { footprint, .. } = setup.compile();
        let pixel = 2.0 * (2.5f32).to_radians().tan() / 100.0 * scale;
        // Facing the camera in any direction, 7 away; the corners of a narrow image are 0.4 % sharper.
        for d in [Vec3::Z, -Vec3::Z, Vec3::new(1.0, 2.0, -0.3).normalize()] {
            let [dpdx, dpdy] = footprint.estimate(&plane(d.as_point() * 7.0, d));
            for change in [dpdx, dpdy] {
                assert!((change.length() / (7.0 * pixel) - 1.0).abs() < 0.01, "{change:?} {pixel}");
            }
            assert!(dpdx.dot(dpdy).abs() < 0.01 * dpdx.length_squared());
        }
        // Tilted by 60 degrees: twice as long one way.
        let tilted = plane(Point3::new(0.0, 0.0, 7.0), Vec3::new(3f32.sqrt(), 0.0, -1.0));
        let [dpdx, dpdy] = footprint.estimate(&tilted);
        let area = dpdx.cross(dpdy).length();
        assert!((area / (2.0 * 49.0 * pixel * pixel) - 1.0).abs() < 0.02, "{area}");
    }
    let ortho = Setup::new(orthographic([-1.0, 1.0, -1.0, 1.0], 0.0, 1.0), [100, 50]).compile().footprint;
    let [dpdx, dpdy] = ortho.estimate(&plane(Point3::new(1.0, 2.0, 7.0), Vec3::new(1.0, 2.0, 7.0)));
    assert!((dpdx.length() - 0.02).abs() < 1e-5 && (dpdy.length() - 0.04).abs() < 1e-5);
}

#[test]
fn parameters_change_as_positions_do_and_never_without_bound() {
    let CompiledCamera { camera, footprint, .. } = Setup::new(perspective(50.0, 0.0, 1.0), [100, 100]).compile();
    let ray = camera.generate_ray(Point2::new(50.0, 50.0), MIDDLE, 0.5).unwrap();
    let at = plane(Point3::new(0.0, 0.0, 10.0), Vec3::Z);
    let c = footprint.texture_context(&at, Some(&ray));
    let pixel = 10.0 * 2.0 * (25f32).to_radians().tan() / 100.0;
    for (found, expected) in [(c.dudx, pixel / 2.0), (c.dvdy, -pixel / 3.0), (c.dudy, 0.0), (c.dvdx, 0.0)] {
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }
    // Edge-on, at the camera itself, and with degenerate parameters.
    let edge_on = plane(Point3::new(0.0, 0.0, 10.0), Vec3::X);
    let here = plane(Point3::ZERO, Vec3::Z);
    let flat = Interaction { dpdv: Vec3::new(1.0, 0.0, 0.0), ..at };
    let none = Interaction { dpdu: Vec3::ZERO, dpdv: Vec3::ZERO, ..at };
    for hit in [edge_on, here, flat, none] {
        for found in [Some(&ray), None] {
            let c = footprint.texture_context(&hit, found);
            assert!(c.dpdx.is_finite() && c.dpdy.is_finite());
            assert!([c.dudx, c.dudy, c.dvdx, c.dvdy].iter().all(|x| x.abs() <= 1e8), "{c:?}");
        }
    }
    assert_eq!(footprint.texture_context(&none, None).dudx, 0.0);
}

#[test]
fn impossible_cameras_are_refused_with_reasons() {
    let window = |w: [f32; 4]| orthographic(w, 0.0, 1.0);
    let lens = |rows: &[[f32; 4]]| match realistic(5.0, 2.0, ApertureShape::Circular) {
        CameraKind::Realistic { lens_file, aperture_diameter, focus_distance, aperture, .. } => {
            CameraKind::Realistic { lens_file, lens: rows.into(), aperture_diameter, focus_distance, aperture }
        }
        other => other,
    };
    let missing = ApertureShape::Image(FileDesc { name: "a.png".into(), path: "a.png".into() });
    for (kind, code) in [
        (perspective(0.0, 0.0, 1.0), "E0912"),
        (perspective(180.0, 0.0, 1.0), "E0912"),
        (perspective(f32::NAN, 0.0, 1.0), "E0912"),
        (perspective(40.0, -1.0, 1.0), "E0912"),
        (perspective(40.0, 1.0, 0.0), "E0912"),
        (window([1.0, 1.0, 0.0, 1.0]), "E0913"),
        (window([0.0, 1.0, 0.0, f32::INFINITY]), "E0913"),
        (realistic(-1.0, 2.0, ApertureShape::Circular), "E0912"),
        (realistic(5.0, 0.01, ApertureShape::Circular), "E0915"),
        (realistic(5.0, 2.0, missing), "E0916"),
        (lens(&[]), "E0914"),
        (lens(&[[10.0, 5.0, 1.5, 0.0]]), "E0914"),
        (lens(&[[10.0, 5.0, f32::NAN, 5.0]]), "E0914"),
        (lens(&[[0.001, 5.0, 1.5, 5.0]]), "E0915"),
    ] {
        let (compiled, codes) = Setup::new(kind.clone(), [40, 30]).try_compile();
        assert!(compiled.is_none() && codes == [code], "{kind:?} {codes:?}");
    }
    let singular = Transform { m: [[0.0; 4]; 4], inv: [[0.0; 4]; 4] };
    let setup =
        Setup { camera_from_world: MotionDesc::still(singular), ..Setup::new(perspective(200.0, 0.0, 1.0), [9, 9]) };
    let (compiled, codes) = setup.try_compile();
    assert!(compiled.is_none() && codes.contains(&"E0911") && codes.contains(&"E0912"), "{codes:?}");
}

#[test]
fn scaled_cameras_and_swapped_shutters_are_warned_of_but_mirrors_are_not() {
    for (scale, codes) in [([-1.0, 1.0, 1.0], vec![]), ([2.0, 2.0, 2.0], vec!["W0911"])] {
        let camera_from_world = MotionDesc::still(Transform::scale(scale[0], scale[1], scale[2]).unwrap());
        let setup = Setup { camera_from_world, ..Setup::new(perspective(90.0, 0.0, 1.0), [20, 20]) };
        let (compiled, found) = setup.try_compile();
        assert_eq!(found, codes);
        let ray = ray_of(&compiled.unwrap().camera, 20.0, 10.0);
        assert_vec(ray.d, Vec3::new(scale[0].signum() as f32, 0.0, 1.0).normalize(), 1e-6);
    }
    let desc = CameraDesc {
        shutter_open: spanned(2.0),
        shutter_close: Spanned::new(1.0, Span::NONE),
        ..CameraDesc::default()
    };
    let mut diagnostics = Diagnostics::default();
    let assets = MemoryAssets::default();
    let film = FilmDesc::default();
    let compiled = compile(&desc, &film, 1, RenderSpace::CameraWorld, &assets, &mut diagnostics).unwrap();
    assert_eq!((compiled.camera.shutter(), diagnostics.len()), ([1.0, 2.0], 1));
}
