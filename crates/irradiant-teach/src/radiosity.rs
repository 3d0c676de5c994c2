//! A second renderer for diffuse scenes of quadrilaterals: classical radiosity (Goral et al. 1984), written from nothing but the
//! scene's text, in f64, with intersections of its own. It shares no code with the path tracer that it is compared with.

use irradiant_testkit::Rng;

type V = [f64; 3];

/// A quadrilateral of a scene and what it is made of.
pub struct Quad {
    /// Corners in order.
    pub p: [V; 4],
    /// Name of its material; of emitters "lamp".
    pub material: String,
    /// Unit normal on the side that light falls on.
    pub n: V,
}

fn sub(a: V, b: V) -> V {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn scaled(a: V, s: f64) -> V {
    a.map(|x| x * s)
}

fn add(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn unit(a: V) -> V {
    scaled(a, 1.0 / dot(a, a).sqrt())
}

/// The quadrilaterals of a scene like the Cornell box: four-point meshes, each after the name of its material. `inside` is a
/// point that walls face; blocks of five sides face away from their middle.
pub fn quads(text: &str, inside: V) -> Vec<Quad> {
    let mut found: Vec<Quad> = vec![];
    let mut material = String::new();
    for line in text.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix("NamedMaterial") {
            material = name.trim().trim_matches('"').into();
        } else if line.starts_with("AreaLightSource") {
            material = "lamp".into();
        }
        let Some(list) = line.split("\"point3 P\" [").nth(1).and_then(|rest| rest.split(']').next()) else { continue };
        let numbers: Vec<f64> = list.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        if numbers.len() != 12 {
            continue;
        }
        let p: [V; 4] = std::array::from_fn(|i| [numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]]);
        let n = unit(cross(sub(p[1], p[0]), sub(p[2], p[0])));
        let n = if dot(n, sub(inside, p[0])) > 0.0 { n } else { scaled(n, -1.0) };
        found.push(Quad { p, material: material.clone(), n });
    }
    // Lamp and five walls come first; then blocks, top and four sides each.
    for block in found.get_mut(6..).unwrap_or_default().chunks_mut(5) {
        let middle = scaled(block.iter().flat_map(|q| q.p).fold([0.0; 3], add), 1.0 / (4 * block.len()) as f64);
        for q in block {
            if dot(q.n, sub(q.p[0], middle)) < 0.0 {
                q.n = scaled(q.n, -1.0);
            }
        }
    }
    found
}

/// Cells of a triangle: squares in its two barycentric coordinates, cut by its third side.
const CELLS: usize = 8;

fn triangles(quads: &[Quad]) -> Vec<[V; 3]> {
    quads.iter().flat_map(|q| [[q.p[0], q.p[1], q.p[2]], [q.p[2], q.p[3], q.p[0]]]).collect()
}

fn hit(triangles: &[[V; 3]], o: V, d: V, but: usize) -> Option<(usize, f64, f64)> {
    let mut nearest = (f64::INFINITY, None);
    for (i, t) in triangles.iter().enumerate() {
        if i / 2 == but {
            continue;
        }
        let (e1, e2) = (sub(t[1], t[0]), sub(t[2], t[0]));
        let h = cross(d, e2);
        let a = dot(e1, h);
        if a.abs() < 1e-12 {
            continue;
        }
        let s = sub(o, t[0]);
        let u = dot(s, h) / a;
        let q = cross(s, e1);
        let v = dot(d, q) / a;
        let distance = dot(e2, q) / a;
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 1e-9 && distance < nearest.0 {
            nearest = (distance, Some((i, u, v)));
        }
    }
    nearest.1
}

/// Who sees whom, for a scene's cells: shares of rays, no wavelengths yet.
pub struct Exchange {
    areas: Vec<f64>,
    quad_of: Vec<usize>,
    rows: Vec<Vec<(usize, f64)>>,
}

fn cell(triangle: usize, u: f64, v: f64) -> usize {
    let clamp = |x: f64| ((x * CELLS as f64) as usize).min(CELLS - 1);
    triangle * CELLS * CELLS + clamp(u) * CELLS + clamp(v)
}

/// The share of a cell's hemisphere that sees the lamp, the first quadrilateral, weighed by the cosine.
fn lamp_share(quads: &[Quad], triangles: &[[V; 3]], t: usize, [i, j]: [usize; 2], n: u32, rng: &mut Rng) -> f64 {
    let corners = triangles[t];
    let (e1, e2) = (sub(corners[1], corners[0]), sub(corners[2], corners[0]));
    let lamp = cross(sub(triangles[0][1], triangles[0][0]), sub(triangles[0][2], triangles[0][0]));
    let area = dot(lamp, lamp).sqrt();
    let mut sum = 0.0;
    for _ in 0..n {
        let (mut u, mut v) = (rng.next_f64(), rng.next_f64());
        if i + j == CELLS - 1 && u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let (u, v) = ((i as f64 + u) / CELLS as f64, (j as f64 + v) / CELLS as f64);
        let o = add(corners[0], add(scaled(e1, u), scaled(e2, v)));
        let d = sub(point_on(&quads[0], rng), o);
        let d2 = dot(d, d);
        let w = scaled(d, 1.0 / d2.sqrt());
        let (here, there) = (dot(quads[t / 2].n, w), -dot(quads[0].n, w));
        if here > 0.0 && there > 0.0 && hit(triangles, o, w, t / 2).is_some_and(|(met, _, _)| met < 2) {
            sum += here * there * area / (std::f64::consts::PI * d2);
        }
    }
    sum / f64::from(n)
}

/// Form factors of all cells by `rays` cosine-distributed rays each.
pub fn exchange(quads: &[Quad], rays: u32, seed: u64) -> Exchange {
    let triangles = triangles(quads);
    let mut rng = Rng::new(seed);
    let n = triangles.len() * CELLS * CELLS;
    let mut exchange = Exchange { areas: vec![0.0; n], quad_of: vec![0; n], rows: vec![vec![]; n] };
    for (t, corners) in triangles.iter().enumerate() {
        let (e1, e2) = (sub(corners[1], corners[0]), sub(corners[2], corners[0]));
        let c = cross(e1, e2);
        let whole = dot(c, c).sqrt() / (CELLS * CELLS) as f64;
        let normal = quads[t / 2].n;
        let x = unit(e1);
        let y = cross(normal, x);
        for i in 0..CELLS {
            for j in 0..CELLS - i {
                let k = t * CELLS * CELLS + i * CELLS + j;
                exchange.areas[k] = if i + j == CELLS - 1 { 0.5 * whole } else { whole };
                exchange.quad_of[k] = t / 2;
                let mut counts = std::collections::BTreeMap::new();
                for _ in 0..rays {
                    let (mut u, mut v) = (rng.next_f64(), rng.next_f64());
                    if i + j == CELLS - 1 && u + v > 1.0 {
                        (u, v) = (1.0 - u, 1.0 - v);
                    }
                    let (u, v) = ((i as f64 + u) / CELLS as f64, (j as f64 + v) / CELLS as f64);
                    let o = add(corners[0], add(scaled(e1, u), scaled(e2, v)));
                    let (r, phi) = (rng.next_f64().sqrt(), std::f64::consts::TAU * rng.next_f64());
                    let z = (1.0 - r * r).sqrt();
                    let d = add(add(scaled(x, r * phi.cos()), scaled(y, r * phi.sin())), scaled(normal, z));
                    if let Some((met, u, v)) = hit(&triangles, o, d, t / 2)
                        && dot(quads[met / 2].n, d) < 0.0
                    {
                        *counts.entry(cell(met, u, v)).or_insert(0u32) += 1;
                    }
                }
                // The lamp is small: what comes from it is counted by points on it instead, each asked whether it is seen.
                counts.retain(|cell: &usize, _| *cell >= 2 * CELLS * CELLS);
                let from_lamp = if t / 2 == 0 { 0.0 } else { lamp_share(quads, &triangles, t, [i, j], rays, &mut rng) };
                exchange.rows[k] = counts.into_iter().map(|(k, n)| (k, f64::from(n) / f64::from(rays))).collect();
                exchange.rows[k].push((0, from_lamp));
            }
        }
    }
    exchange
}

impl Exchange {
    /// Radiance by quadrilateral (mean over its area) for an emission and a reflectance of each.
    pub fn solve(&self, emission: &[f64], reflectance: &[f64]) -> Vec<f64> {
        let n = self.areas.len();
        let mut b: Vec<f64> = (0..n).map(|k| emission[self.quad_of[k]]).collect();
        for _ in 0..60 {
            for k in 0..n {
                let arriving: f64 = self.rows[k].iter().map(|(j, f)| f * b[*j]).sum();
                b[k] = emission[self.quad_of[k]] + reflectance[self.quad_of[k]] * arriving;
            }
        }
        let mut sums = vec![(0.0, 0.0); emission.len()];
        for k in 0..n {
            let s = &mut sums[self.quad_of[k]];
            *s = (s.0 + self.areas[k] * b[k], s.1 + self.areas[k]);
        }
        sums.iter().map(|s| s.0 / s.1).collect()
    }
}

/// A random point of a quadrilateral, uniformly over each half.
pub fn point_on(quad: &Quad, rng: &mut Rng) -> V {
    let t = [[quad.p[0], quad.p[1], quad.p[2]], [quad.p[2], quad.p[3], quad.p[0]]];
    let area = |t: &[V; 3]| {
        let c = cross(sub(t[1], t[0]), sub(t[2], t[0]));
        dot(c, c).sqrt()
    };
    let (a, b) = (area(&t[0]), area(&t[1]));
    let t = if rng.next_f64() * (a + b) < a { t[0] } else { t[1] };
    let (mut u, mut v) = (rng.next_f64(), rng.next_f64());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    add(t[0], add(scaled(sub(t[1], t[0]), u), scaled(sub(t[2], t[0]), v)))
}

/// A spectrum of a named material in a scene's text, linearly interpolated at a wavelength.
pub fn reflectance(text: &str, material: &str, lambda: f64) -> Option<f64> {
    let at = text.find(&format!("MakeNamedMaterial \"{material}\""))?;
    let list = text[at..].split('[').nth(1)?.split(']').next()?;
    let numbers: Vec<f64> = list.split_whitespace().filter_map(|w| w.parse().ok()).collect();
    let pairs: Vec<(f64, f64)> = numbers.chunks(2).map(|c| (c[0], c[1])).collect();
    let next = pairs.iter().position(|p| p.0 >= lambda)?.max(1);
    let ((x0, y0), (x1, y1)) = (pairs[next - 1], pairs[next]);
    Some(y0 + (y1 - y0) * (lambda - x0) / (x1 - x0))
}
