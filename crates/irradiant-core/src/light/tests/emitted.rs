//! Claims of all lights about the rays that leave them.

use super::*;

/// Every kind, with what it shines on: a small facing square whose irradiance both ways must give.
fn every_light() -> Vec<(&'static str, Light)> {
    let mut lights = vec![
        ("point", one(point(None))),
        ("spot", one(spot())),
        ("goniometric", one(goniometric(None))),
        ("projection", one(projection(None))),
        (
            "distant",
            one(describe(LightKind::Distant {
                radiance: said(WHITE),
                from: [0.0, 0.5, 3.0],
                to: [0.0; 3],
                illuminance: None,
            })),
        ),
        ("sphere", one_area(sphere([0.0, 0.0, 3.0], 1.0), area(Some(WHITE), None, false, None), None)),
        ("disk", one_area(disk(2.0, 1.5, true), area(Some(WHITE), None, true, None), None)),
        ("slide on a disk", one_area(disk(2.0, 1.5, true), area(None, Some("slide"), false, None), None)),
        (
            "half there",
            one_area(disk(2.0, 1.5, true), area(Some(WHITE), None, false, None), Some(FloatParam::Value(0.5))),
        ),
        ("unseen", one_area(disk(2.0, 1.5, true), area(Some(WHITE), None, false, None), Some(FloatParam::Value(0.0)))),
        ("sky", one(infinite(Some(WHITE), None, None))),
        ("image of a sky", one(infinite(None, Some("sky"), None))),
        ("portal", one(infinite(None, Some("sky"), Some(PORTAL)))),
    ];
    lights.push(("rectangle", rectangle(false).remove(0)));
    lights
}

/// The rays that a light emits bring to a square what light sampling finds at its points: emission and incidence agree, in
/// density, radiance, sides and opacity. Biases of 6 % would be seen.
#[test]
fn emitted_rays_bring_what_light_samples_find() {
    let white = Wavelengths::rgb();
    for (i, (name, light)) in every_light().into_iter().enumerate() {
        // A square about a point in reach of all lights, facing up but slanted.
        let (center, n) = match name {
            "spot" => (Point3::new(0.2, 0.3, 0.6), Vec3::new(0.0, -1.0, -1.0)),
            "projection" => (Point3::new(0.1, 0.2, 1.0), Vec3::new(0.1, 0.2, -1.0)),
            _ => (Point3::new(0.2, 0.3, -0.4), Vec3::new(0.1, 0.2, 1.0)),
        };
        let n = n.normalize();
        let frame = Frame::from_z(n);
        let half = if name == "spot" { 0.5 } else { 1.6 };
        let mut rng = Rng::new(300 + i as u64);
        // Power that arrives on the side of n.
        let incident = Mean::of(100_000, || {
            let p = center
                + frame.x * (half * (2.0 * rng.next_f32() - 1.0))
                + frame.y * (half * (2.0 * rng.next_f32() - 1.0));
            let here = at(p.x, p.y, p.z, n);
            light.sample(&here, u2(&mut rng), &white, SampleMode::Complete).map_or(0.0, |s| {
                let cos = f64::from(s.wi.dot(n).max(0.0));
                rgb(s.radiance)[1] * cos / f64::from(s.pdf) * f64::from(4.0 * half * half)
            })
        });
        let emitted = Mean::of(300_000, || {
            let Some(e) = light.emit(u2(&mut rng), u2(&mut rng), &white, 0.0) else { return 0.0 };
            let (o, d) = (e.ray.o - center, e.ray.d);
            let t = -o.dot(n) / d.dot(n);
            let hit = o + d * t;
            let reaches = d.dot(n) < 0.0 && t > 0.0 && hit.dot(frame.x).abs() < half && hit.dot(frame.y).abs() < half;
            let cos = if e.normal == Normal3::ZERO { 1.0 } else { e.normal.dot(d).abs() };
            if reaches { rgb(e.radiance)[1] * f64::from(cos / (e.pdf_position * e.pdf_direction)) } else { 0.0 }
        });
        for mean in [&incident, &emitted] {
            assert!(mean.detectable_bias(4.9) < 0.06, "{name}: {}", mean.detectable_bias(4.9));
        }
        // Slides and portals of few pixels look up one pixel and draw by another at borders, less than 1 % of the time.
        let se = incident.standard_error().hypot(emitted.standard_error());
        let off = (incident.mean() - emitted.mean()).abs();
        assert!(off < 4.9 * se + 0.004 * incident.mean(), "{name}: {} {}", incident.mean(), emitted.mean());
    }
}

/// Densities of emitted directions integrate to one over the sphere.
#[test]
fn densities_of_emitted_directions_integrate_to_one() {
    for (name, light) in every_light() {
        // A point of the surface, where there is one.
        let hit = LightHit { p: Point3::new(0.1, 0.0, 2.0), n: (-Vec3::Z).as_normal(), uv: Point2::new(0.4, 0.6) };
        let integral = integrate_sphere(|d| f64::from(light.pdf_emit(&hit, dir(d)).1), 1e-3);
        let expected = if name == "distant" { 0.0 } else { 1.0 };
        // Images have steps that quadrature sees only so well.
        assert!((integral - expected).abs() < 0.02, "{name}: {integral}");
    }
}

/// What [`Light::emit`] says of a ray and what [`Light::pdf_emit`] says afterwards are the same, for the lights whose
/// power test does not ask (the others' does).
#[test]
fn rays_have_the_density_they_were_drawn_with() {
    let white = Wavelengths::rgb();
    for (i, (name, light)) in every_light().into_iter().enumerate() {
        let mut rng = Rng::new(900 + i as u64);
        let (mut n, mut differ) = (0, 0);
        for _ in 0..2000 {
            let Some(e) = light.emit(u2(&mut rng), u2(&mut rng), &white, 0.0) else { continue };
            let hit = LightHit { p: e.ray.o, n: e.normal, uv: Point2::new(0.5, 0.5) };
            let (position, direction) = light.pdf_emit(&hit, e.ray.d);
            let same = |pdf: f32, claimed: f32| pdf == 0.0 && claimed == 1.0 || (pdf / claimed - 1.0).abs() < 5e-3;
            n += 1;
            differ += u32::from(!(same(position, e.pdf_position) && same(direction, e.pdf_direction)));
        }
        // Directions at borders of pixels may round into the next one.
        assert!(n > 1500 && differ * 20 < n, "{name}: {differ} of {n} differ");
    }
}

/// A sky: blue, a lamp of orange, some leaves, black below; or the same colour all over.
fn painted_sky(uneven: bool) -> RadianceImage {
    let pixel = |i: usize| match (uneven, i % 16, i / 16) {
        (false, ..) => [0.9, 0.3, 0.05],
        (_, 6..8, 6) => [60.0, 18.0, 0.5],
        (_, x, y) if y < 10 => [0.1 + 0.01 * x as f32, 0.3, 1.0 + 0.1 * y as f32],
        (_, x, 10..13) => [0.02 * x as f32, 0.2, 0.03],
        _ => [0.0; 3],
    };
    RadianceImage::from_pixels(16, 16, (0..256).map(pixel).collect(), ColorSpace::srgb(), ColorSpace::srgb())
}

/// [`Light::power`] is what the rays of [`Light::emit`] carry, wavelength by wavelength, of images whose colours differ: uplifting is
/// not linear, so the power of the mean colour would not be it (by more than 5 % somewhere in the uneven sky, which is asserted). A
/// bias of 0.5 % in the sum over wavelengths would be seen; 12 comparisons at 4.9 standard errors: 1e-5 false alarms.
#[test]
fn power_of_images_is_what_their_rays_carry_at_every_wavelength() {
    let scene = SceneSphere { center: Point3::ZERO, radius: 2.0 };
    let oriented = Orientation::new(&Transform::IDENTITY);
    for uneven in [false, true] {
        let light = |space: ImageInfiniteLight| Light::ImageInfinite(Box::new(space));
        let light = light(ImageInfiniteLight::new(painted_sky(uneven), oriented, 1.5, scene).expect("square"));
        let mut worst = 0.0f64;
        for nm in [[420.0, 460.0, 500.0, 540.0], [580.0, 620.0, 660.0, 720.0]] {
            let mut lambda = Wavelengths::sample_uniform(0.5, 360.0, 830.0);
            lambda.lambda = nm;
            let mut rng = Rng::new(41);
            let mut carried = [Mean::new(); 4];
            for _ in 0..100_000 {
                let e = light.emit(u2(&mut rng), u2(&mut rng), &lambda, 0.0).expect("not black");
                let lanes = e.radiance * (1.0 / (e.pdf_position * e.pdf_direction));
                (0..4).for_each(|i| carried[i].add(f64::from(lanes[i])));
            }
            let power = light.power(&lambda);
            let image = painted_sky(uneven);
            let of_mean = image.radiance(image.mean_rgb(|_| 1.0), &lambda) * (1.5 * 4.0 * PI * scene.disk_area());
            for i in 0..4 {
                let (mean, claimed) = (carried[i].mean(), f64::from(power[i]));
                let slack = 2e-3 * claimed + 4.9 * carried[i].standard_error();
                assert!((mean - claimed).abs() < slack, "{uneven} {} nm: {mean} and {claimed}", nm[i]);
                assert!(carried[i].standard_error() < 5e-3 * claimed, "{uneven} {} nm", nm[i]);
                worst = worst.max((f64::from(of_mean[i]) / claimed - 1.0).abs());
            }
        }
        assert!(uneven == (worst > 0.05) && (uneven || worst < 1e-3), "{uneven}: {worst}");
    }
}
