//! Shaders, textures and buffers of the face maps on the GPU.

use wgpu::{BufferUsages, ShaderStages, TextureFormat};

const FACE: TextureFormat = TextureFormat::R32Uint;
const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// The two steps: a face map, and the sum of its light.
#[derive(Debug)]
pub(super) struct Pipelines {
    map_layout: wgpu::BindGroupLayout,
    map: wgpu::RenderPipeline,
    light_layout: wgpu::BindGroupLayout,
    light: wgpu::ComputePipeline,
}

/// Textures of one size.
#[derive(Debug)]
pub(super) struct Maps {
    /// Pixels a side.
    pub side: u32,
    sun: wgpu::TextureView,
    view: wgpu::TextureView,
    depth: wgpu::TextureView,
}

/// Buffers of a batch; each grows as it must.
#[derive(Debug)]
pub(super) struct Store {
    pub faces: Room,
    pub frames: Room,
    pub glows: Room,
    pub sums: Room,
    pub answer: Room,
}

/// A buffer that grows.
#[derive(Debug)]
pub(super) struct Room {
    usage: BufferUsages,
    buffer: Option<wgpu::Buffer>,
}

/// What the shaders of a batch read and write.
#[derive(Debug)]
pub(super) struct Groups {
    map: wgpu::BindGroup,
    light: wgpu::BindGroup,
}

impl Default for Store {
    fn default() -> Self {
        let room = |usage| Room { usage, buffer: None };
        Self {
            faces: room(BufferUsages::STORAGE | BufferUsages::COPY_DST),
            frames: room(BufferUsages::UNIFORM | BufferUsages::COPY_DST),
            glows: room(BufferUsages::STORAGE | BufferUsages::COPY_DST),
            sums: room(BufferUsages::STORAGE | BufferUsages::COPY_SRC),
            answer: room(BufferUsages::MAP_READ | BufferUsages::COPY_DST),
        }
    }
}

impl Room {
    /// Makes room for `size` bytes.
    pub fn reserve(&mut self, device: &wgpu::Device, size: u64) {
        if self.buffer.as_ref().is_none_or(|buffer| buffer.size() < size) {
            self.buffer = None;
            let (label, usage) = (None, self.usage);
            self.buffer = Some(device.create_buffer(&wgpu::BufferDescriptor {
                label,
                size,
                usage,
                mapped_at_creation: false,
            }));
        }
    }

    /// Stores `bytes`.
    pub fn write(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, bytes: &[u8]) {
        self.reserve(device, bytes.len() as u64);
        if let Some(buffer) = &self.buffer {
            queue.write_buffer(buffer, 0, bytes);
        }
    }

    /// The buffer, if there was room made.
    pub fn get(&self) -> Option<&wgpu::Buffer> {
        self.buffer.as_ref()
    }
}

impl Maps {
    /// Textures of `side` pixels a side.
    pub fn new(device: &wgpu::Device, side: u32) -> Self {
        let texture = |format, usage| {
            let descriptor = wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            };
            device.create_texture(&descriptor).create_view(&wgpu::TextureViewDescriptor::default())
        };
        let bound = wgpu::TextureUsages::TEXTURE_BINDING;
        let depth = texture(DEPTH, wgpu::TextureUsages::empty());
        Self { side, sun: texture(FACE, bound), view: texture(FACE, bound), depth }
    }
}

impl Pipelines {
    /// Compiles the shaders; faults go to the device's handler.
    pub fn new(device: &wgpu::Device) -> Self {
        let module = |label, source: &'static str| {
            let source = wgpu::ShaderSource::Wgsl(source.into());
            device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
        };
        let map_layout = layout(device, "face map", ShaderStages::VERTEX, &[frame(), storage(true)]);
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let entries = [frame(), frame(), storage(true), storage(true), texture, texture, storage(false)];
        let light_layout = layout(device, "face light", ShaderStages::COMPUTE, &entries);
        let map =
            map_pipeline(device, &map_layout, &module("face map", include_str!("../../../shaders/face_map.wgsl")));
        let light = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("face light"),
            layout: Some(&pipeline_layout(device, &light_layout)),
            module: &module("face light", include_str!("../../../shaders/face_light.wgsl")),
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Self { map_layout, map, light_layout, light }
    }

    /// Ties the buffers and maps to the shaders, if all have room. `frame` is the size of a frame \[bytes\].
    pub fn bind(&self, device: &wgpu::Device, store: &Store, maps: &Maps, frame: u64) -> Option<Groups> {
        let frame = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: store.frames.get()?,
            offset: 0,
            size: wgpu::BufferSize::new(frame),
        });
        let faces = store.faces.get()?.as_entire_binding();
        let glows = store.glows.get()?.as_entire_binding();
        let sums = store.sums.get()?.as_entire_binding();
        let (sun, view) =
            (wgpu::BindingResource::TextureView(&maps.sun), wgpu::BindingResource::TextureView(&maps.view));
        let map = group(device, &self.map_layout, [frame.clone(), faces.clone()]);
        let light = group(device, &self.light_layout, [frame.clone(), frame, faces, glows, sun, view, sums]);
        Some(Groups { map, light })
    }

    /// Both maps and the sums of one epoch: `frames` are the offsets of the Sun's frame and the view's \[bytes\].
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        groups: &Groups,
        maps: &Maps,
        frames: [u32; 2],
        faces: u32,
        tiles: u32,
    ) {
        for (target, frame) in [&maps.sun, &maps.view].into_iter().zip(frames) {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: target,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &maps.depth,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(1.0),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            pass.set_pipeline(&self.map);
            pass.set_bind_group(0, &groups.map, &[frame]);
            pass.draw(0..3 * faces, 0..1);
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&self.light);
        pass.set_bind_group(0, &groups.light, &frames);
        pass.dispatch_workgroups(tiles, tiles, 1);
    }
}

fn frame() -> wgpu::BindingType {
    let ty = wgpu::BufferBindingType::Uniform;
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: true, min_binding_size: None }
}

fn storage(read_only: bool) -> wgpu::BindingType {
    let ty = wgpu::BufferBindingType::Storage { read_only };
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

/// A layout with bindings 0, 1, ... of the given types.
fn layout(
    device: &wgpu::Device,
    label: &str,
    visibility: ShaderStages,
    types: &[wgpu::BindingType],
) -> wgpu::BindGroupLayout {
    let entry = |(binding, ty): (u32, &wgpu::BindingType)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: *ty,
        count: None,
    };
    let entries: Vec<_> = (0..).zip(types).map(entry).collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries };
    device.create_bind_group_layout(&descriptor)
}

/// Resources at bindings 0, 1, ...
fn group<const N: usize>(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: [wgpu::BindingResource; N],
) -> wgpu::BindGroup {
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

fn pipeline_layout(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(layout)],
        ..Default::default()
    })
}

fn map_pipeline(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    module: &wgpu::ShaderModule,
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("face map"),
        layout: Some(&pipeline_layout(device, layout)),
        vertex: wgpu::VertexState {
            module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(FACE.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
