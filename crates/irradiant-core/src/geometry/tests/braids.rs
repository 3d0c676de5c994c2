//! Scenes with instances that are opened, against each instance asked by itself: exact, so no false alarms.
//!
//! Seen to fail when broken: parts counted as primitives; boxes of parts left in the space of their group.

use super::*;
use crate::geometry::accel::{GroupLeaves, User, to_tree};

/// Crumbs around and in two halls in the same place and one that moves.
fn halls() -> (Geometry, usize) {
    let mut hall = shape(faceted_ball(24), trs(0.0, 0.0, 0.0, 30.0, [0.0, 1.0, 0.3], [2.0, 2.0, 1.6]));
    let cut = ShapeDesc { alpha: Some(Spanned::unplaced(FloatParam::Value(0.5))), ..hall.clone() };
    hall.world_from_shape = MotionDesc::still(trs(0.0, 0.2, 0.0, 10.0, [1.0, 1.0, 0.3], [1.2; 3]));
    let object = |name: &str, shapes| ObjectDesc { name: name.into(), shapes, span: Span::NONE };
    let objects = vec![
        object("hall", vec![hall, cut]),
        object("crumb", vec![shape(cube(), trs(0.0, 0.0, 0.0, 0.0, [1.0, 0.0, 0.0], [0.1; 3]))]),
    ];
    let mut rng = Rng::new(8);
    let mut instances: Vec<InstanceDesc> = (0..40)
        .map(|_| {
            let p = point(&mut rng, 1.5);
            let at = trs(p.x.into(), p.y.into(), p.z.into(), 0.0, [1.0, 0.0, 0.0], [1.0; 3]);
            InstanceDesc { object: ObjectRef(1), world_from_object: MotionDesc::still(at), span: Span::NONE }
        })
        .collect();
    let end = trs(0.4, 0.0, 0.0, 10.0, [0.0, 1.0, 0.0], [1.0; 3]);
    let moving = MotionDesc { start: Transform::IDENTITY, end, start_time: 0.0, end_time: 1.0 };
    for (place, motion) in [(3, MotionDesc::still(end)), (4, MotionDesc::still(end)), (20, moving)] {
        instances.insert(place, InstanceDesc { object: ObjectRef(0), world_from_object: motion, span: Span::NONE });
    }
    let n = instances.len();
    (compile_desc(&SceneDesc { objects, instances, ..Default::default() }), n)
}

#[test]
fn opened_instances_meet_what_they_meet_by_themselves() {
    let (mut g, n_instances) = halls();
    assert_eq!(g.n_primitives().1, n_instances);
    let parts_of = |i: u32| {
        let is_part = |u: &&User| matches!(u, User::Instance { instance, .. } if *instance == i);
        g.groups[0].users.iter().filter(is_part).count()
    };
    assert!(parts_of(3) > 4 && parts_of(4) > 4 && parts_of(0) == 1 && parts_of(20) == 1);
    for level in Level::available() {
        g.set_level(level);
        let mut rng = Rng::new(3);
        let mut hits = 0;
        for _ in 0..5000 {
            let ray = ray_through(&mut rng, 2.0);
            let t_max = if rng.next_u32().is_multiple_of(4) { rng.next_f32() } else { f32::INFINITY };
            let mut expected: Option<Hit> = None;
            for (i, instance) in g.shapes.instances.iter().enumerate() {
                let group = &g.groups[instance.group as usize];
                let leaves = GroupLeaves { geometry: &g, group, alpha: &NoAlphaTextures };
                let local = instance.ray_to_group(&to_tree(&ray, t_max));
                let hit = group.tree.intersect(level, &local, &leaves).map(hit_of);
                if let Some(hit) = hit.filter(|h| expected.is_none_or(|e| h.t < e.t)) {
                    expected = Some(Hit { instances: [i as u32, NO_INSTANCE], ..hit });
                }
            }
            assert_eq!(g.intersect(&ray, t_max, &NoAlphaTextures), expected, "{level:?}: {ray:?}");
            assert_eq!(g.occluded(&ray, t_max, &NoAlphaTextures), expected.is_some(), "{level:?}: {ray:?}");
            hits += usize::from(expected.is_some_and(|h| [3, 4].contains(&h.instances[0])));
        }
        assert!(hits > 500, "{level:?}: {hits}");
    }
}
