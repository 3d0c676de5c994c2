//! Following paths asks for no memory: not for a sample, not for a hit, not for a batch. What a thread needs it has from its first work
//! unit on. Seen to fail: with a `Vec` made for each vertex of a batch.

use irradiant::core::film::FilmTile;
use irradiant::renderer::{RenderStats, WorkUnit};
use irradiant::{ColorMode, IntegratorChoice, Job, RenderSettings, load_text};

const HEAD: &str = "Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16\nSampler \"zsobol\" \"integer pixelsamples\" 256\nLookAt 0 1 -3.6  0 1 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n";
const FLOOR: &str = "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ -2 0 -2  2 0 -2  2 0 2  -2 0 2 ] \"point2 uv\" [ 0 0 1 0 1 1 0 1 ]\n";
/// Lamps of a rectangle and a ball, flat and curved surfaces, diffuse ones, metals, glass, a coat, a mix, an instance and textures.
const SCENES: [&str; 3] = [
    "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 9 8 6 ]\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ -1 2 -1  1 2 -1  1 2 1  -1 2 1 ]\nAttributeEnd\nMaterial \"diffuse\" \"rgb reflectance\" [ .7 .5 .3 ]\nFLOORTranslate 0 .5 0\nMaterial \"conductor\" \"float roughness\" [ .2 ]\nShape \"sphere\" \"float radius\" [ .5 ]\n",
    "LightSource \"infinite\" \"rgb L\" [ .4 .5 .7 ]\nLightSource \"distant\" \"point3 from\" [ 1 3 -1 ]\nTexture \"tiles\" \"spectrum\" \"checkerboard\" \"float uscale\" [ 8 ] \"float vscale\" [ 8 ]\nMaterial \"diffuse\" \"texture reflectance\" [ \"tiles\" ]\nFLOORTranslate 0 .5 0\nMaterial \"coateddiffuse\" \"float roughness\" [ .1 ] \"integer maxdepth\" [ 0 ]\nShape \"sphere\" \"float radius\" [ .5 ]\n",
    "AttributeBegin\nTranslate -1 1.5 0\nAreaLightSource \"diffuse\" \"rgb L\" [ 30 20 10 ]\nShape \"sphere\" \"float radius\" [ .2 ]\nAttributeEnd\nObjectBegin \"ball\"\nMaterial \"dielectric\" \"float eta\" [ 1.5 ]\nShape \"sphere\" \"float radius\" [ .4 ]\nObjectEnd\nMakeNamedMaterial \"a\" \"string type\" \"diffuse\"\nMakeNamedMaterial \"b\" \"string type\" \"conductor\"\nMaterial \"mix\" \"string materials\" [ \"a\" \"b\" ] \"float amount\" [ .5 ]\nFLOORTranslate 0 .5 0\nObjectInstance \"ball\"\n",
];

/// How often a thread asks for memory for the samples of its second unit.
fn allocations(job: &Job) -> (u64, RenderStats) {
    let integrator = job.integrator();
    let mut renderer = integrator.renderer(&job.scene);
    let mut tile = FilmTile::new(job.scene.bounds(), job.scene.new_film().channels_per_pixel());
    let mut unit = |samples, stats: &mut RenderStats| {
        renderer(&WorkUnit { bounds: job.scene.bounds(), samples }, &mut tile, stats);
    };
    unit(0..64, &mut RenderStats::default());
    let mut stats = RenderStats::default();
    let counted = allocation_counter::measure(|| unit(64..128, &mut stats));
    (counted.count_total, stats)
}

/// So many lamps that candidates are picked among them.
fn many_lamps() -> String {
    (0..20).map(|i| format!("LightSource \"point\" \"point3 from\" [ {i} 2 0 ]\n")).collect::<String>()
        + FLOOR
        + "Shape \"sphere\"\n"
}

#[test]
fn paths_ask_for_no_memory() {
    for scene in SCENES.map(|scene| scene.replace("FLOOR", FLOOR)).into_iter().chain([many_lamps()]) {
        let text = HEAD.to_owned() + &scene;
        let file = load_text("scene", &text, ".").unwrap_or_else(|e| panic!("{e}"));
        for color in [ColorMode::Rgb, ColorMode::Spectral] {
            for name in ["path", "sharedpath", "simplepath"] {
                let integrator = IntegratorChoice::named(name).unwrap_or_else(|e| panic!("{e}"));
                let settings = RenderSettings { color, integrator: Some(integrator), ..RenderSettings::default() };
                let job = Job::new(&file, &settings).unwrap_or_else(|e| panic!("{e}"));
                let (count, stats) = allocations(&job);
                assert!(stats.paths == 64 * 256 && stats.longest_path > 1, "nothing to count: {stats:?}");
                assert_eq!(count, 0, "{name} {color:?}\n{text}");
            }
        }
    }
}
