//! The lesson's scenes: the files of `scenes/`, and text for small ones whose numbers vary.

/// A quadrilateral as two triangles.
pub fn quad(p: [[f32; 3]; 4]) -> String {
    let list = p.iter().flatten().map(f32::to_string).collect::<Vec<_>>().join(" ");
    format!("Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 2 3 0 ] \"point3 P\" [ {list} ]\n")
}

/// A film of `size` by `size` pixels whose variances are exact: independent samples, box filter.
pub fn film(size: u32) -> String {
    film_of(size, size)
}

/// As [`film`], of any shape.
pub fn film_of(width: u32, height: u32) -> String {
    format!(
        "Film \"rgb\" \"integer xresolution\" {width} \"integer yresolution\" {height}\nPixelFilter \"box\"\nSampler \"independent\"\n"
    )
}

/// A film whose samples are stratified.
pub fn smooth_film(size: u32) -> String {
    film(size).replace("\"independent\"", "\"zsobol\"")
}

/// A closed sphere that emits 1 and reflects `rho` of what falls on it, seen from its centre.
pub fn furnace(size: u32, rho: f64) -> String {
    film(size)
        + &format!(
            "Camera \"perspective\" \"float fov\" 60\nWorldBegin\nReverseOrientation\nMaterial \"diffuse\" \"spectrum reflectance\" [ 300 {rho} 900 {rho} ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ]\nShape \"sphere\" \"float radius\" 3\n"
        )
}

/// A pixel inside a cube of walls that emit 1 and reflect `rho`, with a ball of the same; its numbers are stratified.
pub fn furnace_room(rho: f64) -> String {
    let mut text = smooth_film(1)
        + "LookAt -0.5 0.3 -0.8  0.4 -0.2 0.5  0 1 0\nCamera \"perspective\" \"float fov\" 60\nWorldBegin\n"
        + &format!("Material \"diffuse\" \"spectrum reflectance\" [ 300 {rho} 900 {rho} ]\n")
        + "AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ] \"bool twosided\" true\n";
    (0..6).for_each(|side| text += &quad(side_of_cube(side)));
    text + "Translate 0.3 -0.5 0.2\nShape \"sphere\" \"float radius\" 0.4\n"
}

/// Corners of a side of the cube from -1 to 1: x = -1, x = 1, y = -1, and so on.
fn side_of_cube(i: usize) -> [[f32; 3]; 4] {
    let (axis, side) = (i / 2, if i.is_multiple_of(2) { -1.0 } else { 1.0 });
    let corner = |u: f32, v: f32| {
        let mut p = [0.0; 3];
        (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, u, v);
        p
    };
    [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]
}

/// Things inside a closed emitter of radius 4 and albedo `rho`, seen from inside it.
pub fn furnace_with(size: u32, rho: f64, things: &str) -> String {
    film(size)
        + "LookAt 0 0 -3  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 35\nWorldBegin\nAttributeBegin\nReverseOrientation\n"
        + &format!("Material \"diffuse\" \"spectrum reflectance\" [ 300 {rho} 900 {rho} ]\n")
        + "AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ]\nShape \"sphere\" \"float radius\" 4\nAttributeEnd\n"
        + things
}

/// Things under light of 1 from everywhere, a unit sphere filling the view.
pub fn white_sky(size: u32, things: &str) -> String {
    film(size)
        + "LookAt 0 0 -3  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 45\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n"
        + things
}

/// A floor of albedo 0.5 seen near the origin from `height`, so that the value is E / (2 pi).
pub fn at_the_origin(size: u32, height: f64, light: &str) -> String {
    film(size)
        + &format!(
            "LookAt 0.0001 {height} 0.0001  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 0.01\nWorldBegin\n"
        )
        + light
        + "Material \"diffuse\" \"spectrum reflectance\" [ 300 0.5 900 0.5 ]\n"
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
}

/// A disk of radius `r` at height `h` over the origin that emits `l` both ways.
pub fn disk_light(r: f64, h: f64, l: f64) -> String {
    format!(
        "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ {l} {l} {l} ] \"bool twosided\" true\nTranslate 0 {h} 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" {r}\nAttributeEnd\n"
    )
}

/// A closed box from -1 to 1 of six colours, a slanted lamp and a ball inside; diffuse throughout.
pub fn lit_box(size: u32) -> String {
    let walls = [[0.7, 0.3, 0.2], [0.2, 0.6, 0.3], [0.7, 0.7, 0.7], [0.5, 0.5, 0.6], [0.6, 0.6, 0.6], [0.7, 0.7, 0.7]];
    let mut text =
        film(size) + "LookAt 0 0 -0.95  0 -0.1 0  0 1 0\nCamera \"perspective\" \"float fov\" 70\nWorldBegin\n";
    for (i, [r, g, b]) in walls.into_iter().enumerate() {
        text += &format!("Material \"diffuse\" \"rgb reflectance\" [ {r} {g} {b} ]\n");
        text += &quad(side_of_cube(i));
    }
    text + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 3 2 4 ] \"bool twosided\" true\n"
        + &quad([[-0.6, 0.7, -0.5], [0.6, 0.7, -0.5], [0.6, 0.6, 0.6], [-0.6, 0.6, 0.6]])
        + "AttributeEnd\nMaterial \"diffuse\" \"rgb reflectance\" [ 0.4 0.5 0.8 ]\nTranslate 0.3 -0.6 0.3\nShape \"sphere\" \"float radius\" 0.4\n"
}

/// The Cornell box from measured data, with independent samples and the box filter.
pub fn cornell() -> String {
    CORNELL_BOX
        .replace("PixelFilter \"gaussian\"", "PixelFilter \"box\"")
        .replace("Sampler \"zsobol\"", "Sampler \"independent\"")
}

/// As the built-in scene has it.
pub const CORNELL_BOX: &str = include_str!("../../../scenes/cornell-box.pbrt");

/// A room with a mirror ball and a glass ball.
pub const TWO_BALLS: &str = include_str!("../../../scenes/two-balls.pbrt");

/// One of each.
pub const EVERYTHING: &str = include_str!("../../../scenes/everything.pbrt");

/// A ball of each material of the lecture.
pub const MATERIALS: &str = include_str!("../../../scenes/materials.pbrt");

/// Plates and lamps for multiple importance sampling.
pub const VEACH_PLATES: &str = include_str!("../../../scenes/veach-plates.pbrt");

/// Glass and stone balls on green.
pub const GLASS_ON_GREEN: &str = include_str!("../../../scenes/glass-on-green.pbrt");

/// A metal ring and a glass ball under a small lamp.
pub const RING_AND_GLASS: &str = include_str!("../../../scenes/ring-and-glass.pbrt");
