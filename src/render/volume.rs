//! Boxes swept by spheres on the GPU: instances, and the template that every solid one is drawn with.
//!
//! The template is a sphere cut along its three planes of symmetry; each vertex knows which corner of the box its
//! octant belongs to. Pulling the octants apart gives the flat faces and the quarter cylinders between them, so one
//! mesh serves rectangle-swept spheres, spheres and boxes exactly.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use wgpu::util::DeviceExt;

use super::cull::Bounds;
use super::cull::Run;
use super::frame::VolumeData;

/// Volumes in one culled run.
const RUN: usize = 1024;

/// One volume.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct VolumeInstance {
    center: [f32; 3],
    radius: f32,
    u: [f32; 3],
    half_u: f32,
    v: [f32; 3],
    half_v: f32,
    half_w: f32,
    color: [u8; 4],
}

/// One vertex of the template.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct TemplateVertex {
    normal: [f32; 3],
    corner: [f32; 3],
}

/// Volumes on the GPU.
#[derive(Debug)]
pub(super) struct GpuVolumes {
    pub instances: wgpu::Buffer,
    pub runs: Vec<Run>,
    pub bounds: Bounds,
    pub count: usize,
}

impl GpuVolumes {
    pub fn new(device: &wgpu::Device, data: &VolumeData) -> Option<Self> {
        let mut instances = Vec::with_capacity(data.volumes.len());
        let mut boxes = Vec::with_capacity(data.volumes.len());
        for (volume, color) in data.volumes.iter().zip(&data.colors) {
            let [u, v, w] = volume.frame();
            let center = volume.center - data.origin;
            let half = volume.half;
            let reach = u.abs() * half.x + v.abs() * half.y + w.abs() * half.z + DVec3::splat(volume.radius);
            if !(center.is_finite() && reach.is_finite()) {
                continue;
            }
            boxes.push([(center - reach).as_vec3(), (center + reach).as_vec3()]);
            instances.push(VolumeInstance {
                center: center.as_vec3().to_array(),
                radius: volume.radius as f32,
                u: u.as_vec3().to_array(),
                half_u: half.x as f32,
                v: v.as_vec3().to_array(),
                half_v: half.y as f32,
                half_w: half.z as f32,
                color: *color,
            });
        }
        let mut runs = Vec::new();
        for (k, run) in boxes.chunks(RUN).enumerate() {
            let corners: Vec<[f32; 3]> = run.iter().flatten().map(Vec3::to_array).collect();
            let start = (k * RUN) as u32;
            runs.push(Run { range: start..start + run.len() as u32, bounds: Bounds::of(&corners)? });
        }
        let bounds = runs.iter().map(|r| r.bounds).reduce(Bounds::union)?;
        let contents = bytemuck::cast_slice(&instances);
        let usage = wgpu::BufferUsages::VERTEX;
        let instances =
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some("volumes"), contents, usage });
        Some(Self { instances, runs, bounds, count: boxes.len() })
    }
}

/// The template on the GPU.
#[derive(Debug)]
pub(super) struct Template {
    pub vertices: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    pub count: u32,
}

impl Template {
    /// With `arcs` pieces a quarter of a circle.
    pub fn new(device: &wgpu::Device, arcs: u32) -> Self {
        let (vertices, indices) = template(arcs);
        let buffer = |label, contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        Self {
            vertices: buffer("volume template", bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer("volume template", bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
            count: indices.len() as u32,
        }
    }
}

/// The pulled-apart sphere: vertices, and triangles counter-clockwise seen from outside.
fn template(arcs: u32) -> (Vec<TemplateVertex>, Vec<u32>) {
    let arcs = arcs.max(1);
    // Around the third direction, every quarter with both of its ends; the same from pole to pole, twice a quarter.
    let around: Vec<(f32, usize)> =
        (0..4).flat_map(|q| (0..=arcs).map(move |k| (k as f32 / arcs as f32 + q as f32, q))).collect();
    let rows: Vec<(f32, f32)> = [-1.0_f32, 1.0]
        .into_iter()
        .flat_map(|sign| {
            (0..=arcs).map(move |k| {
                let at = k as f32 / arcs as f32;
                (if sign < 0.0 { at - 1.0 } else { at }, sign)
            })
        })
        .collect();
    let quarter = std::f32::consts::FRAC_PI_2;
    let mut vertices = Vec::new();
    for &(latitude, up) in &rows {
        for &(longitude, q) in &around {
            let ((sin_b, cos_b), (sin_a, cos_a)) = ((quarter * latitude).sin_cos(), (quarter * longitude).sin_cos());
            let [x, y] = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]][q];
            vertices.push(TemplateVertex { normal: [cos_a * cos_b, sin_a * cos_b, sin_b], corner: [x, y, up] });
        }
    }
    let (width, height) = (around.len() as u32, rows.len() as u32);
    let mut indices = Vec::new();
    for j in 0..height - 1 {
        for i in 0..width {
            let next = (i + 1) % width;
            let [a, b, c, d] = [j * width + i, j * width + next, (j + 1) * width + next, (j + 1) * width + i];
            indices.extend([a, b, c, a, c, d]);
        }
    }
    // The flat faces at the poles: the first vertex of every quarter.
    let pole = |row: u32| [0, 1, 2, 3].map(|q| row * width + q * (arcs + 1));
    let ([a, b, c, d], [e, f, g, h]) = (pole(height - 1), pole(0));
    indices.extend([a, b, c, a, c, d, e, g, f, e, h, g]);
    (vertices, indices)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area and volume of the closed template when its corners are pulled apart by `half` and its sphere has `radius`.
    fn measure(arcs: u32, half: Vec3, radius: f32) -> (f32, f32) {
        let (vertices, indices) = template(arcs);
        let at = |k: u32| {
            let v = vertices[k as usize];
            Vec3::from(v.corner) * half + Vec3::from(v.normal) * radius
        };
        let (mut area, mut volume) = (0.0, 0.0);
        for t in indices.chunks_exact(3) {
            let [a, b, c] = [at(t[0]), at(t[1]), at(t[2])];
            area += 0.5 * (b - a).cross(c - a).length();
            volume += a.dot(b.cross(c)) / 6.0;
        }
        (area, volume)
    }

    #[test]
    fn the_pulled_apart_sphere_is_closed_and_has_the_volume_of_a_swept_box() {
        use std::f32::consts::PI;
        // Steiner's formula for a box with edges a, b, c and a ball of radius r.
        for (half, r) in [
            (Vec3::ZERO, 1.0),
            (Vec3::new(2.0, 1.0, 0.0), 0.5),
            (Vec3::new(2.0, 0.0, 0.0), 0.5),
            (Vec3::new(1.0, 2.0, 3.0), 0.0),
        ] {
            let e = 2.0 * half;
            let faces = 2.0 * (e.x * e.y + e.y * e.z + e.z * e.x);
            let edges = e.x + e.y + e.z;
            let volume = e.x * e.y * e.z + faces * r + PI * edges * r * r + 4.0 / 3.0 * PI * r.powi(3);
            let area = faces + 2.0 * PI * edges * r + 4.0 * PI * r * r;
            let (got_area, got_volume) = measure(24, half, r);
            assert!((got_volume - volume).abs() < 4e-3 * volume, "{half} {r}: {got_volume} {volume}");
            assert!((got_area - area).abs() < 4e-3 * area, "{half} {r}: {got_area} {area}");
        }
    }
}
