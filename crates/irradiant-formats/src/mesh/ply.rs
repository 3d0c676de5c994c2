//! PLY meshes: ascii and binary of both byte orders, any scalar types, any extra properties.
//!
//! Format: Turk 1994, The PLY Polygon File Format. As in pbrt-v4, faces of four corners become bilinear patches and
//! texture coordinates may be called `u v`, `s t`, `texture_u texture_v` or `texture_s texture_t`. Nothing is allocated
//! on the word of the header alone: counts are held against the bytes that are there.

use crate::pbrt::lex::{parse_f32, parse_f64, parse_i32};
use irradiant_scene::desc::MeshData;

/// What is wrong with a PLY file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlyError(String);

impl std::fmt::Display for PlyError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for PlyError {}

/// A note's code and text: something was changed on the way in.
pub type Remark = (&'static str, String);

fn fail<T>(text: impl Into<String>) -> Result<T, PlyError> {
    Err(PlyError(text.into()))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number in the first bytes of `b`, which must be long enough.
    #[inline]
    fn decode(self, b: &[u8], big: bool) -> f64 {
        fn bytes<const N: usize>(b: &[u8], big: bool) -> [u8; N] {
            let mut out = [0; N];
            out.copy_from_slice(&b[..N]);
            if big {
                out.reverse();
            }
            out
        }
        match self {
            Self::I8 => f64::from(b[0] as i8),
            Self::U8 => f64::from(b[0]),
            Self::I16 => f64::from(i16::from_le_bytes(bytes(b, big))),
            Self::U16 => f64::from(u16::from_le_bytes(bytes(b, big))),
            Self::I32 => f64::from(i32::from_le_bytes(bytes(b, big))),
            Self::U32 => f64::from(u32::from_le_bytes(bytes(b, big))),
            Self::F32 => f64::from(f32::from_le_bytes(bytes(b, big))),
            Self::F64 => f64::from_le_bytes(bytes(b, big)),
        }
    }
}

#[derive(Clone, Debug)]
enum Property {
    One(Scalar, String),
    List(Scalar, Scalar, String),
}

#[derive(Clone, Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    Ascii,
    Binary { big: bool },
}

fn header(bytes: &[u8]) -> Result<(Encoding, Vec<Element>, &[u8]), PlyError> {
    let mut rest = bytes;
    let mut encoding = None;
    let mut elements: Vec<Element> = vec![];
    for number in 1.. {
        // Header lines are short; a file without any is not searched to its end.
        let window = &rest[..rest.len().min(4096)];
        let Some(end) = window.iter().position(|b| *b == b'\n') else {
            return fail(format!("line {number}: the header has no end_header"));
        };
        let line = String::from_utf8_lossy(&rest[..end]);
        rest = &rest[end + 1..];
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let wrong = || fail(format!("line {number}: cannot be understood: {:.60}", line.trim()));
        if number == 1 {
            if words != ["ply"] {
                return fail("it is not a PLY file: the first line is not \"ply\"");
            }
            continue;
        }
        match words[..] {
            ["end_header"] => break,
            ["comment", ..] | ["obj_info", ..] | [] => {}
            ["format", "ascii", _] => encoding = Some(Encoding::Ascii),
            ["format", "binary_little_endian", _] => encoding = Some(Encoding::Binary { big: false }),
            ["format", "binary_big_endian", _] => encoding = Some(Encoding::Binary { big: true }),
            ["element", name, count] => match count.parse() {
                Ok(count) => elements.push(Element { name: name.into(), count, properties: vec![] }),
                Err(_) => return wrong(),
            },
            ["property", "list", count, item, name] => match (Scalar::named(count), Scalar::named(item)) {
                (Some(count), Some(item)) if !matches!(count, Scalar::F32 | Scalar::F64) && !elements.is_empty() => {
                    let last = elements.len() - 1;
                    elements[last].properties.push(Property::List(count, item, name.into()));
                }
                _ => return wrong(),
            },
            ["property", scalar, name] => match (Scalar::named(scalar), elements.last_mut()) {
                (Some(scalar), Some(element)) => element.properties.push(Property::One(scalar, name.into())),
                _ => return wrong(),
            },
            _ => return wrong(),
        }
    }
    match encoding {
        Some(encoding) => Ok((encoding, elements, rest)),
        None => fail("the header names no format"),
    }
}

/// The numbers of the body, one after another.
enum Body<'a> {
    Ascii { text: &'a [u8] },
    Binary { bytes: &'a [u8], big: bool },
}

impl Body<'_> {
    fn word<'t>(text: &mut &'t [u8]) -> Option<&'t [u8]> {
        let start = text.iter().position(|b| !b.is_ascii_whitespace())?;
        let tail = &text[start..];
        let end = tail.iter().position(|b| b.is_ascii_whitespace()).unwrap_or(tail.len());
        *text = &tail[end..];
        Some(&tail[..end])
    }

    /// The next number; `None` at the end, or when there is something else.
    fn number(&mut self, scalar: Scalar) -> Option<f64> {
        match self {
            Body::Ascii { text } => {
                let word = Self::word(text)?;
                match scalar {
                    Scalar::F32 => parse_f32(word).map(f64::from).or_else(|| not_finite(word)),
                    Scalar::F64 => parse_f64(word).or_else(|| not_finite(word)),
                    _ => parse_i32(word).map(f64::from).or_else(|| parse_f64(word)),
                }
            }
            Body::Binary { bytes, big } => {
                let (head, tail) = bytes.split_at_checked(scalar.size())?;
                *bytes = tail;
                Some(scalar.decode(head, *big))
            }
        }
    }

    /// At most this many items of at least `size` bytes (one digit and a space in ascii) can follow.
    fn room(&self, size: usize) -> usize {
        match self {
            Body::Ascii { text } => text.len() / 2 + 1,
            Body::Binary { bytes, .. } => bytes.len() / size.max(1),
        }
    }
}

/// NaN and infinities as programs write them, to be complained about later with their place.
fn not_finite(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// What each property of a vertex is for: slots of [x, y, z, nx, ny, nz, u, v].
fn vertex_slots(element: &Element) -> Result<(Vec<Option<usize>>, bool, bool), PlyError> {
    let index_of =
        |wanted: &str| element.properties.iter().position(|p| matches!(p, Property::One(_, name) if name == wanted));
    let mut slots = vec![None; element.properties.len()];
    for (slot, name) in ["x", "y", "z"].into_iter().enumerate() {
        match index_of(name) {
            Some(i) => slots[i] = Some(slot),
            None => return fail(format!("its vertices have no \"{name}\"")),
        }
    }
    let mut all = |first: usize, names: &[&str]| {
        let found: Option<Vec<usize>> = names.iter().map(|n| index_of(n)).collect();
        found.is_some_and(|found| {
            found.iter().enumerate().for_each(|(k, i)| slots[*i] = Some(first + k));
            true
        })
    };
    let normals = all(3, &["nx", "ny", "nz"]);
    let uvs = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];
    let uvs = uvs.iter().any(|names| all(6, names));
    Ok((slots, normals, uvs))
}

fn vertices(element: &Element, body: &mut Body<'_>, mesh: &mut MeshData) -> Result<(), PlyError> {
    let (slots, normals, uvs) = vertex_slots(element)?;
    let scalars: Option<Vec<Scalar>> = element
        .properties
        .iter()
        .map(|p| match p {
            Property::One(s, _) => Some(*s),
            Property::List(..) => None,
        })
        .collect();
    let size: usize = scalars.as_ref().map_or(0, |s| s.iter().map(|s| s.size()).sum());
    let short =
        |at: usize| fail(format!("it ends, or holds something that is no number, in vertex {at} of {}", element.count));
    if element.count > u64::from(u32::MAX - 1) || element.count as usize > body.room(size.max(1)) {
        return fail(format!("it is too short for {} vertices", element.count));
    }
    let count = element.count as usize;
    mesh.positions.reserve_exact(count);
    if normals {
        mesh.normals.reserve_exact(count);
    }
    if uvs {
        mesh.uvs.reserve_exact(count);
    }
    let mut values = [0.0f32; 8];
    let keep = |values: &[f32; 8], mesh: &mut MeshData| {
        let [x, y, z, nx, ny, nz, u, v] = *values;
        mesh.positions.push([x, y, z]);
        if normals {
            mesh.normals.push([nx, ny, nz]);
        }
        if uvs {
            mesh.uvs.push([u, v]);
        }
    };
    // The usual case: records of fixed size.
    if let (Body::Binary { bytes, big }, Some(scalars)) = (&mut *body, scalars) {
        let mut at = 0;
        let mut wanted = vec![];
        for (scalar, slot) in scalars.iter().zip(&slots) {
            if let Some(slot) = slot {
                wanted.push((*scalar, at, *slot));
            }
            at += scalar.size();
        }
        let Some((records, tail)) = bytes.split_at_checked(count * size) else { return short(count) };
        let simple = !*big && wanted.iter().all(|w| w.0 == Scalar::F32);
        for record in records.chunks_exact(size) {
            for (scalar, at, slot) in &wanted {
                values[*slot] = if simple {
                    f32::from_le_bytes([record[*at], record[at + 1], record[at + 2], record[at + 3]])
                } else {
                    scalar.decode(&record[*at..], *big) as f32
                };
            }
            keep(&values, mesh);
        }
        *bytes = tail;
        return Ok(());
    }
    for i in 0..count {
        for (property, slot) in element.properties.iter().zip(&slots) {
            match property {
                Property::One(scalar, _) => {
                    let Some(value) = body.number(*scalar) else { return short(i) };
                    if let Some(slot) = slot {
                        values[*slot] = value as f32;
                    }
                }
                Property::List(n, item, _) => {
                    if skip_list(body, *n, *item).is_none() {
                        return short(i);
                    }
                }
            }
        }
        keep(&values, mesh);
    }
    Ok(())
}

fn skip_list(body: &mut Body<'_>, count: Scalar, item: Scalar) -> Option<()> {
    let n = body.number(count).filter(|n| *n >= 0.0)? as usize;
    if n > body.room(item.size()) {
        return None;
    }
    for _ in 0..n {
        body.number(item)?;
    }
    Some(())
}

/// Faces as they come; polygons are cut into fans.
#[derive(Default)]
struct Faces {
    triangles: Vec<[u32; 3]>,
    quads: Vec<[u32; 4]>,
    triangle_ids: Vec<i32>,
    quad_ids: Vec<i32>,
    polygons: usize,
    slivers: usize,
}

impl Faces {
    fn add(&mut self, corners: &[u32], id: Option<i32>) {
        match *corners {
            [a, b, c] => {
                self.triangles.push([a, b, c]);
                self.triangle_ids.extend(id);
            }
            // The order of a patch: its second row runs like its first.
            [a, b, c, d] => {
                self.quads.push([a, b, d, c]);
                self.quad_ids.extend(id);
            }
            [a, _, _, _, _, ..] => {
                self.polygons += 1;
                for w in corners[1..].windows(2) {
                    self.triangles.push([a, w[0], w[1]]);
                    self.triangle_ids.extend(id);
                }
            }
            _ => self.slivers += 1,
        }
    }
}

fn index(v: f64, n_vertices: usize, face: usize) -> Result<u32, PlyError> {
    if v >= 0.0 && v < n_vertices as f64 {
        Ok(v as u32)
    } else {
        fail(format!("face {face} names vertex {v}; there are {n_vertices} vertices"))
    }
}

fn faces(element: &Element, body: &mut Body<'_>, n_vertices: usize, out: &mut Faces) -> Result<(), PlyError> {
    let short =
        |at: usize| fail(format!("it ends, or holds something that is no number, in face {at} of {}", element.count));
    let is_indices = |p: &Property| {
        matches!(p, Property::List(_, item, name)
            if (name == "vertex_indices" || name == "vertex_index") && !matches!(item, Scalar::F32 | Scalar::F64))
    };
    if !element.properties.iter().any(is_indices) {
        return fail("its faces have no list \"vertex_indices\" of integers");
    }
    if element.count > body.room(1) as u64 {
        return fail(format!("it is too short for {} faces", element.count));
    }
    let count = element.count as usize;
    out.triangles.reserve(count.min(body.room(13)));
    let limit = n_vertices as u32;
    // The usual case: triangles with 32-bit indices and nothing else.
    if let (Body::Binary { bytes, big: false }, [Property::List(Scalar::U8, Scalar::I32 | Scalar::U32, _)]) =
        (&mut *body, &element.properties[..])
    {
        let mut rest = *bytes;
        let mut corners = Vec::with_capacity(8);
        for i in 0..count {
            let Some((&n, tail)) = rest.split_first() else { return short(i) };
            let Some((list, tail)) = tail.split_at_checked(4 * n as usize) else { return short(i) };
            rest = tail;
            let decode = |k: usize| u32::from_le_bytes([list[k], list[k + 1], list[k + 2], list[k + 3]]);
            if n == 3 {
                let face = [decode(0), decode(4), decode(8)];
                if face[0] < limit && face[1] < limit && face[2] < limit {
                    out.triangles.push(face);
                    continue;
                }
            }
            corners.clear();
            for k in 0..n as usize {
                corners.push(index(f64::from(decode(4 * k) as i32), n_vertices, i)?);
            }
            out.add(&corners, None);
        }
        *bytes = rest;
        return Ok(());
    }
    let mut corners: Vec<u32> = vec![];
    for i in 0..count {
        let mut id = None;
        corners.clear();
        for property in &element.properties {
            match property {
                Property::List(n, item, _) if is_indices(property) => {
                    let Some(n) = body.number(*n).filter(|n| *n >= 0.0) else { return short(i) };
                    if n as usize > body.room(item.size()) {
                        return short(i);
                    }
                    for _ in 0..n as usize {
                        let Some(v) = body.number(*item) else { return short(i) };
                        corners.push(index(v, n_vertices, i)?);
                    }
                }
                Property::List(n, item, _) => {
                    if skip_list(body, *n, *item).is_none() {
                        return short(i);
                    }
                }
                Property::One(scalar, name) => {
                    let Some(v) = body.number(*scalar) else { return short(i) };
                    if name == "face_indices" {
                        id = Some(v as i32);
                    }
                }
            }
        }
        out.add(&corners, id);
    }
    Ok(())
}

/// Reads a mesh, with remarks on what was changed: polygons cut into triangles, unusable normals set to zero.
///
/// All indices of the result are in range and all positions finite.
pub fn read(bytes: &[u8]) -> Result<(MeshData, Vec<Remark>), PlyError> {
    let (encoding, elements, rest) = header(bytes)?;
    let mut body = match encoding {
        Encoding::Ascii => Body::Ascii { text: rest },
        Encoding::Binary { big } => Body::Binary { bytes: rest, big },
    };
    let mut mesh = MeshData::default();
    let mut found = Faces::default();
    let n_vertices = elements.iter().find(|e| e.name == "vertex").map_or(0, |e| e.count);
    let n_faces = elements.iter().find(|e| e.name == "face").map_or(0, |e| e.count);
    if n_vertices == 0 || n_faces == 0 {
        let strips =
            if elements.iter().any(|e| e.name == "tristrips") { " (triangle strips are not read)" } else { "" };
        return fail(format!("it has {n_vertices} vertices and {n_faces} faces{strips}"));
    }
    let (mut seen_vertices, mut seen_faces) = (false, false);
    for element in &elements {
        match element.name.as_str() {
            "vertex" if !seen_vertices => {
                seen_vertices = true;
                vertices(element, &mut body, &mut mesh)?;
            }
            "face" if !seen_faces => {
                seen_faces = true;
                faces(element, &mut body, n_vertices.min(u64::from(u32::MAX)) as usize, &mut found)?;
            }
            // What follows the last of the two is of no interest.
            _ if seen_vertices && seen_faces => break,
            name => {
                if element.properties.is_empty() {
                    continue;
                }
                for i in 0..element.count {
                    let read = element.properties.iter().all(|p| match p {
                        Property::One(scalar, _) => body.number(*scalar).is_some(),
                        Property::List(n, item, _) => skip_list(&mut body, *n, *item).is_some(),
                    });
                    if !read {
                        return fail(format!("it ends in element \"{name}\" {i} of {}", element.count));
                    }
                }
            }
        }
    }
    let mut remarks = vec![];
    if let Some(i) = mesh.positions.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
        return fail(format!("vertex {i} is at {:?}", mesh.positions[i]));
    }
    let unusable = zero_not_finite(&mut mesh.normals) + zero_not_finite(&mut mesh.uvs);
    if unusable > 0 {
        remarks.push(("N0505", format!("{unusable} normals or uvs that are not finite were set to 0")));
    }
    if found.polygons > 0 {
        remarks
            .push(("N0503", format!("{} faces with more than four corners were cut into triangles", found.polygons)));
    }
    if found.slivers > 0 {
        remarks.push(("N0504", format!("{} faces with fewer than three corners were left out", found.slivers)));
    }
    mesh.triangles = found.triangles;
    mesh.quads = found.quads;
    mesh.face_indices = found.triangle_ids;
    mesh.face_indices.extend(found.quad_ids);
    if mesh.face_indices.len() != mesh.triangles.len() + mesh.quads.len() {
        mesh.face_indices.clear();
    }
    if mesh.triangles.is_empty() && mesh.quads.is_empty() {
        return fail("none of its faces has three corners");
    }
    Ok((mesh, remarks))
}

fn zero_not_finite<const N: usize>(list: &mut [[f32; N]]) -> usize {
    let bad = list.iter_mut().filter(|v| v.iter().any(|c| !c.is_finite()));
    bad.map(|v| *v = [0.0; N]).count()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub const TRIANGLE: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

    /// A mesh of two triangles, a quad and a pentagon, written in every way.
    struct Writer {
        encoding: &'static str,
        vertex: [&'static str; 8],
        names: [&'static str; 2],
        list: [&'static str; 2],
        extra: bool,
    }

    fn put(out: &mut Vec<u8>, encoding: &str, scalar: &str, v: f64) {
        let bytes: Vec<u8> = match scalar {
            _ if encoding == "ascii" => format!("{v} ").into_bytes(),
            "char" => vec![v as i8 as u8],
            "uchar" | "uint8" => vec![v as u8],
            "short" => (v as i16).to_le_bytes().to_vec(),
            "ushort" => (v as u16).to_le_bytes().to_vec(),
            "int" | "int32" => (v as i32).to_le_bytes().to_vec(),
            "uint" => (v as u32).to_le_bytes().to_vec(),
            "float" | "float32" => (v as f32).to_le_bytes().to_vec(),
            "double" => v.to_le_bytes().to_vec(),
            _ => panic!("{scalar}"),
        };
        match encoding {
            "binary_big_endian" => out.extend(bytes.iter().rev()),
            _ => out.extend(bytes),
        }
    }

    const FACES: [&[u32]; 4] = [&[0, 1, 2], &[0, 2, 3], &[0, 1, 2, 3], &[0, 1, 2, 3, 4]];

    fn vertex(i: usize) -> [f64; 8] {
        let i = i as f64;
        [i, i * 0.5, -i, 0.0, 0.0, 1.0, i * 0.25, 1.0 - i * 0.125]
    }

    impl Writer {
        fn write(&self) -> Vec<u8> {
            let mut out = format!("ply\nformat {} 1.0\ncomment by hand\n", self.encoding);
            if self.extra {
                out += "element note 2\nproperty list uchar float words\n";
            }
            out += "element vertex 5\n";
            if self.extra {
                out += "property uchar red\nproperty list uchar short tags\n";
            }
            let names = ["x", "y", "z", "nx", "ny", "nz", self.names[0], self.names[1]];
            for (scalar, name) in self.vertex.iter().zip(names) {
                out += &format!("property {scalar} {name}\n");
            }
            out += &format!("element face 4\nproperty list {} {} vertex_indices\n", self.list[0], self.list[1]);
            if self.extra {
                out += "property int face_indices\nproperty float quality\n";
            }
            out += "end_header\n";
            let mut out = out.into_bytes();
            let e = self.encoding;
            if self.extra {
                for n in [0, 3] {
                    put(&mut out, e, "uchar", n as f64);
                    (0..n).for_each(|_| put(&mut out, e, "float", 1.5));
                }
            }
            for i in 0..5 {
                if self.extra {
                    put(&mut out, e, "uchar", 255.0);
                    put(&mut out, e, "uchar", 1.0);
                    put(&mut out, e, "short", -3.0);
                }
                for (scalar, v) in self.vertex.iter().zip(vertex(i)) {
                    put(&mut out, e, scalar, v);
                }
            }
            for (i, f) in FACES.iter().enumerate() {
                put(&mut out, e, self.list[0], f.len() as f64);
                f.iter().for_each(|v| put(&mut out, e, self.list[1], f64::from(*v)));
                if self.extra {
                    put(&mut out, e, "int", 10.0 + i as f64);
                    put(&mut out, e, "float", 0.5);
                }
            }
            out
        }
    }

    fn variants() -> Vec<Vec<u8>> {
        let mut out = vec![];
        for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
            for (vertex, list) in [
                (["float"; 8], ["uchar", "int"]),
                (["float32"; 8], ["uint8", "uint"]),
                (["double"; 8], ["int", "ushort"]),
                (["float", "double", "float", "char", "short", "int32", "double", "float"], ["ushort", "uchar"]),
            ] {
                for names in [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]] {
                    for extra in [false, true] {
                        out.push(Writer { encoding, vertex, names, list, extra }.write());
                    }
                }
            }
        }
        out
    }

    #[test]
    fn all_encodings_types_and_names_give_the_same_mesh() {
        let all = variants();
        assert_eq!(all.len(), 96);
        for (i, bytes) in all.iter().enumerate() {
            let (mesh, remarks) = read(bytes).unwrap_or_else(|e| panic!("variant {i}: {e}"));
            for v in 0..5 {
                let expected = vertex(v).map(|c| c as f32);
                assert_eq!(mesh.positions[v], expected[..3]);
                assert_eq!(mesh.normals[v], expected[3..6]);
                assert_eq!(mesh.uvs[v], expected[6..]);
            }
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3], [0, 3, 4]]);
            assert_eq!(mesh.quads, [[0, 1, 3, 2]]);
            assert_eq!(remarks.len(), 1);
            assert_eq!(remarks[0].0, "N0503");
            let ids: &[i32] = if i % 2 == 1 { &[10, 11, 13, 13, 13, 12] } else { &[] };
            assert_eq!(mesh.face_indices, ids);
        }
    }

    /// Every file that is cut short is refused, or was already whole; none panics.
    #[test]
    fn cut_files_are_refused() {
        for bytes in variants() {
            let whole = read(&bytes).unwrap().0;
            for n in 0..bytes.len() {
                if let Ok((mesh, _)) = read(&bytes[..n]) {
                    // Only what follows the last digit, or is not looked at, may be missing.
                    assert_eq!(mesh.positions.len(), whole.positions.len());
                    assert!(bytes.len() - n < 12, "{n} of {}", bytes.len());
                }
            }
        }
    }

    #[test]
    fn the_header_is_not_believed() {
        let huge = TRIANGLE.replace("vertex 3", "vertex 4000000000");
        assert!(read(huge.as_bytes()).unwrap_err().to_string().contains("too short"));
        let huge = TRIANGLE.replace("face 1", "face 99999999999");
        assert!(read(huge.as_bytes()).unwrap_err().to_string().contains("too short"));
        let huge = TRIANGLE.replace("ascii", "binary_little_endian").replace("vertex 3", "vertex 18446744073709551615");
        assert!(read(huge.as_bytes()).is_err());
        let mut long =
            TRIANGLE.replace("element face", "element extra 18446744073709551615\nelement face").into_bytes();
        long.extend_from_slice(b"1 1 1");
        assert!(read(&long).is_ok(), "an element without properties takes no bytes");
    }

    #[test]
    fn mistakes_are_named() {
        let bad = |from: &str, to: &str| read(TRIANGLE.replace(from, to).as_bytes()).unwrap_err().to_string();
        assert!(bad("ply", "obj").contains("not a PLY"));
        assert!(bad("3 0 1 2", "3 0 1 7").contains("names vertex 7"));
        assert!(bad("3 0 1 2", "3 0 1 -1").contains("names vertex -1"));
        assert!(bad("property float z", "property float w").contains("\"z\""));
        assert!(bad("vertex_indices", "corners").contains("vertex_indices"));
        assert!(bad("1 0 0", "nan 0 0").contains("vertex 1"));
        assert!(bad("1 0 0", "x 0 0").contains("no number"));
        assert!(bad("element face 1", "element face 0").contains("0 faces"));
        assert!(bad("end_header", "").contains("line"));
        assert!(bad("3 0 1 2", "2 0 1").contains("three corners"));
        assert!(bad("list uchar int", "list uchar integer").contains("line 8"));
    }

    #[test]
    fn unusable_normals_are_set_to_zero_and_said() {
        let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
            property float nx\nproperty float ny\nproperty float nz\nelement face 1\n\
            property list uchar int vertex_index\nend_header\n\
            0 0 0 nan nan nan\n1 0 0 0 0 1\n0 1 0 0 inf 1\n3 0 1 2\n";
        let (mesh, remarks) = read(text.as_bytes()).unwrap();
        assert_eq!(mesh.normals, [[0.0; 3], [0.0, 0.0, 1.0], [0.0; 3]]);
        assert_eq!(remarks[0].0, "N0505");
    }
}
