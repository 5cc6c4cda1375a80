//! GPU buffers that follow the revisions of the data.
//!
//! Meshes and lines are stored in runs with a box for each. What no frame has asked for in the last [`KEEP`] frames is dropped.

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};
use wgpu::util::DeviceExt;

use super::cull::{Bounds, Run};
use super::frame::{Field, GlyphData, GlyphItem, Key, LineData, LineItem, MeshItem, VolumeItem};
use super::mesh_data::MeshData;
use super::volume::GpuVolumes;

/// Line points in one culled run.
const LINE_RUN: usize = 2048;
/// Frames that unused buffers survive.
const KEEP: u64 = 240;

/// A mesh on the GPU.
#[derive(Debug)]
pub(super) struct GpuMesh {
    pub vertices: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    pub runs: Vec<Run>,
    pub bounds: Bounds,
}

/// Polylines on the GPU: every instance reads four consecutive points (before, from, to, after).
#[derive(Debug)]
pub(super) struct GpuLines {
    pub points: wgpu::Buffer,
    pub runs: Vec<Run>,
    pub bounds: Bounds,
}

/// One glyph.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct GlyphInstance {
    pub position: [f32; 3],
    pub size: f32,
    pub direction: [f32; 3],
    pub shape: u32,
    pub color: [f32; 4],
}

/// Glyphs on the GPU.
#[derive(Debug)]
pub(super) struct GpuGlyphs {
    pub instances: wgpu::Buffer,
    pub count: u32,
    pub bounds: Bounds,
}

#[derive(Debug)]
struct Slot<T> {
    revision: u64,
    used: u64,
    /// `None` when there is nothing to draw.
    value: Option<T>,
}

/// One table of buffers.
#[derive(Debug)]
struct Table<T>(HashMap<Key, Slot<T>>);

impl<T> Default for Table<T> {
    fn default() -> Self {
        Self(HashMap::new())
    }
}

impl<T> Table<T> {
    /// Rebuilds the slot when the revision differs; true when it did.
    fn update(&mut self, key: Key, revision: u64, now: u64, build: impl FnOnce() -> Option<T>) -> bool {
        if let Some(slot) = self.0.get_mut(&key)
            && slot.revision == revision
        {
            slot.used = now;
            return false;
        }
        self.0.insert(key, Slot { revision, used: now, value: build() });
        true
    }

    fn get(&self, key: Key) -> Option<&T> {
        self.0.get(&key).and_then(|slot| slot.value.as_ref())
    }

    fn sweep(&mut self, now: u64) {
        self.0.retain(|_, slot| slot.used + KEEP > now);
    }
}

/// Where buffers are made and filled.
#[derive(Clone, Copy)]
pub(super) struct Device<'a> {
    pub device: &'a wgpu::Device,
    pub queue: &'a wgpu::Queue,
}

/// All buffers of one viewport.
#[derive(Debug, Default)]
pub(super) struct Cache {
    meshes: Table<GpuMesh>,
    fields: Table<wgpu::Buffer>,
    lines: Table<GpuLines>,
    glyphs: Table<GpuGlyphs>,
    volumes: Table<GpuVolumes>,
    now: u64,
    /// Buffers rebuilt since the frame began.
    pub rebuilt: usize,
}

impl Cache {
    /// A new frame begins: forgets what has long not been drawn.
    pub fn begin(&mut self) {
        self.now += 1;
        self.rebuilt = 0;
        if self.now.is_multiple_of(64) {
            self.meshes.sweep(self.now);
            self.fields.sweep(self.now);
            self.lines.sweep(self.now);
            self.glyphs.sweep(self.now);
            self.volumes.sweep(self.now);
        }
    }

    pub fn update_mesh(&mut self, gpu: Device<'_>, item: &MeshItem) {
        let (now, device) = (self.now, gpu.device);
        self.rebuilt += self.meshes.update(item.key, item.revision, now, || GpuMesh::new(gpu, &item.mesh)) as usize;
        if let Some(field) = &item.field {
            // A new mesh under an old field revision must not meet the old field.
            let revision = field.revision ^ item.revision.rotate_left(32);
            let count = item.mesh.vertices.len();
            self.rebuilt += self.fields.update(item.key, revision, now, || field_buffer(device, field, count)) as usize;
        }
    }

    pub fn update_lines(&mut self, device: &wgpu::Device, item: &LineItem) {
        let build = || GpuLines::new(device, &item.lines);
        self.rebuilt += self.lines.update(item.key, item.revision, self.now, build) as usize;
    }

    pub fn update_glyphs(&mut self, device: &wgpu::Device, item: &GlyphItem) {
        let build = || GpuGlyphs::new(device, &item.glyphs);
        self.rebuilt += self.glyphs.update(item.key, item.revision, self.now, build) as usize;
    }

    pub fn update_volumes(&mut self, device: &wgpu::Device, item: &VolumeItem) {
        let build = || GpuVolumes::new(device, &item.volumes);
        self.rebuilt += self.volumes.update(item.key, item.revision, self.now, build) as usize;
    }

    pub fn mesh(&self, key: Key) -> Option<&GpuMesh> {
        self.meshes.get(key)
    }

    pub fn field(&self, key: Key) -> Option<&wgpu::Buffer> {
        self.fields.get(key)
    }

    pub fn lines(&self, key: Key) -> Option<&GpuLines> {
        self.lines.get(key)
    }

    pub fn volumes(&self, key: Key) -> Option<&GpuVolumes> {
        self.volumes.get(key)
    }

    pub fn glyphs(&self, key: Key) -> Option<&GpuGlyphs> {
        self.glyphs.get(key)
    }
}

fn buffer<T: Pod>(device: &wgpu::Device, label: &str, data: &[T], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let contents = bytemuck::cast_slice(data);
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
}

/// Value and validity per vertex: NaN does not survive shader optimizers, so it is told apart here.
fn field_buffer(device: &wgpu::Device, field: &Field, count: usize) -> Option<wgpu::Buffer> {
    let at = |k: usize| match field.values.get(k) {
        Some(v) if v.is_finite() => [*v, 1.0],
        Some(v) if v.is_infinite() => [v.signum() * 1e30, 1.0],
        _ => [0.0, 0.0],
    };
    let data: Vec<[f32; 2]> = (0..count).map(at).collect();
    (count > 0).then(|| buffer(device, "field", &data, wgpu::BufferUsages::VERTEX))
}

/// Bytes that are on their way to the graphics card at a time.
const CHUNK: usize = 1 << 24;

/// A large buffer, copied in chunks: room for all of it at once is not cleared, filled and copied again.
fn large_buffer<T: Pod>(gpu: Device<'_>, label: &str, data: &[T], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let bytes: &[u8] = bytemuck::cast_slice(data);
    if bytes.len() <= CHUNK {
        return buffer(gpu.device, label, data, usage);
    }
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.len().next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT as usize) as u64,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    for (k, chunk) in bytes.chunks(CHUNK).enumerate() {
        gpu.queue.write_buffer(&buffer, (k * CHUNK) as u64, chunk);
        gpu.queue.submit([]);
    }
    buffer
}

impl GpuMesh {
    fn new(gpu: Device<'_>, mesh: &MeshData) -> Option<Self> {
        Some(Self {
            bounds: mesh.bounds?,
            vertices: large_buffer(gpu, "surface vertices", &mesh.vertices, wgpu::BufferUsages::VERTEX),
            indices: large_buffer(gpu, "surface indices", &mesh.triangles, wgpu::BufferUsages::INDEX),
            runs: mesh.runs.clone(),
        })
    }
}

/// Bytes of one line point: x, y, z, arc length (negative: no line starts or ends here).
pub(super) const LINE_POINT: u64 = 16;

impl GpuLines {
    fn new(device: &wgpu::Device, lines: &LineData) -> Option<Self> {
        let mut points: Vec<[f32; 4]> = Vec::with_capacity(lines.points.len() + 2 * lines.ends.len());
        for run in lines.polylines() {
            push_polyline(&mut points, run);
        }
        if points.len() < 4 {
            return None;
        }
        let last = points.len() - 3;
        let mut runs = Vec::new();
        for start in (0..last).step_by(LINE_RUN) {
            let end = (start + LINE_RUN).min(last);
            // Instance i draws from point i + 1 to point i + 2.
            let inner = points[start + 1..end + 2].iter().filter(|p| p[3] >= 0.0);
            let drawn: Vec<[f32; 3]> = inner.map(|p| [p[0], p[1], p[2]]).collect();
            if let Some(bounds) = Bounds::of(&drawn) {
                runs.push(Run { range: start as u32..end as u32, bounds });
            }
        }
        let bounds = runs.iter().map(|r| r.bounds).reduce(Bounds::union)?;
        let usage = wgpu::BufferUsages::VERTEX;
        Some(Self { points: buffer(device, "line points", &points, usage), runs, bounds })
    }
}

/// Appends a polyline with one neighbour point before and one after it: of a closed one its own neighbours, so that
/// the joint is a joint; of an open one its end again. Neighbours carry a negative arc length.
fn push_polyline(points: &mut Vec<[f32; 4]>, run: &[[f32; 3]]) {
    // Equal successive points have no direction.
    let mut distinct: Vec<[f32; 3]> = Vec::with_capacity(run.len());
    for p in run.iter().filter(|p| p.iter().all(|c| c.is_finite())) {
        if distinct.last() != Some(p) {
            distinct.push(*p);
        }
    }
    let n = distinct.len();
    if n < 2 {
        return;
    }
    let closed = n > 3 && distinct[0] == distinct[n - 1];
    let (before, after) = if closed { (distinct[n - 2], distinct[1]) } else { (distinct[0], distinct[n - 1]) };
    points.push([before[0], before[1], before[2], -1.0]);
    let mut arc = 0.0f64;
    for k in 0..n {
        if k > 0 {
            arc += glam::Vec3::from(distinct[k]).distance(distinct[k - 1].into()) as f64;
        }
        let [x, y, z] = distinct[k];
        points.push([x, y, z, arc as f32]);
    }
    points.push([after[0], after[1], after[2], -1.0]);
}

impl GpuGlyphs {
    fn new(device: &wgpu::Device, data: &GlyphData) -> Option<Self> {
        let finite = data.glyphs.iter().filter(|g| g.position.iter().all(|c| c.is_finite()));
        let instances: Vec<GlyphInstance> = finite
            .map(|g| GlyphInstance {
                position: g.position,
                size: g.size,
                direction: g.direction,
                shape: g.shape as u32,
                color: g.color,
            })
            .collect();
        let bounds = Bounds::of(instances.iter().map(|g| &g.position))?;
        let usage = wgpu::BufferUsages::VERTEX;
        Some(Self { instances: buffer(device, "glyphs", &instances, usage), count: instances.len() as u32, bounds })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_polyline_has_its_ends_as_neighbours_and_arc_length_inside() {
        let mut points = Vec::new();
        push_polyline(&mut points, &[[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 4.0, 0.0]]);
        let arcs: Vec<f32> = points.iter().map(|p| p[3]).collect();
        assert_eq!(arcs, [-1.0, 0.0, 3.0, 7.0, -1.0]);
        assert_eq!(points[0][..3], points[1][..3]);
        assert_eq!(points[4][..3], points[3][..3]);
    }

    #[test]
    fn a_closed_polyline_joins_its_own_end() {
        let mut points = Vec::new();
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]];
        push_polyline(&mut points, &square);
        assert_eq!(points[0][..3], [0.0, 1.0, 0.0]);
        assert_eq!(points[points.len() - 1][..3], [1.0, 0.0, 0.0]);
    }

    #[test]
    fn points_without_extent_or_meaning_draw_nothing() {
        let mut points = Vec::new();
        push_polyline(&mut points, &[[1.0, 2.0, 3.0]; 5]);
        push_polyline(&mut points, &[[1.0, 2.0, 3.0], [f32::NAN, 0.0, 0.0]]);
        push_polyline(&mut points, &[]);
        assert!(points.is_empty());
    }
}
