//! The one place where the picture meets the toolkit: a paint callback that renders off screen before egui's pass and
//! copies the result into it.

use std::sync::Arc;

use egui_wgpu::{CallbackResources, CallbackTrait, ScreenDescriptor, wgpu};

use crate::render::{FrameData, Renderer, Viewport};

/// Compiles the pipelines and puts a viewport into egui's resources. Call it once, when the window is made.
pub fn install(state: &egui_wgpu::RenderState) {
    let renderer = Arc::new(Renderer::new(&state.device, state.target_format));
    let viewport = Viewport::new(&state.device, renderer);
    state.renderer.write().callback_resources.insert(viewport);
}

/// Paints a frame into a rectangle of the window. Hand over the same `Arc` while nothing in the scene has changed: then
/// the picture is only copied.
pub fn callback(rect: egui::Rect, frame: Arc<FrameData>) -> egui::Shape {
    egui::Shape::Callback(egui_wgpu::Callback::new_paint_callback(rect, Scene { frame }))
}

struct Scene {
    frame: Arc<FrameData>,
}

impl CallbackTrait for Scene {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let viewport = resources.get_mut::<Viewport>();
        viewport.and_then(|v| v.prepare(device, queue, &self.frame)).into_iter().collect()
    }

    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        if let Some(viewport) = resources.get::<Viewport>() {
            viewport.paint(pass);
        }
    }
}
