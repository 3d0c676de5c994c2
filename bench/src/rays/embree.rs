//! Embree 3 or 4, loaded at run time. The only unsafe code of the benchmark.
//!
//! Declarations follow the public headers `rtcore_ray.h`, `rtcore_scene.h`, `rtcore_common.h` of Embree 3.13 and 4.4. A hit
//! may end with one more field when instance arrays are compiled in (they are in 4.4): room for it is kept, nobody reads it.
//! `tests::fields_are_where_embree_puts_them` guards the layout whenever `EMBREE_LIBRARY` names a library.
#![allow(unsafe_code)]

use super::builds::{Spent, Stopwatch};
use super::sets::{Geometry, Placement};
use crate::scene::Mesh;
use irradiant_bvh::Ray;
use libloading::Library;
use std::ffi::{CString, c_char, c_int, c_void};
use std::path::Path;
use std::sync::atomic::{AtomicIsize, Ordering::Relaxed};

type Handle = *mut c_void;

const INVALID: u32 = u32::MAX;
const INDEX_BUFFER: c_int = 0;
const VERTEX_BUFFER: c_int = 1;
const TRIANGLES: c_int = 0;
const INSTANCE: c_int = 121;
const UINT3: c_int = 0x5003;
const FLOAT3: c_int = 0x9003;
const FLOAT3X4_COLUMN_MAJOR: c_int = 0x9234;
const ROBUST: c_int = 1 << 2;

/// N rays and N hits, field by field.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
struct Packet<const N: usize> {
    org: [[f32; N]; 3],
    tnear: [f32; N],
    dir: [[f32; N]; 3],
    time: [f32; N],
    tfar: [f32; N],
    mask: [u32; N],
    id: [u32; N],
    flags: [u32; N],
    normal: [[f32; N]; 3],
    uv: [[f32; N]; 2],
    primitive: [u32; N],
    geometry: [u32; N],
    instance: [u32; N],
    instance_primitive: [u32; N],
}

const _: () = assert!(std::mem::offset_of!(Packet<1>, normal) == 48 && std::mem::offset_of!(Packet<16>, normal) == 768);

impl<const N: usize> Packet<N> {
    #[inline(always)]
    fn of(rays: &[Ray; N]) -> Self {
        // Plain loops, which the compiler turns into straight code: a peer is not to pay for our filling in.
        let axis = |pick: fn(&Ray) -> [f32; 3], a: usize| std::array::from_fn(|i| pick(&rays[i])[a]);
        let (origin, direction) = (|r: &Ray| r.o, |r: &Ray| r.d);
        Self {
            org: [axis(origin, 0), axis(origin, 1), axis(origin, 2)],
            tnear: [0.0; N],
            dir: [axis(direction, 0), axis(direction, 1), axis(direction, 2)],
            time: [0.0; N],
            tfar: std::array::from_fn(|i| rays[i].t_max),
            mask: [INVALID; N],
            id: [0; N],
            flags: [0; N],
            normal: [[0.0; N]; 3],
            uv: [[0.0; N]; 2],
            primitive: [INVALID; N],
            geometry: [INVALID; N],
            instance: [INVALID; N],
            instance_primitive: [INVALID; N],
        }
    }
}

/// What a query may be told: the context of Embree 3, the arguments of Embree 4.
#[repr(C)]
struct Arguments3 {
    flags: u32,
    filter: *const c_void,
    instance: u32,
    minimum_width: f32,
}

#[repr(C)]
struct Arguments4 {
    flags: u32,
    features: u32,
    context: *const c_void,
    filter: *const c_void,
    callback: *const c_void,
    minimum_width: f32,
}

type Query3 = unsafe extern "C" fn(Handle, *mut Arguments3, *mut Packet<1>);
type Query4 = unsafe extern "C" fn(Handle, *mut Packet<1>, *const Arguments4);
type Queries3 = unsafe extern "C" fn(*const [c_int; 16], Handle, *mut Arguments3, *mut Packet<16>);
type Queries4 = unsafe extern "C" fn(*const [c_int; 16], Handle, *mut Packet<16>, *const Arguments4);

/// The four queries that are measured.
#[derive(Clone, Copy)]
enum Queries {
    Three { intersect1: Query3, occluded1: Query3, intersect16: Queries3, occluded16: Queries3 },
    Four { intersect1: Query4, occluded1: Query4, intersect16: Queries4, occluded16: Queries4 },
}

/// A loaded library.
pub struct Embree {
    new_device: unsafe extern "C" fn(*const c_char) -> Handle,
    release_device: unsafe extern "C" fn(Handle),
    device_property: unsafe extern "C" fn(Handle, c_int) -> isize,
    monitor: unsafe extern "C" fn(Handle, unsafe extern "C" fn(*mut c_void, isize, bool) -> bool, *mut c_void),
    new_scene: unsafe extern "C" fn(Handle) -> Handle,
    scene_flags: unsafe extern "C" fn(Handle, c_int),
    scene_quality: unsafe extern "C" fn(Handle, c_int),
    commit_scene: unsafe extern "C" fn(Handle),
    release_scene: unsafe extern "C" fn(Handle),
    new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle,
    shared_buffer: unsafe extern "C" fn(Handle, c_int, u32, c_int, *const c_void, usize, usize, usize),
    instanced_scene: unsafe extern "C" fn(Handle, Handle),
    transform: unsafe extern "C" fn(Handle, u32, c_int, *const c_void),
    commit_geometry: unsafe extern "C" fn(Handle),
    attach: unsafe extern "C" fn(Handle, Handle) -> u32,
    release_geometry: unsafe extern "C" fn(Handle),
    queries: Queries,
    /// 3 or 4.
    pub major: u32,
}

impl Embree {
    /// Loads a library of Embree 3 or 4.
    pub fn load(path: &Path) -> Result<Self, String> {
        let fail = |e: libloading::Error| format!("{}: {e}", path.display());
        // SAFETY: the initialisers of Embree and of the libraries it needs have no preconditions.
        let library = unsafe { Library::new(path) }.map_err(fail)?;
        // Never unloaded: the threads of its scheduler outlive every device and would run on in code that is gone.
        let library: &'static Library = Box::leak(Box::new(library));
        macro_rules! symbol {
            ($name:literal) => {
                // SAFETY: the type is that of the function of this name in Embree's headers, and the library stays loaded.
                *unsafe { library.get($name) }.map_err(fail)?
            };
        }
        // Only Embree 3 has streams.
        // SAFETY: the symbol is only looked for.
        let major = if unsafe { library.get::<Handle>(b"rtcIntersect1M") }.is_ok() { 3 } else { 4 };
        let queries = if major == 3 {
            Queries::Three {
                intersect1: symbol!(b"rtcIntersect1"),
                occluded1: symbol!(b"rtcOccluded1"),
                intersect16: symbol!(b"rtcIntersect16"),
                occluded16: symbol!(b"rtcOccluded16"),
            }
        } else {
            Queries::Four {
                intersect1: symbol!(b"rtcIntersect1"),
                occluded1: symbol!(b"rtcOccluded1"),
                intersect16: symbol!(b"rtcIntersect16"),
                occluded16: symbol!(b"rtcOccluded16"),
            }
        };
        Ok(Self {
            new_device: symbol!(b"rtcNewDevice"),
            release_device: symbol!(b"rtcReleaseDevice"),
            device_property: symbol!(b"rtcGetDeviceProperty"),
            monitor: symbol!(b"rtcSetDeviceMemoryMonitorFunction"),
            new_scene: symbol!(b"rtcNewScene"),
            scene_flags: symbol!(b"rtcSetSceneFlags"),
            scene_quality: symbol!(b"rtcSetSceneBuildQuality"),
            commit_scene: symbol!(b"rtcCommitScene"),
            release_scene: symbol!(b"rtcReleaseScene"),
            new_geometry: symbol!(b"rtcNewGeometry"),
            shared_buffer: symbol!(b"rtcSetSharedGeometryBuffer"),
            instanced_scene: symbol!(b"rtcSetGeometryInstancedScene"),
            transform: symbol!(b"rtcSetGeometryTransform"),
            commit_geometry: symbol!(b"rtcCommitGeometry"),
            attach: symbol!(b"rtcAttachGeometry"),
            release_geometry: symbol!(b"rtcReleaseGeometry"),
            queries,
            major,
        })
    }

    /// As it says itself.
    pub fn version(&self) -> String {
        const VERSION: c_int = 0;
        // SAFETY: no configuration is the default one; a device that could be made is asked and released.
        let number = unsafe {
            let device = (self.new_device)(std::ptr::null());
            if device.is_null() {
                return "unknown".into();
            }
            let number = (self.device_property)(device, VERSION);
            (self.release_device)(device);
            number
        };
        format!("{}.{}.{}", number / 10_000, number / 100 % 100, number % 100)
    }

    /// Builds a scene at medium quality, the default, on so many threads; on more, if an earlier device of this process asked for more.
    pub fn build<'a>(&'a self, geometry: &'a Geometry, robust: bool, threads: usize) -> Result<Tree<'a>, String> {
        let config = CString::new(format!("threads={threads},set_affinity=0")).map_err(|e| e.to_string())?;
        let bytes = Box::new(AtomicIsize::new(0));
        // SAFETY: the string ends with 0 and outlives the call.
        let device = unsafe { (self.new_device)(config.as_ptr()) };
        if device.is_null() {
            return Err("Embree gave no device".into());
        }
        // SAFETY: the counter is boxed and lives as long as the device: `Tree` drops the device first.
        unsafe { (self.monitor)(device, count_bytes, (&raw const *bytes).cast_mut().cast()) };
        let mut tree = Tree {
            embree: self,
            device,
            scene: std::ptr::null_mut(),
            parts: Vec::new(),
            bytes,
            spent: Spent::default(),
            _geometry: geometry,
        };
        let watch = Stopwatch::start();
        tree.scene = tree.new_scene(robust);
        if geometry.placements.is_empty() {
            geometry.meshes.iter().for_each(|mesh| tree.attach_mesh(tree.scene, mesh));
        } else {
            for mesh in &geometry.meshes {
                let part = tree.new_scene(robust);
                tree.attach_mesh(part, mesh);
                // SAFETY: the scene is alive.
                unsafe { (self.commit_scene)(part) };
                tree.parts.push(part);
            }
            geometry.placements.iter().for_each(|p| tree.attach_instance(p));
        }
        // SAFETY: the scene is alive and its buffers are borrowed for as long as the tree lives.
        unsafe { (self.commit_scene)(tree.scene) };
        tree.spent = watch.spent();
        Ok(tree)
    }
}

/// Embree calls this with what it allocated (or freed, negative).
unsafe extern "C" fn count_bytes(counter: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: the pointer is the one given with this function, to an `AtomicIsize` that outlives the device.
    unsafe { &*counter.cast::<AtomicIsize>() }.fetch_add(bytes, Relaxed);
    true
}

/// A committed scene.
pub struct Tree<'a> {
    embree: &'a Embree,
    device: Handle,
    scene: Handle,
    parts: Vec<Handle>,
    bytes: Box<AtomicIsize>,
    /// By the build.
    pub spent: Spent,
    // Embree reads vertices and indices where they are.
    _geometry: &'a Geometry,
}

// SAFETY: a committed scene may be queried from any number of threads (Embree's manual, "Thread Safety"), and `&Tree` only queries.
unsafe impl Sync for Tree<'_> {}

impl Tree<'_> {
    fn new_scene(&self, robust: bool) -> Handle {
        // SAFETY: the device is alive; medium quality is 1.
        unsafe {
            let scene = (self.embree.new_scene)(self.device);
            (self.embree.scene_flags)(scene, if robust { ROBUST } else { 0 });
            (self.embree.scene_quality)(scene, 1);
            scene
        }
    }

    fn attach_mesh(&self, scene: Handle, mesh: &Mesh) {
        let e = self.embree;
        // SAFETY: scene and device are alive. The buffers hold as many items of 12 bytes as said and are borrowed for as long
        // as the tree lives. Embree may read 16 bytes at the last vertex: `Geometry` keeps one spare vertex at the end.
        unsafe {
            let geometry = (e.new_geometry)(self.device, TRIANGLES);
            let (points, triangles) = (&mesh.positions, &mesh.triangles);
            (e.shared_buffer)(geometry, VERTEX_BUFFER, 0, FLOAT3, points.as_ptr().cast(), 0, 12, points.len() - 1);
            (e.shared_buffer)(geometry, INDEX_BUFFER, 0, UINT3, triangles.as_ptr().cast(), 0, 12, triangles.len());
            (e.commit_geometry)(geometry);
            (e.attach)(scene, geometry);
            (e.release_geometry)(geometry);
        }
    }

    fn attach_instance(&self, placement: &Placement) {
        let (e, s) = (self.embree, placement.size);
        let [x, y, z] = placement.origin;
        let columns: [f32; 12] = [s, 0.0, 0.0, 0.0, s, 0.0, 0.0, 0.0, s, x, y, z];
        // SAFETY: handles are alive; the matrix is read during the call only.
        unsafe {
            let geometry = (e.new_geometry)(self.device, INSTANCE);
            (e.instanced_scene)(geometry, self.parts[placement.mesh]);
            (e.transform)(geometry, 0, FLOAT3X4_COLUMN_MAJOR, columns.as_ptr().cast());
            (e.commit_geometry)(geometry);
            (e.attach)(self.scene, geometry);
            (e.release_geometry)(geometry);
        }
    }

    /// Bytes that Embree holds for its trees; vertices and indices are ours.
    pub fn memory_bytes(&self) -> usize {
        self.bytes.load(Relaxed).max(0) as usize
    }

    /// Distances to what the rays meet first, infinite for none; one at a time.
    pub fn closest(&self, rays: &[Ray], out: &mut [f32]) {
        let (mut a3, a4) = arguments(false);
        for (ray, out) in rays.iter().zip(out) {
            let mut packet = Packet::<1>::of(std::array::from_ref(ray));
            // SAFETY: the scene is committed; the packet has the layout of RTCRayHit and room for the field of instance arrays.
            unsafe {
                match self.embree.queries {
                    Queries::Three { intersect1, .. } => intersect1(self.scene, &raw mut a3, &raw mut packet),
                    Queries::Four { intersect1, .. } => intersect1(self.scene, &raw mut packet, &raw const a4),
                }
            }
            *out = if packet.geometry[0] == INVALID { f32::INFINITY } else { packet.tfar[0] };
        }
    }

    /// Whether the rays meet anything (1) or not (0), one at a time.
    pub fn occluded(&self, rays: &[Ray], out: &mut [f32]) {
        let (mut a3, a4) = arguments(false);
        for (ray, out) in rays.iter().zip(out) {
            let mut packet = Packet::<1>::of(std::array::from_ref(ray));
            // SAFETY: as in `closest`; a packet begins with an RTCRay.
            unsafe {
                match self.embree.queries {
                    Queries::Three { occluded1, .. } => occluded1(self.scene, &raw mut a3, &raw mut packet),
                    Queries::Four { occluded1, .. } => occluded1(self.scene, &raw mut packet, &raw const a4),
                }
            }
            *out = f32::from(packet.tfar[0] < 0.0);
        }
    }

    /// As [`Tree::closest`], sixteen at a time; `coherent` is Embree's hint.
    pub fn closest16(&self, rays: &[Ray], out: &mut [f32], coherent: bool) {
        let (mut a3, a4) = arguments(coherent);
        for (rays, out) in rays.chunks(16).zip(out.chunks_mut(16)) {
            let Some((mut packet, valid)) = sixteen(rays) else { continue };
            // SAFETY: as in `closest`, with the layout of RTCRayHit16; `valid` has 16 entries, -1 or 0.
            unsafe {
                match self.embree.queries {
                    Queries::Three { intersect16, .. } => {
                        intersect16(&raw const valid, self.scene, &raw mut a3, &raw mut packet);
                    }
                    Queries::Four { intersect16, .. } => {
                        intersect16(&raw const valid, self.scene, &raw mut packet, &raw const a4);
                    }
                }
            }
            for (i, out) in out.iter_mut().enumerate() {
                *out = if packet.geometry[i] == INVALID { f32::INFINITY } else { packet.tfar[i] };
            }
        }
    }

    /// As [`Tree::occluded`], sixteen at a time.
    pub fn occluded16(&self, rays: &[Ray], out: &mut [f32], coherent: bool) {
        let (mut a3, a4) = arguments(coherent);
        for (rays, out) in rays.chunks(16).zip(out.chunks_mut(16)) {
            let Some((mut packet, valid)) = sixteen(rays) else { continue };
            // SAFETY: as in `closest16`; a packet begins with an RTCRay16.
            unsafe {
                match self.embree.queries {
                    Queries::Three { occluded16, .. } => {
                        occluded16(&raw const valid, self.scene, &raw mut a3, &raw mut packet);
                    }
                    Queries::Four { occluded16, .. } => {
                        occluded16(&raw const valid, self.scene, &raw mut packet, &raw const a4);
                    }
                }
            }
            out.iter_mut().enumerate().for_each(|(i, out)| *out = f32::from(packet.tfar[i] < 0.0));
        }
    }
}

fn arguments(coherent: bool) -> (Arguments3, Arguments4) {
    let none = std::ptr::null();
    let three = Arguments3 { flags: u32::from(coherent), filter: none, instance: INVALID, minimum_width: 0.0 };
    let flags = if coherent { 1 << 16 } else { 0 };
    let four =
        Arguments4 { flags, features: u32::MAX, context: none, filter: none, callback: none, minimum_width: 0.0 };
    (three, four)
}

/// Sixteen rays, the last one repeated where there are fewer, and which are real.
#[inline(always)]
fn sixteen(rays: &[Ray]) -> Option<(Packet<16>, [c_int; 16])> {
    if let Ok(all) = rays.try_into() {
        return Some((Packet::of(all), [-1; 16]));
    }
    let valid = std::array::from_fn(|i| if i < rays.len() { -1 } else { 0 });
    let last = *rays.last()?;
    let filled: [Ray; 16] = std::array::from_fn(|i| *rays.get(i).unwrap_or(&last));
    Some((Packet::of(&filled), valid))
}

impl Drop for Tree<'_> {
    fn drop(&mut self) {
        // SAFETY: each handle was made once, is released once, the device last; the counter is dropped after this.
        unsafe {
            self.parts.iter().for_each(|&p| (self.embree.release_scene)(p));
            (self.embree.release_scene)(self.scene);
            (self.embree.release_device)(self.device);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::sets;

    #[test]
    fn fields_are_where_embree_puts_them() {
        let Some(path) = std::env::var_os("EMBREE_LIBRARY") else {
            println!("SKIPPED: EMBREE_LIBRARY does not name a library of Embree");
            return;
        };
        let embree = Embree::load(Path::new(&path)).unwrap();
        let mesh = Mesh {
            // The third triangle lies at z = 3 and is hit at barycentrics (1/4, 1/2); the last vertex is the spare one.
            positions: vec![
                [0.0, 0.0, 9.0],
                [4.0, 0.0, 9.0],
                [0.0, 4.0, 9.0],
                [0.0, 0.0, 3.0],
                [4.0, 0.0, 3.0],
                [0.0, 4.0, 3.0],
                [0.0; 3],
            ],
            triangles: vec![[0, 1, 2], [0, 2, 1], [3, 4, 5]],
        };
        let geometry = Geometry { meshes: vec![mesh], placements: vec![] };
        let tree = embree.build(&geometry, false, 1).unwrap();
        let ray = Ray { o: [1.0, 2.0, 1.0], t_max: 100.0, d: [0.0, 0.0, 1.0], time: 0.0 };
        let miss = Ray { d: [0.0, 0.0, -1.0], ..ray };
        let (mut a3, a4) = arguments(false);
        let mut packet = Packet::<1>::of(&[ray]);
        // SAFETY: as in `closest`.
        unsafe {
            match embree.queries {
                Queries::Three { intersect1, .. } => intersect1(tree.scene, &raw mut a3, &raw mut packet),
                Queries::Four { intersect1, .. } => intersect1(tree.scene, &raw mut packet, &raw const a4),
            }
        }
        // Embree divides by a refined reciprocal: the last bit may differ.
        let near = |a: f32, b: f32| a == b || (a - b).abs() <= 1e-6 * b;
        assert!(near(packet.tfar[0], 2.0), "{}", packet.tfar[0]);
        assert_eq!((packet.primitive[0], packet.geometry[0]), (2, 0));
        assert!(near(packet.uv[0][0], 0.25) && near(packet.uv[1][0], 0.5), "{:?}", packet.uv);
        let all_near = |a: &[f32], b: &[f32]| assert!(a.iter().zip(b).all(|(&a, &b)| near(a, b)), "{a:?} {b:?}");
        assert_eq!(packet.normal.map(|n| n[0].abs()), [0.0, 0.0, 16.0]);
        assert_eq!(packet.instance[0], INVALID);
        let rays: Vec<Ray> = (0..37).map(|i| if i % 3 == 0 { miss } else { ray }).collect();
        let expected: Vec<f32> = (0..37).map(|i| if i % 3 == 0 { f32::INFINITY } else { 2.0 }).collect();
        let mut out = vec![0.0; 37];
        tree.closest(&rays, &mut out);
        all_near(&out, &expected);
        for coherent in [false, true] {
            out.fill(0.0);
            tree.closest16(&rays, &mut out, coherent);
            all_near(&out, &expected);
            let blocked: Vec<f32> = (0..37).map(|i| f32::from(i % 3 != 0)).collect();
            out.fill(0.5);
            tree.occluded16(&rays, &mut out, coherent);
            assert_eq!(out, blocked);
            out.fill(0.5);
            tree.occluded(&rays, &mut out);
            assert_eq!(out, blocked);
        }
        assert!(tree.memory_bytes() > 0);
        // Instances: the same triangle, twice as large, 10 further up.
        let placed = sets::Placement { mesh: 0, origin: [0.0, 0.0, 10.0], size: 2.0 };
        let geometry = Geometry { placements: vec![placed], ..geometry.clone() };
        let tree = embree.build(&geometry, true, 1).unwrap();
        let mut out = [0.0];
        tree.closest(&[ray], &mut out);
        all_near(&out, &[15.0]);
    }
}
