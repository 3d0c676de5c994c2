//! Small texts and what they must mean: pbrt-v4's defaults and semantics, one line each.

use irradiant_formats::read_pbrt;
use irradiant_math::Transform;
use irradiant_scene::SceneDesc;
use irradiant_scene::assets::MemoryAssets;
use irradiant_scene::desc::camera::ApertureShape;
use irradiant_scene::desc::material::ConductorDesc;
use irradiant_scene::desc::settings::Randomization;
use irradiant_scene::desc::texture::{BasicTexture, EncodingDesc, ImageFilter, ImageWrap};
use irradiant_scene::desc::*;

fn assets() -> MemoryAssets {
    let triangle = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    MemoryAssets::default()
        .with("a.png", &b""[..])
        .with("a.exr", &b""[..])
        .with("m.ply", triangle.as_bytes())
        .with("red.spd", &b"# nm value\n400 0.1\n700, 0.9 # end\n"[..])
        .with("lens.dat", &b"# lens\n1 2 1.5 4\n-1 0.5 1 4\n"[..])
        .with("ball.pbrt", &b"Shape \"sphere\""[..])
        .with("state.pbrt", &b"Translate 5 0 0 Material \"interface\" Shape \"sphere\""[..])
}

type Fact = (&'static str, &'static str, fn(&SceneDesc) -> bool);

fn value(p: &SpannedFloat) -> f32 {
    match p.value {
        FloatParam::Value(v) => v,
        FloatParam::Texture(_) => f32::NAN,
    }
}

fn spectrum(p: &SpannedSpectrum) -> Option<&SpectrumDesc> {
    match &p.value {
        SpectrumParam::Value(v) => Some(v),
        SpectrumParam::Texture(_) => None,
    }
}

fn is_constant(p: &SpannedSpectrum, v: f32) -> bool {
    spectrum(p) == Some(&SpectrumDesc::Constant(v))
}

fn is_rgb(p: &SpannedSpectrum, c: [f32; 3]) -> bool {
    matches!(spectrum(p), Some(SpectrumDesc::Rgb(rgb, _)) if *rgb == c)
}

fn is_named(p: &SpannedSpectrum, name: &str) -> bool {
    matches!(spectrum(p), Some(SpectrumDesc::Named(n)) if n == name)
}

/// Where the origin of the first shape is.
fn place(d: &SceneDesc) -> [f64; 3] {
    d.shapes[0].world_from_shape.start.point64([0.0; 3])
}

fn near(a: [f64; 3], b: [f64; 3]) -> bool {
    (0..3).all(|i| (a[i] - b[i]).abs() < 1e-9)
}

/// The material that the last shape has.
fn material(d: &SceneDesc) -> &MaterialKind {
    &d.materials[d.shapes.last().unwrap().material.0 as usize].kind
}

fn float_texture(d: &SceneDesc) -> &FloatTextureKind {
    &d.float_textures[0].kind
}

fn spectrum_texture(d: &SceneDesc) -> &SpectrumTextureKind {
    &d.spectrum_textures[0].kind
}

fn light(d: &SceneDesc) -> &LightKind {
    &d.lights[0].kind
}

fn mesh(d: &SceneDesc) -> &MeshData {
    match &d.shapes[0].kind {
        ShapeKind::Mesh(m) => m,
        _ => panic!(),
    }
}

fn curve(d: &SceneDesc) -> &CurveData {
    match &d.shapes[0].kind {
        ShapeKind::Curve(c) => c,
        _ => panic!(),
    }
}

const FACTS: &[Fact] = &[
    // Settings before the world.
    ("defaults", "", |d| {
        d.film.resolution.value == [1280, 720]
            && d.sampler.kind == SamplerKind::ZSobol
            && *d.sampler.samples_per_pixel == 16
            && d.integrator.kind == IntegratorKind::Path
            && *d.integrator.max_depth == 5
            && !d.integrator.max_depth_stated
            && matches!(d.filter.kind, FilterKind::Gaussian { sigma } if *sigma == 0.5)
            && *d.filter.x_radius == 1.5
            && matches!(d.camera.kind, CameraKind::Perspective { fov, .. } if *fov == 90.0)
    }),
    (
        "default material",
        "WorldBegin Shape \"sphere\"",
        |d| matches!(material(d), MaterialKind::Diffuse { reflectance } if is_constant(reflectance, 0.5)),
    ),
    ("film", "Film \"rgb\" \"integer xresolution\" 400 \"string filename\" \"o.exr\" \"float iso\" 200", |d| {
        d.film.resolution.value == [400, 720]
            && d.film.filename.as_ref().unwrap().value == "o.exr"
            && *d.film.iso == 200.0
    }),
    ("crop", "Film \"rgb\" \"float cropwindow\" [ .25 .5 0 1 ] \"string sensor\" \"canon_eos_100d\"", |d| {
        d.film.crop_window.unwrap().value == [0.25, 0.5, 0.0, 1.0] && d.film.sensor.value == "canon_eos_100d"
    }),
    ("pixel bounds", "Film \"rgb\" \"integer pixelbounds\" [ 1 2 3 4 ] \"float maxcomponentvalue\" 10", |d| {
        d.film.pixel_bounds.unwrap().value == [1, 2, 3, 4] && *d.film.max_component_value == 10.0
    }),
    ("gbuffer", "Film \"gbuffer\" \"string coordinatesystem\" \"world\"", |d| {
        d.film.kind == FilmKind::Gbuffer { camera_space: false }
    }),
    (
        "spectral film",
        "Film \"spectral\" \"integer nbuckets\" 8",
        |d| matches!(d.film.kind, FilmKind::Spectral { n_buckets, lambda_min, .. } if *n_buckets == 8 && *lambda_min == 360.0),
    ),
    ("film in a colour space", "ColorSpace \"rec2020\" Film \"rgb\"", |d| {
        d.film.color_space == ColorSpaceName::Rec2020
    }),
    ("filters", "PixelFilter \"mitchell\" \"float xradius\" 3", |d| {
        matches!(d.filter.kind, FilterKind::Mitchell { b, .. } if *b == 1.0 / 3.0)
            && *d.filter.x_radius == 3.0
            && *d.filter.y_radius == 2.0
    }),
    ("box filter", "PixelFilter \"box\"", |d| *d.filter.x_radius == 0.5),
    ("independent", "Sampler \"independent\"", |d| *d.sampler.samples_per_pixel == 4),
    ("stratified", "Sampler \"stratified\" \"integer xsamples\" 3 \"bool jitter\" false", |d| {
        d.sampler.kind == SamplerKind::Stratified { x: 3, y: 4, jitter: false } && *d.sampler.samples_per_pixel == 12
    }),
    ("halton", "Sampler \"halton\" \"integer seed\" 7", |d| {
        d.sampler.kind == SamplerKind::Halton(Randomization::PermuteDigits) && d.sampler.seed == Some(7)
    }),
    ("padded", "Sampler \"paddedsobol\" \"string randomization\" \"owen\" \"integer pixelsamples\" [ 64 ]", |d| {
        d.sampler.kind == SamplerKind::PaddedSobol(Randomization::Owen) && *d.sampler.samples_per_pixel == 64
    }),
    ("path", "Integrator \"volpath\" \"integer maxdepth\" 100 \"bool regularize\" true", |d| {
        d.integrator.kind == IntegratorKind::Path
            && *d.integrator.max_depth == 100
            && d.integrator.max_depth_stated
            && d.integrator.regularize
    }),
    ("light sampler", "Integrator \"path\" \"string lightsampler\" \"power\"", |d| {
        d.integrator.light_sampler == LightSamplerKind::Power
    }),
    ("ambient occlusion", "Integrator \"ambientocclusion\" \"float maxdistance\" 2", |d| {
        d.integrator.kind == IntegratorKind::AmbientOcclusion { cos_sample: true, max_distance: 2.0 }
    }),
    ("options", "Option \"seed\" 3 Option \"rendercoordsys\" \"world\" Option \"force-diffuse\" true", |d| {
        d.options.seed == 3 && d.options.render_space == RenderSpace::World && d.options.force_diffuse
    }),
    ("options with types", "Option \"bool disablepixeljitter\" [ true ]", |d| d.options.disable_pixel_jitter),
    // Cameras and transforms.
    ("camera", "LookAt 1 2 3 1 2 9 0 1 0 Camera \"perspective\" \"float fov\" 30", |d| {
        near(d.camera.camera_from_world.start.point64([1.0, 2.0, 3.0]), [0.0; 3])
            && near(d.camera.camera_from_world.start.point64([1.0, 2.0, 5.0]), [0.0, 0.0, 2.0])
    }),
    ("the order of transforms", "Scale -1 1 1 LookAt 0 0 5 0 0 0 0 1 0 Camera \"perspective\"", |d| {
        d.camera.camera_from_world.start.swaps_handedness()
    }),
    (
        "camera coordinates",
        "Translate 0 0 -7 Camera \"perspective\" WorldBegin CoordSysTransform \"camera\" Shape \"sphere\"",
        |d| near(place(d), [0.0, 0.0, 7.0]),
    ),
    ("the world starts afresh", "Translate 0 0 -7 Camera \"perspective\" WorldBegin Shape \"sphere\"", |d| {
        near(place(d), [0.0; 3])
    }),
    (
        "orthographic",
        "Camera \"orthographic\" \"float screenwindow\" [ -1 1 -2 2 ]",
        |d| matches!(d.camera.kind, CameraKind::Orthographic { screen_window: Some(w), .. } if *w == [-1.0, 1.0, -2.0, 2.0]),
    ),
    ("spherical", "Camera \"spherical\"", |d| {
        matches!(d.camera.kind, CameraKind::Spherical { equirectangular: false })
    }),
    ("realistic", "Camera \"realistic\" \"string lensfile\" \"lens.dat\" \"string aperture\" \"star\"", |d| {
        matches!(&d.camera.kind, CameraKind::Realistic { lens, aperture: ApertureShape::Star, aperture_diameter, .. }
            if lens[..] == [[1.0, 2.0, 1.5, 4.0], [-1.0, 0.5, 1.0, 4.0]] && **aperture_diameter == 1.0)
    }),
    ("translate after scale", "WorldBegin Scale 2 2 2 Translate 1 0 0 Shape \"sphere\"", |d| {
        near(place(d), [2.0, 0.0, 0.0])
    }),
    ("matrices are column-major", "WorldBegin Transform [ 1 0 0 0 0 1 0 0 0 0 1 0 4 5 6 1 ] Shape \"sphere\"", |d| {
        near(place(d), [4.0, 5.0, 6.0])
    }),
    (
        "concatenation",
        "WorldBegin Scale 2 2 2 ConcatTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 4 5 6 1 ] Shape \"sphere\"",
        |d| near(place(d), [8.0, 10.0, 12.0]),
    ),
    ("identity", "WorldBegin Translate 1 2 3 Identity Shape \"sphere\"", |d| {
        d.shapes[0].world_from_shape.start == Transform::IDENTITY
    }),
    (
        "named coordinates",
        "WorldBegin Translate 1 2 3 CoordinateSystem \"c\" Identity CoordSysTransform \"c\" Shape \"sphere\"",
        |d| near(place(d), [1.0, 2.0, 3.0]),
    ),
    (
        "attributes restore",
        "WorldBegin AttributeBegin Translate 9 9 9 ReverseOrientation AttributeEnd Shape \"sphere\"",
        |d| near(place(d), [0.0; 3]) && !d.shapes[0].reverse_orientation,
    ),
    ("orientation", "WorldBegin ReverseOrientation Shape \"sphere\"", |d| d.shapes[0].reverse_orientation),
    ("motion", "TransformTimes 0 2 WorldBegin ActiveTransform EndTime Translate 1 0 0 Shape \"sphere\"", |d| {
        let m = d.shapes[0].world_from_shape;
        m.is_animated()
            && near(m.end.point64([0.0; 3]), [1.0, 0.0, 0.0])
            && near(place(d), [0.0; 3])
            && m.end_time == 2.0
    }),
    ("stillness", "WorldBegin ActiveTransform StartTime ActiveTransform All Translate 1 0 0 Shape \"sphere\"", |d| {
        !d.shapes[0].world_from_shape.is_animated()
    }),
    // Shapes.
    ("sphere", "WorldBegin Shape \"sphere\" \"float radius\" 2 \"float zmax\" 1", |d| {
        matches!(d.shapes[0].kind, ShapeKind::Sphere { radius, z_min, z_max, phi_max }
            if *radius == 2.0 && z_min == -2.0 && z_max == 1.0 && *phi_max == 360.0)
    }),
    ("disk", "WorldBegin Shape \"disk\" \"float innerradius\" .5", |d| {
        matches!(d.shapes[0].kind, ShapeKind::Disk { height, radius, inner_radius, .. }
            if height == 0.0 && *radius == 1.0 && inner_radius == 0.5)
    }),
    (
        "cylinder",
        "WorldBegin Shape \"cylinder\"",
        |d| matches!(d.shapes[0].kind, ShapeKind::Cylinder { z_min, z_max, .. } if z_min == -1.0 && z_max == 1.0),
    ),
    (
        "one triangle",
        "WorldBegin Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"vector3 S\" [1 0 0 1 0 0 1 0 0]",
        |d| mesh(d).triangles == [[0, 1, 2]] && mesh(d).tangents.len() == 3,
    ),
    (
        "one patch",
        "WorldBegin Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0] \"point2 uv\" [0 0 1 0 0 1 1 1]",
        |d| mesh(d).quads == [[0, 1, 2, 3]] && mesh(d).uvs[3] == [1.0, 1.0],
    ),
    (
        "ply",
        "WorldBegin Shape \"plymesh\" \"string filename\" \"m.ply\" Shape \"plymesh\" \"string filename\" \"m.ply\"",
        |d| {
            // The same file is the same mesh.
            matches!((&d.shapes[0].kind, &d.shapes[1].kind), (ShapeKind::Mesh(a), ShapeKind::Mesh(b))
            if std::sync::Arc::ptr_eq(a, b) && a.triangles == [[0, 1, 2]])
        },
    ),
    (
        "subdivision",
        "WorldBegin Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]",
        |d| mesh(d).triangles.len() == 64 && mesh(d).normals.len() == mesh(d).positions.len(),
    ),
    (
        "curve",
        "WorldBegin Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0 4 0 0 5 0 0 6 0 0] \"float width1\" 2",
        |d| {
            let c = curve(d);
            c.segments.len() == 2
                && c.width0 == 1.0
                && c.width1 == 2.0
                && c.split_depth == 3
                && c.style == CurveStyle::Flat
        },
    ),
    (
        "b-spline",
        "WorldBegin Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0 4 0 0] \"string basis\" \"bspline\"",
        |d| curve(d).segments.len() == 2 && (curve(d).segments[0][0][0] - 1.0).abs() < 1e-6,
    ),
    (
        "ribbon",
        "WorldBegin Shape \"curve\" \"integer degree\" 2 \"string type\" \"ribbon\" \"point3 P\" [0 0 0 1 0 0 2 0 0] \"normal N\" [0 0 1 0 1 0]",
        |d| curve(d).style == CurveStyle::Ribbon && curve(d).normals.len() == 2,
    ),
    ("alpha", "WorldBegin Shape \"sphere\" \"float alpha\" .5 Shape \"sphere\" \"float alpha\" 1", |d| {
        matches!(d.shapes[0].alpha.unwrap().value, FloatParam::Value(0.5)) && d.shapes[1].alpha.is_none()
    }),
    ("alpha texture", "WorldBegin Texture \"a\" \"float\" \"windy\" Shape \"sphere\" \"texture alpha\" \"a\"", |d| {
        d.shapes[0].alpha.unwrap().value == FloatParam::Texture(FloatTextureRef(0))
    }),
    (
        "shape attributes",
        "WorldBegin Attribute \"shape\" \"float radius\" 2 Shape \"sphere\" Shape \"sphere\" \"float radius\" 3 Shape \"plymesh\" \"string filename\" \"m.ply\"",
        |d| {
            let radius = |i: usize| match d.shapes[i].kind {
                ShapeKind::Sphere { radius, .. } => *radius,
                _ => 0.0,
            };
            radius(0) == 2.0 && radius(1) == 3.0
        },
    ),
    // Objects, includes.
    (
        "objects",
        "WorldBegin Translate 1 0 0 ObjectBegin \"o\" Translate 1 0 0 Shape \"sphere\" ObjectEnd Translate 5 0 0 ObjectInstance \"o\"",
        |d| {
            // The whole transform of the object's shapes counts, and the instance's comes on top.
            let shape = d.objects[0].shapes[0].world_from_shape.start.point64([0.0; 3]);
            d.shapes.is_empty() && near(d.instances[0].world_from_object.start.point64(shape), [8.0, 0.0, 0.0])
        },
    ),
    ("an instance before its object", "WorldBegin ObjectInstance \"o\" ObjectBegin \"o\" ObjectEnd", |d| {
        d.instances[0].object == ObjectRef(0)
    }),
    (
        "a moving instance",
        "WorldBegin ObjectBegin \"o\" ObjectEnd ActiveTransform EndTime Scale 2 2 2 ObjectInstance \"o\"",
        |d| d.instances[0].world_from_object.is_animated(),
    ),
    ("include", "WorldBegin Include \"ball.pbrt\" Include \"ball.pbrt\"", |d| d.shapes.len() == 2),
    ("an include leaves its state", "WorldBegin Include \"state.pbrt\" Shape \"sphere\"", |d| {
        matches!(material(d), MaterialKind::Interface)
    }),
    ("an import does not", "WorldBegin Import \"state.pbrt\" Shape \"sphere\"", |d| {
        matches!(material(d), MaterialKind::Diffuse { .. })
            && d.shapes.len() == 2
            && d.shapes[1].world_from_shape.start == Transform::IDENTITY
    }),
    // Spectra.
    (
        "rgb in a colour space",
        "WorldBegin ColorSpace \"aces2065-1\" Material \"diffuse\" \"rgb reflectance\" [ .1 .2 .3 ] Shape \"sphere\"",
        |d| {
            matches!(material(d), MaterialKind::Diffuse { reflectance } if
            spectrum(reflectance) == Some(&SpectrumDesc::Rgb([0.1, 0.2, 0.3], ColorSpaceName::Aces2065_1)))
        },
    ),
    ("spectrum file", "WorldBegin Material \"diffuse\" \"spectrum reflectance\" \"red.spd\" Shape \"sphere\"", |d| {
        matches!(material(d), MaterialKind::Diffuse { reflectance } if
            spectrum(reflectance) == Some(&SpectrumDesc::Samples([(400.0, 0.1), (700.0, 0.9)].into())))
    }),
    (
        "inline spectrum",
        "WorldBegin Material \"diffuse\" \"spectrum reflectance\" [ 360 .5 830 .6 ] Shape \"sphere\"",
        |d| {
            matches!(material(d), MaterialKind::Diffuse { reflectance } if
            spectrum(reflectance) == Some(&SpectrumDesc::Samples([(360.0, 0.5), (830.0, 0.6)].into())))
        },
    ),
    (
        "black body",
        "WorldBegin LightSource \"point\" \"blackbody I\" 3000",
        |d| matches!(light(d), LightKind::Point { intensity, .. } if intensity.value == SpectrumDesc::Blackbody(3000.0)),
    ),
    // Materials.
    (
        "named later",
        "WorldBegin NamedMaterial \"m\" Shape \"sphere\" MakeNamedMaterial \"m\" \"string type\" \"thindielectric\"",
        |d| matches!(material(d), MaterialKind::ThinDielectric { eta } if is_constant(eta, 1.5)),
    ),
    (
        "copper",
        "WorldBegin Material \"conductor\" \"float roughness\" .3 \"float vroughness\" .2 Shape \"sphere\"",
        |d| {
            matches!(material(d), MaterialKind::Conductor { fresnel: ConductorDesc::Ior { eta, k }, roughness }
            if is_named(eta, "metal-Cu-eta") && is_named(k, "metal-Cu-k")
            && value(&roughness.u) == 0.3 && value(&roughness.v) == 0.2 && roughness.remap)
        },
    ),
    (
        "metal by reflectance",
        "WorldBegin Material \"conductor\" \"rgb reflectance\" [1 0 0] \"bool remaproughness\" false Shape \"sphere\"",
        |d| {
            matches!(material(d), MaterialKind::Conductor { fresnel: ConductorDesc::Reflectance(r), roughness }
            if is_rgb(r, [1.0, 0.0, 0.0]) && !roughness.remap)
        },
    ),
    (
        "glass",
        "WorldBegin Material \"dielectric\" \"spectrum eta\" \"glass-BK7\" Shape \"sphere\"",
        |d| matches!(material(d), MaterialKind::Dielectric { eta, roughness } if is_named(eta, "glass-BK7") && value(&roughness.u) == 0.0),
    ),
    ("coat", "WorldBegin Material \"coateddiffuse\" \"float eta\" 1.3 Shape \"sphere\"", |d| {
        matches!(material(d), MaterialKind::CoatedDiffuse { reflectance, coat }
            if is_constant(reflectance, 0.5) && is_constant(&coat.eta, 1.3) && value(&coat.thickness) == 0.01
            && value(&coat.g) == 0.0 && is_constant(&coat.albedo, 0.0) && *coat.max_depth == 10 && *coat.n_samples == 1
            && value(&coat.roughness.u) == 0.0)
    }),
    (
        "coated metal",
        "WorldBegin Material \"coatedconductor\" \"float interface.roughness\" .1 \"float conductor.uroughness\" .2 Shape \"sphere\"",
        |d| {
            matches!(material(d), MaterialKind::CoatedConductor { fresnel: ConductorDesc::Ior { eta, .. }, roughness, coat }
            if is_named(eta, "metal-Cu-eta") && value(&coat.roughness.v) == 0.1
            && value(&roughness.u) == 0.2 && value(&roughness.v) == 0.0 && is_constant(&coat.eta, 1.5))
        },
    ),
    ("leaf", "WorldBegin Material \"diffusetransmission\" \"float scale\" 2 Shape \"sphere\"", |d| {
        matches!(material(d), MaterialKind::DiffuseTransmission { reflectance, transmittance, scale }
            if is_constant(reflectance, 0.25) && is_constant(transmittance, 0.25) && **scale == 2.0)
    }),
    (
        "mix",
        "WorldBegin MakeNamedMaterial \"a\" \"string type\" \"diffuse\" MakeNamedMaterial \"b\" \"string type\" \"conductor\" Material \"mix\" \"string materials\" [\"b\" \"a\"] Shape \"sphere\"",
        |d| matches!(material(d), MaterialKind::Mix { materials: [MaterialRef(2), MaterialRef(1)], amount } if value(amount) == 0.5),
    ),
    (
        "bumps",
        "WorldBegin Texture \"f\" \"float\" \"fbm\" Material \"diffuse\" \"texture displacement\" \"f\" \"string normalmap\" \"a.png\" Shape \"sphere\"",
        |d| {
            d.materials[1].displacement.unwrap().value == FloatParam::Texture(FloatTextureRef(0))
                && d.materials[1].normal_map.as_ref().unwrap().name == "a.png"
        },
    ),
    ("interface", "WorldBegin Material \"interface\" \"float anything\" 1 Shape \"sphere\"", |d| {
        matches!(material(d), MaterialKind::Interface)
    }),
    ("milk", "WorldBegin Material \"subsurface\" Shape \"sphere\"", |d| {
        matches!(material(d), MaterialKind::Subsurface { mean_albedo, eta, .. } if **eta == 1.33
            && matches!(spectrum(mean_albedo), Some(SpectrumDesc::Rgb([r, g, b], _)) if *r > 0.9 && r > g && g > b && *b > 0.7))
    }),
    ("hair", "WorldBegin Material \"hair\" Shape \"sphere\"", |d| {
        matches!(material(d), MaterialKind::Hair { mean_albedo }
            if matches!(spectrum(mean_albedo), Some(SpectrumDesc::Rgb([r, g, b], _)) if *r < 0.05 && r > g && g > b))
    }),
    ("retroreflective", "WorldBegin Material \"retroreflective\" Shape \"sphere\"", |d| {
        matches!(material(d), MaterialKind::Retroreflective { reflectance, base, roughness }
            if is_constant(reflectance, 0.9) && is_constant(base, 0.1) && value(&roughness.u) == 0.1)
    }),
    (
        "glossy paint",
        "WorldBegin Material \"glossypaint\" \"rgb reflectance\" [1 0 0] Shape \"sphere\"",
        |d| matches!(material(d), MaterialKind::GlossyPaint { reflectance, eta, .. } if is_rgb(reflectance, [1.0, 0.0, 0.0]) && is_constant(eta, 1.5)),
    ),
    ("thin film", "WorldBegin Material \"thinfilmpaint\" \"float thickness\" 500 Shape \"sphere\"", |d| {
        matches!(material(d), MaterialKind::ThinFilmPaint { thickness, film_eta, fresnel: ConductorDesc::Ior { eta, .. }, roughness }
            if value(thickness) == 500.0 && is_constant(film_eta, 1.5) && is_named(eta, "metal-Al-eta") && value(&roughness.u) == 0.2)
    }),
    (
        "material attributes",
        "WorldBegin Attribute \"material\" \"float roughness\" .2 Material \"dielectric\" Shape \"sphere\"",
        |d| matches!(material(d), MaterialKind::Dielectric { roughness, .. } if value(&roughness.v) == 0.2),
    ),
    // Textures.
    (
        "checkerboard",
        "WorldBegin Texture \"t\" \"spectrum\" \"checkerboard\" \"float uscale\" 4 \"rgb tex1\" [1 0 0]",
        |d| {
            matches!(spectrum_texture(d), SpectrumTextureKind::Basic(BasicTexture::Checkerboard { tex1, tex2, dimension: 2,
            mapping: MappingDesc::Uv { u_scale, v_scale, .. } })
            if is_rgb(tex1, [1.0, 0.0, 0.0]) && is_constant(tex2, 0.0) && *u_scale == 4.0 && *v_scale == 1.0)
        },
    ),
    ("checkerboard, nothing said", "WorldBegin Texture \"t\" \"float\" \"checkerboard\"", |d| {
        matches!(float_texture(d), FloatTextureKind::Basic(BasicTexture::Checkerboard { tex1, tex2, .. })
            if value(tex1) == 1.0 && value(tex2) == 0.0)
    }),
    ("mix, nothing said", "WorldBegin Texture \"t\" \"float\" \"mix\"", |d| {
        matches!(float_texture(d), FloatTextureKind::Basic(BasicTexture::Mix { tex1, tex2, amount })
            if value(tex1) == 0.0 && value(tex2) == 1.0 && value(amount) == 0.5)
    }),
    ("bilerp, nothing said", "WorldBegin Texture \"t\" \"float\" \"bilerp\"", |d| {
        matches!(float_texture(d), FloatTextureKind::Basic(BasicTexture::Bilerp { v00, v01, v10, v11, .. })
            if value(v00) == 0.0 && value(v01) == 1.0 && value(v10) == 0.0 && value(v11) == 1.0)
    }),
    ("image map", "WorldBegin Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.png\"", |d| {
        matches!(spectrum_texture(d), SpectrumTextureKind::Basic(BasicTexture::ImageMap(m))
            if m.filter == ImageFilter::Bilinear && m.wrap == ImageWrap::Repeat && m.scale == 1.0 && !m.invert
            && m.encoding == EncodingDesc::Default && m.max_anisotropy == 8.0)
    }),
    (
        "image map, all said",
        "WorldBegin Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"a.exr\" \"string filter\" \"ewa\" \"string wrap\" \"clamp\" \"bool invert\" true \"string encoding\" \"gamma 2.2\"",
        |d| {
            matches!(float_texture(d), FloatTextureKind::Basic(BasicTexture::ImageMap(m))
            if m.filter == ImageFilter::Ewa && m.wrap == ImageWrap::Clamp && m.invert && m.encoding == EncodingDesc::Gamma(2.2))
        },
    ),
    (
        "planar",
        "WorldBegin Texture \"t\" \"float\" \"dots\" \"string mapping\" \"planar\" \"vector3 v2\" [0 0 1]",
        |d| {
            matches!(float_texture(d), FloatTextureKind::Basic(BasicTexture::Dots { inside, outside, mapping: MappingDesc::Planar { v1, v2, .. } })
            if value(inside) == 1.0 && value(outside) == 0.0 && *v1 == [1.0, 0.0, 0.0] && *v2 == [0.0, 0.0, 1.0])
        },
    ),
    ("direction mix", "WorldBegin Rotate 90 1 0 0 Texture \"t\" \"float\" \"directionmix\"", |d| {
        // "dir" is of texture space: (0, 1, 0) there is +z in the world.
        matches!(float_texture(d), FloatTextureKind::Basic(BasicTexture::DirectionMix { dir, .. }) if (dir[2] - 1.0).abs() < 1e-6)
    }),
    ("marble", "WorldBegin Texture \"t\" \"spectrum\" \"marble\"", |d| {
        matches!(spectrum_texture(d), SpectrumTextureKind::Marble { octaves: 8, omega, scale, variation }
            if *omega == 0.5 && *scale == 1.0 && *variation == 0.2)
    }),
    (
        "wrinkles",
        "WorldBegin Texture \"t\" \"float\" \"wrinkled\" \"integer octaves\" 3",
        |d| matches!(float_texture(d), FloatTextureKind::Wrinkled { octaves: 3, omega } if *omega == 0.5),
    ),
    (
        "image maps come first",
        "WorldBegin Texture \"s\" \"float\" \"scale\" \"texture tex\" \"i\" \"float scale\" 2 Texture \"i\" \"float\" \"imagemap\" \"string filename\" \"a.exr\"",
        |d| {
            matches!(&d.float_textures[1].kind, FloatTextureKind::Basic(BasicTexture::Scale { tex, scale })
            if tex.value == FloatParam::Texture(FloatTextureRef(0)) && value(scale) == 2.0)
        },
    ),
    (
        "a name for both classes",
        "WorldBegin Texture \"t\" \"float\" \"windy\" Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [.5 .5 .5]",
        |d| d.float_textures.len() == 1 && d.spectrum_textures.len() == 1,
    ),
    (
        "texture space",
        "WorldBegin Translate 1 2 3 Texture \"t\" \"float\" \"checkerboard\" \"integer dimension\" 3",
        |d| near(d.float_textures[0].world_from_texture.point64([0.0; 3]), [1.0, 2.0, 3.0]),
    ),
    // Lights.
    ("white", "WorldBegin LightSource \"point\"", |d| {
        matches!(light(d), LightKind::Point { intensity, from, power: None }
            if intensity.value == SpectrumDesc::Rgb([1.0; 3], ColorSpaceName::Srgb) && *from == [0.0; 3])
    }),
    ("spot", "WorldBegin LightSource \"spot\" \"float power\" 100 \"float coneangle\" 20", |d| {
        matches!(light(d), LightKind::Spot { cone_angle, cone_delta_angle, to, power: Some(p), .. }
            if **cone_angle == 20.0 && **cone_delta_angle == 5.0 && *to == [0.0, 0.0, 1.0] && **p == 100.0)
    }),
    (
        "sun",
        "WorldBegin LightSource \"distant\" \"point3 from\" [0 1 0] \"point3 to\" [0 0 0] \"float illuminance\" 5 \"float scale\" 3",
        |d| {
            matches!(light(d), LightKind::Distant { from, illuminance: Some(e), .. } if from[1] == 1.0 && **e == 5.0)
                && *d.lights[0].scale == 3.0
        },
    ),
    (
        "sky",
        "WorldBegin LightSource \"infinite\" \"string filename\" \"a.exr\" \"point3 portal\" [0 0 0 1 0 0 1 1 0 0 1 0]",
        |d| {
            matches!(light(d), LightKind::Infinite { radiance: None, file: Some(f), portal: Some(p), illuminance: None }
            if f.name == "a.exr" && p[2] == [1.0, 1.0, 0.0])
        },
    ),
    (
        "projector",
        "WorldBegin LightSource \"projection\" \"string filename\" \"a.exr\"",
        |d| matches!(light(d), LightKind::Projection { fov, .. } if **fov == 90.0),
    ),
    ("goniometric", "WorldBegin LightSource \"goniometric\" \"rgb I\" [2 2 2]", |d| {
        matches!(light(d), LightKind::Goniometric { file: None, .. })
    }),
    (
        "area light",
        "WorldBegin AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [5 5 5] \"bool twosided\" true Shape \"sphere\" AttributeEnd Shape \"sphere\"",
        |d| {
            d.shapes[0].area_light.as_ref().is_some_and(|l| l.two_sided && *l.scale == 1.0 && l.radiance.is_some())
                && d.shapes[1].area_light.is_none()
        },
    ),
    ("light attributes", "WorldBegin Attribute \"light\" \"float scale\" 4 LightSource \"point\"", |d| {
        *d.lights[0].scale == 4.0
    }),
    // Media.
    (
        "boundaries",
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" WorldBegin MediumInterface \"m\" \"\" Shape \"sphere\" MediumInterface \"m\" \"m\" Shape \"sphere\"",
        |d| d.shapes[0].is_medium_boundary && !d.shapes[1].is_medium_boundary,
    ),
];

#[test]
fn small_texts_mean_what_pbrt_means() {
    assert!(FACTS.len() >= 60);
    let assets = assets();
    let mut failures = String::new();
    for (name, text, fact) in FACTS {
        let text = if text.contains("WorldBegin") { text.to_string() } else { format!("{text} WorldBegin") };
        let parsed = read_pbrt("fact", text.as_bytes().into(), &assets);
        let said: String = parsed.diagnostics.iter().map(|d| d.render(&parsed.sources)).collect();
        if parsed.diagnostics.has_errors() || !fact(&parsed.desc) {
            failures += &format!("{name}: {text}\n{said}\n");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// (text, kinds that are not honoured): each kind once, in the order in which they come up.
#[test]
fn what_is_not_rendered_is_said_once_per_kind() {
    let fog = "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" ";
    let cases: &[(String, &[&str])] = &[
        (format!("{fog}WorldBegin Shape \"sphere\""), &[]),
        (format!("{fog}WorldBegin MediumInterface \"m\" \"\" Shape \"sphere\" Shape \"sphere\""), &["medium: vacuum"]),
        (format!("{fog}MediumInterface \"\" \"m\" Camera \"perspective\" WorldBegin"), &["medium: vacuum"]),
        // pbrt-v4's "path" leaves media out too.
        (format!("Integrator \"path\" {fog}WorldBegin MediumInterface \"m\" \"\" Shape \"sphere\""), &[]),
        ("Integrator \"mlt\" WorldBegin".into(), &["integrator mlt: path"]),
        ("Integrator \"bdpt\" WorldBegin".into(), &[]),
        ("Integrator \"sppm\" \"float radius\" 0.1 WorldBegin".into(), &[]),
        ("Integrator \"lightpath\" WorldBegin".into(), &[]),
        ("Integrator \"volpath\" WorldBegin".into(), &[]),
        (
            "WorldBegin Material \"hair\" Material \"hair\" Material \"subsurface\"".into(),
            &["hair: diffuse", "subsurface: diffuse"],
        ),
    ];
    for (text, kinds) in cases {
        let parsed = read_pbrt("kinds", text.as_bytes().into(), &assets());
        assert_eq!(parsed.diagnostics.not_honoured().collect::<Vec<_>>(), *kinds, "{text}");
        assert_eq!(parsed.diagnostics.error_count(), 0, "{text}");
    }
}

#[test]
fn the_files_that_determine_the_scene_are_listed() {
    let text = "WorldBegin Include \"ball.pbrt\" Include \"ball.pbrt\" Shape \"plymesh\" \"string filename\" \"m.ply\"";
    let parsed = read_pbrt("files", text.as_bytes().into(), &assets());
    let names: Vec<&str> = parsed.assets_read.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, ["ball.pbrt", "m.ply"]);
    assert!(parsed.assets_read.iter().all(|a| a.hash != 0 && a.length > 0));
    assert_eq!(parsed.sources.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["files", "ball.pbrt"]);
}

#[test]
fn formats_are_found_by_name() {
    for name in ["a.pbrt", "A.PBRT", "a.pbrt.gz", "-", "a.txt"] {
        assert_eq!(irradiant_formats::format_of(std::path::Path::new(name)).name(), "pbrt-v4");
    }
}
