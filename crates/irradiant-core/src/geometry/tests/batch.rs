//! Batches of rays against the same rays one by one: exact, so no false alarms.

use super::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Checks in `uv`; counts how often it is asked.
#[derive(Default)]
struct Checks(AtomicUsize);

impl AlphaTextures for Checks {
    fn alpha(&self, _texture: FloatTextureRef, at: &TextureContext) -> f32 {
        self.0.fetch_add(1, Ordering::Relaxed);
        if ((at.uv.x * 8.0).floor() + (at.uv.y * 8.0).floor()) as i32 % 2 == 0 { 1.0 } else { 0.4 }
    }
}

/// Shapes of every kind, still, moving, cut out, and instanced, still and moving.
fn everything() -> Geometry {
    let t1 = trs(0.6, 0.5, -0.2, 100.0, [0.0, 0.3, 1.0], [0.9; 3]);
    let motion = MotionDesc { start: Transform::IDENTITY, end: t1, start_time: 0.0, end_time: 1.0 };
    let mut shapes: Vec<ShapeDesc> = zoo().into_iter().chain(curves()).map(|(_, s)| s).collect();
    shapes.push(shape(faceted_ball(24), trs(0.5, 0.5, 0.5, 10.0, [0.0, 1.0, 0.0], [0.8; 3])));
    for (i, s) in shapes.iter_mut().enumerate() {
        match i % 4 {
            1 => s.alpha = Some(Spanned::unplaced(FloatParam::Value(0.5))),
            2 => s.alpha = Some(Spanned::unplaced(FloatParam::Texture(FloatTextureRef(0)))),
            _ => {}
        }
        if i % 5 == 3 {
            s.world_from_shape = MotionDesc { start: s.world_from_shape.start, ..motion };
        }
    }
    let object = ObjectDesc { name: "all".into(), shapes: shapes.clone(), span: Span::NONE };
    let instances = (0..6)
        .map(|i| {
            let place = |angle| trs(i as f64 - 2.5, 2.0, 0.3 * i as f64, angle, [1.0, 0.2, 0.0], [0.5, 0.5, 0.6]);
            let still = MotionDesc::still(place(30.0 * i as f64));
            let world_from_object = if i % 2 == 0 { still } else { MotionDesc { start: place(0.0), ..motion } };
            InstanceDesc { object: ObjectRef(0), world_from_object, span: Span::NONE }
        })
        .collect();
    compile_desc(&SceneDesc { shapes, objects: vec![object], instances, ..Default::default() })
}

/// Rays of a small window of a camera; towards one light from there; and from anywhere to anywhere.
fn some_rays(g: &Geometry, n: usize, rng: &mut Rng) -> (Vec<Ray>, Vec<f32>) {
    let kind = rng.next_u32() % 4;
    let eye = point(rng, 6.0);
    let (centre, size) = (point(rng, 2.0), 0.3 * rng.next_f32());
    let mut rays: Vec<Ray> = (0..n)
        .map(|i| match kind {
            0 => ray_through(rng, 2.0),
            _ => Ray::new(eye, centre + point(rng, size).as_vec() - eye, if i % 3 == 0 { 0.5 } else { rng.next_f32() }),
        })
        .collect();
    if kind == 2 {
        let light = point(rng, 6.0);
        for ray in &mut rays {
            let t = g.intersect(ray, 10.0, &Checks::default()).map_or(1.0, |h| h.t);
            let p = ray.at(t);
            *ray = Ray::new(p, light - p, ray.time);
        }
    }
    let end = [f32::INFINITY, 1.0, 0.999][rng.next_u32() as usize % 3];
    let t_max = rays.iter().map(|_| if rng.next_u32().is_multiple_of(8) { rng.next_f32() } else { end }).collect();
    (rays, t_max)
}

#[test]
fn batches_meet_what_single_rays_meet() {
    let mut g = everything();
    let textures = Checks::default();
    for level in Level::available() {
        g.set_level(level);
        let (mut rng, mut kept) = (Rng::new(31), Box::new(RayBatch::NONE));
        let (mut hits, mut blocked, mut instanced) = (0, 0, 0);
        for i in 0..600 {
            let n = [0, 1, 3, 8, 16, 64, 65, 150][i % 8];
            let (rays, t_max) = some_rays(&g, n, &mut rng);
            let mut closest = vec![None; n];
            let mut occluded = vec![false; n];
            g.intersect_batch(&rays, &t_max, &textures, &mut closest);
            g.occluded_batch(&rays, &t_max, &textures, &mut occluded);
            // In memory that is kept, the same.
            kept.clear();
            rays.iter().zip(&t_max).for_each(|(ray, end)| kept.push(ray.o, ray.d, *end, ray.time));
            for scattered in [false, true] {
                let mut found = vec![None; n];
                g.intersect_rays(&mut kept, scattered, &textures, &mut found);
                assert_eq!(found, closest, "{level:?}, batch {i}");
            }
            g.occluded_rays(&mut kept, &textures);
            assert!((0..n).all(|k| kept.is_blocked(k) == occluded[k]), "{level:?}, batch {i}");
            for k in 0..n {
                let expected = g.intersect(&rays[k], t_max[k], &textures);
                assert_eq!(closest[k], expected, "{level:?}, batch {i}, ray {k}: {:?}", rays[k]);
                let bits = |h: Option<Hit>| h.map(|h| [h.t.to_bits(), h.u.to_bits(), h.v.to_bits()]);
                assert_eq!(bits(closest[k]), bits(expected), "{level:?}, batch {i}, ray {k}: {:?}", rays[k]);
                let expected = g.occluded(&rays[k], t_max[k], &textures);
                assert_eq!(occluded[k], expected, "{level:?}, batch {i}, ray {k}: {:?}", rays[k]);
                hits += usize::from(closest[k].is_some());
                blocked += usize::from(occluded[k]);
                instanced += usize::from(closest[k].is_some_and(|h| h.instances[0] != NO_INSTANCE));
            }
        }
        assert!(hits > 5000 && blocked > 5000 && instanced > 500, "{level:?}: {hits} {blocked} {instanced}");
    }
    assert!(textures.0.into_inner() > 1000);
}
