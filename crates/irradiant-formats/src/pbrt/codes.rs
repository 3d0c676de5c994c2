//! Every code that this reader can say, explained, with a smallest example.

/// What stands behind a code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// As in messages: `E` for errors, `W` for warnings, `N` for notes.
    pub code: &'static str,
    /// What it means, and what to do.
    pub explanation: &'static str,
    /// A smallest text that gives it (below `WorldBegin` where that matters).
    pub example: &'static str,
}

/// The entry of a code.
pub fn explain(code: &str) -> Option<&'static Code> {
    CODES.iter().find(|c| c.code.eq_ignore_ascii_case(code))
}

const fn code(code: &'static str, explanation: &'static str, example: &'static str) -> Code {
    Code { code, explanation, example }
}

/// All codes of the pbrt-v4 reader, sorted.
pub const CODES: &[Code] = &[
    code("E0001", "A string has no closing quote on its line. Strings cannot span lines.", "Shape \"sphere"),
    code(
        "E0002",
        "A backslash in a string is followed by a character that has no meaning there. Use / in paths, or \\\\.",
        r#"Include "geometry\killeroo.pbrt""#,
    ),
    code("E0003", "A string in quotes has to stand here.", "Shape sphere"),
    code("E0004", "A number has to stand here.", "Translate 1 2 up"),
    code("E0005", "The file ends in the middle of a statement.", "Translate 1 2"),
    code(
        "E0006",
        "No such directive. Directives are unquoted words that begin with a capital letter.",
        "Shpae \"sphere\"",
    ),
    code(
        "E0007",
        "A parameter has no value, or a list of values is not closed with ].",
        "Shape \"sphere\" \"float radius\" [ 1",
    ),
    code("E0008", "A parameter is declared by its type and its name in one string.", "Shape \"sphere\" \"radius\" 1"),
    code(
        "E0009",
        "No such parameter type. Types: bool, float, integer, point2, vector2, point3, vector3, normal, rgb, spectrum, \
         blackbody, string, texture.",
        "Shape \"sphere\" \"flaot radius\" 1",
    ),
    code("E0010", "A value is of another kind than its parameter's type.", "Shape \"sphere\" \"float radius\" \"1\""),
    code("E0011", "Infinities and NaN cannot be written in a scene.", "Shape \"sphere\" \"float radius\" nan"),
    code(
        "E0012",
        "The value of an integer parameter is a whole number without a decimal point, of at most 32 bits.",
        "Sampler \"zsobol\" \"integer pixelsamples\" 1.5",
    ),
    code(
        "E0013",
        "Transform and ConcatTransform take 16 numbers in brackets, column after column.",
        "Transform 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1",
    ),
    code(
        "E0101",
        "Camera, film and settings stand before WorldBegin; shapes, lights and materials after it.",
        "WorldBegin Camera \"perspective\"",
    ),
    code("E0102", "An AttributeEnd or ObjectEnd closes nothing, or something else.", "WorldBegin AttributeEnd"),
    code("E0103", "An AttributeBegin or ObjectBegin is never closed.", "WorldBegin AttributeBegin"),
    code("E0104", "The scene has no WorldBegin.", "Camera \"perspective\""),
    code(
        "E0105",
        "Objects cannot be nested: neither ObjectBegin nor ObjectInstance may stand inside of an object.",
        "WorldBegin ObjectBegin \"a\" ObjectInstance \"b\" ObjectEnd",
    ),
    code(
        "E0106",
        "A texture, named material, named medium or object is defined twice. Its uses would be ambiguous.",
        "WorldBegin Texture \"t\" \"float\" \"windy\" Texture \"t\" \"float\" \"windy\"",
    ),
    code(
        "E0107",
        "A transform flattens space or overflows, so that it has no inverse: a scale of 0, a rotation about 0 0 0, a \
         LookAt along its own \"up\".",
        "Scale 1 0 1",
    ),
    code(
        "E0109",
        "A file includes itself, or a scene is nested too deeply or too large.",
        "Include \"this-file.pbrt\"",
    ),
    code("E0110", "No such option, or a value that it cannot have.", "Option \"disablepixeljitter\" 1"),
    code("E0111", "Colour spaces: srgb, dci-p3, rec2020, aces2065-1.", "ColorSpace \"sRGB2\""),
    code(
        "E0112",
        "Attribute sets parameters for all later things of a kind: shape, light, material, medium or texture.",
        "WorldBegin Attribute \"camera\" \"float fov\" 30",
    ),
    code("E0113", "A scene has one WorldBegin.", "WorldBegin WorldBegin"),
    code(
        "E0114",
        "Shapes with an animated transform cannot be area lights (nor in pbrt-v4).",
        "WorldBegin AreaLightSource \"diffuse\" ActiveTransform EndTime Translate 1 0 0 Shape \"sphere\"",
    ),
    code("E0201", "No such shape.", "WorldBegin Shape \"spere\""),
    code("E0202", "No such material.", "WorldBegin Material \"difuse\""),
    code(
        "E0203",
        "No such texture, or one that makes only the other of \"float\" and \"spectrum\".",
        "WorldBegin Texture \"t\" \"float\" \"marble\"",
    ),
    code("E0204", "No such light.", "WorldBegin LightSource \"sun\""),
    code("E0205", "Area lights are \"diffuse\".", "WorldBegin AreaLightSource \"difuse\""),
    code("E0206", "No such camera.", "Camera \"perspectiv\""),
    code("E0207", "No such film.", "Film \"rbg\""),
    code("E0208", "No such sampler.", "Sampler \"zsobl\""),
    code("E0209", "No such integrator, or one that draws no scene.", "Integrator \"pathh\""),
    code("E0210", "No such pixel filter.", "PixelFilter \"gausian\""),
    code("E0211", "No such accelerator.", "Accelerator \"bhv\""),
    code("E0212", "Textures are of class \"float\" or \"spectrum\".", "WorldBegin Texture \"t\" \"rgb\" \"constant\""),
    code("E0213", "No such sensor.", "Film \"rgb\" \"string sensor\" \"canon\""),
    code("E0214", "No such medium.", "MakeNamedMedium \"m\" \"string type\" \"fog\""),
    code(
        "E0220",
        "A parameter takes one of a few words, and this is none of them.",
        "WorldBegin Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"string type\" \"round\"",
    ),
    code(
        "E0301",
        "Nothing asks for this parameter. A misspelt parameter would change the picture without a word, so it is an \
         error.",
        "WorldBegin Shape \"sphere\" \"float raduis\" 1",
    ),
    code("E0302", "The parameter exists, with another type.", "WorldBegin Shape \"sphere\" \"integer radius\" 1"),
    code("E0303", "A parameter has too few or too many values.", "WorldBegin Shape \"sphere\" \"float radius\" [1 2]"),
    code("E0304", "Something cannot be made without this parameter.", "WorldBegin Shape \"plymesh\""),
    code(
        "E0305",
        "Two parameters contradict each other.",
        "WorldBegin Material \"conductor\" \"rgb reflectance\" [.5 .5 .5] \"spectrum k\" \"metal-Ag-k\"",
    ),
    code(
        "E0306",
        "Components of a colour are 0 or more; of a reflectance they are at most 1 as well.",
        "WorldBegin Material \"diffuse\" \"rgb reflectance\" [0 0 9]",
    ),
    code(
        "E0307",
        "A spectrum is a list of pairs of wavelength (nm) and value with ascending wavelengths.",
        "WorldBegin LightSource \"point\" \"spectrum I\" [500 1 400 2]",
    ),
    code(
        "E0308",
        "No built-in spectrum of this name, or a spectrum file that holds something else than numbers.",
        "WorldBegin Material \"conductor\" \"spectrum eta\" \"metal-Xx-eta\"",
    ),
    code("E0309", "A value is outside of what makes sense.", "Camera \"perspective\" \"float shutterclose\" 0"),
    code("E0401", "No named material of this name.", "WorldBegin NamedMaterial \"wall\" Shape \"sphere\""),
    code("E0402", "No texture of this name.", "WorldBegin Material \"diffuse\" \"texture reflectance\" \"wood\""),
    code(
        "E0403",
        "The texture is of the other class: numbers are needed where it gives spectra, or the other way round.",
        "WorldBegin Texture \"t\" \"float\" \"windy\" Material \"diffuse\" \"texture reflectance\" \"t\"",
    ),
    code(
        "E0404",
        "A texture or material uses one that stands below it.",
        "WorldBegin Texture \"a\" \"float\" \"scale\" \"texture tex\" \"b\" Texture \"b\" \"float\" \"windy\"",
    ),
    code("E0405", "No object of this name.", "WorldBegin ObjectInstance \"tree\""),
    code("E0406", "No medium of this name.", "WorldBegin MediumInterface \"fog\" \"\" Shape \"sphere\""),
    code(
        "E1001",
        "A file that the scene names does not exist. Names are relative to the folder of the scene's main file.",
        "WorldBegin Shape \"plymesh\" \"string filename\" \"no-such.ply\"",
    ),
    code("E1002", "A file cannot be read, is not a whole gzip file, or is too large.", "Include \"/\""),
    code(
        "E1003",
        "A mesh file is damaged or holds no mesh.",
        "WorldBegin Shape \"plymesh\" \"string filename\" \"not-a.ply\"",
    ),
    code(
        "E1004",
        "A face names a vertex that does not exist. Indices count from 0.",
        "WorldBegin Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [1 2 3]",
    ),
    code(
        "E1005",
        "Lists of a mesh or curve do not fit together: one uv and one N for each P, three indices for each triangle.",
        "WorldBegin Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1]",
    ),
    code(
        "E1006",
        "A mesh cannot be subdivided: at most two faces may meet at an edge, wound alike.",
        "WorldBegin Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 1]",
    ),
    code(
        "E1007",
        "A lens file is lines of four numbers: curvature radius, thickness, index of refraction, aperture diameter (mm).",
        "Camera \"realistic\" \"string lensfile\" \"wrong.dat\"",
    ),
    code(
        "E1008",
        "A curve of this degree cannot have this number of control points.",
        "WorldBegin Shape \"curve\" \"point3 P\" [0 0 0 1 0 0]",
    ),
    code(
        "E1009",
        "A subdivided mesh would be too large.",
        "WorldBegin Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2] \"integer levels\" 30",
    ),
    code(
        "E1010",
        "The scene, or a file that it includes, is a picture, a mesh, XML, JSON or otherwise no pbrt text.",
        "Include \"not-a.pbrt\"",
    ),
    code("E1101", "A directive of pbrt-v3.", "WorldBegin WorldEnd"),
    code("E1102", "A name of pbrt-v3.", "WorldBegin Material \"matte\""),
    code(
        "E1103",
        "A parameter type or form of pbrt-v3.",
        "WorldBegin Material \"diffuse\" \"color reflectance\" [1 1 1]",
    ),
    code(
        "N0114",
        "A type is understood although pbrt-v4 does not know it under this name.",
        "WorldBegin LightSource \"point\" \"point from\" [0 0 0]",
    ),
    code(
        "N0115",
        "Truth values are understood in quotes, although pbrt-v4 wants them without.",
        "WorldBegin AreaLightSource \"diffuse\" \"bool twosided\" \"true\"",
    ),
    code("N0116", "An old name of \"interface\".", "WorldBegin Material \"none\""),
    code("N0503", "Polygons of a mesh file were cut into triangles, as fans.", "(a PLY file with pentagons)"),
    code(
        "N0504",
        "Points and lines among the faces of a mesh file were left out.",
        "(a PLY file with faces of two corners)",
    ),
    code(
        "N0505",
        "Normals or uvs of a mesh file were NaN or infinite, and were set to 0.",
        "(a PLY file with nan nan nan)",
    ),
    code(
        "N0601",
        "The file is written for pbrt-v3: pbrt --upgrade converts most of it.",
        "WorldBegin Material \"matte\"",
    ),
    code(
        "W0101",
        "Participating media are not rendered yet: light passes through them as through vacuum.",
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" MediumInterface \"m\" \"\" WorldBegin Shape \"sphere\"",
    ),
    code(
        "W0102",
        "This integrator is not here yet; path tracing converges to the same picture, with more noise where that \
         integrator is good.",
        "Integrator \"mlt\"",
    ),
    code("W0103", "Subsurface scattering is rendered as a diffuse surface.", "WorldBegin Material \"subsurface\""),
    code("W0104", "Hair is rendered as a diffuse surface.", "WorldBegin Material \"hair\""),
    code(
        "W0105",
        "Measured reflectance is rendered as a diffuse surface.",
        "WorldBegin Material \"measured\" \"string filename\" \"paper.bsdf\"",
    ),
    code(
        "W0106",
        "Ptex textures are rendered as 0.5 everywhere.",
        "WorldBegin Texture \"t\" \"spectrum\" \"ptex\" \"string filename\" \"a.ptx\"",
    ),
    code(
        "W0107",
        "Displacement of meshes is not rendered.",
        "WorldBegin Shape \"plymesh\" \"string filename\" \"a.ply\" \"texture displacement\" \"t\"",
    ),
    code(
        "W0108",
        "Lights and textures cannot move; they stay where they are at the start (as in pbrt-v4).",
        "WorldBegin ActiveTransform EndTime Translate 1 0 0 LightSource \"point\"",
    ),
    code(
        "W0109",
        "Shapes inside of objects do not emit (as in pbrt-v4).",
        "WorldBegin ObjectBegin \"o\" AreaLightSource \"diffuse\" Shape \"sphere\" ObjectEnd",
    ),
    code(
        "W0110",
        "A shape of material \"interface\" is no surface and cannot emit (as in pbrt-v4).",
        "WorldBegin Material \"interface\" AreaLightSource \"diffuse\" Shape \"sphere\"",
    ),
    code("W0111", "No coordinate system of this name; the transform stays as it is.", "CoordSysTransform \"camrea\""),
    code(
        "W0112",
        "A parameter is given twice; the last one counts.",
        "WorldBegin Shape \"sphere\" \"float radius\" 1 \"float radius\" 2",
    ),
    code(
        "W0113",
        "TransformBegin and TransformEnd are deprecated names of AttributeBegin and AttributeEnd.",
        "WorldBegin TransformBegin TransformEnd",
    ),
    code(
        "W0115",
        "Both forms of cropping are given; \"cropwindow\" counts.",
        "Film \"rgb\" \"integer pixelbounds\" [0 1 0 1] \"float cropwindow\" [0 1 0 1]",
    ),
    code(
        "W0116",
        "Normals have no effect on flat and cylindrical curves.",
        "WorldBegin Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"normal N\" [0 0 1 0 0 1]",
    ),
];

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_scene::assets::MemoryAssets;
    use std::collections::BTreeSet;
    use std::path::Path;

    fn codes_in(folder: &Path, out: &mut BTreeSet<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                codes_in(&path, out);
            } else if path.file_name().is_some_and(|n| n != "codes.rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                for word in text.split('"').filter(|w| w.len() == 5 && w.starts_with(['E', 'W', 'N'])) {
                    if word[1..].bytes().all(|b| b.is_ascii_digit()) {
                        out.insert(word.into());
                    }
                }
            }
        }
    }

    #[test]
    fn the_table_is_sorted_and_holds_exactly_the_codes_in_use() {
        let listed: Vec<&str> = CODES.iter().map(|c| c.code).collect();
        assert!(listed.windows(2).all(|w| w[0] < w[1]));
        let mut used = BTreeSet::new();
        codes_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut used);
        assert_eq!(listed.iter().map(|c| c.to_string()).collect::<BTreeSet<_>>(), used);
        assert_eq!(explain("e0301").unwrap().code, "E0301");
    }

    #[test]
    fn every_example_gives_its_code() {
        for c in CODES.iter().filter(|c| !c.example.starts_with('(')) {
            let assets = MemoryAssets::default()
                .with("this-file.pbrt", c.example.as_bytes())
                .with("not-a.ply", &b"text"[..])
                .with("wrong.dat", &b"1 2 3"[..])
                .with("not-a.pbrt", &b"<scene version=\"3.0.0\"/>"[..])
                .with("paper.bsdf", &b""[..])
                .with("a.ptx", &b""[..])
                .with("a.ply", crate::mesh::ply::tests::TRIANGLE.as_bytes());
            if c.code == "E1002" {
                continue;
            }
            let parsed = crate::read_pbrt("example", c.example.as_bytes().into(), &assets);
            let codes: Vec<&str> = parsed.diagnostics.iter().map(|d| d.code).collect();
            assert!(codes.contains(&c.code), "{}: {codes:?}", c.code);
            if c.code.starts_with('W') && c.example.contains("WorldBegin") {
                assert_eq!(parsed.diagnostics.error_count(), 0, "{}: {codes:?}", c.code);
            }
        }
    }
}
